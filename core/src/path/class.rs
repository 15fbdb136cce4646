//! Which families of techniques could make a path, tracked along a walk.

use super::Families;
use crate::bsdf::TransportMode;
use crate::emitter::Emitter;

/// What x₀ adds to the class of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// It can not be hit.
    pub delta: bool,
    /// It is at infinity.
    pub far: bool,
}

impl From<&Emitter> for Origin {
    #[inline]
    fn from(emitter: &Emitter) -> Self {
        Origin { delta: emitter.is_delta(), far: emitter.is_far() }
    }
}

/// What a walk remembers of its surface vertices to name the families of techniques that could have
/// made its path; agrees with [`super::families()`], which looks at the whole path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WalkClass {
    vertices: u32,
    first_non_specular: bool,
    last_non_specular: bool,
    adjacent_non_specular: bool,
    any_non_specular: bool,
}

impl WalkClass {
    /// Adds the next surface vertex of the walk; `non_specular` where its event is not specular.
    #[inline]
    pub fn push(&mut self, non_specular: bool) {
        if self.vertices == 0 {
            self.first_non_specular = non_specular;
        } else {
            self.adjacent_non_specular |= self.last_non_specular && non_specular;
        }
        self.any_non_specular |= non_specular;
        self.last_non_specular = non_specular;
        self.vertices += 1;
    }

    /// The families for a path whose inner vertices are those pushed so far, by a walk from the
    /// sensor (radiance) or the emitter (importance).
    #[inline]
    pub fn families(&self, mode: TransportMode, origin: Origin, pinhole: bool) -> Families {
        let techniques = self.techniques(mode, origin.delta, pinhole);
        techniques | Families::FAR.when(origin.far && techniques != Families::NONE)
    }

    #[inline]
    fn techniques(&self, mode: TransportMode, delta_emitter: bool, pinhole: bool) -> Families {
        if self.vertices == 0 {
            // x₀ seen directly: a delta emitter has no image.
            return if delta_emitter {
                Families::NONE
            } else {
                Families::S0 | Families::T1 | Families::T0.when(!pinhole)
            };
        }
        let (at_sensor, at_emitter) = match mode {
            TransportMode::Radiance => (self.first_non_specular, self.last_non_specular),
            TransportMode::Importance => (self.last_non_specular, self.first_non_specular),
        };
        Families::S0.when(!delta_emitter)
            | Families::S1.when(at_emitter)
            | Families::INNER.when(self.adjacent_non_specular)
            | Families::T1.when(at_sensor)
            | Families::T0.when(!pinhole)
            | Families::MERGE.when(self.any_non_specular)
    }

    /// The families for the path that joins a light subpath and a sensor subpath (either may hold
    /// no surface vertex).
    #[inline]
    pub fn join(light: &WalkClass, sensor: &WalkClass, origin: Origin, pinhole: bool) -> Families {
        let whole = WalkClass {
            vertices: light.vertices + sensor.vertices,
            first_non_specular: if light.vertices > 0 {
                light.first_non_specular
            } else {
                sensor.last_non_specular
            },
            last_non_specular: if sensor.vertices > 0 {
                sensor.first_non_specular
            } else {
                light.last_non_specular
            },
            adjacent_non_specular: light.adjacent_non_specular
                || sensor.adjacent_non_specular
                || light.last_non_specular && sensor.last_non_specular,
            any_non_specular: light.any_non_specular || sensor.any_non_specular,
        };
        whole.families(TransportMode::Importance, origin, pinhole)
    }
}
