//! Inverses of samplers: from the outcome to numbers that make it again.

use glam::{DVec3, Vec3};
use pathspace_core::bsdf::{Bsdf, Component, Event, TransportMode};
use pathspace_core::path::Vertex;
use pathspace_core::random::{Address, PrimarySample, RandomStream, coordinate_between};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::bsdf_models::{self as models, direction};
use crate::emitters::{emitters, inside, lamp, painted_sky, shapes};
use crate::sensor::sensors;

const SAMPLES: u64 = 20_000;
/// Distance of unit directions, or in the scene of radius 1.
const NEAR: f32 = 1e-4;

fn stream(seed: u64, item: u64) -> RandomStream {
    RandomStream::new(Address { seed, step: 0, item })
}

/// Distance on the circle [0, 1).
fn apart(a: f32, b: f32) -> f32 {
    let d = (a - b).abs();
    d.min(1.0 - d)
}

/// Numbers that are to be uniform.
struct Uniform {
    name: String,
    counts: [f64; 32],
}

impl Uniform {
    fn new(name: impl Into<String>) -> Self {
        Uniform { name: name.into(), counts: [0.0; 32] }
    }

    fn add(&mut self, u: f32) {
        assert!((0.0..1.0).contains(&u), "{}: {u}", self.name);
        self.counts[(u * 32.0) as usize] += 1.0;
    }

    fn assert(&self) {
        let expected = self.counts.iter().sum::<f64>() / 32.0;
        let chi2: f64 = self.counts.iter().map(|n| (n - expected).powi(2) / expected).sum();
        let p = 1.0 - ChiSquared::new(31.0).unwrap().cdf(chi2);
        assert!(expected > 100.0 && p > 1e-5, "{}: χ² {chi2}, {:?}", self.name, self.counts);
    }
}

#[test]
fn numbers_of_a_lobe_that_spreads_come_back() {
    for (seed, (name, bsdf)) in models::spreading().into_iter().enumerate() {
        let (mut tested, mut off) = (0, 0);
        let mut lobes = Uniform::new(name);
        for item in 0..SAMPLES {
            let mut u = stream(seed as u64, item);
            let wo =
                direction(2.0 * u.next() as f64 - 1.0, std::f64::consts::TAU * u.next() as f64);
            let (lobe, number) = (u.next(), u.next2());
            let Some(s) = bsdf.sample(wo, lobe, number, TransportMode::Radiance) else { continue };
            let [lobe, a, b] = bsdf.invert(wo, s.wi, s.event(), &mut u).unwrap();
            lobes.add(lobe);
            let again = bsdf.sample(wo, lobe, [a, b], TransportMode::Radiance);
            let missed = again.map_or(2.0, |again| again.wi.distance(s.wi));
            // On the horizon the direction again may lie below.
            assert!(missed < NEAR || s.wi.z.abs() < 1e-3, "{name} {wo} {number:?}: {missed}");
            tested += 1;
            off += u32::from(apart(a, number[0]).max(apart(b, number[1])) > 1e-3);
        }
        lobes.assert();
        // Where the Jacobian vanishes (poles, grazing angles) directions tell no more.
        assert!(tested > 5000 && off * 50 < tested, "{name}: {off} of {tested}");
    }
}

#[test]
fn numbers_of_a_delta_lobe_are_drawn_from_those_that_choose_it() {
    for (seed, (name, bsdf)) in models::delta().into_iter().enumerate() {
        for cos in [-0.9, -0.4, 0.3, 0.95] {
            let wo = direction(cos, 1.0);
            let mut numbers: Vec<_> = (0..3).map(|i| Uniform::new(format!("{name} {i}"))).collect();
            for item in 0..SAMPLES {
                let mut u = stream(50 + seed as u64, item);
                let (lobe, number) = (u.next(), u.next2());
                let Some(s) = bsdf.sample(wo, lobe, number, TransportMode::Radiance) else {
                    continue;
                };
                let [lobe, a, b] = bsdf.invert(wo, s.wi, s.event(), &mut u).unwrap();
                for (uniform, u) in numbers.iter_mut().zip([lobe, a, b]) {
                    uniform.add(u);
                }
                let again = bsdf.sample(wo, lobe, [a, b], TransportMode::Radiance).unwrap();
                assert_eq!((again.wi, again.event()), (s.wi, s.event()), "{name} {cos}");
            }
            if numbers[0].counts.iter().sum::<f64>() > 0.0 {
                numbers.iter().for_each(Uniform::assert);
            }
        }
    }
}

