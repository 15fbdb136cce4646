//! What a scene is before it is built: plain data in world units, as a file reader or a program
//! writes it. [`crate::Scene::new`] turns it into a normalised, traversable [`crate::Scene`].

mod material;

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

pub use material::{
    MaterialDescription, MaterialKind, MicrofacetKind, Parameter, PrincipledKind,
    PrincipledThinKind, ReliefMap, WardVariant,
};

use crate::color::Rgb;
use crate::texture::{Bitmap, Texture};

/// A whole scene in world units.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// Surfaces; emission is a property of the surface.
    pub shapes: Vec<ShapeDescription>,
    /// Scattering models, referred to by index from [`ShapeDescription::material`].
    pub materials: Vec<MaterialDescription>,
    /// Emitters that are not surfaces.
    pub emitters: Vec<EmitterDescription>,
    /// The one sensor of the scene.
    pub sensor: SensorDescription,
    /// The film behind the sensor.
    pub film: FilmDescription,
    /// Participating media and where they are; empty in most scenes.
    pub media: MediaDescription,
}

/// Participating media and the surfaces that bound them.
///
/// A surface that bounds no medium has the same one on both sides. In a scene with media, surfaces
/// of [`MaterialKind::Null`] are no vertices of paths: edges go through them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MediaDescription {
    /// The media, referred to by index.
    pub media: Vec<MediumDescription>,
    /// The shapes that bound them.
    pub boundaries: Vec<BoundaryDescription>,
    /// The medium that the sensor stands in; `None` where it is not said, and boundaries tell.
    pub sensor: Option<usize>,
}

/// A shape between two media.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryDescription {
    /// Index into [`SceneDescription::shapes`].
    pub shape: usize,
    /// The medium on the side away from the normal; `None` is empty space.
    pub interior: Option<usize>,
    /// The medium on the normal's side.
    pub exterior: Option<usize>,
}

/// A medium.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumDescription {
    /// Name for messages.
    pub name: String,
    /// Absorption and scattering.
    pub kind: MediumKind,
    /// Where it scatters to.
    pub phase: PhaseKind,
}

/// How much a medium absorbs and scatters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MediumKind {
    /// The same everywhere.
    Homogeneous {
        /// σ_t per unit of length of the scene, per channel.
        extinction: [f64; 3],
        /// σ_s/σ_t in \[0, 1\].
        albedo: Rgb,
    },
}

/// Phase functions; [`crate::medium::Phase`] has the formulas.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PhaseKind {
    /// The same everywhere.
    Isotropic,
    /// Henyey and Greenstein.
    HenyeyGreenstein {
        /// Mean cosine in (−1, 1).
        g: f64,
    },
    /// Particles far smaller than a wavelength.
    Rayleigh,
    /// A mixture of two.
    Blend {
        /// Share of the second in \[0, 1\].
        weight: f64,
        /// Both.
        pair: Box<[PhaseKind; 2]>,
    },
}

/// One surface.
#[derive(Clone, Debug)]
pub struct ShapeDescription {
    /// Name for messages (the file's id or the shape's type and line).
    pub name: String,
    /// The surface in its own space.
    pub geometry: ShapeGeometry,
    /// Own space → world. Mirrored (negative determinant) transforms are allowed.
    pub to_world: DAffine3,
    /// Turns geometric and shading normals round, and with them the emitting side.
    pub flip_normals: bool,
    /// Index into [`SceneDescription::materials`].
    pub material: usize,
    /// Radiance of a one-sided area emitter: the side the geometric normal points to emits.
    pub emission: Option<Rgb>,
}

