//! Film positions of large steps, stratified across chains.

use pathspace_core::random::{Address, PrimarySample, RandomStream, derive_seed};

use crate::chain::{Reader, Writer};

/// Where a chain stands among all chains of its run.
///
/// The k-th large steps of all C chains share a grid of at least C cells: chain c takes cell (c +
/// r_k) mod cells, r_k uniform and new for every k. Each chain alone sees independent uniform
/// positions, so nothing changes for its target; together the chains cover the film evenly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    chain: u64,
    /// Columns and rows; 0 where positions are not stratified.
    grid: [u32; 2],
    seed: u64,
    /// Large steps so far.
    step: u64,
}

impl Place {
    /// Chain `chain` of `chains` on a film of this width and height.
    pub fn new(chain: u64, chains: u64, seed: u64, size: [u32; 2]) -> Self {
        let aspect = f64::from(size[0].max(1)) / f64::from(size[1].max(1));
        let columns = ((chains as f64 * aspect).sqrt().ceil() as u64).max(1);
        let rows = chains.div_ceil(columns).max(1);
        Place {
            chain,
            grid: [columns as u32, rows as u32],
            seed: derive_seed(seed, u64::MAX - 3),
            step: 0,
        }
    }

    /// The first two coordinates of the next large step; `None` where they are not stratified.
    pub fn next(&mut self, u: &mut RandomStream) -> Option<[f32; 2]> {
        let [columns, rows] = self.grid.map(u64::from);
        let cells = columns * rows;
        if cells == 0 {
            return None;
        }
        let mut shared = RandomStream::new(Address { seed: self.seed, step: self.step, item: 0 });
        self.step += 1;
        let rotation = (shared.next() as f64 * cells as f64) as u64;
        let cell = (self.chain + rotation) % cells;
        let within = u.next2();
        let at = |cell: u64, count: u64, u: f32| ((cell as f64 + u as f64) / count as f64) as f32;
        Some([at(cell % columns, columns, within[0]), at(cell / columns, rows, within[1])])
    }

    /// Writes all of it.
    pub fn encode(&self, w: &mut Writer) {
        w.u64(self.chain);
        w.u32(self.grid[0]);
        w.u32(self.grid[1]);
        w.u64(self.seed);
        w.u64(self.step);
    }

    /// Reads what [`Place::encode`] wrote.
    pub fn decode(r: &mut Reader<'_>) -> Option<Self> {
        let (chain, grid) = (r.u64()?, [r.u32()?, r.u32()?]);
        Some(Place { chain, grid, seed: r.u64()?, step: r.u64()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_share_the_film_and_each_alone_is_uniform() {
        let (chains, steps) = (12, 2000);
        let mut places: Vec<_> = (0..chains).map(|c| Place::new(c, chains, 5, [40, 30])).collect();
        let mut first = [0.0; 12];
        for step in 0..steps {
            let mut taken = [false; 12];
            for (c, place) in places.iter_mut().enumerate() {
                let mut u = RandomStream::new(Address { seed: 1, step, item: c as u64 });
                let [x, y] = place.next(&mut u).unwrap();
                let cell = (x * 4.0) as usize + 4 * (y * 3.0) as usize;
                assert!(!taken[cell], "two chains in a cell");
                taken[cell] = true;
                if c == 0 {
                    first[cell] += 1.0;
                }
            }
        }
        let expected = steps as f64 / 12.0;
        let chi2: f64 = first.iter().map(|n: &f64| (n - expected).powi(2) / expected).sum();
        assert!(chi2 < 40.0, "{chi2}");
    }
}
