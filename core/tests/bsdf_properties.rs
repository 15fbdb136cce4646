//! What holds for single directions and in the mean: equality of sampled and evaluated quantities,
//! reciprocity, energy, limits, refused parameters.

use glam::{DVec3, Vec3};
use pathspace_core::Rgb;
use pathspace_core::bsdf::microfacet::Microfacet;
use pathspace_core::bsdf::{
    Bsdf, BsdfError, BsdfSample, Component, Event, ScatterPdf, ScatterSide, TransportMode,
};
use pathspace_core::description::{MaterialKind, MicrofacetKind};
use pathspace_core::random::{Address, RandomStream};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::bsdf_models::{self as models, Beckmann, Ggx, build, direction, random_direction};

use TransportMode::{Importance, Radiance};

fn draw(bsdf: &Bsdf, wo: Vec3, mode: TransportMode, rng: &mut Pcg64Mcg) -> Option<BsdfSample> {
    bsdf.sample(wo, rng.random(), [rng.random(), rng.random()], mode)
}

#[test]
fn sampled_pdf_and_value_are_the_evaluated_ones() {
    for (name, bsdf) in models::spreading() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut tested = 0;
        for _ in 0..20_000 {
            let wo = random_direction(&mut rng);
            let Some(s) = draw(&bsdf, wo, Radiance, &mut rng) else { continue };
            assert_eq!(s.pdf, ScatterPdf::NonSpecular(bsdf.pdf(wo, s.wi)), "{name} {wo}");
            assert_eq!(s.value, bsdf.eval(wo, s.wi, Radiance), "{name} {wo}");
            assert_eq!((s.side, s.eta), (ScatterSide::Reflection, 1.0));
            tested += 1;
        }
        assert!(tested > 5_000, "{name}: {tested}");
    }
}

#[test]
fn weight_is_value_times_cosine_over_pdf() {
    for (name, bsdf) in models::spreading() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        for _ in 0..20_000 {
            let wo = random_direction(&mut rng);
            let Some(s) = draw(&bsdf, wo, Radiance, &mut rng) else { continue };
            let pdf = bsdf.pdf(wo, s.wi).value();
            for c in 0..3 {
                let weight = f64::from(s.value[c]) * f64::from(s.wi.z.abs()) / pdf;
                let relative = f64::from(s.weight[c]) / weight - 1.0;
                assert!(relative.abs() < 5e-6, "{name} {wo} {s:?}: {weight}");
            }
        }
    }
}

#[test]
fn sampled_directions_have_unit_length() {
    for (name, bsdf) in models::spreading().into_iter().chain(models::delta()) {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        for _ in 0..5_000 {
            let wo = random_direction(&mut rng);
            let Some(s) = draw(&bsdf, wo, Radiance, &mut rng) else { continue };
            assert!((s.wi.as_dvec3().length() - 1.0).abs() < 4e-7, "{name} {wo} {}", s.wi);
        }
    }
}

#[test]
fn values_are_reciprocal() {
    for (name, bsdf) in models::spreading() {
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        let mut lit = 0;
        for _ in 0..10_000 {
            let (wo, wi) = (random_direction(&mut rng), random_direction(&mut rng));
            let f = bsdf.eval(wo, wi, Radiance);
            assert_eq!(f, bsdf.eval(wi, wo, Radiance), "{name} {wo} {wi}");
            assert_eq!(f, bsdf.eval(wi, wo, Importance), "{name} {wo} {wi}");
            lit += u32::from(!f.is_black());
        }
        assert!(lit > 1_000 || name == "beckmann smooth", "{name}: {lit}");
    }
}

