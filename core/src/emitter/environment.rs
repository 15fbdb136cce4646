//! An environment map: radiance from an image over all directions.
//!
//! Directions of the map's own space are (sin φ sin θ, cos θ, −cos φ sin θ), φ = 2πu, θ = πv, as in
//! Mitsuba. Columns are samples at u = (i + ½)/W, without a seam; rows are samples at v = j/(H −
//! 1), so that the first and the last one are the poles. Between samples the radiance is bilinear
//! in (u, v).
//!
//! Sampling picks a cell between four samples, first its row, then its column, and in it a
//! direction uniform in solid angle: the density P(cell)/Ω(cell) needs no sin θ and is exact at the
//! poles and at the seam. Running sums are whole multiples of 2⁻²⁴, the grid of the numbers of
//! primary sample space, so that each cell has exactly its probability.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use crate::color::Rgb;
use crate::measure::{Density, SolidAngle};
use crate::texture::Bitmap;

/// Steps of the grid of random numbers.
const GRID: f64 = (1 << 24) as f64;

/// Share of the probability that every column of a row has alike: dark cells beside a sun stay
/// samplable.
const UNIFORM_COLUMNS: f64 = 0.05;

/// The same for rows.
const UNIFORM_ROWS: f64 = 0.01;

/// Largest width and height.
pub(crate) const MAX_SIZE: u32 = 1 << 15;

/// An environment map, built.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    bitmap: Arc<Bitmap>,
    scale: f32,
    /// World → own space; a rotation, maybe with a mirror.
    to_own: DMat3,
    /// Rows of cells.
    rows: usize,
    /// Columns of cells.
    columns: usize,
    /// cos θ of the borders between rows, from 1 to −1.
    cos: Vec<f64>,
    /// Running sum over rows in units of 2⁻²⁴.
    row_sums: Vec<u32>,
    /// Running sums over the columns of each row, `columns + 1` for each.
    column_sums: Vec<u32>,
    mean: Rgb,
}

/// A cell and the place in it, both coordinates in [0, 1).
#[derive(Clone, Copy, Debug)]
struct Place {
    row: usize,
    column: usize,
    x: f64,
    y: f64,
}

impl Environment {
    /// Builds the map; `to_world` must be orthonormal, the image within [`MAX_SIZE`] and without
    /// negative texels.
    pub(crate) fn new(bitmap: Arc<Bitmap>, to_world: DMat3, scale: f32) -> Self {
        let (columns, rows) = (bitmap.width() as usize, (bitmap.height() as usize - 1).max(1));
        let cos: Vec<f64> = (0..=rows).map(|j| cos_of_half_turns(j as f64 / rows as f64)).collect();
        let mut map = Environment {
            bitmap,
            scale,
            to_own: to_world.transpose(),
            rows,
            columns,
            cos,
            row_sums: Vec::new(),
            column_sums: Vec::with_capacity(rows * (columns + 1)),
            mean: Rgb::BLACK,
        };
        let mut row_weights = Vec::with_capacity(rows);
        let mut mean = [0.0; 3];
        for row in 0..rows {
            // The mean of the four corners: 0 only where the cell is black.
            let column_weights: Vec<f64> = (0..columns)
                .map(|column| {
                    let corners = map.corners(row, column);
                    let sum = (corners[0] + corners[1]) + (corners[2] + corners[3]);
                    for c in 0..3 {
                        mean[c] += f64::from(sum[c]) * 0.25 * map.cell_area(row);
                    }
                    f64::from(sum.mean())
                })
                .collect();
            row_weights.push(column_weights.iter().sum::<f64>() * map.cell_area(row));
            map.column_sums.extend(grid_sums(&column_weights, UNIFORM_COLUMNS));
        }
        map.row_sums = grid_sums(&row_weights, UNIFORM_ROWS);
        map.mean = Rgb::from(mean.map(|m| (m / (4.0 * PI)) as f32)) * map.scale;
        map
    }

    /// Radiance from a unit direction `to` (towards the environment).
    pub fn radiance(&self, to: Vec3) -> Rgb {
        let place = self.place(to);
        let [a, b, c, d] = self.corners(place.row, place.column);
        let x = place.x as f32;
        // In the row the radiance is linear in θ; cells are divided by cos θ.
        let y = self.theta_fraction(to, place.row) as f32;
        let (upper, lower) = (a * (1.0 - x) + b * x, c * (1.0 - x) + d * x);
        (upper * (1.0 - y) + lower * y) * self.scale
    }

