//! Surfaces of revolution about the y axis.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::mesh::{Corner, Mesh, MeshBuilder};

/// The curve (r, y) that is turned about the y axis, in smooth sections.
///
/// The surface's outside is to the right of the direction of travel, that is at (dy, −dr): a
/// body's profile runs from its lower pole outward and up to its upper pole, a cavity's the other
/// way. Sections that follow each other share a point and may have different normals there.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    sections: Vec<Vec<ProfilePoint>>,
}

#[derive(Clone, Copy, Debug)]
struct ProfilePoint {
    /// (r, y).
    position: DVec2,
    /// Outward, unit, in the same plane.
    normal: DVec2,
}

/// Radii below this are on the axis.
const ON_AXIS: f64 = 1e-9;

/// Ends of sections nearer than this are one point.
const SAME_POINT: f64 = 1e-9;

impl Profile {
    /// A profile without sections.
    pub fn new() -> Self {
        Profile::default()
    }

    /// Adds a straight section.
    pub fn line(mut self, from: (f64, f64), to: (f64, f64)) -> Self {
        let (from, to) = (DVec2::from(from), DVec2::from(to));
        let normal = outward(to - from);
        self.push(vec![
            ProfilePoint { position: from, normal },
            ProfilePoint { position: to, normal },
        ]);
        self
    }

    /// Appends a section. Where it meets the end of the one before, or closes the loop to the
    /// start of the first, it takes that point's very numbers, so that no crack is left.
    fn push(&mut self, mut section: Vec<ProfilePoint>) {
        let end = self.sections.last().and_then(|previous| previous.last()).copied();
        meet(section.first_mut(), end);
        let start = self.sections.first().unwrap_or(&section).first().copied();
        meet(section.last_mut(), start);
        self.sections.push(section);
    }

    /// Adds the smooth section t ↦ (r, y), t ∈ \[0, 1\], in `pieces` pieces. The normals are those
    /// of the curve itself, so it must be defined a little beyond both ends as well. An end on the
    /// axis becomes a smooth pole.
    pub fn curve(mut self, pieces: usize, curve: impl Fn(f64) -> (f64, f64)) -> Self {
        const H: f64 = 1e-6;
        let point = |i: usize| {
            let t = i as f64 / pieces as f64;
            let mut position = DVec2::from(curve(t));
            let mut normal = outward(DVec2::from(curve(t + H)) - DVec2::from(curve(t - H)));
            if position.x.abs() < ON_AXIS {
                position.x = 0.0;
                normal = DVec2::new(0.0, normal.y.signum());
            }
            ProfilePoint { position, normal }
        };
        self.push((0..=pieces).map(point).collect());
        self
    }

    /// Adds the arc about `center` from angle `from` to `to` (radians from +r towards +y).
    pub fn arc(
        self,
        center: (f64, f64),
        radius: f64,
        (from, to): (f64, f64),
        pieces: usize,
    ) -> Self {
        self.curve(pieces, |t| {
            let (sin, cos) = (from + t * (to - from)).sin_cos();
            (center.0 + radius * cos, center.1 + radius * sin)
        })
    }

    /// Turns the profile about the y axis in `segments` steps.
    pub fn revolve(&self, segments: usize) -> Mesh {
        let mut builder = MeshBuilder::default();
        self.revolve_into(segments, &mut builder);
        builder.build()
    }

    /// As [`Profile::revolve`], into a mesh that may have other parts.
    pub fn revolve_into(&self, segments: usize, builder: &mut MeshBuilder) {
        // The last step meets the first at the very same numbers.
        let turns: Vec<(f64, f64)> =
            (0..segments).map(|j| (TAU * j as f64 / segments as f64).sin_cos()).collect();
        let corner = |point: ProfilePoint, j: usize| {
            let (sin, cos) = turns[j % segments];
            let turn = |v: DVec2| DVec3::new(v.x * cos, v.y, v.x * sin);
            Corner { position: turn(point.position), normal: turn(point.normal) }
        };
        for section in &self.sections {
            for pair in section.windows(2) {
                let (p, q) = (pair[0], pair[1]);
                for j in 0..segments {
                    let next = j + 1;
                    builder.quad([corner(p, j), corner(q, j), corner(q, next), corner(p, next)]);
                }
            }
        }
    }
}

/// Normal to the right of the direction of travel.
fn outward(direction: DVec2) -> DVec2 {
    DVec2::new(direction.y, -direction.x).normalize()
}

/// Moves `point` to `neighbour` if they are the same point but for rounding.
fn meet(point: Option<&mut ProfilePoint>, neighbour: Option<ProfilePoint>) {
    if let (Some(point), Some(neighbour)) = (point, neighbour)
        && point.position.distance(neighbour.position) < SAME_POINT
    {
        point.position = neighbour.position;
    }
}
