//! The functions of a whole path (f, p_{s,t}, which technique can make it) by hand. Integrators are
//! held to these functions, so that nothing else would see a term that both leave out.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use pathspace_core::bsdf::{Component, Event, TransportMode};
use pathspace_core::description::*;
use pathspace_core::film::Families;
use pathspace_core::math::Ray;
use pathspace_core::measure::Density;
use pathspace_core::path::{
    Origin, Path, Technique, Vertex, WalkClass, WalkRules, contribution, families, ln_density,
    samplable,
};
use pathspace_core::scene::NextDensity;
use pathspace_core::{Rgb, Scene};

use crate::emitters::inside;

const RHO: f64 = 0.4;
const LAMP: DVec3 = DVec3::new(0.2, 0.1, 1.6);
const LAMP_RADIUS: f64 = 0.25;
const POINT: DVec3 = DVec3::new(-0.6, 0.9, 1.4);
const EYE: DVec3 = DVec3::new(1.5, 0.1, 1.0);
const FLOOR: DVec3 = DVec3::new(-0.5, 0.3, 0.0);
const WALL: DVec3 = DVec3::new(-2.0, -0.2, 0.9);
/// Materials of the scene.
const DIFFUSE: u32 = 0;
/// Diffuse in front and a mirror behind, and the other way round.
const DIFFUSE_FRONT: u32 = 1;
const MIRROR_FRONT: u32 = 2;
/// Emitters, in the order of shapes, then of the others.
const AREA: u32 = 0;
const SPOT: u32 = 1;
const SUN: u32 = 2;
const SKY: u32 = 3;

/// A floor, a wall, a round lamp and one emitter of every other kind.
fn scene(aperture_radius: f64) -> Scene {
    let shape = |name: &str, geometry, to_world, emission| ShapeDescription {
        name: name.into(),
        geometry,
        to_world,
        flip_normals: false,
        material: DIFFUSE as usize,
        emission,
    };
    let wide = DAffine3::from_scale(DVec3::splat(2.0));
    // The normal from +z to +x.
    let wall = DAffine3::from_translation(DVec3::new(-2.0, 0.0, 0.0))
        * DAffine3::from_quat(DQuat::from_rotation_y(PI / 2.0))
        * wide;
    let sphere = ShapeGeometry::Sphere { center: LAMP, radius: LAMP_RADIUS };
    let reflectance = Rgb::grey(RHO as f32);
    let mirror = MaterialKind::Conductor {
        eta: Rgb::BLACK,
        k: Rgb::WHITE,
        specular_reflectance: Rgb::grey(0.5),
    };
    let diffuse = MaterialKind::Diffuse { reflectance };
    let two_sided = |front: &MaterialKind, back: &MaterialKind| MaterialKind::TwoSided {
        front: Box::new(front.clone()),
        back: Box::new(back.clone()),
    };
    let material = |name: &str, kind: MaterialKind| MaterialDescription { name: name.into(), kind };
    // Towards −x, +z up.
    let axes = DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X);
    let eye = DAffine3::from_mat3_translation(axes, EYE);
    Scene::new(&SceneDescription {
        shapes: vec![
            shape("floor", ShapeGeometry::Rectangle, wide, None),
            shape("wall", ShapeGeometry::Rectangle, wall, None),
            shape("lamp", sphere, DAffine3::IDENTITY, Some(Rgb::new(1.0, 2.0, 3.0))),
        ],
        materials: vec![
            material("diffuse", diffuse.clone()),
            material("diffuse front", two_sided(&diffuse, &mirror)),
            material("mirror front", two_sided(&mirror, &diffuse)),
        ],
        emitters: vec![
            EmitterDescription::Point { position: POINT, intensity: Rgb::grey(0.7) },
            EmitterDescription::Directional {
                direction: DVec3::new(0.3, -0.2, -1.0),
                irradiance: Rgb::grey(1.3),
            },
            EmitterDescription::Constant { radiance: Rgb::grey(0.9) },
        ],
        sensor: SensorDescription {
            to_world: eye,
            aperture_radius,
            focus_distance: 3.0,
            fov_x_degrees: 60.0,
            ..SensorDescription::default()
        },
        film: FilmDescription::new(16, 16),
        ..SceneDescription::default()
    })
    .unwrap()
}

