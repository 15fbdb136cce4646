//! Triangle meshes as the generators make them, and their OBJ form.

use std::collections::HashMap;
use std::fmt::Write;

use glam::{DVec3, Vec3};

/// A triangle mesh with one shading normal per corner, in the precision in which it is written.
///
/// Positions are welded: two corners at the same place have the same index, so that a mesh is
/// closed exactly if each of its directed edges occurs once and its reverse occurs once.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Welded positions.
    pub positions: Vec<Vec3>,
    /// Unit shading normals.
    pub normals: Vec<Vec3>,
    /// Triangles: per corner an index into `positions` and one into `normals`, counter-clockwise
    /// seen from the side the normals point to.
    pub triangles: Vec<[(u32, u32); 3]>,
}

/// Builds a [`Mesh`] from corners.
#[derive(Default)]
pub struct MeshBuilder {
    mesh: Mesh,
    positions: HashMap<[u32; 3], u32>,
    normals: HashMap<[u32; 3], u32>,
}

/// A corner of a triangle while a mesh is built: position and shading normal.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Position.
    pub position: DVec3,
    /// Shading normal of any length but 0.
    pub normal: DVec3,
}

impl MeshBuilder {
    /// Adds a triangle, counter-clockwise seen from outside; one without three different corners
    /// (at a pole) is left out.
    pub fn triangle(&mut self, corners: [Corner; 3]) {
        let positions = corners.map(|corner| {
            weld(&mut self.positions, &mut self.mesh.positions, corner.position.as_vec3())
        });
        if positions[0] == positions[1]
            || positions[1] == positions[2]
            || positions[2] == positions[0]
        {
            return;
        }
        let normals = corners.map(|corner| {
            let unit = corner.normal.normalize().as_vec3();
            weld(&mut self.normals, &mut self.mesh.normals, unit)
        });
        self.mesh.triangles.push(std::array::from_fn(|i| (positions[i], normals[i])));
    }

    /// Adds two triangles for the corners of a quadrilateral, counter-clockwise from outside.
    pub fn quad(&mut self, [a, b, c, d]: [Corner; 4]) {
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// The finished mesh.
    pub fn build(self) -> Mesh {
        self.mesh
    }
}

/// Index of `value` in `list`, appended if it is new. −0 counts as 0.
fn weld(seen: &mut HashMap<[u32; 3], u32>, list: &mut Vec<Vec3>, value: Vec3) -> u32 {
    let value = value + Vec3::ZERO;
    *seen.entry(value.to_array().map(f32::to_bits)).or_insert_with(|| {
        list.push(value);
        (list.len() - 1) as u32
    })
}

impl Mesh {
    /// The mesh as Wavefront OBJ (`v`, `vn` and `f v//vn` lines). Numbers are the shortest
    /// decimals that read back as the same f32.
    pub fn to_obj(&self) -> String {
        let mut text = String::with_capacity(40 * (self.positions.len() + self.triangles.len()));
        // Writing to a String cannot fail.
        for Vec3 { x, y, z } in &self.positions {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for Vec3 { x, y, z } in &self.normals {
            let _ = writeln!(text, "vn {x} {y} {z}");
        }
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|(v, n)| (v + 1, n + 1));
            let _ = writeln!(text, "f {}//{} {}//{} {}//{}", a.0, a.1, b.0, b.1, c.0, c.1);
        }
        text
    }

    /// Positions of a triangle's corners.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|(v, _)| self.positions[v as usize])
    }

    /// Volume enclosed, ⅙ Σ a·(b×c), positive for a closed mesh whose
    /// triangles face outward.
    pub fn signed_volume(&self) -> f64 {
        (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i).map(Vec3::as_dvec3);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }
}
