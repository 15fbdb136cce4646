//! Starts of chains whose technique is a coordinate: every technique of a pair of subpaths.

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::film::{Contribution, RecordingSink};
use pathspace_core::path::Technique;
use pathspace_core::random::{Address, RandomStream};
use pathspace_integrators::bdpt::TechniqueNumbers;
use pathspace_integrators::chain::{Candidates, ChainTarget};
use pathspace_integrators::mmlt::{Mmlt, Multiplexed};
use pathspace_integrators::primary::{Integrand, PrimaryTarget};
use pathspace_integrators::{Defaults, Spec};

use super::jumps::scenes;

const SPECS: [&str; 3] =
    ["mmlt:max_depth=6", "mmlt:max_depth=5,s=1..,heuristic=balance", "mmlt:max_depth=5,t=..2"];

fn mmlt(spec: &str) -> Mmlt {
    let spec: Spec = spec.parse().unwrap();
    Mmlt::from_spec(&spec, &Defaults::default()).unwrap()
}

fn alone(
    mmlt: &Mmlt,
    scene: &Scene,
    k: u16,
    u: &mut impl pathspace_core::random::PrimarySample,
) -> Vec<Contribution> {
    let mut sink = RecordingSink::default();
    mmlt.techniques.evaluate(scene, k, u, &mut sink);
    sink.contributions
}

#[test]
fn every_technique_of_a_pair_is_made_again_alone_to_the_bit() {
    for spec in SPECS {
        let mmlt = mmlt(spec);
        let mut thinned = 0;
        for (name, scene) in scenes() {
            let mut made = 0;
            for seed in 0..400 {
                mmlt.techniques.bdpt.estimate_every(&scene, seed, |c, survival| {
                    assert!(survival > 0.0 && survival <= 1.0, "{survival}");
                    let (k, s) = (c.length(), usize::from(c.s));
                    let selector = Multiplexed::select(&scene, k, s, 0.5).unwrap();
                    let technique = Technique::new(s, usize::from(c.t));
                    let u = &mut TechniqueNumbers::new(seed, technique, selector);
                    let count = Multiplexed::count(&scene, k) as f32;
                    let expected = Contribution { value: c.value * count, ..c };
                    assert_eq!(alone(&mmlt, &scene, k, u), [expected], "{name}, {spec}");
                    made += 1;
                    thinned += u32::from(survival < 1.0);
                });
            }
            assert!(made > 50, "{name}, {spec}: {made} made");
        }
        assert!(thinned > 100, "{spec}: {thinned} thinned");
    }
}

/// E ΣW over pairs of subpaths is E W over one technique of one length at a time, per length and
/// half of the film.
#[test]
fn pairs_of_subpaths_have_the_integral_of_single_techniques() {
    const N: u64 = 150_000;
    let mmlt = mmlt("mmlt:max_depth=5");
    let target = PrimaryTarget::new(mmlt.techniques.clone(), mmlt.options);
    for (name, scene) in scenes() {
        let middle = scene.film().crop.width as f32 / 2.0;
        let cell = |k: u16, film: Vec2| 2 * usize::from(k) + usize::from(film.x > middle);
        let mut sums = [[[0.0; 2]; 12]; 2];
        let mut add = |method: usize, row: [f64; 12]| {
            for (sum, x) in sums[method].iter_mut().zip(row) {
                sum[0] += x;
                sum[1] += x * x;
            }
        };
        let mut found = Candidates::default();
        for item in 0..N {
            let mut u = RandomStream::new(Address { seed: 5, step: 0, item });
            let mut again = u.clone();
            found.clear();
            target.candidates(&scene, &mut u, &mut found);
            let mut row = [0.0; 12];
            for c in found.iter() {
                let x = target.start(&scene, &mut again.clone(), c.index).unwrap();
                row[cell(x.point.part, x.point.contributions[0].film)] += c.weight;
            }
            add(0, row);
            let mut row = [0.0; 12];
            let (k, p) = mmlt.techniques.part(&mut again);
            for c in alone(&mmlt, &scene, k, &mut again) {
                let luminance =
                    pathspace_core::color::luminance(&c.value.to_array().map(f64::from));
                row[cell(k, c.film)] += luminance / p;
            }
            add(1, row);
        }
        let n = N as f64;
        let moments = |[sum, sum2]: [f64; 2]| {
            let mean = sum / n;
            (mean, (sum2 / n - mean * mean) / (n - 1.0))
        };
        let (mut total, mut gain) = (0, 0);
        for (i, (pairs, alone)) in sums[0].iter().zip(&sums[1]).enumerate() {
            let ((a, va), (b, vb)) = (moments(*pairs), moments(*alone));
            // Cells of nothing or of a few bright samples are no test of means.
            if b > 0.0 && vb.sqrt() < 0.1 * b {
                let z = (a - b) / (va + vb).sqrt();
                assert!(z.abs() < 4.5, "{name}, cell {i}: {a} {b}, z = {z}");
                total += 1;
                gain += u32::from(va < vb);
            }
        }
        println!("{name}: {total} cells, of less variance {gain}");
        assert!(total >= 4 && gain * 4 >= total * 3, "{name}: {total} cells, {gain}");
    }
}