    /// Mean radiance over all directions.
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// A direction towards the environment.
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        let (row, y) = pick(&self.row_sums, u[0]);
        let (column, x) = pick(self.columns_of(row), u[1]);
        let phi = TAU * (column as f64 + 0.5 + x) / self.columns as f64;
        let cos = self.cos[row] + (self.cos[row + 1] - self.cos[row]) * y;
        // From the nearer pole, so that sin θ keeps its digits there.
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        let own = DVec3::new(phi.sin() * sin, cos, -phi.cos() * sin);
        (self.to_own.transpose() * own).normalize().as_vec3()
    }

    /// Density of [`Environment::sample`].
    pub fn pdf(&self, to: Vec3) -> Density<SolidAngle> {
        let place = self.place(to);
        let mass = |sums: &[u32], i: usize| f64::from(sums[i + 1] - sums[i]) / GRID;
        let cell = mass(&self.row_sums, place.row) * mass(self.columns_of(place.row), place.column);
        Density::new(cell / self.cell_area(place.row))
    }

    /// The numbers by which [`Environment::sample`] makes a direction; `None` where there are none.
    pub(crate) fn invert(&self, to: Vec3) -> Option<[f32; 2]> {
        let place = self.place(to);
        Some([
            unpick(&self.row_sums, place.row, place.y)?,
            unpick(self.columns_of(place.row), place.column, place.x)?,
        ])
    }

    fn columns_of(&self, row: usize) -> &[u32] {
        let n = self.columns + 1;
        &self.column_sums[row * n..(row + 1) * n]
    }

    /// Solid angle of each cell of a row.
    fn cell_area(&self, row: usize) -> f64 {
        TAU / self.columns as f64 * (self.cos[row] - self.cos[row + 1])
    }

    /// Samples at the corners: left and right of the row above, left and right of the row below.
    fn corners(&self, row: usize, column: usize) -> [Rgb; 4] {
        let right = if column + 1 == self.columns { 0 } else { column + 1 };
        let below = (row + 1).min(self.bitmap.height() as usize - 1);
        let at = |x: usize, y: usize| self.bitmap.texel(x as u32, y as u32);
        [at(column, row), at(right, row), at(column, below), at(right, below)]
    }

    fn own(&self, to: Vec3) -> DVec3 {
        self.to_own * to.as_dvec3()
    }

    /// θ in units of rows, less the row.
    fn theta_fraction(&self, to: Vec3, row: usize) -> f64 {
        let d = self.own(to);
        (d.x.hypot(d.z).atan2(d.y) / PI * self.rows as f64 - row as f64).clamp(0.0, 1.0)
    }

    fn place(&self, to: Vec3) -> Place {
        let d = self.own(to);
        let theta = d.x.hypot(d.z).atan2(d.y) / PI * self.rows as f64;
        let row = (theta as usize).min(self.rows - 1);
        let turn = d.x.atan2(-d.z) / TAU * self.columns as f64 - 0.5;
        let turn = turn.rem_euclid(self.columns as f64);
        let column = (turn as usize).min(self.columns - 1);
        let (top, bottom) = (self.cos[row], self.cos[row + 1]);
        let cos = d.y / d.length();
        let y = ((top - cos) / (top - bottom)).clamp(0.0, 1.0);
        Place { row, column, x: (turn - column as f64).clamp(0.0, 1.0), y }
    }
}

/// cos πx, exactly 0 and ±1 where it is.
fn cos_of_half_turns(x: f64) -> f64 {
    if x <= 0.25 {
        (PI * x).cos()
    } else if x < 0.75 {
        -(PI * (x - 0.5)).sin()
    } else {
        -(PI * (1.0 - x)).cos()
    }
}

/// Running sums from 0 to 2²⁴ of probabilities in proportion to weights, a share of them uniform.
fn grid_sums(weights: &[f64], uniform: f64) -> Vec<u32> {
    let total: f64 = weights.iter().sum();
    let (uniform, by_weight) =
        if total > 0.0 { (uniform, (1.0 - uniform) / total) } else { (1.0, 0.0) };
    let each = uniform / weights.len() as f64;
    let mut sum = 0.0;
    let mut sums = Vec::with_capacity(weights.len() + 1);
    sums.push(0);
    for w in weights {
        sum += each + w * by_weight;
        sums.push((sum * GRID).round().min(GRID) as u32);
    }
    if let Some(last) = sums.last_mut() {
        *last = 1 << 24;
    }
    sums
}

/// The interval that a number lies in, and where in it.
fn pick(sums: &[u32], u: f32) -> (usize, f64) {
    let k = (f64::from(u) * GRID) as u32;
    let i = sums.partition_point(|s| *s <= k).clamp(1, sums.len() - 1) - 1;
    let (low, high) = (sums[i], sums[i + 1]);
    // The middle of the step, so that the mean of the places is that of the interval.
    (i, (f64::from(k - low) + 0.5) / f64::from(high - low))
}