/// The surface at `p` of the world, from the side of `n`.
fn surface(scene: &Scene, p: DVec3, n: DVec3, material: u32) -> Vertex {
    let ray = Ray::new(inside(scene, p + 0.05 * n), -n.as_vec3());
    let mut point = scene.intersect(&ray).expect("a surface");
    assert!(point.p.distance(inside(scene, p)) < 1e-4, "another surface is there");
    point.material = material;
    Vertex::Surface(point)
}

fn lens(scene: &Scene) -> Vertex {
    Vertex::Sensor { p: scene.sensor().position(), n: scene.sensor().axis() }
}

/// x₀ of each kind.
fn start(scene: &Scene, emitter: u32) -> Vertex {
    match emitter {
        AREA => {
            let n = (FLOOR - LAMP).normalize();
            let n = (n + DVec3::new(0.3, 0.0, 0.1)).normalize();
            surface(scene, LAMP + LAMP_RADIUS * n, n, DIFFUSE)
        }
        SPOT => Vertex::PointEmitter { emitter, p: inside(scene, POINT) },
        _ => Vertex::InfiniteEmitter { emitter, to: Vec3::new(-0.3, 0.2, 1.0).normalize() },
    }
}

/// Emitter, floor, wall, lens.
fn long_path(scene: &Scene, emitter: u32) -> Path {
    let floor = surface(scene, FLOOR, DVec3::Z, DIFFUSE);
    let wall = surface(scene, WALL, DVec3::X, DIFFUSE);
    Path::non_specular(vec![start(scene, emitter), floor, wall, lens(scene)])
}

/// (|cos| at a, |cos| at b, squared distance) for points and normals.
fn between((a, n): (DVec3, DVec3), (b, m): (DVec3, DVec3)) -> (f64, f64, f64) {
    let v = b - a;
    let d2 = v.length_squared();
    let w = v / d2.sqrt();
    (n.dot(w).abs(), m.dot(w).abs(), d2)
}

/// Everything that is multiplied along [`long_path`].
struct ByHand {
    /// Densities of vertices of the light subpath, each given the one before; the first as the
    /// subpath takes it.
    light: [f64; 4],
    /// Density of x₀ by next-event estimation.
    direct: f64,
    /// The same from the sensor.
    sensor: [f64; 4],
    value: f64,
}

fn by_hand(scene: &Scene, emitter: u32, path: &Path) -> ByHand {
    let scale = scene.normalisation().scale;
    let place = |p: DVec3| inside(scene, p).as_dvec3();
    let (floor, wall) = ((place(FLOOR), DVec3::Z), (place(WALL), DVec3::X));
    let eye = (place(EYE), DVec3::NEG_X);
    let mass = scene.emitters().mass(emitter).value();
    let r = LAMP_RADIUS * scale;
    let area = 4.0 * PI * r * r;
    let beam = 1.0 / (PI * (scene.ball().radius as f64).powi(2));
    // Density of x₀, of x₁ from it, of x₀ by next-event estimation and from the floor, and L_e G.
    let (x0, x1, direct, hit, start) = match emitter {
        AREA => {
            let p = path.vertices[0].position().unwrap().as_dvec3();
            let n = (p - place(LAMP)).normalize();
            let (c0, c1, d2) = between((p, n), floor);
            let sin2 = r * r / (place(LAMP) - floor.0).length_squared();
            let cone = 1.0 / (2.0 * PI * (1.0 - (1.0 - sin2).sqrt()));
            (1.0 / area, c0 / PI * c1 / d2, cone * c0 / d2, c1 / PI * c0 / d2, 2.0 * c0 * c1 / d2)
        }
        SPOT => {
            let (_, c1, d2) = between((place(POINT), DVec3::Z), floor);
            (1.0, 0.25 / PI * c1 / d2, 1.0, 0.0, 0.7 * scale * scale * c1 / d2)
        }
        SUN | SKY => {
            let c1 = DVec3::new(-0.3, 0.2, 1.0).normalize().z;
            let (own, hit, radiance) =
                if emitter == SUN { (1.0, 0.0, 1.3) } else { (0.25 / PI, c1 / PI, 0.9) };
            (own, beam * c1, own, hit, radiance * c1)
        }
        _ => unreachable!(),
    };
    let (f, w, d2) = between(floor, wall);
    let (w_out, e, e2) = between(wall, eye);
    let d = (wall.0 - eye.0).normalize().as_vec3();
    let sensor = scene.sensor();
    ByHand {
        light: [mass * x0, x1, f / PI * w / d2, w_out / PI * e / e2],
        direct: mass * direct,
        sensor: [
            sensor.pdf_vertex().value(),
            sensor.pdf_direction(d).value() * w_out / e2,
            w / PI * f / d2,
            hit,
        ],
        value: start * (RHO / PI).powi(2) * (f * w / d2) * (w_out * e / e2) * sensor.importance(d),
    }
}