#[test]
fn nothing_is_inverted_that_is_never_sampled() {
    let mut u = stream(1, 1);
    let (front, behind) = (direction(0.6, 1.0), direction(-0.7, 2.0));
    let glass = models::build(&models::dielectric(1.0, 1.5));
    // Beyond the critical angle nothing is refracted; without a boundary nothing is reflected.
    let flat = direction(0.2, 0.0);
    let specular = Event::Specular;
    let (reflection, transmission) = (Component::REFLECTION, Component::TRANSMISSION);
    assert_eq!(glass.invert(flat, behind, specular(transmission), &mut u), None);
    assert!(glass.invert(flat, direction(0.2, 3.0), specular(reflection), &mut u).is_some());
    assert_eq!(glass.invert(flat, behind, Event::NonSpecular, &mut u), None);
    let matched = models::build(&models::dielectric(1.3, 1.3));
    assert_eq!(matched.invert(front, front, specular(reflection), &mut u), None);
    assert_eq!(Bsdf::Null.invert(front, front, specular(transmission), &mut u), None);
    for (name, bsdf) in models::spreading() {
        assert_eq!(bsdf.invert(front, behind, Event::NonSpecular, &mut u), None, "{name}");
    }
}

fn same(name: &str, a: &Vertex, b: &Vertex) {
    assert_eq!(a.emitter(), b.emitter(), "{name}");
    let distance = match (a, b) {
        (Vertex::InfiniteEmitter { to: a, .. }, Vertex::InfiniteEmitter { to: b, .. }) => {
            a.distance(*b)
        }
        _ => a.position().unwrap().distance(b.position().unwrap()),
    };
    assert!(distance < NEAR, "{name}: {a:?} {b:?}");
}

/// Every shape that emits, beside a point; directional light and environment.
fn scenes() -> Vec<(String, pathspace_core::Scene)> {
    use pathspace_core::Rgb;
    use pathspace_core::description::EmitterDescription as E;
    let far = vec![
        E::Directional { direction: DVec3::new(0.1, 0.3, -1.0), irradiance: Rgb::WHITE },
        E::Constant { radiance: Rgb::grey(0.2) },
        lamp(),
    ];
    let mut list: Vec<_> = shapes()
        .iter()
        .map(|(name, geometry, place)| {
            (name.to_string(), emitters(Some((geometry, *place, false)), vec![lamp()]))
        })
        .collect();
    let (_, geometry, place) = &shapes()[0];
    list.push(("far".into(), emitters(Some((geometry, *place, false)), far)));
    let to_world = glam::DAffine3::from_rotation_translation(
        glam::DQuat::from_rotation_x(2.8),
        DVec3::new(0.1, 0.2, 2.0),
    );
    let texture = pathspace_core::texture::Texture::Constant(Rgb::new(0.5, 1.0, 0.7));
    let beams = vec![
        E::Spot {
            to_world,
            shape: pathspace_core::description::SpotDescription {
                intensity: Rgb::WHITE,
                cutoff_degrees: 30.0,
                beam_degrees: 20.0,
                texture: None,
            },
        },
        E::Projector {
            to_world,
            shape: pathspace_core::description::ProjectorDescription {
                irradiance: texture.into(),
                aspect: 1.5,
                fov_x_degrees: 50.0,
                scale: 2.0,
            },
        },
        lamp(),
    ];
    list.push(("beams".into(), emitters(None, beams)));
    list.push(("map".into(), emitters(None, vec![painted_sky(), lamp()])));
    list
}