/// A surface in its own space.
///
/// Where `to_world` mirrors (negative determinant): the analytic shapes keep their side, their
/// normal is transformed by the inverse transpose; a mesh takes the side from which the
/// *transformed* triangle is counter-clockwise. A reader whose format means something else sets
/// [`ShapeDescription::flip_normals`] or reverses triangles.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum ShapeGeometry {
    /// Triangles.
    Mesh(Arc<MeshData>),
    /// The square [−1,1]² at z = 0, normal +z, ∂p/∂u along +x.
    Rectangle,
    /// The box [−1,1]³ with outward normals. ∂p/∂u is along ±y on the faces ±x and ±z, along x on
    /// the face +y and along z on the face −y (as in Mitsuba 3.9; against the axis on +y and −z).
    Cube,
    /// Sphere with outward normals, ∂p/∂u along (−y, x, 0) from the centre. `to_world` may rotate,
    /// mirror, translate and scale uniformly only.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius > 0.
        radius: f64,
    },
    /// The unit disk at z = 0, normal +z, ∂p/∂u radial.
    Disk,
    /// The side of a right circular cylinder, open at both ends, with outward normals; ∂p/∂u round
    /// the axis. `to_world` may stretch it along its axis, but must keep it right and circular.
    Cylinder {
        /// Centre of one end.
        p0: DVec3,
        /// Centre of the other end.
        p1: DVec3,
        /// Radius > 0.
        radius: f64,
    },
}

/// Triangles with optional shading normals and texture coordinates, one index set for all.
#[derive(Clone, Debug, Default)]
pub struct MeshData {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals per vertex: empty (faceted) or as many as positions; unit length.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates per vertex: empty or as many as positions. Only the direction of
    /// ∂p/∂u matters (anisotropic roughness). Where empty, it is along the triangle's first edge.
    pub uvs: Vec<[f32; 2]>,
    /// Vertex indices, counter-clockwise seen from the side the normal points to.
    pub triangles: Vec<[u32; 3]>,
}

/// Emitters that are not surfaces, in world units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum EmitterDescription {
    /// Isotropic point light.
    Point {
        /// Position.
        position: DVec3,
        /// Radiant intensity in W·sr⁻¹.
        intensity: Rgb,
    },
    /// Point light in a cone.
    Spot {
        /// Own space → world: a rotation, maybe with a mirror, and a translation. The cone is about
        /// +z.
        to_world: DAffine3,
        /// The cone.
        shape: SpotDescription,
    },
    /// An image thrown from a point.
    Projector {
        /// Own space → world: a rotation, maybe with a mirror, and a translation. The image is
        /// about +z.
        to_world: DAffine3,
        /// The image.
        shape: ProjectorDescription,
    },
    /// Parallel light.
    Directional {
        /// Direction in which the light travels; need not be normalised.
        direction: DVec3,
        /// Irradiance on a plane across the direction, W·m⁻².
        irradiance: Rgb,
    },
    /// The same radiance from everywhere.
    Constant {
        /// Radiance.
        radiance: Rgb,
    },
    /// Radiance from an image over all directions; see [`crate::emitter::Environment`] for how it
    /// lies.
    Environment {
        /// Radiance.
        bitmap: Arc<Bitmap>,
        /// The map's own directions → world: orthonormal, mirrors allowed.
        to_world: DMat3,
        /// Factor on the radiance, ≥ 0.
        scale: f32,
    },
}

/// The sensor in world units.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorDescription {
    /// Camera space → world. In camera space the view is along +z, +y is up and +x is to the *left*
    /// of the image, as in Mitsuba.
    pub to_world: DAffine3,
    /// Full horizontal angle of view in degrees (fov_axis is resolved by the reader with the size
    /// of the whole film, crop ignored).
    pub fov_x_degrees: f64,
    /// Radius of the lens; 0 is a pinhole.
    pub aperture_radius: f64,
    /// Distance of the plane in focus along +z; used where `aperture_radius` > 0.
    pub focus_distance: f64,
    /// Shift of the principal point as a fraction of the film's width and height, Mitsuba's
    /// `principal_point_offset_x/y`.
    pub principal_point_offset: [f64; 2],
}

impl Default for SensorDescription {
    fn default() -> Self {
        SensorDescription {
            to_world: DAffine3::IDENTITY,
            fov_x_degrees: 45.0,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            principal_point_offset: [0.0, 0.0],
        }
    }
}

