//! Samplers of scattering models against their densities.

use glam::Vec3;
use pathspace_core::Rgb;
use pathspace_core::bsdf::{Bsdf, TransportMode};
use pathspace_core::description::MaterialKind;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::bsdf_models::{Beckmann, Ggx, build, diffuse, direction, rough, two_sided};
use crate::chi2::{self, Chart, Outcome};

/// Family-wise level of each test function.
const ALPHA: f64 = 1e-4;
const SAMPLES: usize = 300_000;

/// Known directions: normal, oblique, steep, grazing.
fn known_directions() -> [Vec3; 5] {
    [Vec3::Z, direction(0.8, 0.7), direction(0.4, 2.0), direction(0.1, 4.0), direction(0.01, 5.5)]
}

fn run(
    name: String,
    bsdf: &Bsdf,
    wo: Vec3,
    chart: &Chart<Vec3>,
    resolution: [usize; 2],
    seed: u64,
) -> Outcome {
    let sample = |r: &mut Pcg64Mcg| {
        let (lobe, u) = (r.random(), [r.random(), r.random()]);
        bsdf.sample(wo, lobe, u, TransportMode::Radiance).map(|s| s.wi)
    };
    let density = |wi: &Vec3| bsdf.pdf(wo, *wi).value();
    chi2::test(name, chart, resolution, SAMPLES, seed, sample, density)
}

/// Tests a model on the upper hemisphere for every known direction.
fn hemisphere(kind: &MaterialKind, seed: u64) {
    let bsdf = build(kind);
    let chart = chi2::zone(0.0, 1.0);
    let outcomes = known_directions()
        .into_iter()
        .zip(seed..)
        .map(|(wo, seed)| run(format!("{kind:?} {wo}"), &bsdf, wo, &chart, [24, 36], seed));
    chi2::assert_none_rejected(outcomes.collect(), ALPHA);
}

#[test]
fn diffuse_follows_its_density() {
    hemisphere(&diffuse(Rgb::grey(0.5)), 100);
}

#[test]
fn ggx_visible_follows_its_density() {
    hemisphere(&rough(Ggx, 0.3, 0.3, true), 200);
}

#[test]
fn ggx_visible_anisotropic_follows_its_density() {
    hemisphere(&rough(Ggx, 0.15, 0.6, true), 300);
}

#[test]
fn ggx_all_normals_follows_its_density() {
    hemisphere(&rough(Ggx, 0.5, 0.2, false), 400);
}

#[test]
fn ggx_of_full_roughness_follows_its_density() {
    hemisphere(&rough(Ggx, 1.0, 1.0, true), 500);
}

#[test]
fn beckmann_visible_follows_its_density() {
    hemisphere(&rough(Beckmann, 0.3, 0.3, true), 600);
}

#[test]
fn beckmann_visible_anisotropic_follows_its_density() {
    hemisphere(&rough(Beckmann, 0.15, 0.6, true), 700);
}

#[test]
fn beckmann_all_normals_follows_its_density() {
    hemisphere(&rough(Beckmann, 0.5, 0.2, false), 800);
}

#[test]
fn two_sided_follows_its_density_on_both_sides() {
    let bsdf = build(&two_sided(diffuse(Rgb::WHITE), rough(Ggx, 0.3, 0.6, true)));
    let chart = chi2::zone(-1.0, 1.0);
    let outcomes = known_directions()
        .into_iter()
        .flat_map(|w| [w, -w])
        .zip(900..)
        .map(|(wo, seed)| run(format!("twosided {wo}"), &bsdf, wo, &chart, [32, 24], seed));
    chi2::assert_none_rejected(outcomes.collect(), ALPHA);
}

/// Narrow lobes on a window of `width`·α about the mirror direction; what falls beside is one cell.
fn narrow(kind: impl Fn(f32) -> MaterialKind, width: f64, seed: u64) {
    let mut outcomes = Vec::new();
    for (alpha, seed) in [1e-2_f32, 1e-3].into_iter().zip((seed..).step_by(10)) {
        let bsdf = build(&kind(alpha));
        for (wo, seed) in known_directions().into_iter().take(3).zip(seed..) {
            let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
            let chart = chi2::gnomonic(mirror, width * f64::from(alpha));
            let name = format!("α {alpha} {wo}");
            outcomes.push(run(name, &bsdf, wo, &chart, [30, 30], seed));
        }
    }
    chi2::assert_none_rejected(outcomes, ALPHA);
}

#[test]
fn narrow_ggx_lobes_follow_their_density() {
    narrow(|a| rough(Ggx, a, a, true), 6.0, 1000);
}

#[test]
fn narrow_ggx_lobes_of_all_normals_follow_their_density() {
    narrow(|a| rough(Ggx, a, 2.0 * a, false), 6.0, 1100);
}

#[test]
fn narrow_beckmann_lobes_follow_their_density() {
    narrow(|a| rough(Beckmann, a, a, true), 4.0, 1200);
}

#[test]
fn density_integrates_to_one_minus_null_mass() {
    for (kind, seed) in [
        (rough(Ggx, 0.5, 0.5, true), 1300),
        (rough(Ggx, 0.6, 0.3, false), 1310),
        (rough(Beckmann, 0.5, 0.5, true), 1320),
        (rough(Beckmann, 0.6, 0.3, false), 1330),
    ] {
        let bsdf = build(&kind);
        let mut largest = 0.0_f64;
        for (wo, seed) in known_directions().into_iter().zip(seed..) {
            let o = run(format!("{kind:?} {wo}"), &bsdf, wo, &chi2::zone(0.0, 1.0), [8, 8], seed);
            let null = 1.0 - o.integral;
            let deviation = (null * (1.0 - null) / SAMPLES as f64).sqrt();
            assert!((o.outside - null).abs() < 5.0 * deviation + 1e-6, "{o}");
            largest = largest.max(o.outside);
        }
        assert!(largest > 0.05, "no null mass to test: {largest}");
    }
}
