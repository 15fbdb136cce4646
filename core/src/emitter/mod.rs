//! Emitters: what they emit, and how they are chosen and sampled.
//!
//! | emitter | L_e of the path | measure of x₀ | density of x₁ |
//! | --- | --- | --- | --- |
//! | area | radiance, on the side of n_g | area | cosine-weighted direction |
//! | point | radiant intensity I | counting | uniform direction |
//! | spot, projector | radiant intensity I of the direction | counting | uniform in the cone or on the image |
//! | directional | irradiance E across the beam | counting | uniform on the disk across the scene |
//! | constant | radiance | solid angle | uniform on the disk across the scene |
//! | environment | radiance of its direction | solid angle | uniform on the disk across the scene |
//!
//! With the generalised geometry term of [`Edge`](crate::measure::Edge) the product L_e·G is the
//! right one in every row.

mod beam;
pub(crate) mod environment;
pub use beam::{Beam, BeamShape};
pub use environment::Environment;

use glam::Vec3;

use crate::color::Rgb;
use crate::math::warp;
use crate::measure::{Area, Density, Mass};
use crate::normalisation::Ball;
use crate::random::coordinate_between;

/// One emitter of the built scene, in normalised units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emitter {
    /// One-sided diffuse emission of a whole shape.
    Area {
        /// The shape.
        shape: u32,
        /// L_e.
        radiance: Rgb,
    },
    /// Isotropic point.
    Point {
        /// Position.
        position: Vec3,
        /// I in normalised units (world intensity × scale²).
        intensity: Rgb,
    },
    /// Point that shines by a [`Beam`].
    Beam {
        /// Position.
        position: Vec3,
        /// Index of the beam ([`Emitters::beam`]).
        beam: u32,
    },
    /// Parallel light.
    Directional {
        /// Unit direction towards the light.
        to: Vec3,
        /// E on a plane across the beam.
        irradiance: Rgb,
    },
    /// The same radiance from everywhere.
    Constant {
        /// L_e.
        radiance: Rgb,
    },
    /// Radiance from an image; the image itself is [`Emitters::environment`].
    Environment {
        /// Mean of L_e over all directions.
        mean: Rgb,
    },
}

impl Emitter {
    /// True where x₀ has a counting measure: no other technique can hit it.
    pub fn is_delta(&self) -> bool {
        matches!(self, Emitter::Point { .. } | Emitter::Beam { .. } | Emitter::Directional { .. })
    }

    /// True where x₀ is at infinity.
    pub fn is_far(&self) -> bool {
        matches!(
            self,
            Emitter::Constant { .. } | Emitter::Environment { .. } | Emitter::Directional { .. }
        )
    }
}

/// Units that probability comes in: a coordinate of primary sample space takes so many values.
const UNITS: u64 = 1 << 24;

/// Part of the picks that goes to all emitters alike.
const EVEN: f64 = 1.0 / 32.0;

/// All emitters of a scene with the discrete distribution by which one is picked: nearly in
/// proportion to emitted power (mean of the channels; power through the ball about the surfaces for
/// emitters at infinity).
///
/// A small part (1 in 32) of the picks is spread over all emitters that emit, so that a weak one
/// that is alone in its room is found. Probabilities are whole multiples of 2⁻²⁴, at least one,
/// because the number that picks is one too: what [`Emitters::mass`] says is exactly what
/// [`Emitters::pick`] does.
#[derive(Clone, Debug)]
pub struct Emitters {
    list: Vec<Emitter>,
    /// Running sum of the units of each; [`UNITS`] in all, or 0 in a dark scene.
    units: Vec<u32>,
    background: Option<u32>,
    /// What beams from infinity cover.
    ball: Ball,
    environment: Option<Environment>,
    beams: Vec<Beam>,
}

