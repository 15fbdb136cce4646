//! How large the noise of an image is, while it is being rendered.

use pathspace_core::color::luminance;
use pathspace_core::film::Film;
use pathspace_validation::stats::PairedT;
use serde::{Deserialize, Serialize};

/// Prior variance of a standardised mean in the confidence sequences.
const G: f64 = 1.0;
/// Pairs of batches before anything is said: means of few are not normal enough.
const LEAST_PAIRS: u64 = 8;
/// The interval holds with this probability, at all times together.
pub const CONFIDENCE: f64 = 0.95;

/// The relative error of an image, with an interval that holds at whatever moment one looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RelativeError {
    /// √(mean over pixels of the variance of the pixel's luminance) / mean luminance.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval; infinite while too little is known.
    #[serde(serialize_with = "finite")]
    pub high: f64,
}

/// Infinity has no JSON: `null`.
fn finite<S: serde::Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { serializer.serialize_some(value) } else { serializer.serialize_none() }
}

/// Estimates the relative error of a film from independent batches of equal size,
///
/// ε = √(1/P Σ_j Var Ȳ_j) / (1/P Σ_j E Ȳ_j),
///
/// where Ȳ_j is the luminance of pixel j of P in the image so far: the standard deviation of a
/// pixel, root mean square over the image, as a share of its mean brightness. It falls with the
/// square root of the samples.
///
/// A pair of batches a, b gives D = 1/P Σ_j ½(a_j − b_j)², whose expectation is the variance of one
/// batch; the image of N batches has the variance E D/N. D and the mean luminance are means over
/// pixels, nearly normal, and independent from pair to pair. Each has a confidence sequence from
/// the paired t e-process ([`PairedT::half_width`]) at half of 1 − [`CONFIDENCE`], so that both
/// hold at all times with that confidence, and with them the interval of ε. What no batch has met
/// yet (a caustic that is hit once in a million samples) is in no estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Precision {
    /// Luminance of the sums at the end of the last batch.
    last: Vec<f64>,
    last_samples: u64,
    /// The first batch of a pair, until the second one comes.
    half: Option<Vec<f64>>,
    batch_samples: u64,
    variance: PairedT,
    mean: PairedT,
}

impl Precision {
    /// Nothing known yet about a film of this many pixels.
    pub fn new(pixels: u64) -> Self {
        Precision {
            last: vec![0.0; pixels as usize],
            last_samples: 0,
            half: None,
            batch_samples: 0,
            variance: PairedT::default(),
            mean: PairedT::default(),
        }
    }

    /// Ends a batch: all that was added to the film since the last one. Batches must be independent
    /// of each other.
    pub fn end_batch(&mut self, film: &Film) {
        let samples = film.samples() - self.last_samples;
        if samples == 0 {
            return;
        }
        let k = film.pixels() as f64 / samples as f64;
        let mut batch = Vec::with_capacity(self.last.len());
        for (last, sum) in self.last.iter_mut().zip(film.sums().sums()) {
            let now = luminance(sum);
            batch.push((now - *last) * k);
            *last = now;
        }
        self.last_samples = film.samples();
        self.batch_samples = samples;
        let Some(first) = self.half.take() else {
            self.half = Some(batch);
            return;
        };
        let (mut squares, mut sum) = (0.0, 0.0);
        for (a, b) in first.iter().zip(&batch) {
            squares += 0.5 * (a - b) * (a - b);
            sum += 0.5 * (a + b);
        }
        self.variance.push(squares / first.len() as f64);
        self.mean.push(sum / first.len() as f64);
    }

    /// Batches in the estimate.
    pub fn batches(&self) -> u64 {
        2 * self.variance.pairs()
    }

    /// Samples per pixel of a batch; 0 before the first.
    pub fn batch_samples_per_pixel(&self) -> f64 {
        self.batch_samples as f64 / self.last.len() as f64
    }