fn near(found: f64, expected: f64, what: &dyn std::fmt::Debug) {
    assert!((found / expected - 1.0).abs() < 1e-4, "{what:?}: {found}, expected {expected}");
}

#[test]
fn densities_are_products_over_both_subpaths() {
    for aperture in [0.0, 0.1] {
        let scene = scene(aperture);
        for emitter in [AREA, SPOT, SUN, SKY] {
            let path = long_path(&scene, emitter);
            let hand = by_hand(&scene, emitter, &path);
            for rr_depth in [1, 2, 3] {
                let rules = WalkRules { max_length: None, rr_depth };
                // Survival at the second, third vertex of a subpath: ρ, where roulette plays.
                let q = [1, 2].map(|i| if i >= rr_depth { RHO } else { 1.0 });
                for s in 0..=4 {
                    let t = 4 - s;
                    let mut p = hand.light[..s].iter().product::<f64>()
                        * hand.sensor[..t].iter().product::<f64>();
                    if s == 1 {
                        p *= hand.direct / hand.light[0];
                    }
                    for n in [s, t] {
                        p *= q[..n.saturating_sub(2)].iter().product::<f64>();
                    }
                    let found = ln_density(&scene, &path, Technique::new(s, t), &rules);
                    let what = (aperture, emitter, rr_depth, s);
                    let delta = emitter == SPOT || emitter == SUN;
                    if s == 0 && delta || t == 0 && aperture == 0.0 {
                        assert_eq!(found, None, "{what:?}");
                    } else {
                        near(found.expect("a density").exp(), p, &what);
                    }
                }
            }
        }
    }
}

#[test]
fn contribution_is_emission_geometry_scattering_and_importance() {
    for aperture in [0.0, 0.1] {
        let scene = scene(aperture);
        for emitter in [AREA, SPOT, SUN, SKY] {
            let path = long_path(&scene, emitter);
            let f = contribution(&scene, &path);
            near(f[1], by_hand(&scene, emitter, &path).value, &(aperture, emitter));
            let ratio = if emitter == AREA { 1.5 } else { 1.0 };
            near(f[2] / f[1], ratio, &(aperture, emitter));
        }
    }
}

#[test]
fn light_seen_directly_is_emission_times_geometry_times_importance() {
    let scene = scene(0.0);
    let n = (EYE - LAMP).normalize();
    let lamp = surface(&scene, LAMP + LAMP_RADIUS * n, n, DIFFUSE);
    let path = Path::non_specular(vec![lamp, lens(&scene)]);
    let x0 = path.vertices[0].position().unwrap().as_dvec3();
    let eye = scene.sensor().position().as_dvec3();
    let (c0, e, d2) = between((x0, n), (eye, DVec3::NEG_X));
    let d = (x0 - eye).normalize().as_vec3();
    let value = 2.0 * c0 * e / d2 * scene.sensor().importance(d);
    near(contribution(&scene, &path)[1], value, &"direct");
    let mass = scene.emitters().mass(AREA).value();
    let r = LAMP_RADIUS * scene.normalisation().scale;
    let rules = WalkRules::default();
    let light = ln_density(&scene, &path, Technique::new(1, 1), &rules).unwrap().exp();
    near(light, mass / (4.0 * PI * r * r), &"one vertex each");
    let sensor = ln_density(&scene, &path, Technique::new(0, 2), &rules).unwrap().exp();
    near(sensor, scene.sensor().pdf_direction(d).value() * c0 / d2, &"by the sensor alone");
}

#[test]
fn a_path_outside_the_film_or_through_a_wall_has_no_value() {
    let scene = scene(0.0);
    let rules = WalkRules::default();
    let mut outside = long_path(&scene, AREA);
    // Behind the camera.
    outside.vertices[2] = surface(&scene, DVec3::new(1.8, 0.0, 0.0), DVec3::Z, DIFFUSE);
    assert_eq!(contribution(&scene, &outside), [0.0; 3]);
    assert_eq!(ln_density(&scene, &outside, Technique::new(1, 3), &rules), None);
    let mut through = long_path(&scene, AREA);
    if let Vertex::Surface(point) = &mut through.vertices[1] {
        point.n_g = -point.n_g;
        point.frame.n = -point.frame.n;
    }
    assert_eq!(contribution(&scene, &through), [0.0; 3]);
    assert_eq!(ln_density(&scene, &through, Technique::new(0, 4), &rules), None);
    // The sensor is no emitter and an emitter no sensor.
    through.vertices.reverse();
    assert_eq!(contribution(&scene, &through), [0.0; 3]);
}

