//! How charts are cut into cells.

use glam::DVec3;
use pathspace_core::scene::Chart;

/// Cosine (sine) below which directions count as at right angles (parallel).
const ALIGNED: f64 = 1e-4;
/// Share of a chart's side below which no line is drawn beside another one.
const APART: f64 = 1e-3;

/// A cell in chart coordinates: a rectangle, or a triangle in a triangular chart.
#[derive(Clone, Copy, Debug)]
pub(super) enum Cell {
    Square {
        origin: [f64; 2],
        size: [f64; 2],
    },
    /// Corner and signed edge length of a triangle similar to the chart, turned by half a turn
    /// where it is negative.
    Triangle {
        origin: [f64; 2],
        size: f64,
    },
}

impl Cell {
    /// Chart coordinates of the point (x, y) of the unit square, equal areas to equal areas.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match *self {
            Cell::Square { origin, size } => [origin[0] + x * size[0], origin[1] + y * size[1]],
            Cell::Triangle { origin, size } => {
                let r = x.sqrt();
                [origin[0] + size * r * (1.0 - y), origin[1] + size * r * y]
            }
        }
    }

    /// Its area over that of the chart.
    pub(super) fn share(&self) -> f64 {
        match *self {
            Cell::Square { size: [w, h], .. } => w * h,
            Cell::Triangle { size, .. } => size * size,
        }
    }

    pub(super) fn corners(&self) -> Vec<[f64; 2]> {
        match *self {
            Cell::Square { origin: [x, y], size: [w, h] } => {
                vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
            }
            Cell::Triangle { origin: [x, y], size } => {
                vec![[x, y], [x + size, y], [x, y + size]]
            }
        }
    }
}

/// A stretch of a side of a chart, cut into cells of one size.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    from: f64,
    to: f64,
    cells: u32,
}

/// How a chart is cut into cells.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Stretches along u and v, from 0 to 1; along the edges, one, for a triangle.
    stretches: [Vec<Stretch>; 2],
    triangle: bool,
}

impl Grid {
    /// Cells of edges up to about `h`, each halved so often. What hangs close over a rectangle,
    /// nearer than `h`, and along its sides puts its outline into the grid: below it hardly any
    /// light arrives, and the mean of a cell over both sides of the outline is that of neither.
    pub(super) fn new(chart: &Chart, all: &[Chart], h: f64, halvings: u32) -> Self {
        let extent = chart.extent();
        let lines = if is_rectangle(chart) { outlines(chart, all, h) } else { Default::default() };
        // A turn needs corners enough to be round.
        let least = [if chart.is_periodic() { 6 } else { 1 }, 1];
        let stretches = [0, 1].map(|side: usize| {
            let ends = lines[side].iter().copied().chain([1.0]);
            let starts = [0.0].into_iter().chain(lines[side].iter().copied());
            let stretch = |(from, to): (f64, f64)| {
                // Not one cell more for what rounding makes of a whole number.
                let cells = ((to - from) * extent[side] / h - 1e-9).ceil();
                let cells = (cells.clamp(1.0, 1e6) as u64).max(least[side]);
                let cells = cells.saturating_mul(1 << halvings.min(20)).min(1 << 31);
                Stretch { from, to, cells: cells as u32 }
            };
            starts.zip(ends).map(stretch).collect()
        });
        Grid { stretches, triangle: chart.is_triangle() }
    }

    fn counts(&self) -> [u64; 2] {
        [0, 1].map(|side: usize| self.stretches[side].iter().map(|s| u64::from(s.cells)).sum())
    }

    pub(super) fn len(&self) -> u64 {
        let [u, v] = self.counts();
        u.saturating_mul(v)
    }

    pub(super) fn cells(&self) -> Vec<Cell> {
        if self.triangle {
            return self.triangles();
        }
        // Origin and size of each cell along a side.
        let [us, vs] = [0, 1].map(|side: usize| {
            let of_stretch = |s: &Stretch| {
                let (from, size) = (s.from, (s.to - s.from) / f64::from(s.cells));
                (0..s.cells).map(move |i| (from + f64::from(i) * size, size))
            };
            self.stretches[side].iter().flat_map(of_stretch).collect::<Vec<_>>()
        });
        let row = |&(y, height): &(f64, f64)| {
            let cell = move |&(x, width): &(f64, f64)| Cell::Square {
                origin: [x, y],
                size: [width, height],
            };
            us.iter().map(cell).collect::<Vec<_>>()
        };
        vs.iter().flat_map(row).collect()
    }

