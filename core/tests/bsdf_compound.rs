//! The models that are large or made of others: samplers, densities, both modes, inverses, energy.

use glam::Vec3;
use pathspace_core::bsdf::TransportMode::{Importance, Radiance};
use pathspace_core::bsdf::{Bsdf, Component, Event, ScatterPdf};
use pathspace_core::math::{Frame, Ray};
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use pathspace_core::scene::SurfacePoint;
use pathspace_core::{Rgb, Scene};
use rand::RngExt;

use crate::bsdf_models::{build, compound, direction, random_direction};
use crate::chi2::{self, rng};
use crate::delta::scene;

/// A point whose frame is the surface's own, with the model of the scene there.
fn flat(scene: &Scene) -> SurfacePoint {
    let mut point = scene.intersect(&Ray::new(Vec3::new(0.05, 0.0, 0.3), -Vec3::Z)).unwrap();
    point.n_g = Vec3::Z;
    point.frame = Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z };
    point
}

/// Every model as it is at a point.
fn models() -> Vec<(&'static str, Bsdf)> {
    compound()
        .into_iter()
        .map(|(name, kind)| {
            let scene = scene(kind);
            let model = (*scene.bsdf(&flat(&scene))).clone();
            (name, model)
        })
        .collect()
}

fn stream(seed: u64, item: u64) -> RandomStream {
    RandomStream::new(Address { seed, step: 0, item })
}

/// Probability of all specular components together.
fn specular_mass(bsdf: &Bsdf, wo: Vec3) -> f64 {
    let of = |c| bsdf.specular(wo, Component(c), Radiance).map_or(0.0, |s| s.mass.value());
    (0..32).map(of).sum()
}

#[test]
fn non_specular_samples_follow_their_density_from_both_sides() {
    let chart = chi2::zone(-1.0, 1.0);
    let mut outcomes = Vec::new();
    for (i, (name, bsdf)) in models().into_iter().enumerate() {
        for (j, cos) in [0.9, 0.3, -0.6].into_iter().enumerate() {
            let wo = direction(cos, 0.7 + j as f64);
            // Black or specular on that side.
            let spreads =
                |i: u32| !bsdf.pdf(wo, random_direction(&mut rng(u64::from(i)))).is_zero();
            if !(0..100).any(spreads) {
                continue;
            }
            let sample = |r: &mut rand_pcg::Pcg64Mcg| {
                let (lobe, u) = (r.random(), [r.random(), r.random()]);
                bsdf.sample(wo, lobe, u, Radiance)
                    .filter(|s| !s.event().is_specular())
                    .map(|s| s.wi)
            };
            let density = |wi: &Vec3| bsdf.pdf(wo, *wi).value();
            let seed = 10 * i as u64 + j as u64;
            let name = format!("{name} {cos}");
            outcomes.push(chi2::test(name, &chart, [24, 24], 100_000, seed, sample, density));
        }
    }
    chi2::assert_none_rejected(outcomes, 1e-4);
}

#[test]
fn value_is_that_of_light_whichever_way_the_walk_goes() {
    for (name, bsdf) in models() {
        let mut rng = rng(3);
        let mut lit = 0;
        for _ in 0..4_000 {
            let (c, l) = (random_direction(&mut rng), random_direction(&mut rng));
            let (f, back) = (bsdf.eval(c, l, Radiance), bsdf.eval(l, c, Importance));
            for i in 0..3 {
                assert!(
                    (f[i] - back[i]).abs() <= 2e-4 * f[i].abs() + 1e-7,
                    "{name} {f:?} {back:?}"
                );
            }
            if bsdf.is_reciprocal() && !f.is_black() {
                let turned = bsdf.eval(l, c, Radiance);
                assert!((turned.g / f.g - 1.0).abs() < 2e-4, "{name} {f:?} {turned:?}");
            }
            lit += u32::from(!f.is_black());
            assert!(f.is_black() || (bsdf.is_connectible(c) && bsdf.is_connectible(l)), "{name}");
        }
        assert!(lit > 300 || name == "pane" || name == "relief of glass", "{name}: {lit}");
    }
}

/// What light can take, the walk in either mode can make.
#[test]
fn where_there_is_a_value_there_is_a_density_from_both_ends() {
    for (name, bsdf) in models() {
        let mut rng = rng(4);
        for _ in 0..20_000 {
            let (c, l) = (random_direction(&mut rng), random_direction(&mut rng));
            if bsdf.eval(c, l, Radiance).max_channel() > 1e-6 {
                assert!(!bsdf.pdf(c, l).is_zero() && !bsdf.pdf(l, c).is_zero(), "{name} {c} {l}");
            }
        }
    }
}

