//! Replicate sets: what every render of every arm gave in every cell.

use serde::{Deserialize, Serialize};

use super::decide::Gates;
use super::fault::{StatsError, all_finite, same_length};
use super::moments::Moments;

/// One observable of a render: the whole image or a tile, over all path lengths or one.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Cell {
    /// Name for reports, unique in its set by convention.
    pub name: String,
    /// Path length (number of edges), `None` for the sum over all lengths.
    pub length: Option<u32>,
    /// Whether a pair can only agree if this cell agrees; any cell can make it differ.
    pub decisive: bool,
}

impl Cell {
    /// The whole image over all path lengths; decisive.
    pub fn image() -> Self {
        Cell { name: "image".into(), length: None, decisive: true }
    }

    /// The whole image over paths of one length; not decisive, since long paths carry little light
    /// and much noise.
    pub fn length(length: u32) -> Self {
        Cell { name: format!("length {length}"), length: Some(length), decisive: false }
    }

    /// The tile in column `x` and row `y`, over all path lengths or one; not decisive.
    pub fn tile(x: u32, y: u32, length: Option<u32>) -> Self {
        let name = match length {
            Some(k) => format!("tile {x},{y} length {k}"),
            None => format!("tile {x},{y}"),
        };
        Cell { name, length, decisive: false }
    }
}

/// Matrix arm × replicate × cell of replicate means Y_{a,r,c}.
///
/// A replicate is a whole render with a seed of its own; its row holds the mean luminance of every
/// cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReplicateSet {
    cells: Vec<Cell>,
    arms: Vec<Arm>,
}

/// The replicates of one integrator.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Arm {
    pub(super) name: String,
    pub(super) rows: Vec<Vec<f64>>,
    gates: Vec<Gates>,
}

impl ReplicateSet {
    /// An empty set over these cells.
    pub fn new(cells: Vec<Cell>) -> Self {
        ReplicateSet { cells, arms: Vec::new() }
    }

    /// Adds a replicate of an arm, one value a cell; a new name makes a new arm.
    ///
    /// Fails where the number of values is not that of the cells, or a value is not finite.
    pub fn push(&mut self, arm: &str, row: Vec<f64>) -> Result<(), StatsError> {
        same_length("cells and values of a replicate", self.cells.len(), row.len())?;
        all_finite("replicate", &row)?;
        match self.arms.iter_mut().find(|a| a.name == arm) {
            Some(a) => a.rows.push(row),
            None => {
                let gates = vec![Gates::default(); self.cells.len()];
                self.arms.push(Arm { name: arm.into(), rows: vec![row], gates });
            }
        }
        Ok(())
    }

    /// Records the gates of an existing arm as measured on its samples, one entry a cell.
    ///
    /// Where n_eff is left `None` the comparison uses the bound Ȳ²/s² of the replicates instead.
    /// Fails for an unknown arm or another number of cells.
    pub fn set_gates(&mut self, arm: &str, gates: Vec<Gates>) -> Result<(), StatsError> {
        same_length("cells and gates", self.cells.len(), gates.len())?;
        let found = self.arms.iter_mut().find(|a| a.name == arm);
        found.ok_or_else(|| StatsError::UnknownArm(arm.into()))?.gates = gates;
        Ok(())
    }

    /// The cells, in the order of the rows.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Names of the arms in the order of their first replicate.
    pub fn arms(&self) -> impl Iterator<Item = &str> {
        self.arms.iter().map(|a| a.name.as_str())
    }

    /// The replicates of an arm, one row each; fails for an unknown arm.
    pub fn rows(&self, arm: &str) -> Result<&[Vec<f64>], StatsError> {
        Ok(&self.arm(arm)?.rows)
    }

    pub(super) fn arm(&self, name: &str) -> Result<&Arm, StatsError> {
        let found = self.arms.iter().find(|a| a.name == name);
        found.ok_or_else(|| StatsError::UnknownArm(name.into()))
    }
}

impl Arm {
    pub(super) fn column(&self, cell: usize) -> Vec<f64> {
        self.rows.iter().map(|row| row[cell]).collect()
    }

    /// Gates of a cell, with n_eff from the replicates where no sample sums were given.
    pub(super) fn gates(&self, cell: usize, column: &[f64]) -> Result<Gates, StatsError> {
        let mut gates = self.gates[cell];
        if gates.n_eff.is_none() {
            gates.n_eff = implied_n_eff(column)?;
        }
        Ok(gates)
    }
}

/// Ȳ²/s² of the replicate means, an upper bound on n_eff = (Σx)²/Σx² that needs no samples.
///
/// For n independent samples a replicate has n_eff = n μ²/(σ²+μ²) ≤ n μ²/σ² = E²/Var of its mean.
/// `None` where a value is negative: signed observables have no such reading.
fn implied_n_eff(column: &[f64]) -> Result<Option<f64>, StatsError> {
    if column.iter().any(|v| *v < 0.0) {
        return Ok(None);
    }
    let m = Moments::of(column)?;
    Ok(Some(if m.mean == 0.0 { 0.0 } else { m.mean * m.mean / m.variance }))
}
