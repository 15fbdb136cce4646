//! What f32 cannot hold: shapes that are small beside their distance from the origin, films finer
//! than directions, beams that are too wide.

use glam::DVec3;

use super::build::for_each_bound;
use super::{Ball, Normalisation, SceneError};
use crate::description::SceneDescription;
use crate::emitter::Emitter;
use crate::sensor::Sensor;

/// Distance between f32 coordinates in parts of the coordinate, at the most.
const SPACING: f64 = 1.0 / 8_388_608.0;

/// Shapes narrower than one spacing are refused: no point can be told from another.
const LEAST_SPACINGS: f64 = 1.0;

/// Shapes that are fewer spacings wide than this are warned about.
const SPACINGS: f64 = 1000.0;

/// Pixels that are fewer spacings of directions wide than this are warned about.
const DIRECTIONS: f64 = 4.0;

/// Beams from infinity are sampled by 24 bits: shapes smaller than this part of the beam are warned
/// about.
const BEAM: f64 = 1e-5;

/// A shape's name and size in the normalised scene.
struct Size<'a> {
    name: &'a str,
    /// Longest side of its bounds.
    width: f64,
    /// Largest coordinate of its middle.
    place: f64,
}

impl Size<'_> {
    /// Width in spacings of coordinates where the shape lies.
    fn spacings(&self) -> f64 {
        self.width / (self.place * SPACING)
    }
}

/// Sizes of all shapes.
pub(super) struct Sizes<'a>(Vec<Size<'a>>);

impl<'a> Sizes<'a> {
    pub(super) fn of(description: &'a SceneDescription, n: Normalisation) -> Self {
        let shapes = description.shapes.iter().map(|s| {
            let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for_each_bound(s, &mut |p, r| {
                let p = (p - n.center) * n.scale;
                let r = DVec3::splat(r * n.scale);
                (lo, hi) = (lo.min(p - r), hi.max(p + r));
            });
            let (width, place) = ((hi - lo).max_element(), ((lo + hi) * 0.5).abs().max_element());
            Size { name: &s.name, width, place }
        });
        Sizes(shapes.collect())
    }

    /// # Errors
    /// The first shape that is narrower than the spacing of coordinates where it lies.
    pub(super) fn check(&self) -> Result<(), SceneError> {
        match self.0.iter().find(|s| s.spacings() < LEAST_SPACINGS) {
            Some(s) => Err(SceneError::Shape {
                shape: s.name.to_owned(),
                problem: format!(
                    "is only {:.3} times as wide as the spacing of f32 coordinates at its place",
                    s.spacings()
                ),
            }),
            None => Ok(()),
        }
    }

    pub(super) fn warnings(
        &self,
        sensor: &Sensor,
        emitters: &[Emitter],
        ball: &Ball,
    ) -> Vec<String> {
        let mut out = Vec::new();
        for s in &self.0 {
            let spacings = s.spacings();
            if spacings < SPACINGS {
                out.push(format!(
                    "shape '{}': it is only {spacings:.3} times as wide as the spacing of f32 coordinates at \
                     its place; points on it are off by 1/{spacings:.3} of its width",
                    s.name
                ));
            }
        }
        let directions = sensor.pixel_angle() / SPACING;
        if directions < DIRECTIONS {
            out.push(format!(
                "sensor: a pixel is only {directions:.3} times as wide as the spacing of f32 directions; \
                 details of the image are blurred"
            ));
        }
        let beams = emitters.iter().any(Emitter::is_far);
        let narrow = self.0.iter().min_by(|a, b| a.width.total_cmp(&b.width));
        if let Some(s) = narrow.filter(|s| beams && s.width < BEAM * f64::from(ball.radius)) {
            out.push(format!(
                "shape '{}': the beam of light from infinity covers all shapes and is {:.3e} times as wide; \
                 light subpaths hardly ever find this one",
                s.name,
                2.0 * f64::from(ball.radius) / s.width
            ));
        }
        out
    }
}
