//! Closed meshes whose neighbours share corners to the bit.

use glam::{Quat, Vec3};

/// Surface of the cube [−1, 1]³ cut into n × n squares a face, two triangles each, mapped by `f`,
/// which is called with the same bits for the same lattice point; normals point outwards.
pub fn lattice_cube(n: i32, f: impl Fn(Vec3) -> Vec3) -> Vec<[Vec3; 3]> {
    let at = |p: [i32; 3]| f(Vec3::from(p.map(|i| (2 * i - n) as f32 / n as f32)));
    let mut out = Vec::with_capacity(12 * (n * n) as usize);
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let corner = |di: i32, dj: i32| {
                        let mut p = [0; 3];
                        p[axis] = side;
                        p[(axis + 1) % 3] = i + di;
                        p[(axis + 2) % 3] = j + dj;
                        at(p)
                    };
                    let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
                    if side == 0 {
                        out.extend([[a, c, b], [a, d, c]]);
                    } else {
                        out.extend([[a, b, c], [a, c, d]]);
                    }
                }
            }
        }
    }
    out
}

/// Axis-aligned box with half extents (0.5, 0.4, 0.45), n × n squares a face.
pub fn room(n: i32) -> Vec<[Vec3; 3]> {
    lattice_cube(n, |p| p * Vec3::new(0.5, 0.4, 0.45))
}

/// The same box, rotated.
pub fn rotated_room(n: i32) -> Vec<[Vec3; 3]> {
    let q = Quat::from_xyzw(0.3, -0.2, 0.5, 0.8).normalize();
    lattice_cube(n, |p| q * (p * Vec3::new(0.5, 0.4, 0.45)))
}

/// Bumpy sphere of 12 n² triangles, radius about 0.48 to 0.72, star-shaped about the origin.
pub fn blob(n: i32) -> Vec<[Vec3; 3]> {
    lattice_cube(n, |p| {
        let d = p.normalize();
        let bumps = (9.0 * d.x).sin() * (8.0 * d.y).cos() * (7.0 * d.z + 1.0).sin()
            + 0.2 * (41.0 * d.x + 3.0).sin() * (37.0 * d.y).sin() * (43.0 * d.z).cos();
        d * (0.6 + 0.1 * bumps)
    })
}
