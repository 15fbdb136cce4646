//! Hard cases: scales, offsets, leaks, surfaces that nearly touch.

use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::description::{MicrofacetKind, SceneDescription};
use pathspace_core::film::{Contribution, Film, Layers, Sink};
use pathspace_core::integrator::PathEstimator;
use pathspace_core::math::Ray;
use pathspace_core::path::Vertex;
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use pathspace_integrators::lt::LightTracer;
use pathspace_integrators::pt::PathTracer;
use pathspace_integrators::{Defaults, Registry};
use pathspace_validation::exact;
use pathspace_validation::scene_builder::SceneBuilder;
use pathspace_validation::suites::{self, moved};

use crate::models::{self, v};

fn mean(description: &SceneDescription, spec: &str, steps: u32) -> f64 {
    let scene = std::sync::Arc::new(models::build(description));
    let integrator =
        Registry::builtin().create(&spec.parse().unwrap(), &Defaults::default()).unwrap();
    let mut film = Film::new(scene.film(), Layers::NONE);
    let mut run = integrator.start(scene, 3).unwrap();
    for _ in 0..steps {
        run.step(&mut film);
    }
    assert_eq!(film.nonfinite(), 0);
    film.mean().iter().sum()
}

#[test]
fn units_do_not_matter() {
    // The same random numbers: the same paths but for rounding of the normalisation.
    for description in [models::glossy_room(), models::emitters_and_lens()] {
        for spec in ["pt:max_depth=4", "lt:max_depth=4"] {
            let here = mean(&description, spec, 8);
            for scale in [1e-6, 1e-3, 1e3, 1e6] {
                let there = mean(&moved(&description, scale, DVec3::ZERO), spec, 8);
                assert!((there / here - 1.0).abs() < 1e-3, "{spec}, {scale}: {here} {there}");
            }
        }
    }
}

#[test]
fn a_million_radii_from_the_origin_nothing_changes() {
    let description = models::emitters_and_lens();
    let offset = DVec3::new(1e6, -2e6, 0.5e6);
    for spec in ["pt:max_depth=4", "lt:max_depth=4"] {
        let here = mean(&description, spec, 8);
        let there = mean(&moved(&description, 1.0, offset), spec, 8);
        assert!((there / here - 1.0).abs() < 1e-3, "{spec}: {here} {there}");
    }
}

struct Counter(u64);

impl Sink for Counter {
    fn add(&mut self, c: Contribution) {
        self.0 += u64::from(!c.value.is_black());
    }
}

fn contributions(scene: &Scene, estimator: &impl PathEstimator, paths: u64) -> u64 {
    let mut sink = Counter(0);
    let film = scene.film();
    for item in 0..paths {
        let pixel = [item as u32 % film.width, item as u32 / film.width % film.height];
        let mut u = RandomStream::new(Address { seed: 5, step: 0, item });
        estimator.estimate(scene, Some(pixel), &mut u, &mut sink);
    }
    sink.0
}

#[test]
fn a_closed_box_is_dark() {
    let spec = |s: &str| s.parse().unwrap();
    let pt = PathTracer::from_spec(&spec("pt:max_depth=10"), &Defaults::default()).unwrap();
    let lt = LightTracer::from_spec(&spec("lt:max_depth=6"), &Defaults::default()).unwrap();
    for dark in suites::dark_boxes() {
        let (kind, scene) = (dark.name, models::build(&dark.description));
        assert_eq!(contributions(&scene, &pt, 100_000), 0, "pt, {kind}");
        assert_eq!(contributions(&scene, &lt, 300_000), 0, "lt, {kind}");
    }
}

