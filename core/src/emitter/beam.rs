//! Points that do not shine alike in all directions: spot lights and projectors.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use crate::color::Rgb;
use crate::measure::{Density, SolidAngle};
use crate::random::nearest_coordinate;
use crate::texture::Texture;

/// Where and how a point shines; its axes are world directions, z along the beam.
#[derive(Clone, Debug, PartialEq)]
pub struct Beam {
    axes: [DVec3; 3],
    shape: BeamShape,
}

/// How intensity depends on the direction.
#[derive(Clone, Debug, PartialEq)]
pub enum BeamShape {
    /// I within the beam, falling linearly with the angle to 0 at the border of the cone.
    Spot {
        /// I in normalised units.
        intensity: Rgb,
        /// Angle of the cone in radians.
        cutoff: f64,
        /// Angle within which nothing falls.
        beam: f64,
        /// A factor over the square about the cone.
        texture: Option<Arc<Texture>>,
    },
    /// I = scale E(u, v)/cos³θ over a rectangle, so that a plane across the beam shows the image
    /// evenly.
    Projector {
        /// E.
        image: Arc<Texture>,
        /// Factor in normalised units.
        scale: f32,
        /// Half width and half height at distance 1.
        half: [f64; 2],
    },
}

impl Beam {
    /// A beam along the third axis.
    pub fn new(axes: [DVec3; 3], shape: BeamShape) -> Self {
        Beam { axes, shape }
    }

    #[inline]
    fn local(&self, d: Vec3) -> DVec3 {
        let d = d.as_dvec3();
        DVec3::from(self.axes.map(|a| a.dot(d))).normalize()
    }

    /// Radiant intensity in the unit direction `d`.
    pub fn intensity(&self, d: Vec3) -> Rgb {
        let d = self.local(d);
        if d.z <= 0.0 {
            return Rgb::BLACK;
        }
        match &self.shape {
            BeamShape::Spot { intensity, cutoff, beam, texture } => {
                let angle = d.truncate().length().atan2(d.z);
                if angle >= *cutoff {
                    return Rgb::BLACK;
                }
                let falloff = if angle <= *beam { 1.0 } else { (cutoff - angle) / (cutoff - beam) };
                let colour = texture.as_ref().map_or(Rgb::WHITE, |texture| {
                    let uv = d.truncate() / (d.z * cutoff.tan()) * 0.5 + 0.5;
                    texture.eval(uv.as_vec2())
                });
                *intensity * colour * falloff as f32
            }
            BeamShape::Projector { image, scale, half: [x, y] } => {
                let uv = [0.5 - 0.5 * d.x / (d.z * x), 0.5 - 0.5 * d.y / (d.z * y)];
                if !uv.iter().all(|v| (0.0..=1.0).contains(v)) {
                    return Rgb::BLACK;
                }
                let colour = image.eval(Vec2::new(uv[0] as f32, uv[1] as f32));
                colour * (f64::from(*scale) / (d.z * d.z * d.z)) as f32
            }
        }
    }

    /// Mean of the channels of the power, for the choice among emitters.
    pub(crate) fn power(&self) -> f64 {
        match &self.shape {
            BeamShape::Spot { intensity, cutoff, beam, texture } => {
                let colour = texture.as_ref().map_or(Rgb::WHITE, |t| t.mean());
                let angle = 1.0 - 0.5 * (cutoff.cos() + beam.cos());
                2.0 * PI * angle * f64::from((*intensity * colour).mean().max(0.0))
            }
            BeamShape::Projector { image, scale, half: [x, y] } => {
                4.0 * x * y * f64::from(*scale) * f64::from(image.mean().mean().max(0.0))
            }
        }
    }

