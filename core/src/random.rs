//! Random numbers addressed by (seed, step, item, dimension), never by thread.

use rand::Rng;
use rand_pcg::Pcg32;

/// A point of primary sample space U = [0,1)^∞, read one coordinate after the other (Kelemen et al.
/// 2002). A random stream makes an estimator a Monte Carlo integrator; a mutated vector makes it
/// primary-sample-space Metropolis.
pub trait PrimarySample {
    /// The next coordinate in [0, 1).
    fn next(&mut self) -> f32;

    /// The next two coordinates.
    #[inline]
    fn next2(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }

    /// Says what the coordinates that follow are for, until the next call. A mutated vector keeps a
    /// vector for each purpose, so that a subpath that grows by a vertex does not shift the meaning
    /// of another one's numbers; a random stream takes no notice.
    #[inline]
    fn stream(&mut self, _stream: Stream) {}
}

/// What coordinates of primary sample space are for.
///
/// Estimators whose samples begin at the sensor read the film position from the first two
/// coordinates of [`Stream::Sensor`], which is the purpose until [`PrimarySample::stream`] is
/// called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stream {
    /// The sensor subpath.
    Sensor,
    /// The light subpath.
    Light,
    /// Points on the lens that light vertices are connected to.
    Lens,
    /// Points on emitters that sensor vertices are connected to, and choices among connections.
    Connection,
}

impl Stream {
    /// Number of purposes.
    pub const COUNT: usize = 4;
}

/// Number of values that a coordinate takes: multiples of 2⁻²⁴ in [0, 1).
const GRID: f64 = (1u32 << 24) as f64;

/// The coordinate nearest to `x`.
#[inline]
pub fn nearest_coordinate(x: f64) -> f32 {
    ((x * GRID).round_ties_even().clamp(0.0, GRID - 1.0) / GRID) as f32
}

/// The coordinate in [`low`, `high`) that is nearest to `x`; `None` where there is none.
pub fn nearest_coordinate_in(low: f64, high: f64, x: f64) -> Option<f32> {
    let (first, end) = ((low * GRID).ceil().max(0.0), (high * GRID).ceil().min(GRID));
    (first < end).then(|| ((x * GRID).round_ties_even().clamp(first, end - 1.0) / GRID) as f32)
}

/// One of the coordinates in [`low`, `high`), all alike, by the uniform number `u`: what a choice
/// among intervals is inverted to. `None` where the interval is so short that it holds none, so
/// that the choice is never made.
#[inline]
pub fn coordinate_between(low: f64, high: f64, u: f32) -> Option<f32> {
    let first = (low * GRID).ceil().max(0.0);
    let count = (high * GRID).ceil().min(GRID) - first;
    let k = first + (u as f64 * count).floor();
    (count >= 1.0).then_some((k / GRID) as f32)
}

/// What a random number depends on besides its dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Address {
    /// Seed of the run (one per replicate).
    pub seed: u64,
    /// Step of the run.
    pub step: u64,
    /// Work item of the step: a pixel, a light path, a chain.
    pub item: u64,
}

/// The stream of random numbers at an [`Address`]: PCG32 (O'Neill 2014), whose state and stream
/// are hashes of the address.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomStream(Pcg32);

impl RandomStream {
    /// The stream at `address`, at dimension 0.
    #[inline]
    pub fn new(address: Address) -> Self {
        let a = mix(address.seed ^ 0x9e37_79b9_7f4a_7c15);
        let b = mix(a ^ address.step.wrapping_mul(0xd1b5_4a32_d192_ed03));
        let state = mix(b ^ address.item.wrapping_mul(0xaef1_7502_108e_f2d9));
        let stream = mix(state ^ 0x2545_f491_4f6c_dd1d);
        RandomStream(Pcg32::new(state, stream))
    }

    /// The stream at `address`, advanced to `dimension`.
    pub fn at_dimension(address: Address, dimension: u64) -> Self {
        let mut s = RandomStream::new(address);
        s.0.advance(dimension);
        s
    }
}

impl PrimarySample for RandomStream {
    #[inline]
    fn next(&mut self) -> f32 {
        // 24 bits: every value is a multiple of 2⁻²⁴, none is 1.
        (self.0.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}

/// Derives an independent seed, for example of replicate `index`.
pub fn derive_seed(seed: u64, index: u64) -> u64 {
    mix(mix(seed ^ 0x6a09_e667_f3bc_c909) ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection of 64 bits.
#[inline]
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_address_gives_same_numbers() {
        let a = Address { seed: 3, step: 5, item: 7 };
        let (mut x, mut y) = (RandomStream::new(a), RandomStream::new(a));
        assert!((0..100).all(|_| x.next() == y.next()));
    }

    #[test]
    fn dimension_is_addressable() {
        let a = Address { seed: 3, step: 5, item: 7 };
        let mut x = RandomStream::new(a);
        let tenth = (0..11).map(|_| x.next()).last();
        assert_eq!(tenth, Some(RandomStream::at_dimension(a, 10).next()));
    }

    #[test]
    fn neighbouring_addresses_are_uncorrelated() {
        // First numbers over items, steps and seeds: mean ½, variance 1/12, lag-1 correlation 0.
        for axis in 0..3 {
            let n = 100_000;
            let v: Vec<f64> = (0..n)
                .map(|i| {
                    let mut a = Address { seed: 1, step: 1, item: 1 };
                    match axis {
                        0 => a.item = i,
                        1 => a.step = i,
                        _ => a.seed = i,
                    }
                    RandomStream::new(a).next() as f64
                })
                .collect();
            let mean = v.iter().sum::<f64>() / n as f64;
            let var = v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64;
            let lag = v.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>() / n as f64;
            let se = (1.0 / 12.0_f64 / n as f64).sqrt();
            assert!((mean - 0.5).abs() < 5.0 * se, "axis {axis}: mean {mean}");
            assert!((var - 1.0 / 12.0).abs() < 5.0 * 0.0745 / (n as f64).sqrt(), "{var}");
            assert!((lag / var).abs() < 5.0 / (n as f64).sqrt(), "axis {axis}: lag {lag}");
        }
    }
}