#[test]
fn samples_carry_the_weight_of_what_is_evaluated() {
    for (name, bsdf) in models() {
        let mut rng = rng(5);
        for _ in 0..5_000 {
            let wo = random_direction(&mut rng);
            for mode in [Radiance, Importance] {
                let (lobe, u) = (rng.random(), [rng.random(), rng.random()]);
                let Some(s) = bsdf.sample(wo, lobe, u, mode) else { continue };
                assert!((s.wi.length() - 1.0).abs() < 1e-5 && s.weight.is_finite(), "{name}");
                match s.pdf {
                    ScatterPdf::NonSpecular(pdf) => {
                        assert_eq!(pdf, bsdf.pdf(wo, s.wi), "{name}");
                        assert_eq!(s.value, bsdf.eval(wo, s.wi, mode), "{name}");
                    }
                    ScatterPdf::Specular(component, mass) => {
                        let again = bsdf.specular(wo, component, mode).expect(name);
                        assert!(again.wi.distance(s.wi) < 1e-6, "{name}");
                        assert!((again.mass.value() - mass.value()).abs() < 1e-6, "{name}");
                        let weight = again.value.g / mass.value() as f32;
                        assert!((weight - s.weight.g).abs() < 1e-4 * weight.max(1.0), "{name}");
                    }
                }
            }
        }
    }
}

#[test]
fn numbers_come_back_and_choose_uniformly() {
    for (i, (name, bsdf)) in models().into_iter().enumerate() {
        let (mut tested, mut missed) = (0, 0);
        let mut counts = [0.0; 16];
        for item in 0..20_000 {
            let mut u = stream(70 + i as u64, item);
            let sign = if item % 2 == 0 || !bsdf.transmits() { 1.0 } else { -1.0 };
            let wo =
                direction(sign * f64::from(u.next()), std::f64::consts::TAU * f64::from(u.next()));
            let (lobe, number) = (u.next(), u.next2());
            let Some(s) = bsdf.sample(wo, lobe, number, Radiance) else { continue };
            let Some([lobe, a, b]) = bsdf.invert(wo, s.wi, s.event(), &mut u) else {
                panic!("{name} {wo} {s:?}");
            };
            assert!((0.0..1.0).contains(&lobe), "{name}: {lobe}");
            counts[(lobe * 16.0) as usize] += f64::from(u8::from(item % 2 == 0));
            tested += 1;
            match bsdf.sample(wo, lobe, [a, b], Radiance) {
                Some(again) if again.wi.distance(s.wi) < 2e-3 && again.event() == s.event() => {}
                _ => missed += 1,
            }
        }
        // Grazing directions and the borders between lobes.
        assert!(tested > 5_000 && missed * 100 < tested, "{name}: {missed} of {tested}");
        // Samples that come to nothing are missing where they were drawn: all within a factor.
        let mean = counts.iter().sum::<f64>() / 16.0;
        let spread = counts.iter().map(|n| (n / mean - 1.0).abs()).fold(0.0, f64::max);
        assert!(spread < 0.5, "{name}: {counts:?}");
    }
}

#[test]
fn no_probability_is_lost_or_invented() {
    for (name, bsdf) in models() {
        for cos in [0.8, 0.2, -0.5] {
            let wo = direction(cos, 1.0);
            let mut rng = rng(6);
            let n = 20_000;
            let mut specular = 0;
            for _ in 0..n {
                let (lobe, u) = (rng.random(), [rng.random(), rng.random()]);
                let sample = bsdf.sample(wo, lobe, u, Radiance);
                specular += u32::from(sample.is_some_and(|s| s.event().is_specular()));
            }
            let (share, mass) = (f64::from(specular) / f64::from(n), specular_mass(&bsdf, wo));
            // Components about a turned normal have a probability, and no value.
            let slack = if name.contains("relief") { 0.05 } else { 0.0 };
            assert!(
                share < mass + 0.02 && share > mass - 0.02 - slack,
                "{name} {cos} {share} {mass}"
            );
        }
    }
}

/// Mean weight of importance.
fn albedo(bsdf: &Bsdf, wo: Vec3) -> f64 {
    let mut rng = rng(7);
    let n = 20_000;
    let mut draw = || {
        let (lobe, u) = (rng.random(), [rng.random(), rng.random()]);
        bsdf.sample(wo, lobe, u, Importance).map_or(0.0, |s| f64::from(s.weight.max_channel()))
    };
    (0..n).map(|_| draw()).sum::<f64>() / f64::from(n)
}

