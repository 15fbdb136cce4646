//! Walks: the one place where subpaths grow, are connected and are weighed.
//!
//! A walk is a list of [`WalkVertex`] and an [`OpenEdge`] whose end is not known yet. A step traces
//! the edge, makes its end a vertex ([`Walk::arrive`]) and opens the next edge ([`Walk::scatter`]).
//! Between any two steps a walk can wait, so that a caller may advance many side by side and trace
//! their rays together; [`Walk::run`] advances one to its end.
//!
//! In a scene with media an edge may end in a medium: [`OpenEdge::travel`] draws where.
//! Index-matched surfaces are passed on the way.
//!
//! What happens at a vertex is known when the walk leaves it: its [`Event`](crate::bsdf::Event),
//! specular or not. A vertex can end a connection where its material has a non-specular component;
//! in the path that goes on from it the event decides.
//!
//! | step | file |
//! | --- | --- |
//! | which random number means what | `layout` |
//! | growing a subpath, its densities from both sides | `subpath` |
//! | the same along the vertices of a given path | `lay` |
//! | both subpaths of a sample: first vertices, lens, environment | `start` |
//! | every technique (s, t): f/p and what its weight needs | `connect` |
//! | the weight, O(1) per connection | `weight` |
//! | which techniques take part | `techniques` |
//! | debug builds check weights against the plain functions of a whole path | `verify` |
//!
//! ```
//! use pathspace_core::walk::TechniqueSet;
//!
//! // Next-event estimation and hits alone, as a path tracer has them.
//! let techniques = TechniqueSet::new(0..=1, 2..=64);
//! assert!(techniques.contains(1, 5) && !techniques.contains(2, 3));
//! ```

mod connect;
mod lay;
mod layout;
mod start;
mod subpath;
mod techniques;
mod verify;
mod weight;

pub use connect::{Connection, connect, joined};
pub use layout::{
    EventNumbers, Layout, emission_numbers, event_numbers, flight_numbers, next_event_numbers,
};
pub use start::{LightSubpath, SensorSubpath, Walks};
pub use subpath::{OpenEdge, Subpath, Walk, WalkVertex, always, scatter};
pub use techniques::TechniqueSet;
pub use weight::{Side, WeightState, Weights};
