//! Emitters that are not surfaces, in normalised units.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};

use super::Builder;
use crate::color::Rgb;
use crate::description::*;
use crate::emitter::{Beam, BeamShape, Emitter, Environment};
use crate::scene::check::check_environment;
use crate::scene::{Normalisation, SceneError};

impl Builder {
    pub(super) fn add_emitter(
        &mut self,
        index: usize,
        e: &EmitterDescription,
    ) -> Result<(), SceneError> {
        let bad = |problem: &str| Err(SceneError::Emitter { index, problem: problem.into() });
        let scale = self.normalisation.scale;
        let colour_ok = |c: Rgb| c.is_finite() && c.r >= 0.0 && c.g >= 0.0 && c.b >= 0.0;
        let disk = PI * (self.ball.radius as f64).powi(2);
        let (emitter, power) = match e {
            &EmitterDescription::Point { position, intensity } => {
                if !position.is_finite() || !colour_ok(intensity) {
                    return bad(
                        "position or intensity of the point light is not finite and non-negative",
                    );
                }
                let position = ((position - self.normalisation.center) * scale).as_vec3();
                let intensity = intensity * (scale * scale) as f32;
                (Emitter::Point { position, intensity }, 4.0 * PI * intensity.mean() as f64)
            }
            EmitterDescription::Spot { to_world, shape } => {
                let (position, axes) = match rigid(to_world) {
                    Some(axes) => (to_world.translation, axes),
                    None => return bad("to_world of the spot light is not a rotation"),
                };
                let SpotDescription { intensity, cutoff_degrees, beam_degrees, texture } = shape;
                let (cutoff, beam) = (cutoff_degrees.to_radians(), beam_degrees.to_radians());
                // NaN fails every comparison.
                let sound = colour_ok(*intensity) && cutoff > 0.0 && cutoff < PI / 2.0;
                if !sound {
                    return bad("the spot light has no cone between 0° and 90° or a bad intensity");
                }
                let shape = BeamShape::Spot {
                    intensity: *intensity * (scale * scale) as f32,
                    cutoff,
                    beam: beam.clamp(0.0, cutoff),
                    texture: texture.clone(),
                };
                self.add_beam(position, Beam::new(axes, shape))
            }
            EmitterDescription::Projector { to_world, shape } => {
                let (position, axes) = match rigid(to_world) {
                    Some(axes) => (to_world.translation, axes),
                    None => return bad("to_world of the projector is not a rotation"),
                };
                let ProjectorDescription { irradiance, aspect, fov_x_degrees, scale: factor } =
                    shape;
                let x = (fov_x_degrees.to_radians() * 0.5).tan();
                let fov = *fov_x_degrees;
                let sound = fov > 0.0 && fov < 180.0 && *aspect > 0.0;
                if !(sound && factor.is_finite() && *factor >= 0.0) {
                    return bad("angle of view, aspect or scale of the projector is out of range");
                }
                let shape = BeamShape::Projector {
                    image: irradiance.clone(),
                    scale: *factor * (PI * scale * scale) as f32,
                    half: [x, x / aspect],
                };
                self.add_beam(position, Beam::new(axes, shape))
            }
            &EmitterDescription::Directional { direction, irradiance } => {
                let to = -direction.normalize_or_zero();
                if to == DVec3::ZERO || !to.is_finite() || !colour_ok(irradiance) {
                    return bad("direction or irradiance of the directional light is not finite");
                }
                let to = to.as_vec3();
                (Emitter::Directional { to, irradiance }, disk * irradiance.mean() as f64)
            }
            &EmitterDescription::Constant { radiance } => {
                if !colour_ok(radiance) {
                    return bad("radiance of the environment is not finite and non-negative");
                }
                if self.has_environment() {
                    return bad("a scene has one environment only");
                }
                (Emitter::Constant { radiance }, 4.0 * PI * disk * radiance.mean() as f64)
            }
            EmitterDescription::Environment { bitmap, to_world, scale } => {
                if let Some(problem) = check_environment(bitmap, to_world, *scale) {
                    return Err(SceneError::Emitter { index, problem });
                }
                if self.has_environment() {
                    return bad("a scene has one environment only");
                }
                let map = Environment::new(bitmap.clone(), *to_world, *scale);
                let mean = map.mean();
                self.environment = Some(map);
                (Emitter::Environment { mean }, 4.0 * PI * disk * mean.mean() as f64)
            }
        };
        self.emitters.push(emitter);
        self.power.push(power);
        Ok(())
    }

    fn add_beam(&mut self, position: DVec3, beam: Beam) -> (Emitter, f64) {
        let Normalisation { center, scale } = self.normalisation;
        let position = ((position - center) * scale).as_vec3();
        let power = beam.power();
        self.beams.push(beam);
        (Emitter::Beam { position, beam: self.beams.len() as u32 - 1 }, power)
    }
}

/// The axes of a rotation, maybe with a mirror; `None` where it stretches or shears.
fn rigid(t: &DAffine3) -> Option<[DVec3; 3]> {
    let m = t.matrix3;
    let off = (m.transpose() * m - DMat3::IDENTITY).to_cols_array();
    let fits = t.is_finite() && off.iter().all(|v| v.abs() < 1e-3);
    fits.then(|| [m.x_axis, m.y_axis, m.z_axis].map(DVec3::normalize))
}
