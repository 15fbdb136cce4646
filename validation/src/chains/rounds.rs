//! Chains converge: what a run is wrong by in one round it is not wrong by in the next.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::color::luminance;
use pathspace_core::film::{Film, Layers};
use pathspace_core::integrator::{Integrator, IntegratorError};
use pathspace_core::random::derive_seed;
use rayon::prelude::*;

use super::ChainCheck;

/// Steps after the first; each is a round of its own where the bootstrap is as small as here.
const LATER: u32 = 4;

/// The brightness of the image after the first step, over `count` replicates, against that of the
/// steps after it alone, by Spearman's rank correlation.
///
/// The image of a run is unbiased whatever b̂ is, so that no mean over replicates sees a b̂ that is
/// drawn once and kept: all images of such a run are too bright, or all too dark, and its error
/// never falls. Independent rounds have a correlation of 0; then the error of the mean of n of them
/// falls like 1/√n. Ranks make the test exact for every distribution of brightness.
///
/// The bootstrap of the first step must be so small that it has a round of its own: see `bootstrap`
/// of the integrator.
///
/// # Errors
/// Where the integrator does not render the scene.
pub fn independent_rounds(
    integrator: &dyn Integrator,
    scene: &Arc<Scene>,
    seed: u64,
    count: u64,
) -> Result<ChainCheck, IntegratorError> {
    let pair = |r: u64| {
        let mut film = Film::new(scene.film(), Layers::NONE);
        let mut run = integrator.start(Arc::clone(scene), derive_seed(seed, r))?;
        run.step(&mut film);
        let (first, samples) = (luminance(&film.mean()), film.samples() as f64);
        for _ in 0..LATER {
            run.step(&mut film);
        }
        let all = film.samples() as f64;
        let later = (luminance(&film.mean()) * all - first * samples) / (all - samples);
        Ok((first, later))
    };
    let pairs: Result<Vec<(f64, f64)>, IntegratorError> =
        (0..count).into_par_iter().map(pair).collect();
    let (first, later): (Vec<f64>, Vec<f64>) = pairs?.into_iter().unzip();
    // Under independence ρ has the variance 1/(n − 1) (Spearman 1904; Kendall 1948).
    let z = correlation(&ranks(&first), &ranks(&later)) * ((count as f64) - 1.0).sqrt();
    Ok(ChainCheck::normal(integrator.spec(), "rounds are independent".to_owned(), z))
}

/// Ranks from 0; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut begin = 0;
    for alike in order.chunk_by(|&a, &b| values[a] == values[b]) {
        for &i in alike {
            ranks[i] = begin as f64 + 0.5 * (alike.len() - 1) as f64;
        }
        begin += alike.len();
    }
    ranks
}

/// Pearson's coefficient; 0 where one of both does not vary.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (ma, mb) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma).powi(2);
        bb += (y - mb).powi(2);
    }
    if aa > 0.0 && bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_core::description::FilmDescription;
    use pathspace_integrators::{Defaults, Registry};

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 0.5]), [2.5, 1.0, 2.5, 0.0]);
        let falling = correlation(&ranks(&[1.0, 2.0, 3.0]), &ranks(&[9.0, 4.0, 1.0]));
        assert!((falling + 1.0).abs() < 1e-12);
        assert_eq!(correlation(&[1.0, 1.0], &[0.0, 1.0]), 0.0);
    }

    /// One round without end is what the test must find.
    #[test]
    fn a_normalisation_that_is_kept_for_ever_is_found() {
        let scene = pathspace_scenes::library::find("mis-plates").unwrap();
        let mut description = scene.load(&[]).unwrap().description;
        description.film = FilmDescription::new(16, 16);
        let scene = Arc::new(Scene::new(&description).unwrap());
        let check = |spec: &str, seed: u64| {
            let spec = format!("{spec},bootstrap=32,chains=4,max_depth=4").parse().unwrap();
            let made = Registry::builtin().create(&spec, &Defaults::default()).unwrap();
            independent_rounds(&*made, &scene, seed, 48).unwrap()
        };
        for name in ["pssmlt", "mmlt", "rjmlt", "mlt"] {
            let kept = check(&format!("{name}:rounds=one"), 5);
            assert!(kept.p < 1e-5, "{kept:?}");
            let grown = check(&format!("{name}:rounds=grow"), 5);
            assert!(grown.p > 1e-4, "{grown:?}");
        }
    }
}