/// f_importance(ω_o, ω_i) = f_radiance(ω_i, ω_o) (Veach 1997, eq. 3.20 ff.). Turning a δ over
/// projected solid angles round costs n_o² dσ⊥_o = n_i² dσ⊥_i, so that the coefficients obey
/// c_importance(ω_o→ω_i) = c_radiance(ω_i→ω_o) (n_o/n_i)².
#[test]
fn refraction_of_importance_is_the_transpose_of_that_of_radiance() {
    let bsdf = build(&MaterialKind::Dielectric {
        int_ior: 1.5,
        ext_ior: 1.1,
        specular_reflectance: Rgb::new(0.9, 0.8, 1.0),
        specular_transmittance: Rgb::new(1.0, 0.7, 0.6),
    });
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut transmitted = 0;
    for _ in 0..20_000 {
        let wo = random_direction(&mut rng);
        let Some(s) = draw(&bsdf, wo, Importance, &mut rng) else { panic!("no event") };
        let Event::Specular(component) = s.event() else { panic!("a density") };
        let back = bsdf.specular(s.wi, component, Radiance).expect("the way back").value;
        // At grazing exits the way back magnifies the rounding of the way there.
        if s.wi.z.abs() < 0.05 {
            continue;
        }
        let n2 = 1.0 / (s.eta * s.eta);
        for c in 0..3 {
            let (there, back) = (s.value[c], back[c] * n2);
            assert!((there - back).abs() < 1e-4, "{wo} {s:?}: {back}");
        }
        transmitted += u32::from(s.side == ScatterSide::Transmission);
    }
    assert!(transmitted > 5_000);
}

#[test]
fn only_refracted_radiance_is_compressed() {
    let bsdf = build(&models::dielectric(1.5, 1.0));
    for (z, eta) in [(0.6, 1.5_f32), (-0.9, 1.0 / 1.5)] {
        let wo = direction(z, 1.0);
        let radiance = bsdf.sample(wo, 0.999, [0.5; 2], Radiance).unwrap();
        let importance = bsdf.sample(wo, 0.999, [0.5; 2], Importance).unwrap();
        assert_eq!(radiance.side, ScatterSide::Transmission);
        assert!((radiance.eta - eta).abs() < 1e-6);
        assert!((radiance.weight.r * eta * eta - 1.0).abs() < 1e-6, "{radiance:?}");
        assert_eq!(importance.weight, Rgb::WHITE);
        // Snell: n_o sin θ_o = n_i sin θ_i.
        let sin = |w: Vec3| f64::from(w.x).hypot(f64::from(w.y));
        assert!((sin(wo) / sin(radiance.wi) / f64::from(eta) - 1.0).abs() < 1e-6);
        let reflected = bsdf.sample(wo, 0.0, [0.5; 2], Radiance).unwrap();
        assert_eq!((reflected.weight, reflected.eta), (Rgb::WHITE, 1.0));
    }
}

#[test]
fn specular_components_are_the_sampled_ones() {
    for (name, bsdf) in models::delta() {
        let mut rng = Pcg64Mcg::seed_from_u64(6);
        for _ in 0..5_000 {
            let wo = random_direction(&mut rng);
            for mode in [Radiance, Importance] {
                let Some(s) = draw(&bsdf, wo, mode, &mut rng) else {
                    assert!(wo.z <= 0.0 && name == "conductor");
                    continue;
                };
                assert!(!bsdf.is_connectible(wo), "{name}");
                let ScatterPdf::Specular(component, mass) = s.pdf else { panic!("a density") };
                let same = bsdf.specular(wo, component, mode).expect(name);
                let value = same.value;
                assert_eq!((value, same.mass, same.wi), (s.value, mass, s.wi), "{name} {wo}");
                assert!(mass.value() > 0.0);
                let weight = value * (1.0 / mass.value() as f32);
                assert!((weight - s.weight).max_channel() < 1e-5 * s.weight.max_channel());
                assert!(bsdf.eval(wo, s.wi, mode).is_black() && bsdf.pdf(wo, s.wi).is_zero());
            }
        }
    }
}

