//! The integrators of pathspace. Each one is a file (or a folder) that can be read alone:
//!
//! | name | algorithm | techniques (s,t) |
//! | --- | --- | --- |
//! | [`pt`] | path tracing with next-event estimation | (0,t), (1,t) |
//! | [`lt`] | light tracing | (s,1) |
//! | [`bdpt`] | bidirectional path tracing | all |

pub mod bdpt;
pub mod chain;
pub mod lt;
pub mod pt;
mod registry;
mod spec;
mod trace;

pub use registry::{Factory, Registry};
pub use spec::{Defaults, Options, Spec, SpecError};
