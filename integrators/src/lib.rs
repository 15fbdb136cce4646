//! The integrators of pathspace. Each one is a file (or a folder) that can be read alone:
//!
//! | name | algorithm | techniques (s,t) |
//! | --- | --- | --- |
//! | [`pt`] | path tracing with next-event estimation | (0,t), (1,t) |
//! | [`lt`] | light tracing | (s,1) |
//! | [`bdpt`] | bidirectional path tracing | all |
//! | [`pssmlt`] | primary-sample-space Metropolis light transport | those of pt or bdpt |
//! | [`mlt`] | Metropolis light transport on path space | all |
//! | [`mmlt`] | multiplexed Metropolis light transport | all |
//! | [`rjmlt`] | reversible jump Metropolis light transport | all |
//! | [`erpt`] | energy redistribution path tracing | those of pt or bdpt |
//! | [`radiosity`] | finite elements, for diffuse scenes | none: it reads what they send to the eye |
//!
//! The Metropolis integrators share the driver [`chain`]; those on primary sample space share
//! [`primary`].

pub mod bdpt;
pub mod chain;
pub mod erpt;
pub mod lt;
pub mod mlt;
pub mod mmlt;
pub mod primary;
pub mod pssmlt;
pub mod pt;
pub mod radiosity;
mod registry;
pub mod rjmlt;
mod spec;
mod trace;

pub use registry::{Factory, Registry};
pub use spec::{Defaults, Options, Spec, SpecError};