/// A number for which [`pick`] gives the interval and the step that `x` lies in.
fn unpick(sums: &[u32], i: usize, x: f64) -> Option<f32> {
    let (low, high) = (sums[i], sums[i + 1]);
    let steps = f64::from(high - low);
    (high > low).then(|| ((f64::from(low) + (x * steps).floor().min(steps - 1.0)) / GRID) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn ramp() -> Arc<Bitmap> {
        let texel = |x: u32, y: u32| [(x + 1) as f32, (y + 1) as f32, 1.0];
        let data = (0..4).flat_map(|y| (0..8).flat_map(move |x| texel(x, y))).collect();
        Arc::new(Bitmap::from_floats(8, 4, 3, data).unwrap())
    }

    fn at(u: f64, v: f64) -> Vec3 {
        let ((sp, cp), (st, ct)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
        DVec3::new(sp * st, ct, -cp * st).as_vec3()
    }

    /// The numbers are those of Mitsuba 3.9.1 for the same image.
    #[test]
    fn radiance_is_that_of_mitsuba() {
        let map = Environment::new(ramp(), DMat3::IDENTITY, 1.0);
        for ((u, v), expected) in [
            ((0.0625, 0.125), [1.0, 1.375]),
            ((0.0, 0.5), [4.5, 2.5]),
            ((0.25, 0.5), [2.5, 2.5]),
            ((0.999, 0.5), [4.556, 2.5]),
            ((0.3, 0.01), [2.9, 1.03]),
            ((0.3, 0.99), [2.9, 3.97]),
            ((0.3, 0.4), [2.9, 2.2]),
        ] {
            let c = map.radiance(at(u, v));
            assert!((c.r - expected[0]).abs() < 1e-4, "({u}, {v}): {c:?}");
            assert!((c.g - expected[1]).abs() < 1e-4, "({u}, {v}): {c:?}");
        }
        let turned = DMat3::from_axis_angle(DVec3::Y, PI / 2.0);
        let map = Environment::new(ramp(), turned, 2.0);
        assert!((map.radiance(Vec3::X).r - 9.0).abs() < 1e-4);
    }

    /// ∫ L dω by sampling is the mean that is told, and the density integrates to 1.
    #[test]
    fn samples_integrate_the_radiance_and_the_density() {
        let turned = DMat3::from_quat(DQuat::from_rotation_z(0.7));
        let mirrored = turned * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        for to_world in [turned, mirrored] {
            let map = Environment::new(ramp(), to_world, 1.5);
            let mut random = Pcg64Mcg::seed_from_u64(3);
            let (mut light, mut inverse) = (0.0, 0.0);
            let n = 200_000;
            for _ in 0..n {
                let d = map.sample([random.random(), random.random()]);
                light += f64::from(map.radiance(d).r) / map.pdf(d).value();
                inverse += 1.0 / map.pdf(d).value();
            }
            let (light, inverse) = (light / f64::from(n), inverse / f64::from(n));
            assert!((inverse / (4.0 * PI) - 1.0).abs() < 0.005, "{inverse}");
            // The mean of cells is a little different from the mean of bilinear patches.
            let mean = f64::from(map.mean().r) * 4.0 * PI;
            assert!((light / mean - 1.0).abs() < 0.01, "{light} {mean}");
        }
    }

    #[test]
    fn the_inverse_gives_back_the_direction() {
        let map = Environment::new(ramp(), DMat3::from_axis_angle(DVec3::X, 1.0), 1.0);
        let mut random = Pcg64Mcg::seed_from_u64(4);
        for _ in 0..10_000 {
            let u = [random.random(), random.random()];
            let d = map.sample(u);
            let again = map.sample(map.invert(d).unwrap());
            assert!((d - again).length() < 1e-5, "{u:?}: {d} {again}");
        }
    }

    #[test]
    fn every_cell_of_a_map_with_a_sun_can_be_sampled() {
        let mut data = vec![1e-3; 512 * 256];
        data[100 * 512 + 300] = 1e6;
        let bitmap = Bitmap::from_floats(512, 256, 1, data).unwrap();
        let map = Environment::new(Arc::new(bitmap), DMat3::IDENTITY, 1.0);
        assert!(map.row_sums.windows(2).all(|w| w[0] < w[1]));
        for row in 0..map.rows {
            assert!(map.columns_of(row).windows(2).all(|w| w[0] < w[1]), "row {row}");
        }
    }

    #[test]
    fn the_smallest_images_are_maps() {
        for (w, h) in [(1, 1), (1, 2), (2, 1), (3, 2)] {
            let bitmap = Bitmap::from_floats(w, h, 1, vec![2.0; (w * h) as usize]).unwrap();
            let map = Environment::new(Arc::new(bitmap), DMat3::IDENTITY, 1.0);
            for d in [Vec3::Y, -Vec3::Y, Vec3::X, -Vec3::Z, Vec3::Z] {
                assert_eq!(map.radiance(d), Rgb::grey(2.0));
                assert!(map.pdf(d).value() > 0.0);
            }
            assert!((map.mean().r - 2.0).abs() < 1e-5);
        }
    }
}