#[test]
fn the_inner_of_two_nearly_equal_spheres_is_found() {
    let mut b = SceneBuilder::new(8);
    let grey = b.diffuse(0.5);
    b.sphere(DVec3::ZERO, 1.0, grey);
    b.sphere(DVec3::ZERO, 1.0 + 4e-5, grey);
    b.look_at(v(0.0, -3.0, 0.0), DVec3::ZERO, DVec3::Z, 20.0);
    let scene = models::build(&b.finish());
    let mut u = RandomStream::new(Address { seed: 2, step: 0, item: 0 });
    let center = (-scene.normalisation().center * scene.normalisation().scale).as_vec3();
    for _ in 0..100_000 {
        let d = pathspace_core::math::warp::uniform_sphere(u.next2());
        // From the centre out: the inner sphere, then the outer one, then nothing.
        let inner = scene.intersect(&Ray::new(center, d)).expect("the inner sphere");
        assert_eq!(inner.shape, 0);
        let outer = scene.intersect(&inner.spawn(d)).expect("the outer sphere");
        assert_eq!(outer.shape, 1);
        assert!(scene.intersect(&outer.spawn(d)).is_none());
        // And back in again.
        let back = scene.intersect(&outer.spawn(-d)).expect("the inner sphere from outside");
        assert_eq!(back.shape, 0);
        assert!(scene.visible(&Vertex::Surface(inner), &Vertex::Surface(outer)));
    }
}

#[test]
fn grazing_rays_carry_bounded_weights() {
    let mut b = SceneBuilder::new(8);
    let materials = [
        models::rough(MicrofacetKind::Ggx, 0.05, 0.05, true),
        models::rough(MicrofacetKind::Beckmann, 0.3, 0.3, true),
        models::mirror(),
    ];
    let indices: Vec<usize> = materials.into_iter().map(|m| b.material(m)).collect();
    let (glass, grey) = (b.glass(1.5), b.diffuse(0.8));
    for (i, material) in indices.into_iter().chain([glass, grey]).enumerate() {
        let corner = v(-1.0, -1.0, i as f64);
        b.rectangle(corner, v(2.0, 0.0, 0.0), v(0.0, 2.0, 0.0), material);
    }
    b.look_at(v(0.0, -6.0, 2.0), DVec3::ZERO, DVec3::Z, 20.0);
    let scene = models::build(&b.finish());
    let mut u = RandomStream::new(Address { seed: 4, step: 0, item: 0 });
    let n = scene.normalisation();
    for i in 0..5 {
        let above = ((v(0.2, 0.1, i as f64 + 0.4) - n.center) * n.scale).as_vec3();
        let point = scene.intersect(&Ray::new(above, -glam::Vec3::Z)).expect("the plate");
        for exponent in 1..=6 {
            for _ in 0..2000 {
                let cos = 10_f32.powi(-exponent);
                let phi = u.next() * std::f32::consts::TAU;
                let sin = (1.0 - cos * cos).sqrt();
                let from = glam::Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                let mode = pathspace_core::bsdf::TransportMode::Importance;
                let (lobe, direction) = (u.next(), u.next2());
                let Some(s) = scene.sample_scatter(&point, from, mode, lobe, direction) else {
                    continue;
                };
                let largest = s.weight.max_channel();
                assert!((0.0..=1.0001).contains(&largest), "plate {i}, 10^-{exponent}: {largest}");
            }
        }
    }
}

#[test]
fn a_tiny_sphere_light_lights_as_a_point() {
    // π(R/d)² L over the plate to 10⁻⁴: the cone is uniform, so that only the receiver's points
    // vary.
    let scene = exact::receivers::small_sphere_light();
    let expected = scene.expected.iter().find(|e| e.mean > 0.0).unwrap();
    let built = models::build(&scene.description);
    let pt = "pt:max_depth=2".parse().unwrap();
    let integrator = Registry::builtin().create(&pt, &Defaults::default()).unwrap();
    let mut film = Film::new(built.film(), Layers { length: true, ..Layers::NONE });
    let mut run = integrator.start(std::sync::Arc::new(built), 8).unwrap();
    for _ in 0..200 {
        run.step(&mut film);
    }
    let ratio = expected.observe(&film) / expected.mean;
    assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
}
