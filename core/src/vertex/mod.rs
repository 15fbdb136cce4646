//! Vertices of paths, and points on surfaces among them.

mod surface;

pub use surface::{NO_EMITTER, SurfacePoint};

use glam::Vec3;

use crate::math::Ray;
use crate::measure::{Edge, End};
use crate::medium::MediumPoint;

/// A vertex of a light transport path x̄ = x₀x₁…x_k, x₀ on an emitter, x_k on the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Vertex {
    /// A surface; as x₀ it is a point of an area emitter.
    Surface(SurfacePoint),
    /// A point in a medium; its measure is volume.
    Medium(MediumPoint),
    /// x₀ on a point emitter.
    PointEmitter {
        /// Index of the emitter.
        emitter: u32,
        /// Position.
        p: Vec3,
    },
    /// x₀ at infinity.
    InfiniteEmitter {
        /// Index of the emitter.
        emitter: u32,
        /// Unit direction towards it.
        to: Vec3,
    },
    /// x_k on the lens.
    Sensor {
        /// Position on the lens.
        p: Vec3,
        /// Axis of view, unit length.
        n: Vec3,
    },
}

impl Vertex {
    /// Position; `None` at infinity.
    #[inline]
    pub fn position(&self) -> Option<Vec3> {
        match self {
            Vertex::Surface(s) => Some(s.p),
            Vertex::Medium(m) => Some(m.p),
            Vertex::PointEmitter { p, .. } | Vertex::Sensor { p, .. } => Some(*p),
            Vertex::InfiniteEmitter { .. } => None,
        }
    }

    /// The vertex as the end of an edge.
    #[inline]
    pub fn end(&self) -> End {
        match self {
            Vertex::Surface(s) => s.end(),
            Vertex::Medium(m) => End::Point { p: m.p },
            Vertex::PointEmitter { p, .. } => End::Point { p: *p },
            Vertex::InfiniteEmitter { to, .. } => End::Infinite { to: *to },
            Vertex::Sensor { p, n } => End::Surface { p: *p, n: *n },
        }
    }

    /// The edge from this vertex to another.
    #[inline]
    pub fn edge_to(&self, other: &Vertex) -> Edge {
        Edge::new(&self.end(), &other.end())
    }

    /// Unit direction towards this vertex from `p`.
    #[inline]
    pub fn direction_from(&self, p: Vec3) -> Vec3 {
        match self {
            Vertex::InfiniteEmitter { to, .. } => *to,
            _ => (self.position().unwrap_or(p) - p).normalize_or_zero(),
        }
    }

    /// The surface point, if it is one.
    #[inline]
    pub fn surface(&self) -> Option<&SurfacePoint> {
        match self {
            Vertex::Surface(s) => Some(s),
            _ => None,
        }
    }

    /// Index of the emitter that this vertex lies on.
    #[inline]
    pub fn emitter(&self) -> Option<u32> {
        match self {
            Vertex::Surface(s) => s.emitter(),
            Vertex::PointEmitter { emitter, .. } | Vertex::InfiniteEmitter { emitter, .. } => {
                Some(*emitter)
            }
            Vertex::Medium(_) | Vertex::Sensor { .. } => None,
        }
    }

    /// The unbounded ray that leaves a scattering vertex in direction `d`; `None` at other
    /// vertices.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Option<Ray> {
        match self {
            Vertex::Surface(point) => Some(point.spawn(d)),
            Vertex::Medium(point) => Some(Ray::new(point.p, d)),
            _ => None,
        }
    }

    /// True where light scatters: on a surface or in a medium.
    #[inline]
    pub fn scatters(&self) -> bool {
        matches!(self, Vertex::Surface(_) | Vertex::Medium(_))
    }
}