/// What the definition of a technique asks for, vertex by vertex.
fn can(s: usize, t: usize, delta_emitter: bool, pinhole: bool, spreads: &[bool]) -> bool {
    let end = |i: usize| spreads[i - 1];
    if delta_emitter && spreads.is_empty() {
        return false;
    }
    match (s, t) {
        (0, _) => !delta_emitter,
        (_, 0) => !pinhole,
        _ => (s == 1 || end(s - 1)) && (t == 1 || end(s)),
    }
}

#[test]
fn techniques_need_ends_that_spread_and_starts_that_can_be_hit() {
    for (aperture, emitter) in
        [0.0, 0.1].iter().flat_map(|a| [AREA, SPOT, SUN, SKY].map(|e| (*a, e)))
    {
        let scene = scene(aperture);
        let (delta, pinhole) = (emitter == SPOT || emitter == SUN, aperture == 0.0);
        for inner in 0..4_usize {
            for pattern in 0..1_u32 << inner {
                let spreads: Vec<bool> = (0..inner).map(|i| pattern >> i & 1 == 1).collect();
                let mut vertices = vec![start(&scene, emitter)];
                for (i, spreads) in spreads.iter().enumerate() {
                    let material = if *spreads { DIFFUSE_FRONT } else { MIRROR_FRONT };
                    vertices.push(if i % 2 == 0 {
                        surface(&scene, FLOOR + DVec3::X * 0.1 * i as f64, DVec3::Z, material)
                    } else {
                        surface(&scene, WALL, DVec3::X, material)
                    });
                }
                vertices.push(lens(&scene));
                let mut path = Path::non_specular(vertices);
                for (event, spreads) in path.events[1..].iter_mut().zip(&spreads) {
                    if !spreads {
                        *event = Event::Specular(Component::REFLECTION);
                    }
                }
                let k = inner + 1;
                let rules = WalkRules { max_length: Some(k as u32), rr_depth: 5 };
                let mut expected = Families::MERGE.when(spreads.iter().any(|s| *s));
                for s in 0..=k + 1 {
                    let t = k + 1 - s;
                    let technique = Technique::new(s, t);
                    let found = samplable(&scene, &path, technique, &rules);
                    let possible = can(s, t, delta, pinhole, &spreads);
                    assert_eq!(found, possible, "{technique:?} {emitter} {pinhole} {spreads:?}");
                    let family = match (s, t) {
                        (0, _) => Families::S0,
                        (_, 0) => Families::T0,
                        (_, 1) => Families::T1,
                        (1, _) => Families::S1,
                        _ => Families::INNER,
                    };
                    assert_eq!(technique.family(), family);
                    expected = expected | family.when(possible);
                    for (ds, dt) in [(1, 0), (0, 1)] {
                        let longer = Technique::new(s + ds, t + dt);
                        assert!(!samplable(&scene, &path, longer, &rules), "of another length");
                    }
                }
                let far = emitter == SUN || emitter == SKY;
                let expected = expected | Families::FAR.when(far && expected != Families::NONE);
                let found = families(&scene, &path, &rules);
                assert_eq!(found, expected, "{emitter} {pinhole} {spreads:?}");
                let short = WalkRules { max_length: Some(k as u32 - 1), rr_depth: 5 };
                assert_eq!(families(&scene, &path, &short), Families::NONE);
                walks_agree(expected, &spreads, Origin { delta, far }, pinhole);
            }
        }
    }
}

/// The families that walks name: from either end, and joined at every edge.
fn walks_agree(expected: Families, spreads: &[bool], origin: Origin, pinhole: bool) {
    let walk = |spreads: &mut dyn Iterator<Item = &bool>| {
        let mut class = WalkClass::default();
        for s in spreads {
            class.push(*s);
        }
        class
    };
    let light = walk(&mut spreads.iter()).families(TransportMode::Importance, origin, pinhole);
    let sensor = walk(&mut spreads.iter().rev()).families(TransportMode::Radiance, origin, pinhole);
    assert_eq!(light, expected, "from the emitter: {spreads:?} {origin:?} {pinhole}");
    assert_eq!(sensor, expected, "from the sensor: {spreads:?} {origin:?} {pinhole}");
    for cut in 0..=spreads.len() {
        let (a, b) = spreads.split_at(cut);
        let (a, b) = (walk(&mut a.iter()), walk(&mut b.iter().rev()));
        let joined = WalkClass::join(&a, &b, origin, pinhole);
        assert_eq!(joined, expected, "joined at {cut}: {spreads:?} {origin:?} {pinhole}");
    }
}

