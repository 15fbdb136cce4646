//! Light vertices in a grid, found by distance.

use pathspace::core::glam::{IVec3, Vec3};
use pathspace::core::walk::WalkVertex;

/// A light vertex that can be merged with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Photon {
    p: Vec3,
    cell: IVec3,
    /// Index of its light subpath.
    pub path: u32,
    /// Index in that subpath, from 1.
    pub vertex: u32,
}

/// A hashed grid of cells with the side 2r, so that a ball of radius r meets eight at most.
///
/// Photons lie in the order of their buckets and, within a bucket, in that of the light subpaths:
/// what a query gives does not depend on threads.
pub(crate) struct PhotonGrid {
    radius: f32,
    /// First photon of each bucket, and the end.
    starts: Vec<u32>,
    photons: Vec<Photon>,
}

impl PhotonGrid {
    /// All vertices of `light` that merge.
    pub(crate) fn new(light: &[Vec<WalkVertex>], radius: f32) -> Self {
        let mut all = Vec::new();
        for (path, subpath) in light.iter().enumerate() {
            for (vertex, v) in subpath.iter().enumerate() {
                // It may have gone on by a specular component: a merge ends it here.
                if vertex > 0
                    && v.connectible
                    && let Some(p) = v.vertex.position()
                {
                    let cell = cell_of(p, radius);
                    all.push(Photon { p, cell, path: path as u32, vertex: vertex as u32 });
                }
            }
        }
        // Counting sort by bucket, stable.
        let buckets = all.len().next_power_of_two();
        let mut starts = vec![0_u32; buckets + 1];
        for photon in &all {
            starts[bucket(photon.cell, buckets) + 1] += 1;
        }
        for b in 0..buckets {
            starts[b + 1] += starts[b];
        }
        let mut next = starts.clone();
        let mut photons = all.clone();
        for photon in &all {
            let slot = &mut next[bucket(photon.cell, buckets)];
            photons[*slot as usize] = *photon;
            *slot += 1;
        }
        PhotonGrid { radius, starts, photons }
    }

    /// Calls `f` for every photon within the radius of `p`.
    #[inline]
    pub(crate) fn within(&self, p: Vec3, mut f: impl FnMut(&Photon)) {
        let buckets = self.starts.len() - 1;
        let (lo, hi) =
            (cell_of(p - self.radius, self.radius), cell_of(p + self.radius, self.radius));
        let squared = self.radius * self.radius;
        for z in lo.z..=hi.z {
            for y in lo.y..=hi.y {
                for x in lo.x..=hi.x {
                    let cell = IVec3::new(x, y, z);
                    let b = bucket(cell, buckets);
                    let range = self.starts[b] as usize..self.starts[b + 1] as usize;
                    // Cells may share a bucket: a photon is met in its own cell only.
                    for photon in &self.photons[range] {
                        if photon.cell == cell && photon.p.distance_squared(p) <= squared {
                            f(photon);
                        }
                    }
                }
            }
        }
    }
}

/// The scene is a unit ball and the radius at least 10⁻⁷: cells fit into `i32`.
#[inline]
fn cell_of(p: Vec3, radius: f32) -> IVec3 {
    (p / (2.0 * radius)).floor().as_ivec3()
}

/// Bucket of a cell; `buckets` is a power of two.
#[inline]
fn bucket(cell: IVec3, buckets: usize) -> usize {
    // Primes of Teschner et al. 2003.
    let (x, y, z) = (cell.x as u32, cell.y as u32, cell.z as u32);
    let hash = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
    (hash ^ (hash >> 15)) as usize & (buckets - 1)
}

#[cfg(test)]
mod tests {
    use pathspace::core::measure::Density;
    use pathspace::core::path::Vertex;
    use pathspace::core::random::{Address, PrimarySample, RandomStream};

    use super::*;

    #[test]
    fn a_query_gives_exactly_the_photons_within_the_radius_once_each() {
        let mut u = RandomStream::new(Address { seed: 1, step: 0, item: 0 });
        let mut point = |scale: f32| Vec3::from([0; 3].map(|_| (u.next() - 0.5) * scale));
        // Few cells and many photons, then many cells with collisions.
        for (scale, radius) in [(0.5, 0.2), (2.0, 0.05), (2.0, 0.01)] {
            let vertices = (0..2001).map(|_| {
                let sensor = Vertex::Sensor { p: point(scale), n: Vec3::Z };
                WalkVertex::first(sensor, Density::new(1.0))
            });
            let light = [vertices.collect::<Vec<_>>()];
            let grid = PhotonGrid::new(&light, radius);
            let mut met = 0;
            for _ in 0..500 {
                let p = point(scale);
                let mut found = Vec::new();
                grid.within(p, |photon| found.push(photon.vertex));
                found.sort_unstable();
                let near = |v: &WalkVertex| {
                    let q = v.vertex.position().unwrap();
                    q.distance_squared(p) <= radius * radius
                };
                let expected: Vec<u32> =
                    (1..2001).filter(|i| near(&light[0][*i as usize])).collect();
                assert_eq!(found, expected, "radius {radius}");
                met += found.len();
            }
            assert!(met > 0, "radius {radius}");
        }
    }
}
