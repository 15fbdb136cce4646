use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::stats::binomial_interval;

const SIZE: usize = 16;

type Images = Vec<Vec<[f32; 3]>>;

/// Images with exponential noise in every pixel (skewness 2), averaged over `samples`.
struct Renderer {
    rng: Pcg64Mcg,
    samples: u32,
}

impl Renderer {
    fn new(seed: u64) -> Self {
        Renderer { rng: Pcg64Mcg::seed_from_u64(seed), samples: 4 }
    }

    fn images(&mut self, count: usize, expectation: impl Fn(usize) -> [f64; 3]) -> Images {
        let mut image = || -> Vec<[f32; 3]> {
            let mut pixel = |p: usize| {
                let sum: f64 = (0..self.samples).map(|_| -self.rng.random::<f64>().ln()).sum();
                let noise = sum / f64::from(self.samples);
                expectation(p).map(|v| (v * noise) as f32)
            };
            (0..SIZE * SIZE).map(&mut pixel).collect()
        };
        (0..count).map(|_| image()).collect()
    }
}

fn grey(v: f64) -> impl Fn(usize) -> [f64; 3] {
    move |_| [v; 3]
}

fn set(images: &Images) -> ImageSet<'_> {
    ImageSet { images, seconds: &[] }
}

fn judge_with(a: &Images, b: &Images, alpha: f64) -> Agreement {
    let config = AgreeConfig { alpha, ..AgreeConfig::default() };
    agree(SIZE, SIZE, set(a), set(b), &config).unwrap()
}

fn judge(a: &Images, b: &Images) -> Agreement {
    judge_with(a, b, 1e-4)
}

#[test]
fn equal_expectations_agree_and_say_what_would_have_been_seen() {
    let mut r = Renderer::new(1);
    r.samples = 16;
    let found = judge(&r.images(32, grey(0.5)), &r.images(20, grey(0.5)));
    assert_eq!((found.verdict, found.ground), (Verdict::Agree, Ground::Resolved));
    // 1/√(16·256) of noise in an image, √(1/32 + 1/20) of that in the difference, and 5 to 7 of
    // those.
    assert!(found.mdb > 0.02 && found.mdb < 0.035, "{}", found.mdb);
    assert!(found.tile_mdb.is_some_and(|t| t > 5.0 * found.mdb));
    assert!(found.difference.low < 0.0 && found.difference.high > 0.0);
}

#[test]
fn more_light_differs_also_between_unequal_counts() {
    let mut r = Renderer::new(2);
    r.samples = 64;
    let found = judge(&r.images(16, grey(0.5)), &r.images(40, grey(0.51)));
    assert_eq!((found.verdict, found.ground), (Verdict::Differ, Ground::Image));
    assert!(found.p < 1e-4 && found.difference.high < 0.0);
}

#[test]
fn light_in_the_wrong_place_differs_in_tiles() {
    let mut r = Renderer::new(3);
    r.samples = 64;
    let shifted = |p: usize| [if p % SIZE < SIZE / 2 { 0.53 } else { 0.47 }; 3];
    let found = judge(&r.images(16, grey(0.5)), &r.images(16, shifted));
    assert_eq!((found.verdict, found.ground), (Verdict::Differ, Ground::Tiles));
    // And the map shows the sides: A has less on the left.
    assert!(found.map.sigma[0] + found.map.sigma[1] < 0.0);
    assert!(found.map.sigma[SIZE - 1] + found.map.sigma[SIZE - 2] > 0.0);
}

#[test]
fn another_colour_of_the_same_luminance_differs() {
    let mut r = Renderer::new(4);
    r.samples = 64;
    // Luminance is 0.2126 R + 0.7152 G + 0.0722 B.
    let tinted = |_| [0.5 + 0.05, 0.5 - 0.05 * 0.2126 / 0.7152, 0.5];
    let found = judge(&r.images(16, grey(0.5)), &r.images(16, tinted));
    assert_eq!((found.verdict, found.ground), (Verdict::Differ, Ground::Image));
    assert!(found.channels[0].p > 1e-3 && found.channels[1].p < 1e-4);
}

#[test]
fn fewer_than_four_images_a_side_give_no_verdict() {
    let mut r = Renderer::new(5);
    for (k, l) in [(2, 2), (3, 30), (30, 2)] {
        let found = judge(&r.images(k, grey(0.5)), &r.images(l, grey(1.0)));
        assert_eq!((found.verdict, found.ground), (Verdict::Inconclusive, Ground::TooFewImages));
    }
}

#[test]
fn noise_beyond_the_limit_is_inconclusive() {
    let mut r = Renderer::new(6);
    r.samples = 1;
    let found = judge(&r.images(6, grey(0.5)), &r.images(6, grey(0.5)));
    assert_eq!((found.verdict, found.ground), (Verdict::Inconclusive, Ground::TooNoisy));
}

