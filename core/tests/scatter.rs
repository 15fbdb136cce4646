//! Scattering where the shading normal leaves the geometric one: f̄, densities, adjoint factor and
//! survival, by hand and against each other.

use std::f32::consts::PI;

use glam::Vec3;
use pathspace_core::bsdf::Event;
use pathspace_core::bsdf::TransportMode::{self, Importance, Radiance};
use pathspace_core::description::MaterialKind;
use pathspace_core::math::{Frame, Ray};
use pathspace_core::scene::SurfacePoint;
use pathspace_core::{Rgb, Scene};
use rand::RngExt;

use crate::bsdf_models::{Beckmann, Ggx, diffuse, random_direction, rough, two_sided};
use crate::chi2::rng;
use crate::delta::scene;

const RHO: Rgb = Rgb::new(0.1, 0.2, 0.4);
const MODES: [TransportMode; 2] = [Radiance, Importance];

/// A point of the scene's boundary with other normals.
fn point(scene: &Scene, n_g: Vec3, n_s: Vec3) -> SurfacePoint {
    let mut point = scene.intersect(&Ray::new(Vec3::new(0.05, 0.0, 0.3), -Vec3::Z)).unwrap();
    point.n_g = n_g.normalize();
    point.frame = Frame::from_normal(n_s.normalize());
    point
}

fn tilted(scene: &Scene) -> SurfacePoint {
    point(scene, Vec3::new(0.1, -0.2, 1.0), Vec3::new(-0.3, 0.4, 1.0))
}

fn other(mode: TransportMode) -> TransportMode {
    match mode {
        Radiance => Importance,
        Importance => Radiance,
    }
}

/// |ω·n_s| and |ω·n_g|.
fn cosines(point: &SurfacePoint, w: Vec3) -> (f32, f32) {
    (point.frame.n.dot(w).abs(), point.n_g.dot(w).abs())
}

/// Veach 1997, eq. 5.19.
fn adjoint(point: &SurfacePoint, l: Vec3, c: Vec3) -> f32 {
    let ((l_s, l_g), (c_s, c_g)) = (cosines(point, l), cosines(point, c));
    l_s * c_g / (l_g * c_s)
}

fn near(found: f32, expected: f32) {
    assert!((found - expected).abs() <= 1e-4 * expected.abs(), "{found}, expected {expected}");
}

/// Directions that no cosine makes ill-conditioned.
fn directions(point: &SurfacePoint, seed: u64) -> Vec<(Vec3, Vec3)> {
    let mut rng = rng(seed);
    let mut draw = || loop {
        let w = random_direction(&mut rng);
        let (s, g) = cosines(point, w);
        if s > 0.1 && g > 0.1 {
            return w;
        }
    };
    (0..100).map(|_| (draw(), draw())).collect()
}

#[test]
fn a_diffuse_vertex_is_what_its_formulas_say() {
    let scene = scene(two_sided(diffuse(RHO), diffuse(RHO)));
    let point = tilted(&scene);
    let mut seen = 0;
    for (from, to) in directions(&point, 1) {
        if point.frame.n.dot(from) * point.frame.n.dot(to) < 0.0 {
            continue;
        }
        seen += 1;
        for mode in MODES {
            let (l, c) = if mode == Radiance { (to, from) } else { (from, to) };
            let (l_s, l_g) = cosines(&point, l);
            let f = 0.4 / PI * l_s / l_g;
            let (forward, backward) = (cosines(&point, to).0 / PI, cosines(&point, from).0 / PI);
            // f|cos|/p = ρ, times the adjoint factor on the walk from the light.
            let (by_sensor, by_light) = (0.4, (0.4 * adjoint(&point, l, c)).min(0.95));
            let (on, back) =
                if mode == Radiance { (by_sensor, by_light) } else { (by_light, by_sensor) };
            near(scene.scatter(&point, l, c).b, f);
            near(scene.scatter_value(&point, l, c, Event::NonSpecular).b, f);
            let one = scene.evaluate_scatter(&point, from, to, mode).unwrap();
            near(one.value.b, f);
            near(one.pdf.value() as f32, forward);
            near(one.survival.value() as f32, on);
            let two = scene.connect_scatter(&point, from, to, mode).unwrap();
            near(two.value.b, f);
            near(two.forward.value() as f32, forward);
            near(two.backward.value() as f32, backward);
            near(two.survival_forward.value() as f32, on);
            near(two.survival_backward.value() as f32, back);
            let (pdf, survival) =
                scene.scatter_event(&point, from, to, mode, Event::NonSpecular).unwrap();
            near(pdf.value() as f32, forward);
            near(survival.value() as f32, on);
        }
    }
    assert!(seen > 30);
}

