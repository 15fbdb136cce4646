//! Surfaces y = h(x, z) over a square.

use glam::{DVec2, DVec3};

use super::mesh::{Corner, Mesh, MeshBuilder};

/// Mesh of y = h(x, z) over [−half, half]² in `cells`² squares of two triangles, facing up, with
/// the normals of the function itself. `surface` gives h and its gradient (∂h/∂x, ∂h/∂z).
pub fn heightfield(half: f64, cells: usize, surface: impl Fn(f64, f64) -> (f64, DVec2)) -> Mesh {
    let mut builder = MeshBuilder::default();
    let place = |i: usize| half * (2.0 * i as f64 / cells as f64 - 1.0);
    let corner = |i: usize, k: usize| {
        let (x, z) = (place(i), place(k));
        let (h, gradient) = surface(x, z);
        Corner { position: DVec3::new(x, h, z), normal: DVec3::new(-gradient.x, 1.0, -gradient.y) }
    };
    for k in 0..cells {
        for i in 0..cells {
            builder.quad([corner(i, k), corner(i, k + 1), corner(i + 1, k + 1), corner(i + 1, k)]);
        }
    }
    builder.build()
}