    /// A direction: uniform in the cone of a spot light, or on the image of a projector.
    pub(crate) fn sample(&self, u: [f32; 2]) -> Vec3 {
        let u = u.map(f64::from);
        let d = match &self.shape {
            BeamShape::Spot { cutoff, .. } => {
                // 1 − cos θ = 2 sin²(θ/2), so that narrow cones keep their digits.
                let less = u[0] * 2.0 * (0.5 * cutoff).sin().powi(2);
                let sin = (less * (2.0 - less)).sqrt();
                let (s, c) = (2.0 * PI * u[1]).sin_cos();
                DVec3::new(sin * c, sin * s, 1.0 - less)
            }
            BeamShape::Projector { half: [x, y], .. } => {
                DVec3::new((1.0 - 2.0 * u[0]) * x, (1.0 - 2.0 * u[1]) * y, 1.0).normalize()
            }
        };
        let [x, y, z] = self.axes;
        (x * d.x + y * d.y + z * d.z).normalize().as_vec3()
    }

    /// Density of [`Beam::sample`].
    pub(crate) fn pdf(&self, d: Vec3) -> Density<SolidAngle> {
        let d = self.local(d);
        if d.z <= 0.0 {
            return Density::ZERO;
        }
        match &self.shape {
            BeamShape::Spot { cutoff, .. } => {
                let less = 2.0 * (0.5 * cutoff).sin().powi(2);
                // A little wider than what is sampled: directions are rounded.
                let inside = d.truncate().length().atan2(d.z) <= cutoff * (1.0 + 1e-6);
                if inside { Density::new(0.5 / (PI * less)) } else { Density::ZERO }
            }
            BeamShape::Projector { half: [x, y], .. } => {
                let (a, b) = ((d.x / d.z).abs(), (d.y / d.z).abs());
                if a > x * (1.0 + 1e-6) || b > y * (1.0 + 1e-6) {
                    return Density::ZERO;
                }
                Density::new(1.0 / (4.0 * x * y * d.z * d.z * d.z))
            }
        }
    }

    /// Inverse of [`Beam::sample`].
    pub(crate) fn invert(&self, d: Vec3) -> Option<[f32; 2]> {
        if self.pdf(d).is_zero() {
            return None;
        }
        let d = self.local(d);
        let u = match &self.shape {
            BeamShape::Spot { cutoff, .. } => {
                let sin2 = d.truncate().length_squared();
                let less = sin2 / (1.0 + d.z);
                let turn = d.y.atan2(d.x) / (2.0 * PI);
                [less / (2.0 * (0.5 * cutoff).sin().powi(2)), turn.rem_euclid(1.0)]
            }
            BeamShape::Projector { half: [x, y], .. } => {
                [0.5 - 0.5 * d.x / (d.z * x), 0.5 - 0.5 * d.y / (d.z * y)]
            }
        };
        Some(u.map(nearest_coordinate))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Address, PrimarySample, RandomStream};

    fn beams() -> [Beam; 2] {
        let z = DVec3::new(0.3, -0.5, 0.8).normalize();
        let x = z.any_orthogonal_vector().normalize();
        let axes = [x, z.cross(x), z];
        let image = Arc::new(Texture::Constant(Rgb::new(0.5, 1.0, 2.0)));
        [
            BeamShape::Spot { intensity: Rgb::WHITE, cutoff: 0.6, beam: 0.4, texture: None },
            BeamShape::Projector { image, scale: 3.0, half: [0.5, 0.3] },
        ]
        .map(|shape| Beam::new(axes, shape))
    }

    /// Samples by their density estimate the power, and the numbers come back.
    #[test]
    fn directions_follow_their_density_and_come_back() {
        for (seed, beam) in beams().iter().enumerate() {
            let n = 40_000;
            let mut sum = 0.0;
            for item in 0..n {
                let mut u = RandomStream::new(Address { seed: seed as u64, step: 0, item });
                let numbers = u.next2();
                let d = beam.sample(numbers);
                sum += f64::from(beam.intensity(d).mean()) / beam.pdf(d).value();
                let again = beam.sample(beam.invert(d).unwrap());
                assert!(again.distance(d) < 1e-5, "{seed}: {d} {again}");
            }
            let power = sum / n as f64;
            // The power of the spot light is that of a falloff that is linear in the cosine.
            assert!((power / beam.power() - 1.0).abs() < 0.03, "{power} {}", beam.power());
            assert!(beam.intensity(Vec3::NEG_Z).is_black() && beam.pdf(Vec3::NEG_Z).is_zero());
        }
    }
}
