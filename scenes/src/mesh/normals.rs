//! Vertex normals for meshes that have none.
//!
//! As Mitsuba 3.9.1 computes them: the sum of the unit normals of the triangles around a vertex,
//! each weighted by its angle there (Thürmer and Wüthrich, "Computing Vertex Normals from
//! Polygonal Facets", 1998), taken in world space, so that a stretching transform counts.

use glam::{DAffine3, DVec3};

use super::RawMesh;

/// Unit normals in the mesh's own space, and how many vertices had to borrow the normal of a
/// triangle because the sum vanishes. (Mitsuba gives these the normal (1, 0, 0).)
pub(super) fn smooth(mesh: &RawMesh, to_world: &DAffine3) -> (Vec<[f32; 3]>, usize) {
    let world: Vec<DVec3> = mesh
        .positions
        .iter()
        .map(|p| to_world.transform_point3(DVec3::from(p.map(f64::from))))
        .collect();
    let mut sums = vec![DVec3::ZERO; world.len()];
    let mut any = vec![DVec3::ZERO; world.len()];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|i| world[i as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        if normal == DVec3::ZERO {
            continue;
        }
        for (i, at) in triangle.iter().enumerate() {
            let to_next = (corners[(i + 1) % 3] - corners[i]).normalize();
            let to_last = (corners[(i + 2) % 3] - corners[i]).normalize();
            sums[*at as usize] += normal * angle(to_next, to_last);
            if any[*at as usize] == DVec3::ZERO {
                any[*at as usize] = normal;
            }
        }
    }
    // A normal n of own space is M⁻ᵀn in the world, so a world normal w is Mᵀw in own space.
    let back = to_world.matrix3.transpose();
    let mut borrowed = 0;
    let normals = sums
        .iter()
        .zip(&any)
        .map(|(sum, any)| {
            // Below this, the sum is what rounding leaves of opposite normals.
            let vanishes = sum.length_squared() < 1e-20;
            borrowed += usize::from(vanishes && *any != DVec3::ZERO);
            let world = if vanishes { *any } else { *sum };
            // Vertices of degenerate triangles only: no triangle that is kept uses them.
            let own = (back * world).try_normalize().unwrap_or(DVec3::Z);
            own.as_vec3().to_array()
        })
        .collect();
    (normals, borrowed)
}

/// Angle between unit vectors, accurate for small and for flat angles.
fn angle(a: DVec3, b: DVec3) -> f64 {
    let cosine = a.dot(b);
    let half = if cosine > 0.0 { (a - b).length() } else { (a + b).length() } / 2.0;
    let small = 2.0 * half.min(1.0).asin();
    if cosine > 0.0 { small } else { std::f64::consts::PI - small }
}