/// Both components of a coated surface in one sampler: masses, densities and weights agree with
/// what is evaluated, and every number has its inverse.
#[test]
fn a_coat_and_its_base_share_one_side() {
    for (name, bsdf) in models::mixed() {
        let mut rng = Pcg64Mcg::seed_from_u64(9);
        let (mut specular, mut other) = (0, 0);
        for i in 0..40_000 {
            let wo = random_direction(&mut rng);
            if wo.z <= 1e-3 {
                continue;
            }
            assert!(bsdf.is_connectible(wo), "{name}");
            let mirror = bsdf.specular(wo, Component::REFLECTION, Radiance).expect(name);
            let numbers = (rng.random(), [rng.random(), rng.random()]);
            let Some(s) = bsdf.sample(wo, numbers.0, numbers.1, Radiance) else { continue };
            match s.pdf {
                ScatterPdf::Specular(_, mass) => {
                    specular += 1;
                    assert_eq!((s.wi, s.value, mass), (mirror.wi, mirror.value, mirror.mass));
                }
                ScatterPdf::NonSpecular(pdf) => {
                    other += 1;
                    assert_eq!(pdf, bsdf.pdf(wo, s.wi), "{name}");
                    let f = bsdf.eval(wo, s.wi, Radiance);
                    let weight = f.g * s.wi.z / pdf.value() as f32;
                    assert!((weight / s.weight.g - 1.0).abs() < 1e-4, "{name} {wo}");
                    let back = bsdf.eval(s.wi, wo, Importance);
                    assert!((back.g / f.g - 1.0).abs() < 1e-4, "{name} {wo}");
                    // ∫ pdf is what the coat leaves.
                    let left = 1.0 - mirror.mass.value();
                    let cosine = f64::from(s.wi.z) / std::f64::consts::PI;
                    assert!((pdf.value() / (left * cosine) - 1.0).abs() < 1e-4, "{name}");
                }
            }
            let mut free = RandomStream::new(Address { seed: 9, step: 0, item: i });
            let [lobe, u, v] = bsdf.invert(wo, s.wi, s.event(), &mut free).expect(name);
            let again = bsdf.sample(wo, lobe, [u, v], Radiance).expect(name);
            assert_eq!(again.event(), s.event(), "{name}");
            assert!(again.wi.distance(s.wi) < 1e-3 || s.wi.z < 1e-3, "{name}");
        }
        assert!(specular > 1000 && other > 5000, "{name}: {specular} {other}");
    }
}

#[test]
fn models_without_a_specular_component_say_so() {
    for (name, bsdf) in models::spreading() {
        let wo = direction(0.5, 1.0);
        assert!(bsdf.is_connectible(wo), "{name}");
        for component in [Component::REFLECTION, Component::TRANSMISSION] {
            assert_eq!(bsdf.specular(wo, component, Radiance), None, "{name}");
        }
    }
}

#[test]
fn lobes_of_glass_share_all_energy() {
    for (int_ior, ext_ior) in [(1.5, 1.0), (1.0, 1.33), (1.3, 1.3)] {
        let bsdf = build(&models::dielectric(int_ior, ext_ior));
        let critical = f64::from(int_ior.min(ext_ior) / int_ior.max(ext_ior));
        let critical = ((1.0 - critical) * (1.0 + critical)).sqrt();
        for i in 0..400 {
            let z = match i {
                0..200 => f64::from(i + 1) / 200.0,
                // About the critical angle, in steps of 10⁻⁹.
                _ => (critical + 1e-9 * f64::from(i - 300)).max(1e-6),
            };
            for wo in [direction(z, 0.3), direction(-z, 0.3)] {
                // Either end of the lobe's number; total reflection answers both alike.
                let sum: f64 = [0.0, 1.0 - f32::EPSILON / 2.0]
                    .map(|u| bsdf.sample(wo, u, [0.5; 2], Importance).unwrap())
                    .map(|s| {
                        assert!(s.wi.is_finite() && s.value.is_finite() && s.weight.is_finite());
                        let ScatterPdf::Specular(_, mass) = s.pdf else { panic!("a density") };
                        assert!((0.0..=1.0).contains(&mass.value()));
                        if mass.value() == 1.0 { 0.5 } else { mass.value() }
                    })
                    .into_iter()
                    .sum();
                assert!((sum - 1.0).abs() < 1e-6, "{int_ior}/{ext_ior} {wo}: {sum}");
            }
        }
    }
}

