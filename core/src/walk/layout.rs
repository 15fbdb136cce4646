//! Which random number means what: walking, inversion, jumps and steps of chains read it here.
//!
//! | stream | numbers, in order |
//! | --- | --- |
//! | [`Stream::Sensor`] | film position (2), point of the lens (2, none for a pinhole), then per scattering event 3, and 1 where roulette plays |
//! | [`Stream::Light`] | emitter (1), position on it (2), direction (2), then per scattering event 3, and 1 where roulette plays |
//! | both, in a scene with media | before each event channel and distance of the free flight that leads there (2) |
//! | [`Stream::Lens`] | per connection to the lens a point of it (2, none for a pinhole) |
//! | [`Stream::Connection`] | per vertex of next-event estimation emitter (1) and position on it (2), and what an integrator draws beside |

use crate::path::Technique;
use crate::random::{PrimarySample, Stream};
use crate::scene::Scene;

/// The numbers of a scattering event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventNumbers {
    /// Chooses the component.
    pub component: f32,
    /// Direction of the component.
    pub direction: [f32; 2],
}

/// Reads the numbers of a scattering event.
#[inline]
pub fn event_numbers<U: PrimarySample>(u: &mut U) -> EventNumbers {
    EventNumbers { component: u.next(), direction: u.next2() }
}

/// Reads channel and distance of a free flight; only scenes with media have them.
#[inline]
pub fn flight_numbers<U: PrimarySample>(u: &mut U) -> [f32; 2] {
    u.next2()
}

/// Reads emitter, position and direction of an emission.
#[inline]
pub fn emission_numbers<U: PrimarySample>(u: &mut U) -> (f32, [f32; 2], [f32; 2]) {
    (u.next(), u.next2(), u.next2())
}

/// Reads emitter and position of next-event estimation.
#[inline]
pub fn next_event_numbers<U: PrimarySample>(u: &mut U) -> (f32, [f32; 2]) {
    (u.next(), u.next2())
}

/// How many numbers of its two walks a technique (s, t) depends on, where no roulette plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Film position and point of the lens.
    pub sensor_start: usize,
    /// Numbers of the free flight along an edge: 2 in a scene with media, else none.
    pub flight: usize,
    /// Numbers of [`Stream::Sensor`].
    pub sensor: usize,
    /// Numbers of [`Stream::Light`].
    pub light: usize,
}

impl Layout {
    /// Emitter, position on it and direction.
    pub const LIGHT_START: usize = 5;

    /// Emitter and position on it.
    pub const EMITTER_VERTEX: usize = 3;

    /// The layout of a technique.
    pub fn new(scene: &Scene, Technique { s, t }: Technique) -> Self {
        let sensor_start = if scene.sensor().is_pinhole() { 2 } else { 4 };
        let flight = if scene.has_media() { 2 } else { 0 };
        let walk = |start, n| Layout::walk(start, flight, n);
        Layout {
            sensor_start,
            flight,
            sensor: if t >= 2 { walk(sensor_start, t) } else { 0 },
            light: match s {
                0 => 0,
                // x₀ for the lens: a direction is drawn and not used.
                1 if t == 1 => Layout::EMITTER_VERTEX,
                1 => 0,
                _ => walk(Layout::LIGHT_START, s),
            },
        }
    }

    /// Numbers of a walk of n ≥ 2 vertices that begins with `start` ones: three for each event
    /// between the first and the last vertex, and `flight` for each edge.
    pub fn walk(start: usize, flight: usize, n: usize) -> usize {
        start + 3 * (n - 2) + flight * (n - 1)
    }

    /// How many numbers of each stream mean the same to two techniques of one path: those of the
    /// vertices that both walk to.
    pub fn shared(scene: &Scene, a: Technique, b: Technique) -> [usize; Stream::COUNT] {
        let (a, b) = (Layout::new(scene, a), Layout::new(scene, b));
        let mut shared = [0; Stream::COUNT];
        shared[Stream::Sensor as usize] = a.sensor.min(b.sensor);
        shared[Stream::Light as usize] = a.light.min(b.light);
        shared
    }
}