#[test]
fn a_seed_used_twice_is_named_and_accuses_nobody() {
    let mut r = Renderer::new(7);
    let (mut a, b) = (r.images(8, grey(0.5)), r.images(8, grey(1.0)));
    a[5] = a[2].clone();
    let found = judge(&a, &b);
    assert_eq!((found.verdict, found.ground), (Verdict::Inconclusive, Ground::Repeated));
    assert_eq!(found.repeated, Some((0, [2, 5])));
}

#[test]
fn black_images_agree_and_one_black_side_proves_nothing() {
    let mut r = Renderer::new(8);
    let (dark, lit) = (vec![vec![[0.0; 3]; SIZE * SIZE]; 5], r.images(5, grey(0.5)));
    let both = judge(&dark, &dark);
    assert_eq!((both.verdict, both.ground), (Verdict::Agree, Ground::Black));
    assert_eq!(judge(&dark, &lit).verdict, Verdict::Inconclusive);
}

#[test]
fn the_ratio_of_efficiencies_counts_noise_and_seconds() {
    let mut r = Renderer::new(9);
    let a = r.images(32, grey(0.5));
    r.samples = 16;
    let b = r.images(32, grey(0.5));
    // A quarter of the noise for three times the seconds.
    let (one, three) = (vec![1.0; 32], vec![3.0; 32]);
    let sets = [ImageSet { images: &a, seconds: &one }, ImageSet { images: &b, seconds: &three }];
    let found = agree(SIZE, SIZE, sets[0], sets[1], &AgreeConfig::default()).unwrap();
    for ratio in [found.efficiency, found.efficiency_relative] {
        let ratio = ratio.unwrap();
        assert!(ratio.low < 0.75 && 0.75 < ratio.high && (ratio.value - 0.75).abs() < 0.05);
    }
    assert!(judge(&a, &b).efficiency.is_none());
}

#[test]
fn a_bias_of_the_detectable_size_is_found_nine_times_in_ten() {
    let (mut r, alpha) = (Renderer::new(10), 0.01);
    // The bias of a run is an estimate; that of many is nearly the true one.
    let mut mdb = || judge_with(&r.images(8, grey(0.5)), &r.images(8, grey(0.5)), alpha).mdb;
    let bias = (0..100).map(|_| mdb()).sum::<f64>() / 100.0;
    let (runs, mut hits) = (300, 0);
    for _ in 0..runs {
        let a = r.images(8, grey(0.5 * (1.0 - 0.5 * bias)));
        let b = r.images(8, grey(0.5 * (1.0 + 0.5 * bias)));
        hits += u64::from(judge_with(&a, &b, alpha).verdict == Verdict::Differ);
    }
    let (low, high) = binomial_interval(hits, runs, 0.99).unwrap();
    assert!(low > 0.8 && high < 0.97, "{hits} of {runs}: [{low}, {high}]");
}

/// False alarms of 1000 pairs at α = 5 %, sides of `k` and `l` images whose noise differs by
/// `ratio` in samples.
fn alarms(seed: u64, k: usize, l: usize, ratio: u32) -> u64 {
    let mut r = Renderer::new(seed);
    let mut alarm = || {
        r.samples = 2;
        let a = r.images(k, grey(0.5));
        r.samples = 2 * ratio;
        let b = r.images(l, grey(0.5));
        judge_with(&a, &b, 0.05).verdict == Verdict::Differ
    };
    (0..1000).filter(|_| alarm()).count() as u64
}

#[test]
fn false_alarms_stay_at_the_level_for_any_number_of_images() {
    for (k, l, ratio) in [(16, 24, 4), (4, 9, 1)] {
        let found = alarms(20 + k as u64, k, l, ratio);
        let (_, high) = binomial_interval(found, 1000, 0.95).unwrap();
        assert!(high <= 0.075, "{k} against {l} at 1:{ratio}: {found} of 1000");
    }
    assert_eq!(alarms(99, 2, 2, 1), 0);
}

#[test]
fn bad_sets_are_errors_that_name_the_fault() {
    let mut r = Renderer::new(11);
    let good = r.images(4, grey(0.5));
    let tell = |a: &Images, b: &Images| {
        agree(SIZE, SIZE, set(a), set(b), &AgreeConfig::default()).unwrap_err().to_string()
    };
    assert!(tell(&good[..1].to_vec(), &good).contains("1 given, at least 2"));
    let mut bad = good.clone();
    bad[1][7][2] = f32::NAN;
    assert!(tell(&good, &bad).contains("NaN at index 7"));
    bad[1].pop();
    assert!(tell(&good, &bad).contains("lengths 256 and 255"));
    let config = AgreeConfig { alpha: 0.0, ..AgreeConfig::default() };
    assert!(agree(SIZE, SIZE, set(&good), set(&good), &config).is_err());
    let timed = ImageSet { images: &good, seconds: &[1.0, 0.0, 1.0, 1.0] };
    assert!(agree(SIZE, SIZE, timed, set(&good), &AgreeConfig::default()).is_err());
}