/// What a walk samples is what its vertex says when it is asked for that direction, and what the
/// walk from the other side says.
#[test]
fn sampled_and_evaluated_steps_agree() {
    let kinds = [diffuse(RHO), rough(Ggx, 0.4, 0.6, true), rough(Beckmann, 0.5, 0.3, false)];
    for (i, kind) in kinds.into_iter().enumerate() {
        let scene = scene(two_sided(kind.clone(), kind));
        let point = tilted(&scene);
        let mut rng = rng(10 + i as u64);
        let mut seen = 0;
        for (from, _) in directions(&point, 20 + i as u64) {
            for mode in MODES {
                let (lobe, u) = (rng.random(), [rng.random(), rng.random()]);
                let Some(s) = scene.sample_scatter(&point, from, mode, lobe, u) else { continue };
                let (cos_s, cos_g) = cosines(&point, s.direction);
                if cos_s < 0.1 || cos_g < 0.1 {
                    continue;
                }
                seen += 1;
                assert!(!s.event.is_specular() && s.survival.value() <= 0.95);
                let one = scene.evaluate_scatter(&point, from, s.direction, mode).unwrap();
                let pdf = s.pdf.value();
                assert!((one.pdf.value() / pdf - 1.0).abs() < 1e-3, "{i} {mode:?}");
                let weight = one.value.g * cos_g / pdf as f32;
                assert!((weight / s.weight.g - 1.0).abs() < 2e-3, "{i} {mode:?} {weight} {s:?}");
                let survival = s.weight.max_channel().min(0.95) as f64;
                assert!((survival - s.survival.value()).abs() < 1e-6);
                assert!((survival - one.survival.value()).abs() < 2e-3, "{i} {mode:?}");
                let two = scene.connect_scatter(&point, from, s.direction, mode).unwrap();
                let back = scene.connect_scatter(&point, s.direction, from, other(mode)).unwrap();
                near(two.value.g, one.value.g);
                near(back.value.g, one.value.g);
                near(back.forward.value() as f32, two.backward.value() as f32);
                near(back.survival_forward.value() as f32, two.survival_backward.value() as f32);
                near(back.survival_backward.value() as f32, two.survival_forward.value() as f32);
            }
        }
        assert!(seen > 100, "{i}: {seen}");
    }
}

#[test]
fn nothing_is_scattered_through_an_opaque_surface() {
    let scene = scene(two_sided(diffuse(RHO), diffuse(RHO)));
    let point = tilted(&scene);
    let (above, below) =
        (Vec3::new(0.1, 0.2, 0.9).normalize(), Vec3::new(0.3, 0.1, -0.9).normalize());
    for mode in MODES {
        assert!(scene.scatter(&point, above, below).is_black());
        assert!(scene.evaluate_scatter(&point, above, below, mode).is_none());
        assert!(scene.connect_scatter(&point, above, below, mode).is_none());
        assert!(scene.scatter_event(&point, above, below, mode, Event::NonSpecular).is_none());
    }
}

/// Tinted glass, so that no survival is at its bound.
fn tinted() -> MaterialKind {
    MaterialKind::Dielectric {
        int_ior: 1.7,
        ext_ior: 1.0,
        specular_reflectance: Rgb::grey(0.3),
        specular_transmittance: Rgb::grey(0.6),
    }
}

#[test]
fn roulette_does_not_see_the_compression_of_radiance() {
    let scene = scene(tinted());
    let point = point(&scene, Vec3::Z, Vec3::Z);
    for side in [1.0, -1.0] {
        let from = Vec3::new(0.2, 0.1, side).normalize();
        for lobe in [0.001, 0.999] {
            for mode in MODES {
                let s = scene.sample_scatter(&point, from, mode, lobe, [0.5, 0.5]).unwrap();
                let through = s.direction.z * side < 0.0;
                // n² of the side it leaves to over n² of the side it came from; radiance is divided
                // by it.
                let n2 =
                    if !through || mode == Importance { 1.0 } else { 1.7_f32.powf(2.0 * side) };
                assert!(s.event.is_specular());
                near(s.survival.value() as f32, s.weight.r * n2);
                let (pdf, survival) =
                    scene.scatter_event(&point, from, s.direction, mode, s.event).unwrap();
                near(survival.value() as f32, s.weight.r * n2);
                near(pdf.value() as f32, s.pdf.value() as f32);
                assert!(survival.value() < 0.94);
            }
        }
    }
}

/// Quotients of cosines would be noise there.
#[test]
fn a_direction_in_a_tangent_plane_carries_nothing_where_normals_differ() {
    let scene = scene(two_sided(diffuse(RHO), diffuse(RHO)));
    let point = point(&scene, Vec3::new(0.48, 0.36, 0.8), Vec3::Z);
    // Across n_g, above the shading frame.
    let l = Vec3::new(-0.8, 0.0, 0.48).normalize();
    let c = Vec3::new(0.3, 0.2, 0.9).normalize();
    assert!(cosines(&point, l).1 < 1e-6);
    assert!(scene.scatter(&point, l, c).is_black());
    let walk = scene.connect_scatter(&point, l, c, Importance).unwrap();
    assert!(walk.value.is_black() && walk.survival_forward.value() == 0.0);
    assert_eq!(scene.evaluate_scatter(&point, l, c, Importance).unwrap().survival.value(), 0.0);
    // Across n_s: c_s divides the adjoint factor alone.
    let c = Vec3::new(1.0, 0.0, 5e-7);
    let walk = scene.connect_scatter(&point, c, Vec3::new(0.0, 0.6, 0.8), Radiance).unwrap();
    assert_eq!(walk.survival_backward.value(), 0.0);
}