#[test]
fn total_internal_reflection_reflects_everything() {
    let bsdf = build(&models::dielectric(1.5, 1.0));
    // sin θ = 0.75 > 1/1.5.
    let wo = direction(-(1.0_f64 - 0.75 * 0.75).sqrt(), 0.4);
    for u in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0] {
        let s = bsdf.sample(wo, u, [0.1; 2], Radiance).unwrap();
        assert_eq!((s.wi, s.weight), (Vec3::new(-wo.x, -wo.y, wo.z), Rgb::WHITE));
        assert_eq!(s.side, ScatterSide::Reflection);
    }
}

#[test]
fn null_goes_straight_on() {
    let wo = direction(0.3, 1.0);
    let s = Bsdf::Null.sample(wo, 0.3, [0.1, 0.2], Radiance).unwrap();
    assert_eq!((s.wi, s.weight, s.value), (-wo, Rgb::WHITE, Rgb::WHITE));
    assert_eq!((s.side, s.eta), (ScatterSide::Transmission, 1.0));
    assert_eq!(s.event(), Event::Specular(Component::TRANSMISSION));
    assert!(!Bsdf::Null.is_connectible(wo));
}

#[test]
fn one_sided_models_are_black_behind() {
    for kind in [
        models::diffuse(Rgb::WHITE),
        models::conductor(Rgb::WHITE),
        models::rough(Ggx, 0.3, 0.3, true),
        models::rough(Beckmann, 0.3, 0.3, false),
    ] {
        let bsdf = build(&kind);
        let (up, down) = (direction(0.5, 1.0), direction(-0.5, 2.0));
        for (wo, wi) in [(up, down), (down, up), (down, down)] {
            assert!(bsdf.eval(wo, wi, Radiance).is_black() && bsdf.pdf(wo, wi).is_zero());
        }
        assert_eq!(bsdf.sample(down, 0.5, [0.3; 2], Radiance), None);
        assert_eq!(bsdf.sample(direction(0.0, 1.0), 0.5, [0.3; 2], Radiance), None);
    }
}

#[test]
fn two_sided_shows_each_side_its_model() {
    let front = models::diffuse(Rgb::grey(0.25));
    let bsdf = build(&models::two_sided(front.clone(), models::conductor(Rgb::WHITE)));
    let wo = direction(0.5, 1.0);
    let wi = direction(0.7, 3.0);
    assert_eq!(bsdf.eval(wo, wi, Radiance), build(&front).eval(wo, wi, Radiance));
    assert!(bsdf.is_connectible(wo) && !bsdf.is_connectible(-wo));
    let behind = bsdf.sample(-wo, 0.5, [0.5; 2], Radiance).unwrap();
    assert_eq!(behind.wi, Vec3::new(wo.x, wo.y, -wo.z));
    assert!(bsdf.eval(wo, -wi, Radiance).is_black() && bsdf.eval(-wo, -wi, Radiance).is_black());
}

/// Mean weight of a model at `wo`.
fn albedo(bsdf: &Bsdf, wo: Vec3, samples: u32, seed: u64) -> f64 {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let sum: f64 = (0..samples)
        .filter_map(|_| draw(bsdf, wo, Importance, &mut rng))
        .map(|s| f64::from(s.weight.max_channel()))
        .sum();
    sum / f64::from(samples)
}

const COSINES: [f64; 9] = [1.0, 0.8, 0.5, 0.3, 1e-1, 1e-2, 1e-3, 1e-5, 1e-6];
const ALPHAS: [f32; 8] = [1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.3, 0.5, 1.0];

#[test]
fn ggx_never_gives_more_than_it_takes() {
    for alpha in ALPHAS {
        let bsdf = build(&models::rough_mirror(Ggx, alpha, true));
        for cos in COSINES {
            let a = albedo(&bsdf, direction(cos, 0.4), 4_000, 8);
            assert!(a <= 1.0 + 1e-5, "α {alpha} cos {cos}: albedo {a}");
            assert!(alpha > 0.01 || cos < 0.1 || a > 0.99, "α {alpha} cos {cos}: albedo {a}");
        }
    }
}

