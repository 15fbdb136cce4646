//! Shares of one render, made apart and merged afterwards.

use std::fmt;
use std::str::FromStr;

use pathspace_core::random::derive_seed;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::budget::Budget;

/// Sets the seeds of shards apart from those that integrators derive for themselves.
const SHARDS: u64 = 0x7368_6172_6473;

/// One of `count` shares of a render; their films add up to that of the whole.
///
/// Share i (from 0) of n makes the steps i, i + n, i + 2n, … of the render's seed, where steps are
/// independent of each other ([`Run::seek`](pathspace_core::integrator::Run::seek)). A Markov chain
/// can not begin in the middle: there every share is a run with a seed of its own, derived from
/// (seed, i), with its own bootstrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Shard {
    index: u32,
    count: u32,
}

/// Most shares of one render.
const MAX_SHARDS: u32 = 100_000;

/// Not a share of anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("expected i/n with 1 ≤ i ≤ n ≤ {MAX_SHARDS}, such as 2/8")]
pub struct ShardError;

impl Shard {
    /// All of it.
    pub const WHOLE: Shard = Shard { index: 0, count: 1 };

    /// Share `index`, counted from 0, of `count`.
    ///
    /// # Errors
    /// [`ShardError`], where there is no such share.
    pub fn new(index: u32, count: u32) -> Result<Shard, ShardError> {
        if index < count && count <= MAX_SHARDS {
            Ok(Shard { index, count })
        } else {
            Err(ShardError)
        }
    }

    /// Which share, counted from 0.
    pub fn index(self) -> u32 {
        self.index
    }

    /// How many shares there are.
    pub fn count(self) -> u32 {
        self.count
    }

    /// True where there is one share only.
    pub fn is_whole(self) -> bool {
        self.count == 1
    }

    /// The step of the whole render that this share makes after `steps` of its own.
    pub fn step(self, steps: u64) -> u64 {
        u64::from(self.index) + steps * u64::from(self.count)
    }

    /// The share's part of the budget of the whole: of samples those of its steps, of seconds all,
    /// because shares run side by side.
    pub fn share_of(self, budget: Budget) -> Budget {
        match budget {
            Budget::Samples(n) => {
                let left = n.saturating_sub(u64::from(self.index));
                Budget::Samples(left.div_ceil(u64::from(self.count)))
            }
            Budget::Seconds(s) => Budget::Seconds(s),
        }
    }

    /// The seed of a share that is a run of its own.
    pub fn seed(self, seed: u64) -> u64 {
        if self.is_whole() {
            seed
        } else {
            derive_seed(derive_seed(seed, SHARDS), u64::from(self.index))
        }
    }
}

impl fmt::Display for Shard {
    /// `2/8`, counted from 1.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", u64::from(self.index) + 1, self.count)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Shard, ShardError> {
        let (index, count) = text.split_once('/').ok_or(ShardError)?;
        let number = |text: &str| text.trim().parse::<u32>().map_err(|_| ShardError);
        Shard::new(number(index)?.checked_sub(1).ok_or(ShardError)?, number(count)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_partition_the_steps_whatever_their_number() {
        for (steps, count) in [(1, 1), (7, 3), (12, 4), (2, 5), (100, 7)] {
            let mut made = vec![0; steps as usize];
            for index in 0..count {
                let shard = Shard::new(index, count).unwrap();
                let Budget::Samples(own) = shard.share_of(Budget::Samples(steps)) else {
                    panic!("samples stay samples")
                };
                (0..own).for_each(|s| made[shard.step(s) as usize] += 1);
            }
            assert!(made.iter().all(|n| *n == 1), "{steps} in {count}: {made:?}");
        }
    }

    #[test]
    fn shares_are_written_and_read_counted_from_one() {
        assert_eq!("2/8".parse::<Shard>().unwrap(), Shard::new(1, 8).unwrap());
        assert_eq!(Shard::new(1, 8).unwrap().to_string(), "2/8");
        for text in ["", "1", "0/4", "5/4", "1/0", "-1/4", "1/4/2", "a/b", "1.5/2", "1/100001"] {
            assert_eq!(text.parse::<Shard>(), Err(ShardError), "{text}");
        }
    }

    #[test]
    fn the_whole_keeps_its_seed_and_shares_have_their_own() {
        assert_eq!(Shard::WHOLE.seed(5), 5);
        let seeds: Vec<u64> = (0..4).map(|i| Shard::new(i, 4).unwrap().seed(5)).collect();
        assert!((0..4).all(|i| seeds[i] != 5 && !seeds[..i].contains(&seeds[i])));
    }
}