#[test]
fn a_start_that_emits_nothing_is_never_hit() {
    let scene = scene(0.1);
    let mut path = long_path(&scene, AREA);
    path.vertices[0] = surface(&scene, DVec3::new(-2.0, 1.0, 1.0), DVec3::X, DIFFUSE);
    let rules = WalkRules::default();
    assert!(!samplable(&scene, &path, Technique::new(0, 4), &rules));
    assert_eq!(ln_density(&scene, &path, Technique::new(2, 2), &rules), None);
    assert_eq!(contribution(&scene, &path), [0.0; 3]);
    let alone = Path::non_specular(vec![lens(&scene)]);
    assert!(!samplable(&scene, &alone, Technique::new(0, 1), &rules));
}

#[test]
fn a_vertex_is_seen_in_the_direction_of_its_position() {
    let scene = scene(0.0);
    let from = Vec3::new(0.1, -0.3, 0.2);
    let floor = surface(&scene, FLOOR, DVec3::Z, DIFFUSE);
    for vertex in [floor, start(&scene, SPOT), lens(&scene)] {
        let to = (vertex.position().unwrap() - from).normalize();
        assert!(vertex.direction_from(from).distance(to) < 1e-6, "{vertex:?}");
    }
    let sky = start(&scene, SKY);
    assert!(sky.position().is_none());
    assert_eq!(sky.direction_from(from), Vec3::new(-0.3, 0.2, 1.0).normalize());
}

#[test]
fn vertices_name_their_emitter_and_their_surface() {
    let scene = scene(0.0);
    for emitter in [AREA, SPOT, SUN, SKY] {
        let vertex = start(&scene, emitter);
        assert_eq!(vertex.emitter(), Some(emitter));
        assert_eq!(vertex.surface().is_some(), emitter == AREA);
    }
    assert_eq!(surface(&scene, FLOOR, DVec3::Z, DIFFUSE).emitter(), None);
    assert_eq!(lens(&scene).emitter(), None);
}

#[test]
fn a_light_walk_begins_with_the_power_of_its_emitter() {
    let scene = scene(0.0);
    let scale = scene.normalisation().scale;
    let r = LAMP_RADIUS * scale;
    let disk = PI * (scene.ball().radius as f64).powi(2);
    for emitter in [AREA, SPOT, SUN, SKY] {
        let pick = scene.emitters().invert_pick(emitter, 0.5).unwrap();
        let mut sample = scene.sample_emission(pick, [0.3, 0.6], [0.2, 0.7]).unwrap();
        assert_eq!(sample.emitter, emitter);
        let power = match emitter {
            AREA => 2.0 * PI * 4.0 * PI * r * r,
            SPOT => 0.7 * scale * scale * 4.0 * PI,
            SUN => 1.3 * disk,
            _ => 0.9 * 4.0 * PI * disk,
        };
        let mass = scene.emitters().mass(emitter).value();
        near(sample.throughput().g as f64 * mass, power, &emitter);
        // In the surface itself cosine and density are both 0.
        sample.cos = 0.0;
        sample.next = NextDensity::Direction(Density::ZERO);
        assert!(sample.throughput().is_black());
    }
}

#[test]
fn the_far_side_of_a_round_lamp_has_no_density() {
    let scene = scene(0.0);
    let toward = (FLOOR - LAMP).normalize();
    let density = |n: DVec3| {
        let vertex = surface(&scene, LAMP + LAMP_RADIUS * n, n, DIFFUSE);
        scene.pdf_direct(inside(&scene, FLOOR), &vertex).value()
    };
    assert!(density(toward) > 0.0);
    // Seen from the floor the limb is at cos θ = 0.25/1.76 on the lamp.
    let across = toward.any_orthonormal_vector();
    let at = |cos: f64| toward * cos + across * (1.0 - cos * cos).sqrt();
    assert!(density(at(0.2)) > 0.0);
    assert_eq!(density(at(0.1)), 0.0);
    assert_eq!(density(-toward), 0.0);
}