/// The rational G₁ of the value over the exact G₁ of the density is at most 1.0032.
#[test]
fn beckmann_gives_more_than_it_takes_only_by_its_rational_shadowing() {
    for alpha in ALPHAS {
        let bsdf = build(&models::rough_mirror(Beckmann, alpha, true));
        for cos in COSINES {
            let a = albedo(&bsdf, direction(cos, 0.4), 4_000, 9);
            assert!(a <= 1.0032, "α {alpha} cos {cos}: albedo {a}");
            assert!(alpha > 0.01 || cos < 0.1 || a > 0.99, "α {alpha} cos {cos}: albedo {a}");
        }
    }
}

#[test]
fn both_ways_of_sampling_normals_have_the_same_mean() {
    for (kind, cos) in [(Ggx, 0.9), (Ggx, 0.4), (Beckmann, 0.9), (Beckmann, 0.4)] {
        let wo = direction(cos, 0.4);
        let mean = |visible, seed| {
            albedo(&build(&models::rough_mirror(kind, 0.4, visible)), wo, 400_000, seed)
        };
        let (visible, all) = (mean(true, 10), mean(false, 11));
        assert!((visible - all).abs() < 0.003, "{kind:?} {cos}: {visible} {all}");
    }
}

#[test]
fn weights_stay_bounded_at_grazing_angles() {
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    for kind in [Ggx, Beckmann] {
        for alpha in ALPHAS {
            let bsdf = build(&models::rough_mirror(kind, alpha, true));
            for cos in (1..=6).map(|e| 10.0_f64.powi(-e)) {
                for i in 0..2_000 {
                    let wo = direction(cos, f64::from(i));
                    let Some(s) = draw(&bsdf, wo, Radiance, &mut rng) else { continue };
                    let pdf = bsdf.pdf(wo, s.wi).value();
                    let ratio = f64::from(s.value.r) * f64::from(s.wi.z) / pdf;
                    assert!(pdf.is_finite() && pdf > 0.0 && s.value.is_finite(), "{wo} {s:?}");
                    let bound = if kind == Ggx { 1.0 + 1e-5 } else { 1.0032 };
                    assert!(ratio > 0.0 && ratio <= bound, "α {alpha} {wo} {s:?}: {ratio}");
                }
            }
        }
    }
}

#[test]
fn smooth_ggx_distribution_has_no_rounding_to_speak_of() {
    for alpha in [1e-4_f32, 1e-3, 3e-3, 1e-2] {
        let microfacet = Microfacet::new(Ggx, alpha, alpha, true);
        for i in 0..400 {
            // tan θ from α/100 to 100 α.
            let tan = f64::from(alpha) * 10.0_f64.powf(f64::from(i) / 100.0 - 2.0);
            let cos = 1.0 / (1.0 + tan * tan).sqrt();
            let m = direction(cos, 0.1 * f64::from(i));
            let (a, m64) = (f64::from(alpha), m.as_dvec3());
            let tan2 = (m64.x * m64.x + m64.y * m64.y) / (m64.z * m64.z);
            let cos4 = (1.0 / (1.0 + tan2)).powi(2);
            let t = 1.0 + tan2 / (a * a);
            let exact = 1.0 / (std::f64::consts::PI * a * a * cos4 * t * t);
            let relative = f64::from(microfacet.d(m)) / exact - 1.0;
            assert!(relative.abs() < 1e-5, "α {alpha} tan {tan}: {relative}");
        }
    }
}

/// ∫ D(m) m.z dm = 1 and ∫ D(m) max(0, ω·m) dm = cos θ/G₁(ω) by the midpoint rule over slopes.
#[test]
fn distributions_are_normalised_and_shadowing_is_consistent() {
    for kind in [Ggx, Beckmann] {
        let microfacet = Microfacet::new(kind, 0.3, 0.6, true);
        for cos in [1.0, 0.7, 0.2, 0.01] {
            let w = direction(cos, 0.8);
            let (mut area, mut seen) = (0.0, 0.0);
            let (radii, angles) = (2400, 200);
            for i in 0..radii {
                // m = (r cos φ, r sin φ, √(1−r²)), z = v².
                let v = (f64::from(i) + 0.5) / f64::from(radii);
                let (z, dz) = (v * v, 2.0 * v / f64::from(radii));
                for j in 0..angles {
                    let phi = (f64::from(j) + 0.5) / f64::from(angles) * std::f64::consts::TAU;
                    let r = (1.0 - z * z).sqrt();
                    let m = DVec3::new(r * phi.cos(), r * phi.sin(), z);
                    let d = f64::from(microfacet.d(m.as_vec3())) * dz * std::f64::consts::TAU
                        / f64::from(angles);
                    area += d * z;
                    seen += d * m.dot(w.as_dvec3()).max(0.0);
                }
            }
            assert!((area - 1.0).abs() < 1e-4, "{kind:?}: {area}");
            let expected = 1.0 / f64::from(microfacet.visible_g1_over_cos(w));
            assert!((seen / expected - 1.0).abs() < 1e-4, "{kind:?} {cos}: {seen} {expected}");
            let ratio = microfacet.g1_over_cos(w) / microfacet.visible_g1_over_cos(w);
            assert!((ratio - 1.0).abs() < if kind == Ggx { 1e-7 } else { 3.2e-3 });
        }
    }
}

