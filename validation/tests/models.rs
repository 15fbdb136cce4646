//! Scenes that together use every scattering model, emitter, shape and sensor.

use glam::{DAffine3, DQuat, DVec3};
use pathspace_core::description::{
    EmitterDescription, MaterialKind, MicrofacetKind, PhaseKind, SceneDescription, ShapeGeometry,
};
use pathspace_core::{Rgb, Scene};
use pathspace_validation::scene_builder::{SceneBuilder, smooth_sphere};

pub fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

pub fn rough(distribution: MicrofacetKind, u: f32, v: f32, visible: bool) -> MaterialKind {
    MaterialKind::RoughConductor {
        distribution,
        alpha_u: u,
        alpha_v: v,
        sample_visible: visible,
        eta: Rgb::new(0.2, 0.9, 1.1),
        k: Rgb::new(3.9, 2.4, 2.1),
        specular_reflectance: Rgb::new(1.0, 0.9, 0.8),
    }
}

pub fn mirror() -> MaterialKind {
    MaterialKind::Conductor {
        eta: Rgb::new(0.2, 0.9, 1.1),
        k: Rgb::new(3.9, 2.4, 2.1),
        specular_reflectance: Rgb::WHITE,
    }
}

/// The inside of the box [−1, 1]³ without its front, in colours.
fn room(b: &mut SceneBuilder) {
    let white = b.diffuse(0.7);
    let red = b.material(MaterialKind::Diffuse { reflectance: Rgb::new(0.6, 0.1, 0.05) });
    b.rectangle(v(-1.0, -1.0, -1.0), v(2.0, 0.0, 0.0), v(0.0, 2.0, 0.0), white);
    b.rectangle(v(-1.0, -1.0, 1.0), v(0.0, 2.0, 0.0), v(2.0, 0.0, 0.0), white);
    b.rectangle(v(-1.0, 1.0, -1.0), v(2.0, 0.0, 0.0), v(0.0, 0.0, 2.0), white);
    b.rectangle(v(-1.0, -1.0, -1.0), v(0.0, 2.0, 0.0), v(0.0, 0.0, 2.0), red);
    b.rectangle(v(1.0, -1.0, -1.0), v(0.0, 0.0, 2.0), v(0.0, 2.0, 0.0), red);
}

/// Closed forms of light in a room: glass, mirror, anisotropic GGX, a rectangle that emits.
pub fn glossy_room() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    room(&mut b);
    let (glass, mirror) = (b.glass(1.5), b.material(mirror()));
    let metal = b.material(rough(MicrofacetKind::Ggx, 0.1, 0.4, true));
    let black = b.diffuse(0.0);
    b.sphere(v(0.4, -0.2, -0.55), 0.4, glass);
    b.sphere(v(-0.5, 0.3, -0.5), 0.45, mirror);
    b.disk(v(0.0, 0.4, -0.9), v(0.2, -0.3, 1.0), 0.5, metal);
    b.rectangle(v(-0.4, -0.4, 0.98), v(0.0, 0.8, 0.0), v(0.8, 0.0, 0.0), black).emission =
        Some(Rgb::new(5.0, 4.0, 3.0));
    b.look_at(v(0.0, -2.8, 0.0), v(0.0, 0.0, 0.0), DVec3::Z, 40.0);
    b.finish()
}

