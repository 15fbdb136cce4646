//! Bookkeeping of whole paths, done only for sinks that record them.

use pathspace_core::bsdf::Event;
use pathspace_core::film::{Contribution, Sink};
use pathspace_core::path::{Path, PathRecord, Technique, Vertex};

/// Vertices of a subpath in walk order and ln of its density by the integrator's own numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trace {
    path: Path,
    ln_pdf: f64,
}

impl Trace {
    /// Adds a vertex and the factor that its sampling multiplied the density by.
    pub(crate) fn push<S: Sink>(
        &mut self,
        vertex: impl FnOnce() -> Vertex,
        pdf: impl FnOnce() -> f64,
    ) {
        if S::RECORDS_PATHS {
            self.path.vertices.push(vertex());
            self.path.events.push(Event::NonSpecular);
            self.ln_pdf += pdf().ln();
        }
    }

    /// Says what happened at the last vertex.
    pub(crate) fn scatter<S: Sink>(&mut self, event: Event) {
        if S::RECORDS_PATHS
            && let Some(last) = self.path.events.last_mut()
        {
            *last = event;
        }
    }

    /// Hands a contribution to the sink, with the path for sinks that record: the walk's vertices,
    /// then `rest`, and the factor by which `rest` multiplies the density. `from_sensor` tells in
    /// which direction the walk went.
    pub(crate) fn emit<S: Sink>(
        &self,
        sink: &mut S,
        contribution: Contribution,
        from_sensor: bool,
        rest: impl FnOnce() -> (Vertex, f64),
    ) {
        sink.add(contribution);
        if S::RECORDS_PATHS {
            let (last, pdf) = rest();
            let mut path = self.path.clone();
            path.vertices.push(last);
            path.events.push(Event::NonSpecular);
            if from_sensor {
                path.vertices.reverse();
                path.events.reverse();
            }
            sink.record(PathRecord {
                path,
                technique: Technique::new(contribution.s as usize, contribution.t as usize),
                ln_pdf: self.ln_pdf + pdf.ln(),
                weight: contribution.weight as f64,
                value: contribution.value,
            });
        }
    }
}