impl Emitters {
    /// `power` holds each emitter's power in the same arbitrary unit. `None` where more emitters
    /// emit than there are units.
    pub(crate) fn new(
        list: Vec<Emitter>,
        power: &[f64],
        ball: Ball,
        environment: Option<Environment>,
    ) -> Option<Self> {
        let everywhere =
            |e: &Emitter| matches!(e, Emitter::Constant { .. } | Emitter::Environment { .. });
        let background = list.iter().position(everywhere).map(|i| i as u32);
        let (units, beams) = (running_units(power)?, Vec::new());
        Some(Emitters { units, list, background, ball, environment, beams })
    }

    /// The same with the beams that [`Emitter::Beam`] refers to.
    pub(crate) fn with_beams(self, beams: Vec<Beam>) -> Self {
        Emitters { beams, ..self }
    }

    /// A beam.
    #[inline]
    pub fn beam(&self, index: u32) -> &Beam {
        &self.beams[index as usize]
    }

    /// The emitters.
    pub fn list(&self) -> &[Emitter] {
        &self.list
    }

    /// One emitter.
    pub fn get(&self, index: u32) -> &Emitter {
        &self.list[index as usize]
    }

    /// True where nothing emits.
    pub fn is_dark(&self) -> bool {
        self.units.last().is_none_or(|&all| all == 0)
    }

    /// The environment, if there is one.
    pub fn background(&self) -> Option<u32> {
        self.background
    }

    /// Picks an emitter by the coordinate `u`, a multiple of 2⁻²⁴. `None` in a dark scene.
    #[inline]
    pub fn pick(&self, u: f32) -> Option<(u32, Mass)> {
        if self.is_dark() {
            return None;
        }
        let x = (f64::from(u) * UNITS as f64) as u32;
        // The first whose running sum exceeds x: emitters without power are never it.
        let i = self.units.partition_point(|&sum| sum <= x).min(self.units.len() - 1) as u32;
        Some((i, self.mass(i)))
    }

    /// A number by which [`Emitters::pick`] gives this emitter, by the uniform number `u`; `None`
    /// where there is none.
    pub fn invert_pick(&self, index: u32, u: f32) -> Option<f32> {
        let (low, high) = self.range(index);
        let unit = |n: u32| f64::from(n) / UNITS as f64;
        coordinate_between(unit(low), unit(high), u)
    }

    /// Probability that [`Emitters::pick`] gives this emitter.
    #[inline]
    pub fn mass(&self, index: u32) -> Mass {
        let (low, high) = self.range(index);
        Mass::new(f64::from(high - low) / UNITS as f64)
    }

    /// The units of one emitter.
    #[inline]
    fn range(&self, index: u32) -> (u32, u32) {
        let i = index as usize;
        (if i == 0 { 0 } else { self.units[i - 1] }, self.units[i])
    }

    /// Radiance of an area emitter or of the same radiance from everywhere; black for others.
    #[inline]
    pub fn area_radiance(&self, index: u32) -> Rgb {
        match self.list[index as usize] {
            Emitter::Area { radiance, .. } | Emitter::Constant { radiance } => radiance,
            _ => Rgb::BLACK,
        }
    }

    /// The environment map, if there is one.
    pub fn environment(&self) -> Option<&Environment> {
        self.environment.as_ref()
    }

    /// Radiance of the surroundings from the unit direction `to`, which points to them.
    #[inline]
    pub fn background_radiance(&self, to: Vec3) -> Rgb {
        match &self.environment {
            Some(map) => map.radiance(to),
            None => self.background.map_or(Rgb::BLACK, |i| self.area_radiance(i)),
        }
    }

    /// Density with which directions to the surroundings are sampled: per solid angle, the own
    /// measure of a vertex at infinity.
    #[inline]
    pub(crate) fn background_pdf(&self, to: Vec3) -> Density<Area> {
        match &self.environment {
            Some(map) => Density::new(map.pdf(to).value()),
            None => Density::new(0.25 / std::f64::consts::PI),
        }
    }

    /// A direction to the surroundings.
    pub(crate) fn sample_background(&self, u: [f32; 2]) -> Vec3 {
        match &self.environment {
            Some(map) => map.sample(u),
            None => warp::uniform_sphere(u),
        }
    }