/// Every area emitter, a point light, a thin lens, shading normals, two-sided and null surfaces.
pub fn emitters_and_lens() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    room(&mut b);
    let black = b.diffuse(0.0);
    let grey = b.diffuse(0.4);
    let two = b.material(MaterialKind::TwoSided {
        front: Box::new(MaterialKind::Diffuse { reflectance: Rgb::grey(0.5) }),
        back: Box::new(mirror()),
    });
    let null = b.material(MaterialKind::Null);
    let metal = b.material(rough(MicrofacetKind::Beckmann, 0.3, 0.3, true));
    b.sphere(v(-0.6, 0.2, 0.6), 0.15, black).emission = Some(Rgb::new(9.0, 9.0, 4.0));
    let disk = b.disk(v(0.5, 0.3, 0.9), v(0.0, 0.0, 1.0), 0.2, grey);
    disk.flip_normals = true;
    disk.emission = Some(Rgb::new(3.0, 5.0, 7.0));
    let mirrored = DAffine3::from_scale_rotation_translation(
        v(-0.1, 0.2, 0.15),
        DQuat::from_rotation_z(0.4),
        v(0.7, -0.3, 0.3),
    );
    b.shape(ShapeGeometry::Cube, mirrored, grey).emission = Some(Rgb::grey(2.0));
    let bulb = b.mesh(smooth_sphere(0.15, 1), grey);
    bulb.to_world = DAffine3::from_translation(v(-0.2, -0.5, -0.1));
    bulb.emission = Some(Rgb::new(4.0, 2.0, 1.0));
    b.mesh(smooth_sphere(0.4, 2), grey).to_world = DAffine3::from_translation(v(-0.4, 0.3, -0.6));
    b.mesh(smooth_sphere(0.3, 2), metal).to_world = DAffine3::from_translation(v(0.5, 0.2, -0.7));
    b.rectangle(v(0.0, -0.6, -0.9), v(0.5, 0.2, 0.0), v(0.0, 0.2, 0.7), two);
    b.rectangle(v(-0.9, -0.7, -0.9), v(0.9, 0.0, 0.0), v(0.0, 0.1, 1.5), null);
    b.emitter(EmitterDescription::Point {
        position: v(0.1, -0.3, 0.5),
        intensity: Rgb::new(0.5, 0.6, 0.9),
    });
    let sensor = b.look_at(v(0.3, -2.6, 0.2), v(0.0, 0.0, -0.1), DVec3::Z, 45.0);
    sensor.aperture_radius = 0.08;
    sensor.focus_distance = 2.3;
    b.finish()
}

/// Environment and directional light on dielectrics with shading normals and metals sampled by all
/// normals.
pub fn open_air() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    let ground = b.diffuse(0.5);
    let glass = b.glass(1.6);
    let ggx = b.material(rough(MicrofacetKind::Ggx, 0.3, 0.3, false));
    let beckmann = b.material(rough(MicrofacetKind::Beckmann, 0.2, 0.5, false));
    let two = b.material(MaterialKind::TwoSided {
        front: Box::new(rough(MicrofacetKind::Ggx, 0.2, 0.2, true)),
        back: Box::new(MaterialKind::Diffuse { reflectance: Rgb::grey(0.3) }),
    });
    b.rectangle(v(-3.0, -3.0, 0.0), v(6.0, 0.0, 0.0), v(0.0, 6.0, 0.0), ground);
    b.mesh(smooth_sphere(0.6, 3), glass).to_world = DAffine3::from_translation(v(0.6, 0.0, 0.7));
    b.sphere(v(-0.7, 0.6, 0.5), 0.5, ggx);
    b.shape(
        ShapeGeometry::Cube,
        DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.3),
            DQuat::from_rotation_z(0.7),
            v(-0.6, -0.7, 0.31),
        ),
        beckmann,
    );
    b.rectangle(v(-1.5, 1.3, 0.1), v(3.0, 0.0, 0.0), v(0.0, 0.3, 1.2), two);
    b.emitter(EmitterDescription::Constant { radiance: Rgb::new(0.3, 0.5, 0.9) });
    b.emitter(EmitterDescription::Directional {
        direction: v(0.5, 0.4, -1.0),
        irradiance: Rgb::new(2.0, 1.8, 1.2),
    });
    b.look_at(v(1.0, -4.0, 2.0), v(0.0, 0.0, 0.4), DVec3::Z, 40.0);
    b.finish()
}