/// The cone of a spot light.
#[derive(Clone, Debug, PartialEq)]
pub struct SpotDescription {
    /// Radiant intensity in W·sr⁻¹ within the beam.
    pub intensity: Rgb,
    /// Angle between axis and border, under 90.
    pub cutoff_degrees: f64,
    /// Angle from which the intensity falls, linearly with the angle, to 0 at the border.
    pub beam_degrees: f64,
    /// A factor over the square about the cone, (½, ½) on the axis.
    pub texture: Option<Arc<Texture>>,
}

/// The image of a projector.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectorDescription {
    /// Radiant exitance of a white diffuse wall at distance 1 across the axis, over (u, v).
    pub irradiance: Arc<Texture>,
    /// Width over height.
    pub aspect: f64,
    /// Horizontal angle of view in degrees.
    pub fov_x_degrees: f64,
    /// Factor on the image.
    pub scale: f32,
}

/// Film size, crop window and reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmDescription {
    /// Width of the whole film in pixels.
    pub width: u32,
    /// Height of the whole film in pixels.
    pub height: u32,
    /// Window that is rendered.
    pub crop: Crop,
    /// Reconstruction filter.
    pub filter: FilterKind,
}

impl FilmDescription {
    /// A film without crop and with the box filter.
    pub fn new(width: u32, height: u32) -> Self {
        let crop = Crop { x: 0, y: 0, width, height };
        FilmDescription { width, height, crop, filter: FilterKind::Box }
    }
}

impl Default for FilmDescription {
    fn default() -> Self {
        FilmDescription::new(256, 256)
    }
}

/// Most pixels of a film: beyond it sums would not fit the memory of a workstation.
const MAX_FILM_PIXELS: u64 = 1 << 28;
/// Longest side of a film, in pixels: image files and viewers end here.
const MAX_FILM_SIDE: u32 = 1 << 16;

impl FilmDescription {
    /// What makes it impossible, in words; `None` where nothing does. Nothing is allocated for it.
    pub fn problem(&self) -> Option<String> {
        let (width, height) = (self.width, self.height);
        let crop = self.crop;
        if width == 0 || height == 0 {
            return Some(format!("size {width}×{height} has no pixel"));
        }
        if width > MAX_FILM_SIDE || height > MAX_FILM_SIDE {
            return Some(format!("size {width}×{height} has a side over {MAX_FILM_SIDE} pixels"));
        }
        if u64::from(width) * u64::from(height) > MAX_FILM_PIXELS {
            return Some(format!("size {width}×{height} is over 2²⁸ pixels"));
        }
        let within = |origin: u32, n: u32, all: u32| {
            n > 0 && u64::from(origin) + u64::from(n) <= u64::from(all)
        };
        if !within(crop.x, crop.width, width) || !within(crop.y, crop.height, height) {
            return Some(format!(
                "crop window {}×{} at ({}, {}) is not within {width}×{height}",
                crop.width, crop.height, crop.x, crop.y
            ));
        }
        let positive = match self.filter {
            FilterKind::Box => true,
            FilterKind::Tent { radius } => radius > 0.0 && radius <= 64.0,
            FilterKind::Gaussian { stddev } => stddev > 0.0 && stddev <= 16.0,
        };
        (!positive).then(|| format!("filter {:?} has no valid width", self.filter))
    }
}

/// A window of the film in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Crop {
    /// Left column.
    pub x: u32,
    /// Top row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Reconstruction filters h(x)·h(y), each normalised to unit integral; lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterKind {
    /// 1 on [−½, ½).
    Box,
    /// max(0, 1 − |x|/radius).
    Tent {
        /// Half width, 1 by default.
        radius: f64,
    },
    /// max(0, exp(−x²/2σ²) − exp(−(4σ)²/2σ²)), cut at 4σ.
    Gaussian {
        /// Standard deviation σ, 0.5 by default.
        stddev: f64,
    },
}