#[test]
fn nothing_gives_more_than_it_takes() {
    for (name, kind) in compound() {
        // Sheen and coats of these models are added to a whole base, and a leaning normal sees more
        // of a lamp than the surface does.
        let adds = ["cloth", "paint", "sides", "glass and paint", "ward 1992"].contains(&name);
        if adds || name.contains("relief") {
            continue;
        }
        let bsdf = build(&kind);
        for cos in [1.0, 0.7, 0.3, 0.1, -0.2, -0.8] {
            let a = albedo(&bsdf, direction(cos, 0.4));
            assert!(a < 1.01, "{name} {cos}: {a}");
        }
    }
}

/// A rough boundary without absorption loses only what a second bounce between its facets would
/// bring.
#[test]
fn rough_glass_keeps_nearly_all_light() {
    use crate::bsdf_models::Ggx;
    use pathspace_core::description::MaterialKind;
    for alpha in [0.02_f32, 0.1] {
        let bsdf = build(&MaterialKind::RoughDielectric {
            distribution: Ggx,
            alpha_u: alpha,
            alpha_v: alpha,
            sample_visible: true,
            int_ior: 1.5,
            ext_ior: 1.0,
            specular_reflectance: Rgb::WHITE,
            specular_transmittance: Rgb::WHITE,
        });
        for cos in [0.9, 0.5, -0.95] {
            let a = albedo(&bsdf, direction(cos, 0.4));
            assert!((a - 1.0).abs() < 0.02, "{alpha} {cos}: {a}");
        }
    }
}

/// What a walk samples at a point with a leaning shading normal is what the whole-path functions
/// say, in both modes and for every event.
#[test]
fn value_and_density_make_the_weight_of_both_walks() {
    for (name, kind) in compound() {
        let scene = scene(kind);
        let mut point = flat(&scene);
        point.n_g = Vec3::new(0.1, -0.2, 1.0).normalize();
        point.frame = Frame::from_normal(Vec3::new(-0.1, 0.2, 1.0).normalize());
        let mut rng = rng(8);
        let mut seen = 0;
        for i in 0..4_000 {
            let from = random_direction(&mut rng);
            let mode = if i % 2 == 0 { Radiance } else { Importance };
            let (lobe, u) = (rng.random(), [rng.random(), rng.random()]);
            let Some(s) = scene.sample_scatter(&point, from, mode, lobe, u) else { continue };
            let cosines =
                [from, s.direction].map(|w| point.n_g.dot(w).abs().min(point.frame.n.dot(w).abs()));
            if s.weight.is_black() || cosines.iter().any(|c| *c < 0.1) {
                continue;
            }
            seen += 1;
            let (density, survival) = scene
                .scatter_event(&point, from, s.direction, mode, s.event)
                .unwrap_or_else(|| panic!("{name} {s:?}"));
            assert!((density.value() / s.pdf.value() - 1.0).abs() < 2e-3, "{name} {mode:?} {s:?}");
            assert!((survival.value() - s.survival.value()).abs() < 2e-3, "{name} {mode:?} {s:?}");
            let (l, c) = if mode == Radiance { (s.direction, from) } else { (from, s.direction) };
            let value = scene.scatter_value(&point, l, c, s.event);
            let cos = f64::from(point.n_g.dot(s.direction).abs());
            let weight = f64::from(value.g) * cos / density.value();
            let off = (weight / f64::from(s.weight.g) - 1.0).abs();
            assert!(off < 5e-3, "{name} {mode:?} {weight} {s:?}");
            let opposite = mode.opposite();
            let back = scene.scatter_event(&point, s.direction, from, opposite, s.event);
            assert!(back.is_some_and(|(p, _)| !p.is_zero()), "{name} {mode:?} {s:?}");
            if s.event == Event::NonSpecular {
                let two = scene.connect_scatter(&point, from, s.direction, mode).expect(name);
                let (p, q) = back.expect(name);
                assert!((two.backward.value() / p.value() - 1.0).abs() < 1e-3, "{name}");
                let apart = two.survival_backward.value() - q.value();
                assert!(apart.abs() < 2e-3, "{name} {mode:?} {apart}");
            }
        }
        assert!(seen > 300, "{name}: {seen}");
    }
}