#[test]
fn numbers_of_next_event_estimation_come_back() {
    for (seed, (name, scene)) in scenes().into_iter().enumerate() {
        let reference = inside(&scene, DVec3::new(0.4, -0.5, 1.4));
        let mut picks = Uniform::new(name.as_str());
        for item in 0..SAMPLES {
            let mut u = stream(100 + seed as u64, item);
            let Some(s) = scene.sample_direct(reference, u.next(), u.next2()) else { continue };
            let [pick, a, b] = scene.invert_direct(reference, &s.vertex, &mut u).unwrap();
            picks.add(pick);
            let again = scene.sample_direct(reference, pick, [a, b]).unwrap();
            same(&name, &again.vertex, &s.vertex);
        }
        // Points on the far side are sampled and left out: their picks are missing.
        if ["far", "sphere", "map"].contains(&name.as_str()) {
            picks.assert();
        }
    }
}

#[test]
fn numbers_of_emission_come_back() {
    for (seed, (name, scene)) in scenes().into_iter().enumerate() {
        let mut picks = Uniform::new(name.as_str());
        for item in 0..SAMPLES {
            let mut u = stream(200 + seed as u64, item);
            let s = scene.sample_emission(u.next(), u.next2(), u.next2()).unwrap();
            // x₁ somewhere on the ray; a free point lies for all of them in the same direction.
            let p = s.ray.o + s.ray.d * (0.2 + u.next());
            let x1 = Vertex::Sensor { p, n: Vec3::Z };
            let [pick, a, b] = scene.invert_emission_vertex(&s.vertex, &mut u).unwrap();
            let direction = scene.invert_emission_next(&s.vertex, &x1).unwrap();
            picks.add(pick);
            let again = scene.sample_emission(pick, [a, b], direction).unwrap();
            same(&name, &again.vertex, &s.vertex);
            assert!(again.ray.d.distance(s.ray.d) < 2.0 * NEAR, "{name}");
            assert!(again.ray.o.distance(s.ray.o) < 4.0 * NEAR, "{name}");
        }
        picks.assert();
    }
}

#[test]
fn numbers_of_the_sensor_come_back() {
    for (seed, (name, scene)) in sensors().into_iter().enumerate() {
        let sensor = scene.sensor();
        for item in 0..SAMPLES {
            let mut u = stream(300 + seed as u64, item);
            let (film, lens) = (u.next2(), u.next2());
            let sample = sensor.sample(None, film, lens);
            // A position of the film has 24 bits in the whole film.
            let back = sensor.invert_film(sample.film);
            assert!(apart(back[0], film[0]).max(apart(back[1], film[1])) < 1e-6, "{name}");
            let p = sample.vertex.position().unwrap();
            match sensor.invert_vertex(p) {
                None => assert!(sensor.is_pinhole(), "{name}"),
                Some(lens) => {
                    let again = sensor.sample(None, back, lens);
                    assert!(again.vertex.position().unwrap().distance(p) < 1e-6, "{name}");
                    assert!(again.ray.d.distance(sample.ray.d) < 1e-5, "{name}");
                }
            }
        }
    }
}

#[test]
fn numbers_between_two_bounds_are_uniform_there() {
    let mut uniform = Uniform::new("between");
    let (low, high) = (0.3, 0.30001);
    for item in 0..SAMPLES {
        let mut u = stream(400, item);
        let x = coordinate_between(low, high, u.next()).unwrap() as f64;
        assert!(x >= low && x < high);
        uniform.add(((x - low) / (high - low)) as f32);
    }
    // 168 coordinates in 32 cells: five or six each.
    uniform.counts.iter().for_each(|&n| assert!((450.0..800.0).contains(&n)));
    assert_eq!(coordinate_between(0.25, 0.25, 0.5), None);
    assert_eq!(coordinate_between(0.250_000_01, 0.250_000_02, 0.5), None);
    assert_eq!(coordinate_between(1.0 - 1e-9, 1.0, 0.5), None);
}