/// A light inside a glass ball, an inward emitting sphere round everything.
pub fn lamp_in_a_shell() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    let grey = b.diffuse(0.6);
    let glass = b.glass(1.5);
    let black = b.diffuse(0.0);
    let shell = b.sphere(DVec3::ZERO, 2.0, grey);
    shell.flip_normals = true;
    shell.emission = Some(Rgb::grey(0.1));
    b.sphere(v(0.2, 0.3, 0.1), 0.5, glass);
    b.sphere(v(0.2, 0.3, 0.15), 0.1, black).emission = Some(Rgb::grey(20.0));
    b.sphere(v(-0.8, -0.1, 0.0), 0.3, grey);
    b.look_at(v(0.0, -1.7, 0.2), v(0.0, 0.0, 0.0), DVec3::Z, 70.0);
    b.finish()
}

fn plastic(rho: Rgb, nonlinear: bool) -> MaterialKind {
    MaterialKind::Plastic {
        int_ior: 1.5,
        ext_ior: 1.0,
        diffuse_reflectance: rho,
        specular_reflectance: Rgb::new(1.0, 0.9, 0.8),
        nonlinear,
    }
}

/// Plastic floor and ball in a room, a lamp that both mirror.
pub fn glazed_room() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    room(&mut b);
    let floor = b.material(MaterialKind::TwoSided {
        front: Box::new(plastic(Rgb::new(0.2, 0.5, 0.3), false)),
        back: Box::new(mirror()),
    });
    let ball = b.material(plastic(Rgb::new(0.6, 0.2, 0.1), true));
    let black = b.diffuse(0.0);
    b.rectangle(v(-0.9, -0.9, -0.9), v(1.8, 0.0, 0.0), v(0.0, 1.8, 0.0), floor);
    b.sphere(v(0.2, 0.0, -0.4), 0.4, ball);
    b.rectangle(v(-0.4, -0.4, 0.98), v(0.0, 0.8, 0.0), v(0.8, 0.0, 0.0), black).emission =
        Some(Rgb::new(5.0, 4.0, 3.0));
    b.look_at(v(0.0, -2.8, 0.0), v(0.0, 0.0, 0.0), DVec3::Z, 40.0);
    b.finish()
}

/// A point light over glass and a plastic floor: caustics on a surface with a coat, and mirrored by
/// it.
pub fn glazed_caustic() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    let floor = b.material(plastic(Rgb::grey(0.6), false));
    let wall = b.material(plastic(Rgb::new(0.3, 0.3, 0.7), true));
    let glass = b.glass(1.5);
    b.rectangle(v(-2.0, -2.0, 0.0), v(4.0, 0.0, 0.0), v(0.0, 4.0, 0.0), floor);
    b.rectangle(v(-2.0, 1.0, 0.0), v(4.0, 0.0, 0.0), v(0.0, 0.0, 2.0), wall);
    b.sphere(v(0.0, 0.0, 0.6), 0.5, glass);
    b.emitter(EmitterDescription::Point {
        position: v(-0.8, -0.4, 2.5),
        intensity: Rgb::grey(4.0),
    });
    b.look_at(v(1.0, -4.0, 2.0), v(0.0, 0.0, 0.4), DVec3::Z, 40.0);
    b.finish()
}

/// Plastic with shading normals under a sky and a sun, through a lens.
pub fn glazed_air() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    let ground = b.material(plastic(Rgb::grey(0.4), false));
    let ball = b.material(plastic(Rgb::new(0.1, 0.4, 0.6), true));
    b.rectangle(v(-3.0, -3.0, 0.0), v(6.0, 0.0, 0.0), v(0.0, 6.0, 0.0), ground);
    b.mesh(smooth_sphere(0.6, 2), ball).to_world = DAffine3::from_translation(v(0.2, 0.0, 0.7));
    b.emitter(EmitterDescription::Constant { radiance: Rgb::new(0.3, 0.5, 0.9) });
    b.emitter(EmitterDescription::Directional {
        direction: v(0.5, 0.4, -1.0),
        irradiance: Rgb::new(2.0, 1.8, 1.2),
    });
    let sensor = b.look_at(v(1.0, -4.0, 2.0), v(0.0, 0.0, 0.4), DVec3::Z, 40.0);
    sensor.aperture_radius = 0.08;
    sensor.focus_distance = 4.0;
    b.finish()
}

