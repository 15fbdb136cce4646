//! The open set of integrators by name.

use pathspace_core::integrator::Integrator;

use crate::bdpt::{self, Bdpt};
use crate::erpt::{self, Erpt};
use crate::lt::{self, LightTracer};
use crate::mlt::{self, Mlt};
use crate::mmlt::{self, Mmlt};
use crate::pssmlt;
use crate::pt::{self, PathTracer};
use crate::radiosity::{self, RadiosityIntegrator};
use crate::rjmlt::{self, Rjmlt};
use crate::spec::{Defaults, Spec, SpecError};

/// Builds an integrator from its options.
pub type Factory =
    Box<dyn Fn(&Spec, &Defaults) -> Result<Box<dyn Integrator>, SpecError> + Send + Sync>;

struct Entry {
    name: String,
    summary: String,
    factory: Factory,
    by_name_only: bool,
}

/// Integrators by name. A plug-in adds one with [`Registry::with`].
#[derive(Default)]
pub struct Registry {
    entries: Vec<Entry>,
}

impl Registry {
    /// A registry without integrators.
    pub fn empty() -> Self {
        Registry::default()
    }

    /// The integrators of this crate.
    pub fn builtin() -> Self {
        Registry::empty()
            .with(pt::NAME, "path tracing with next-event estimation", |spec, defaults| {
                Ok(Box::new(PathTracer::from_spec(spec, defaults)?))
            })
            .with(lt::NAME, "light tracing onto the film", |spec, defaults| {
                Ok(Box::new(LightTracer::from_spec(spec, defaults)?))
            })
            .with(bdpt::NAME, "bidirectional path tracing, all techniques", |spec, defaults| {
                Ok(Box::new(Bdpt::from_spec(spec, defaults)?))
            })
            .with(
                pssmlt::NAME,
                "primary-sample-space Metropolis over bdpt or pt",
                pssmlt::from_spec,
            )
            .with(mlt::NAME, "Metropolis light transport on path space", |spec, defaults| {
                Ok(Box::new(Mlt::from_spec(spec, defaults)?))
            })
            .with(
                mmlt::NAME,
                "multiplexed Metropolis: a chain per path length, all techniques",
                |spec, defaults| Ok(Box::new(Mmlt::from_spec(spec, defaults)?)),
            )
            .with(
                rjmlt::NAME,
                "reversible jump Metropolis: mmlt with jumps between techniques",
                |spec, defaults| Ok(Box::new(Rjmlt::from_spec(spec, defaults)?)),
            )
            .with(erpt::NAME, "energy redistribution path tracing", |spec, defaults| {
                Ok(Box::new(Erpt::from_spec(spec, defaults)?))
            })
            .with(radiosity::NAME, "finite elements, for diffuse scenes", |spec, defaults| {
                Ok(Box::new(RadiosityIntegrator::from_spec(spec, defaults)?))
            })
            .by_name_only(radiosity::NAME)
    }

    /// Adds an integrator, or replaces the one of that name.
    pub fn with(
        mut self,
        name: &str,
        summary: &str,
        factory: impl Fn(&Spec, &Defaults) -> Result<Box<dyn Integrator>, SpecError>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        self.entries.retain(|e| e.name != name);
        self.entries.push(Entry {
            name: name.to_owned(),
            summary: summary.to_owned(),
            factory: Box::new(factory),
            by_name_only: false,
        });
        self
    }

    /// Leaves an integrator out of [`Registry::list`]: one that refuses most scenes, or whose
    /// answer is not exact, takes part in comparisons only where it is named.
    pub fn by_name_only(mut self, name: &str) -> Self {
        self.entries.iter_mut().filter(|e| e.name == name).for_each(|e| e.by_name_only = true);
        self
    }

    /// Names and one-line summaries, in order, of the integrators that take part where none is
    /// named.
    pub fn list(&self) -> impl Iterator<Item = (&str, &str)> {
        self.all()
            .filter(|(name, _)| self.entries.iter().any(|e| e.name == *name && !e.by_name_only))
    }

    /// Names and one-line summaries of all integrators in order.
    pub fn all(&self) -> impl Iterator<Item = (&str, &str)> {
        self.entries.iter().map(|e| (e.name.as_str(), e.summary.as_str()))
    }

    /// Builds the integrator that a spec names.
    ///
    /// # Errors
    /// Where the name or an option is unknown, or a value out of range.
    pub fn create(
        &self,
        spec: &Spec,
        defaults: &Defaults,
    ) -> Result<Box<dyn Integrator>, SpecError> {
        let entry = self.entries.iter().find(|e| e.name == spec.name).ok_or_else(|| {
            SpecError::UnknownIntegrator {
                name: spec.name.clone(),
                known: self.all().map(|(name, _)| name).collect::<Vec<_>>().join(", "),
            }
        })?;
        (entry.factory)(spec, defaults)
    }
}