    /// Numbers for which [`Emitters::sample_background`] gives a direction.
    pub(crate) fn invert_background(&self, to: Vec3) -> Option<[f32; 2]> {
        match &self.environment {
            Some(map) => map.invert(to),
            None => Some(warp::uniform_sphere_inverse(to)),
        }
    }

    /// What beams from infinity cover.
    #[inline]
    pub(crate) fn ball(&self) -> &Ball {
        &self.ball
    }

    /// Density across a beam that is uniform on the disk that covers the scene.
    #[inline]
    pub(crate) fn beam_density(&self) -> Density<Area> {
        let r = self.ball.radius as f64;
        Density::new(1.0 / (std::f64::consts::PI * r * r))
    }
}

/// Running sums of the units of each emitter; `None` where more emit than there are units. One that
/// emits has at least one unit.
fn running_units(power: &[f64]) -> Option<Vec<u32>> {
    let lit = power.iter().filter(|&&p| p > 0.0).count() as u64;
    let largest = power.iter().copied().fold(0.0, f64::max);
    let spare = UNITS.checked_sub(lit)?;
    // Relative to the largest: the sum of powers may leave the range of numbers.
    let total: f64 = power.iter().map(|p| p / largest).sum();
    let wanted = |p: f64| match lit {
        _ if p <= 0.0 => 0,
        1 => UNITS,
        _ => {
            let share = (1.0 - EVEN) * (p / largest / total) + EVEN / lit as f64;
            1 + (share * spare as f64) as u64
        }
    };
    let mut units: Vec<u64> = power.iter().map(|&p| wanted(p)).collect();
    // What rounding down has left, or too much by the rounding of shares, is hardly felt by the
    // strongest.
    let given: u64 = units.iter().sum();
    if lit > 0
        && let Some(strongest) = units.iter_mut().max()
    {
        *strongest = (*strongest + UNITS).saturating_sub(given).max(1);
    }
    let mut sum = 0;
    Some(units.iter().map(|n| (sum += *n as u32, sum).1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::nearest_coordinate;

    fn emitters(power: &[f64]) -> Emitters {
        let one = Emitter::Point { position: Vec3::ZERO, intensity: Rgb::grey(1.0) };
        Emitters::new(vec![one; power.len()], power, Ball::default(), None).unwrap()
    }

    /// Every value of the coordinate is tried: what is picked is what the mass says.
    #[test]
    fn every_emitter_is_picked_with_exactly_its_mass() {
        let weak = [1.0, 1e-7, 0.0, 3e-6, 1e-30, 0.2];
        for power in [&weak[..], &[1e-9], &[0.0, 5.0], &[1e300, 1e308, 1e308], &[1.0; 1000]] {
            let emitters = emitters(power);
            let mut counts = vec![0_u64; power.len()];
            for k in 0..UNITS {
                let u = nearest_coordinate(k as f64 / UNITS as f64);
                let (i, mass) = emitters.pick(u).unwrap();
                assert_eq!(mass, emitters.mass(i));
                counts[i as usize] += 1;
            }
            for (i, &count) in counts.iter().enumerate() {
                let mass = emitters.mass(i as u32).value();
                assert_eq!(count as f64, mass * UNITS as f64, "{i} of {power:?}");
                assert_eq!(count > 0, power[i] > 0.0, "{i} of {power:?}");
            }
        }
    }

    #[test]
    fn masses_follow_power_but_for_a_small_even_part() {
        let emitters = emitters(&[3.0, 1.0, 1e-12]);
        for (i, expected) in [0.75, 0.25, 0.0].into_iter().enumerate() {
            let expected = (1.0 - EVEN) * expected + EVEN / 3.0;
            assert!((emitters.mass(i as u32).value() - expected).abs() < 1e-6);
        }
    }

    #[test]
    fn nothing_is_picked_in_the_dark() {
        assert_eq!(emitters(&[0.0, 0.0]).pick(0.5), None);
        assert_eq!(emitters(&[]).pick(0.5), None);
    }
}
