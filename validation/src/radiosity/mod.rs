//! The finite-element side of the comparison: what radiosity says of a diffuse scene, with an
//! interval.
//!
//! [`System`](pathspace_integrators::radiosity::System) discretises and solves; here are the checks
//! on it and what makes its answer a number to hold Monte Carlo to:
//!
//! | what | where |
//! | --- | --- |
//! | the matrix solved directly | [`solve_directly`] |
//! | reciprocity and row sums | [`defects`] |
//! | means of the film, per length, at edges h, h/2, h/4 | [`Levels`] |
//! | Richardson's extrapolation and its uncertainty | [`Extrapolated`] |
//! | the same as a scene with exact answers | [`scene_of`] |

mod direct;
mod extrapolate;
mod levels;
mod scenes;

pub use direct::{Defects, NotSolved, defects, solve_directly};
pub use extrapolate::Extrapolated;
pub use levels::{FeError, Levels, scene_of};
pub use scenes::of_library;