    /// The relative error of the film, which may have grown beyond the last batch; `None` before
    /// enough is known, and of a film that is black so far.
    pub fn error(&self, film: &Film) -> Option<RelativeError> {
        let mean = self.mean.mean();
        if self.variance.pairs() < LEAST_PAIRS || !(mean > 0.0) {
            return None;
        }
        let alpha = 0.5 * (1.0 - CONFIDENCE);
        let batches = film.samples() as f64 / self.batch_samples as f64;
        let error = |variance: f64, mean: f64| {
            if mean > 0.0 { (variance.max(0.0) / batches).sqrt() / mean } else { f64::INFINITY }
        };
        let (dv, dm) = (self.variance.half_width(G, alpha), self.mean.half_width(G, alpha));
        let v = self.variance.mean();
        Some(RelativeError {
            value: error(v, mean),
            low: error(v - dv, mean + dm),
            high: error(v + dv, mean - dm),
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use pathspace_core::color::Rgb;
    use pathspace_core::description::FilmDescription;
    use pathspace_core::film::{Chunk, Contribution, Families, Layers, Sink};
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg32;

    use super::*;

    const SIDE: u32 = 12;

    /// Adds one sample to every pixel: brightness (1 + the column) times an exponential number.
    /// Mean 6.5, variance of a sample the mean of the squared brightness, 54 1/6.
    fn add_sample(film: &mut Film, random: &mut Pcg32) {
        let mut chunk = Chunk::new(film.layers());
        for y in 0..SIDE {
            for x in 0..SIDE {
                let u = (random.next_u32() as f32 + 0.5) / 4_294_967_296.0;
                chunk.add(Contribution {
                    film: Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
                    value: Rgb::grey(-(1.0 + x as f32) * u.ln()),
                    weight: 1.0,
                    s: 0,
                    t: 2,
                    emitter: 0,
                    families: Families::ALL,
                });
            }
        }
        film.apply(&chunk);
        film.add_samples(u64::from(SIDE * SIDE));
    }

    fn truth(samples: f64) -> f64 {
        (650.0 / 12.0 / samples).sqrt() / 6.5
    }

    fn film() -> (Film, Precision) {
        let film = Film::new(&FilmDescription::new(SIDE, SIDE), Layers::NONE);
        let precision = Precision::new(film.pixels());
        (film, precision)
    }

    #[test]
    fn the_interval_holds_the_error_at_every_look() {
        let runs = 300;
        let escapes = (0..runs).filter(|seed| {
            let mut random = Pcg32::seed_from_u64(*seed);
            let (mut film, mut precision) = film();
            (0..120).any(|_| {
                add_sample(&mut film, &mut random);
                precision.end_batch(&film);
                let truth = truth(film.samples_per_pixel());
                precision.error(&film).is_some_and(|e| !(e.low..=e.high).contains(&truth))
            })
        });
        // 5 % at most in expectation; 26 of 300 is the 99.5 % quantile of that.
        let escapes = escapes.count();
        assert!(escapes <= 26, "{escapes} of {runs}");
    }

    #[test]
    fn the_estimate_comes_close_to_the_truth_and_the_interval_narrows() {
        let mut random = Pcg32::seed_from_u64(7);
        let (mut film, mut precision) = film();
        let mut widths = Vec::new();
        for samples in 1..=400 {
            add_sample(&mut film, &mut random);
            precision.end_batch(&film);
            if samples % 100 == 0 {
                let e = precision.error(&film).unwrap();
                assert!((e.value / truth(f64::from(samples)) - 1.0).abs() < 0.04, "{e:?}");
                widths.push(e.high / e.low);
            }
        }
        assert!(widths.windows(2).all(|w| w[1] < w[0]) && widths[3] < 1.15, "{widths:?}");
    }

    #[test]
    fn little_is_known_of_few_batches_and_nothing_of_a_black_film() {
        let mut random = Pcg32::seed_from_u64(8);
        let (mut lit, mut precision) = film();
        for _ in 0..15 {
            add_sample(&mut lit, &mut random);
            precision.end_batch(&lit);
            assert_eq!(precision.error(&lit), None);
        }
        let (mut black, mut precision) = film();
        for _ in 0..40 {
            black.add_samples(black.pixels());
            precision.end_batch(&black);
        }
        assert_eq!((precision.batches(), precision.error(&black)), (40, None));
    }

    #[test]
    fn a_half_batch_at_the_end_counts_by_its_samples() {
        let mut random = Pcg32::seed_from_u64(9);
        let (mut film, mut precision) = film();
        for _ in 0..40 {
            add_sample(&mut film, &mut random);
            add_sample(&mut film, &mut random);
            precision.end_batch(&film);
        }
        assert_eq!(precision.batch_samples_per_pixel(), 2.0);
        let before = precision.error(&film).unwrap().value;
        add_sample(&mut film, &mut random);
        let after = precision.error(&film).unwrap().value;
        assert!((after / before - (80.0f64 / 81.0).sqrt()).abs() < 1e-12);
    }
}
