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

/// What a walk remembers of its surface vertices to name the families of techniques that could have made its path; agrees with
/// [`super::families()`], which looks at the whole path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WalkClass {
    vertices: u32,
    first_spreads: bool,
    last_spreads: bool,
    adjacent_spread: bool,
    any_spreads: bool,
}

impl WalkClass {
    /// Adds the next surface vertex of the walk; `spreads` where its event is not specular.
    #[inline]
    pub fn push(&mut self, spreads: bool) {
        if self.vertices == 0 {
            self.first_spreads = spreads;
        } else {
            self.adjacent_spread |= self.last_spreads && spreads;
        }
        self.any_spreads |= spreads;
        self.last_spreads = spreads;
        self.vertices += 1;
    }

    /// The families for a path whose inner vertices are those pushed so far, by a walk from the sensor (radiance) or the emitter (importance).
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
            TransportMode::Radiance => (self.first_spreads, self.last_spreads),
            TransportMode::Importance => (self.last_spreads, self.first_spreads),
        };
        Families::S0.when(!delta_emitter)
            | Families::S1.when(at_emitter)
            | Families::INNER.when(self.adjacent_spread)
            | Families::T1.when(at_sensor)
            | Families::T0.when(!pinhole)
            | Families::MERGE.when(self.any_spreads)
    }

    /// The families for the path that joins a light subpath and a sensor subpath (either may hold no surface vertex).
    #[inline]
    pub fn join(light: &WalkClass, sensor: &WalkClass, origin: Origin, pinhole: bool) -> Families {
        let whole = WalkClass {
            vertices: light.vertices + sensor.vertices,
            first_spreads: if light.vertices > 0 {
                light.first_spreads
            } else {
                sensor.last_spreads
            },
            last_spreads: if sensor.vertices > 0 {
                sensor.first_spreads
            } else {
                light.last_spreads
            },
            adjacent_spread: light.adjacent_spread
                || sensor.adjacent_spread
                || light.last_spreads && sensor.last_spreads,
            any_spreads: light.any_spreads || sensor.any_spreads,
        };
        whole.families(TransportMode::Importance, origin, pinhole)
    }
}