/// A room full of coloured fog, a glass ball of another medium in it, a box of thin fog with an
/// index-matched boundary.
pub fn foggy_room() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    room(&mut b);
    let phase = PhaseKind::HenyeyGreenstein { g: 0.4 };
    let fog = b.medium([0.5, 0.7, 0.4], Rgb::new(0.9, 0.8, 0.95), phase);
    let blend = PhaseKind::Blend {
        weight: 0.3,
        pair: Box::new([PhaseKind::Isotropic, PhaseKind::Rayleigh]),
    };
    let milk = b.medium([3.0, 2.0, 4.0], Rgb::new(0.95, 0.9, 0.8), blend);
    let (glass, matched, black) = (b.glass(1.4), b.material(MaterialKind::Null), b.diffuse(0.0));
    let grey = b.diffuse(0.5);
    b.sphere(v(0.45, -0.2, -0.5), 0.4, glass);
    b.filled_with(milk);
    // Wider than the room but for its front, where the sensor stands outside.
    b.shape(ShapeGeometry::Cube, DAffine3::from_scale(v(1.2, 1.2, 1.2)), matched);
    b.filled_with(fog);
    let shapes = &mut b.description().media.boundaries;
    shapes[0].exterior = Some(fog);
    b.sphere(v(-0.5, 0.2, -0.6), 0.3, grey);
    b.rectangle(v(-0.4, -0.4, 0.98), v(0.0, 0.8, 0.0), v(0.8, 0.0, 0.0), black).emission =
        Some(Rgb::new(5.0, 4.0, 3.0));
    b.look_at(v(0.0, -2.8, 0.0), v(0.0, 0.0, 0.0), DVec3::Z, 40.0);
    b.finish()
}

/// A lamp, a point light and a lens in thick fog without end, with a mirror.
pub fn fog_through_a_lens() -> SceneDescription {
    let mut b = SceneBuilder::new(32);
    let fog = b.medium([0.3; 3], Rgb::grey(0.8), PhaseKind::Isotropic);
    let (mirror, grey, black) = (b.material(mirror()), b.diffuse(0.6), b.diffuse(0.0));
    b.rectangle(v(-1.5, -1.5, -1.0), v(3.0, 0.0, 0.0), v(0.0, 3.0, 0.0), grey);
    b.sphere(v(0.5, 0.3, -0.4), 0.5, mirror);
    b.sphere(v(-0.5, 0.2, 0.5), 0.2, black).emission = Some(Rgb::grey(6.0));
    b.emitter(EmitterDescription::Point {
        position: v(0.3, -0.5, 0.8),
        intensity: Rgb::new(1.0, 0.8, 0.6),
    });
    let sensor = b.look_at(v(0.0, -2.5, 0.3), v(0.0, 0.0, 0.0), DVec3::Z, 45.0);
    sensor.aperture_radius = 0.2;
    sensor.focus_distance = 2.5;
    b.sensor_in(fog);
    b.finish()
}

/// Scenes with participating media, which not every integrator sees.
pub fn in_media() -> Vec<(&'static str, Scene)> {
    [("foggy room", foggy_room()), ("fog through a lens", fog_through_a_lens())]
        .map(|(name, description)| (name, build(&description)))
        .into()
}

pub fn all() -> Vec<(&'static str, Scene)> {
    [
        ("glazed room", glazed_room()),
        ("glazed caustic", glazed_caustic()),
        ("glazed air", glazed_air()),
        ("glossy room", glossy_room()),
        ("emitters and lens", emitters_and_lens()),
        ("open air", open_air()),
        ("lamp in a shell", lamp_in_a_shell()),
    ]
    .map(|(name, description)| (name, build(&description)))
    .into()
}

pub fn build(description: &SceneDescription) -> Scene {
    Scene::new(description).unwrap_or_else(|e| panic!("{e}"))
}