    fn triangles(&self) -> Vec<Cell> {
        let [n, _] = self.counts();
        let n = n as u32;
        let size = 1.0 / f64::from(n);
        // Square (i, j) of the lower half holds an upright triangle and, but on the diagonal, one
        // turned by half a turn; the squares above the diagonal hold the latter.
        let cell = |i: u32, j: u32| {
            if i + j < n {
                Cell::Triangle { origin: [f64::from(i) * size, f64::from(j) * size], size }
            } else {
                let (a, b) = (f64::from(n - 1 - i), f64::from(n - 1 - j));
                Cell::Triangle { origin: [(a + 1.0) * size, (b + 1.0) * size], size: -size }
            }
        };
        (0..n).flat_map(|j| (0..n).map(move |i| cell(i, j))).collect()
    }

    /// Number of the cell that holds a point of the chart.
    pub(super) fn find(&self, [u, v]: [f64; 2]) -> usize {
        let (i, x) = index(&self.stretches[0], u);
        let (j, y) = index(&self.stretches[1], v);
        let nu = self.counts()[0] as usize;
        let at = |i: usize, j: usize| j * nu + i;
        if !self.triangle {
            return at(i, j);
        }
        let turned = x + y > 1.0 && i + j + 2 <= nu;
        if turned { at(nu - 1 - i, nu - 1 - j) } else { at(i, j.min(nu - 1 - i.min(nu - 1))) }
    }
}

/// Cell along a side that holds a coordinate, and how far into it.
fn index(stretches: &[Stretch], x: f64) -> (usize, f64) {
    let which = stretches.partition_point(|s| s.to <= x).min(stretches.len() - 1);
    let before: usize = stretches[..which].iter().map(|s| s.cells as usize).sum();
    let s = &stretches[which];
    let place = (x - s.from) / (s.to - s.from) * f64::from(s.cells);
    let i = (place as usize).min(s.cells as usize - 1);
    (before + i, place - i as f64)
}

/// Origin and sides of an affine chart.
fn sides(chart: &Chart) -> [DVec3; 3] {
    let o = chart.position([0.0, 0.0]);
    [o, chart.position([1.0, 0.0]) - o, chart.position([0.0, 1.0]) - o]
}

fn is_rectangle(chart: &Chart) -> bool {
    let [_, u, v] = sides(chart);
    chart.is_affine() && !chart.is_triangle() && aligned(u, v, true)
}

/// Whether two vectors are at right angles, or parallel.
fn aligned(a: DVec3, b: DVec3, right: bool) -> bool {
    let [a, b] = [a.normalize_or_zero(), b.normalize_or_zero()];
    if right { a.dot(b).abs() < ALIGNED } else { a.cross(b).length() < ALIGNED }
}

/// Coordinates u and v, rising, of the outlines of rectangles within `h` of this one whose sides
/// are parallel to its own.
fn outlines(chart: &Chart, all: &[Chart], h: f64) -> [Vec<f64>; 2] {
    let [o, u, v] = sides(chart);
    let n = u.cross(v).normalize_or_zero();
    let mut lines = [Vec::new(), Vec::new()];
    for other in all.iter().filter(|other| is_rectangle(other)) {
        let [p, a, b] = sides(other);
        let along = aligned(a, u, false) && aligned(b, v, false);
        let across = aligned(a, v, false) && aligned(b, u, false);
        let height = (p - o).dot(n).abs();
        // What lies in the plane itself covers it and has cells of its own.
        let close = height > super::elements::FLAT && height < h;
        let corners = [chart.locate(p.as_vec3()), chart.locate((p + a + b).as_vec3())];
        let overlaps = (0..2).all(|side| (corners[0][side] - corners[1][side]).abs() > APART);
        if (along || across) && close && overlaps {
            for corner in corners {
                lines[0].push(corner[0]);
                lines[1].push(corner[1]);
            }
        }
    }
    for lines in &mut lines {
        lines.retain(|x| (APART..1.0 - APART).contains(x));
        lines.sort_by(f64::total_cmp);
        lines.dedup_by(|x, y| *x - *y < APART);
    }
    lines
}
