//! The built scene: scaled to the unit sphere, traversable, with its emitters and its sensor.

mod build;
mod chart;
mod check;
mod curvature;
mod inverse;
mod light;
mod media;
mod media_build;
mod shape;
mod surface;
mod tangents;
mod uv;
mod warnings;

pub use crate::error::SceneError;
pub use crate::normalisation::{Ball, Normalisation};
pub use crate::vertex::{NO_EMITTER, SurfacePoint};
pub use chart::Chart;
pub use light::{DirectSample, EmissionSample, NextDensity};
pub use media::Flight;
pub use shape::Shape;
pub(crate) use shape::{AreaSample, ShapeKind};

use crate::bsdf::{Bsdf, Here, Resolved, Textures, memo};
use crate::description::FilmDescription;
use crate::emitter::Emitters;
use crate::geometry::Accel;
use crate::sensor::Sensor;

/// A scene ready for light transport. Immutable; every integrator shares it.
pub struct Scene {
    accel: Accel,
    shapes: Vec<Shape>,
    /// Shape of each primitive.
    prim_shape: Vec<u32>,
    materials: Vec<Bsdf>,
    /// Of each material, where it has some.
    textures: Vec<Option<Textures>>,
    /// Materials for which the azimuth of the shading frame matters.
    tangents: Vec<bool>,
    /// Tells it from every other scene of the process.
    id: u64,
    emitters: Emitters,
    sensor: Sensor,
    film: FilmDescription,
    normalisation: Normalisation,
    warnings: Vec<String>,
    /// None in most scenes, and then nothing is asked of it.
    volumes: Option<Box<media::Volumes>>,
}

impl Scene {
    /// Film size, crop and filter that the scene asks for.
    pub fn film(&self) -> &FilmDescription {
        &self.film
    }

    /// The sensor.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// The emitters.
    pub fn emitters(&self) -> &Emitters {
        &self.emitters
    }

    /// The surfaces.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// How world units were normalised.
    pub fn normalisation(&self) -> Normalisation {
        self.normalisation
    }

    /// What cannot come out right in this scene because its numbers are too far apart for f32: one
    /// sentence each, with the name of the shape or sensor and the ratio. Empty for most scenes.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What beams from infinity cover.
    #[inline]
    pub fn ball(&self) -> &Ball {
        self.emitters.ball()
    }

    /// The tree.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// The scattering model at a point. Textures are looked up once for each hit: what they make of
    /// the model is kept for connections, densities and weights ([`crate::bsdf::Resolved`]).
    #[inline]
    pub fn bsdf(&self, point: &SurfacePoint) -> Resolved<'_> {
        let model = &self.materials[point.material as usize];
        match &self.textures[point.material as usize] {
            None => Resolved::Constant(model),
            Some(textures) => {
                let key = memo::Key::new(self.id, point.prim, point.p);
                let make = || {
                    let tangents = &|| self.tangents(point);
                    textures.resolve(model, &Here { uv: self.uv(point), tangents })
                };
                Resolved::Here(memo::resolved(key, make))
            }
        }
    }

    /// True where a material varies over its surface.
    pub fn has_textures(&self) -> bool {
        self.textures.iter().any(Option::is_some)
    }

    /// The scattering models.
    pub fn materials(&self) -> &[Bsdf] {
        &self.materials
    }
}
