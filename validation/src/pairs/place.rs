//! Where two integrators differ most: the path class, for the eye and never for the verdict.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::observe::{Method, PathClass};
use super::unseen;
use crate::stats::{StatsError, welch};

/// Differences above this p-value are nothing to point at.
const NOTHING: f64 = 1e-3;

/// The paths of one class, and what two integrators make of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Path length in edges.
    pub length: u32,
    /// Techniques that can make the paths, in words.
    pub techniques: Vec<String>,
    /// Mean luminance of the first integrator.
    pub mean_a: f64,
    /// Mean luminance of the second.
    pub mean_b: f64,
    /// p-value of this difference alone.
    pub p: f64,
}

/// The class of `classes` with the least p-value; `None` where no class looks as if it differed.
pub(super) fn place(
    a: &Method,
    b: &Method,
    classes: &BTreeSet<PathClass>,
) -> Result<Option<Place>, StatsError> {
    let mut least: Option<Place> = None;
    for class in classes {
        let test = welch(&a.class_column(class), &b.class_column(class))?;
        if test.p < least.as_ref().map_or(NOTHING, |l| l.p) {
            least = Some(Place {
                length: class.length.into(),
                techniques: unseen::techniques(class.families),
                mean_a: test.mean_a,
                mean_b: test.mean_b,
                p: test.p,
            });
        }
    }
    Ok(least)
}