#[test]
fn extreme_numbers_give_no_invalid_sample() {
    let edge = 1.0 - f32::EPSILON / 2.0;
    for (name, bsdf) in models::spreading().into_iter().chain(models::delta()) {
        for wo in [Vec3::Z, Vec3::X, -Vec3::Z, direction(1e-30, 1.0), direction(1e-4, 2.0)] {
            for u in [0.0, 0.5, edge] {
                for v in [0.0, 0.5, edge] {
                    for lobe in [0.0, edge] {
                        let Some(s) = bsdf.sample(wo, lobe, [u, v], Radiance) else { continue };
                        let valid = s.wi.is_finite() && s.weight.is_finite() && s.value.is_finite();
                        assert!(valid, "{name} {wo} {u} {v}: {s:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn invalid_parameters_are_refused() {
    let metal = |eta, k, alpha_u| MaterialKind::RoughConductor {
        distribution: MicrofacetKind::Ggx,
        alpha_u,
        alpha_v: 0.1,
        sample_visible: true,
        eta,
        k,
        specular_reflectance: Rgb::WHITE,
    };
    let one = Rgb::WHITE;
    for (kind, message) in [
        (
            models::diffuse(Rgb::new(0.5, 1.5, 0.0)),
            "diffuse reflectance is (0.5, 1.5, 0), expected values in [0, 1]",
        ),
        (
            models::diffuse(Rgb::grey(f32::NAN)),
            "diffuse reflectance is (NaN, NaN, NaN), expected values in [0, 1]",
        ),
        (
            models::conductor(Rgb::grey(-0.1)),
            "specular_reflectance is (-0.1, -0.1, -0.1), expected finite and not negative",
        ),
        (models::dielectric(0.0, 1.0), "int_ior is 0, expected between 0.0001 and 10000"),
        (
            models::dielectric(1.5, f32::INFINITY),
            "ext_ior is inf, expected between 0.0001 and 10000",
        ),
        (metal(one, one, 0.0), "alpha_u is 0, expected finite and positive, at most 10⁶"),
        (metal(one, one, f32::NAN), "alpha_u is NaN, expected finite and positive, at most 10⁶"),
        (
            metal(one, one, 1e20),
            "alpha_u is 100000000000000000000, expected finite and positive, at most 10⁶",
        ),
        (
            metal(Rgb::grey(-1.0), one, 0.1),
            "conductor eta is (-1, -1, -1), expected values in [0, 10000]",
        ),
        (
            metal(Rgb::BLACK, Rgb::BLACK, 0.1),
            "conductor eta and k is 0 in one channel, expected at least one of them positive in \
             each channel",
        ),
        (
            models::two_sided(models::diffuse(one), models::dielectric(1.5, 1.0)),
            "twosided can hold opaque models only, not dielectric",
        ),
        (
            models::two_sided(MaterialKind::Null, models::diffuse(one)),
            "twosided can hold opaque models only, not null",
        ),
    ] {
        let error: BsdfError = Bsdf::new(&kind).unwrap_err();
        assert_eq!(error.to_string(), message);
    }
}

#[test]
fn specular_factors_above_one_are_accepted_as_mitsuba_does() {
    assert!(Bsdf::new(&models::conductor(Rgb::grey(2.0))).is_ok());
}
