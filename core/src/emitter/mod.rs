//! Emitters: what they emit, and how they are chosen and sampled.
//!
//! | emitter | L_e of the path | measure of x₀ | density of x₁ |
//! | --- | --- | --- | --- |
//! | area | radiance, on the side of n_g | area | cosine-weighted direction |
//! | point | radiant intensity I | counting | uniform direction |
//! | directional | irradiance E across the beam | counting | uniform on the disk across the scene |
//! | constant | radiance | solid angle | uniform on the disk across the scene |
//! | environment | radiance of its direction | solid angle | uniform on the disk across the scene |
//!
//! With the generalised geometry term of [`Edge`](crate::measure::Edge) the product L_e·G is the right one in every row.

mod cone;
pub(crate) mod environment;
mod inverse;
mod sample;

pub use environment::Environment;
pub use sample::{DirectSample, EmissionSample, NextDensity};

use glam::Vec3;

use crate::color::Rgb;
use crate::math::warp;
use crate::measure::{Area, Density, Mass};
use crate::random::coordinate_between;
use crate::scene::Ball;

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
        matches!(self, Emitter::Point { .. } | Emitter::Directional { .. })
    }

    /// True where x₀ is at infinity.
    pub fn is_far(&self) -> bool {
        matches!(
            self,
            Emitter::Constant { .. } | Emitter::Environment { .. } | Emitter::Directional { .. }
        )
    }
}

/// All emitters of a scene with the discrete distribution by which one is picked: in proportion to emitted power
/// (mean of the channels; power through the ball about the surfaces for emitters at infinity).
#[derive(Clone, Debug)]
pub struct Emitters {
    list: Vec<Emitter>,
    /// Probability of each.
    mass: Vec<f64>,
    /// Running sum of `mass`.
    cdf: Vec<f64>,
    background: Option<u32>,
    /// What beams from infinity cover.
    ball: Ball,
    environment: Option<Environment>,
}

impl Emitters {
    /// `power` holds each emitter's power in the same arbitrary unit.
    pub(crate) fn new(
        list: Vec<Emitter>,
        power: &[f64],
        ball: Ball,
        environment: Option<Environment>,
    ) -> Self {
        let total: f64 = power.iter().sum();
        let mass: Vec<f64> =
            power.iter().map(|&p| if total > 0.0 { p / total } else { 0.0 }).collect();
        let cdf = mass
            .iter()
            .scan(0.0, |sum, m| {
                *sum += m;
                Some(*sum)
            })
            .collect();
        let everywhere =
            |e: &Emitter| matches!(e, Emitter::Constant { .. } | Emitter::Environment { .. });
        let background = list.iter().position(everywhere).map(|i| i as u32);
        Emitters { list, mass, cdf, background, ball, environment }
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
        self.cdf.last().is_none_or(|&c| c == 0.0)
    }

    /// The environment, if there is one.
    pub fn background(&self) -> Option<u32> {
        self.background
    }

    /// Picks an emitter by power. `None` in a dark scene.
    #[inline]
    pub fn pick(&self, u: f32) -> Option<(u32, Mass)> {
        if self.is_dark() {
            return None;
        }
        let total = self.cdf[self.cdf.len() - 1];
        let x = u as f64 * total;
        // The first whose running sum exceeds x: emitters without power are never it.
        let i = self.cdf.partition_point(|&c| c <= x).min(self.cdf.len() - 1);
        Some((i as u32, Mass::new(self.mass[i])))
    }

    /// A number by which [`Emitters::pick`] gives this emitter, by the uniform number `u`; `None` where there is none.
    pub fn invert_pick(&self, index: u32, u: f32) -> Option<f32> {
        let i = index as usize;
        let low = if i == 0 { 0.0 } else { self.cdf[i - 1] };
        let total = self.cdf[self.cdf.len() - 1];
        coordinate_between(low / total, self.cdf[i] / total, u)
    }

    /// Probability that [`Emitters::pick`] gives this emitter.
    #[inline]
    pub fn mass(&self, index: u32) -> Mass {
        Mass::new(self.mass[index as usize])
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

    /// Density with which directions to the surroundings are sampled: per solid angle, the own measure of a vertex at infinity.
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
