//! Elements: cells of the charts of all surfaces, one for each side that emits or reflects.

use std::collections::HashMap;

use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::{Bsdf, Opaque};
use pathspace_core::color::Rgb;
use pathspace_core::scene::{Chart, SurfacePoint};

use super::{Settings, SolveError};

/// Marks a cell without element.
const NONE: u32 = u32::MAX;
/// Samples along the edge of a cell in its two fine sets; different counts, so that samples of an element and itself never
/// coincide.
pub(super) const FINE: [u32; 2] = [8, 9];
/// Height over a plane, in the normalised scene, up to which rounding of positions and normals to `f32` may put a point of the
/// plane. Whoever takes such a height for a real one sees from one side of a plane to the other.
pub(super) const FLAT: f64 = 1e-6;

/// A cell of a chart on one side of the surface, with constant radiosity on its open part.
#[derive(Clone, Debug)]
pub struct Element {
    /// Index of the chart.
    pub chart: u32,
    /// 1 on the side of n_g, −1 behind.
    pub side: f32,
    /// Reflectance ρ per channel.
    pub reflectance: Rgb,
    /// Area emitter and its radiance L_e.
    pub emission: Option<(u32, Rgb)>,
    /// Area of the whole cell in the normalised scene.
    pub area: f64,
    /// Radius of the cell about its first-to-last middle.
    pub(super) radius: f64,
    pub(super) center: DVec3,
    /// Samples of equal area: of the whole cell while it is being found out what is open, afterwards of the open part alone.
    pub(super) points: Vec<SurfacePoint>,
    /// Which of them light can reach at all.
    pub(super) open: Vec<bool>,
    /// Which samples of the fine sets light can reach; empty where all of them are open.
    pub(super) fine: [Vec<bool>; 2],
    /// Samples of the whole cell, each with whether light can reach it; empty where all of it is open.
    pub(super) cover: Vec<(SurfacePoint, bool)>,
    /// Area of the open part over that of the cell.
    pub(super) share: f64,
    /// Corners, counter-clockwise or not, where the cell is flat.
    pub(super) polygon: Vec<DVec3>,
    cell: Cell,
}

impl Element {
    /// Unit normal of the side at a sample.
    pub(super) fn normal(&self, sample: &SurfacePoint) -> DVec3 {
        sample.n_g.as_dvec3() * f64::from(self.side)
    }

    /// Area of the part that light can reach.
    pub fn open_area(&self) -> f64 {
        self.area * self.share
    }

    /// Whether two samples of two elements lie on the side of each other that is meant, by more than rounding.
    pub(super) fn faces(&self, x: &SurfacePoint, other: &Element, y: &SurfacePoint) -> bool {
        let d = y.p.as_dvec3() - x.p.as_dvec3();
        d.dot(self.normal(x)) > FLAT && -d.dot(other.normal(y)) > FLAT
    }

    /// True where it sends light onwards once it has received some.
    pub(super) fn spreads(&self) -> bool {
        self.emission.is_some() || !self.reflectance.is_black()
    }
}

/// A cell in chart coordinates: a rectangle, or a triangle in a triangular chart.
#[derive(Clone, Copy, Debug)]
enum Cell {
    Square {
        origin: [f64; 2],
        size: [f64; 2],
    },
    /// Corner and signed edge length of a triangle similar to the chart, turned by half a turn where it is negative.
    Triangle {
        origin: [f64; 2],
        size: f64,
    },
}

impl Cell {
    /// Chart coordinates of the point (x, y) of the unit square, equal areas to equal areas.
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match *self {
            Cell::Square { origin, size } => [origin[0] + x * size[0], origin[1] + y * size[1]],
            Cell::Triangle { origin, size } => {
                let r = x.sqrt();
                [origin[0] + size * r * (1.0 - y), origin[1] + size * r * y]
            }
        }
    }

    fn corners(&self) -> Vec<[f64; 2]> {
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

/// How a chart is cut into cells.
#[derive(Clone, Copy, Debug)]
struct Grid {
    /// Cells along u and v; along the edges for a triangle.
    counts: [u32; 2],
    triangle: bool,
}

impl Grid {
    fn new(chart: &Chart, h: f64, halvings: u32) -> Self {
        let count = |length: f64| (length / h).ceil().clamp(1.0, 1e6) as u32;
        let [u, v] = chart.extent();
        // A turn needs corners enough to be round.
        let least = if chart.is_periodic() { 6 } else { 1 };
        let counts = [count(u).max(least), count(v)];
        let halved = |count: u32| u64::from(count).saturating_mul(1 << halvings.min(20));
        let counts = counts.map(|count| halved(count).min(1 << 31) as u32);
        Grid { counts, triangle: chart.is_triangle() }
    }

    fn len(&self) -> u64 {
        u64::from(self.counts[0]) * u64::from(self.counts[1])
    }

    fn cells(&self) -> Vec<Cell> {
        let [nu, nv] = self.counts;
        let mut cells = Vec::with_capacity(self.len() as usize);
        for j in 0..nv {
            for i in 0..nu {
                let (x, y) = (f64::from(i), f64::from(j));
                if !self.triangle {
                    let size = [1.0 / f64::from(nu), 1.0 / f64::from(nv)];
                    cells.push(Cell::Square { origin: [x * size[0], y * size[1]], size });
                    continue;
                }
                // Square (i, j) of the lower half holds an upright triangle and, but on the diagonal, one turned by half a
                // turn; the squares above the diagonal hold the latter.
                let size = 1.0 / f64::from(nu);
                cells.push(if i + j < nu {
                    Cell::Triangle { origin: [x * size, y * size], size }
                } else {
                    let (a, b) = (f64::from(nu - 1 - i), f64::from(nu - 1 - j));
                    Cell::Triangle { origin: [(a + 1.0) * size, (b + 1.0) * size], size: -size }
                });
            }
        }
        cells
    }

    /// Number of the cell that holds a point of the chart.
    fn find(&self, [u, v]: [f64; 2]) -> usize {
        let [nu, nv] = self.counts;
        let index = |x: f64, n: u32| ((x * f64::from(n)) as u32).min(n - 1);
        let (i, j) = (index(u, nu), index(v, nv));
        let at = |i: u32, j: u32| (j * nu + i) as usize;
        if !self.triangle {
            return at(i, j);
        }
        let rest = u * f64::from(nu) - f64::from(i) + v * f64::from(nu) - f64::from(j);
        let turned = rest > 1.0 && i + j + 2 <= nu;
        if turned { at(nu - 1 - i, nu - 1 - j) } else { at(i, j.min(nu - 1 - i.min(nu - 1))) }
    }
}

/// All elements of a scene.
pub struct Mesh {
    /// The elements.
    pub elements: Vec<Element>,
    charts: Vec<Chart>,
    grids: Vec<Grid>,
    /// Chart of each primitive that begins one, and of the second half of a parallelogram.
    of_prim: HashMap<u32, u32>,
    /// Element of each cell in front and behind, by chart.
    of_cell: Vec<[Vec<u32>; 2]>,
}

impl Mesh {
    /// Cuts every surface into cells of edges about `settings.edge`. `most` bounds the number of cells.
    pub(super) fn new(scene: &Scene, settings: &Settings, most: u64) -> Result<Mesh, SolveError> {
        if let Some(shape) = scene.shapes().iter().find(|shape| !scene.is_faceted(shape)) {
            return Err(SolveError::Refused(format!(
                "shape '{}' has shading normals other than its own",
                shape.name
            )));
        }
        let charts = scene.charts();
        let h = settings.edge(scene);
        let grids: Vec<Grid> =
            charts.iter().map(|chart| Grid::new(chart, h, settings.halvings)).collect();
        let cells = grids.iter().map(Grid::len).fold(0, u64::saturating_add);
        if cells > most {
            return Err(SolveError::TooLarge { elements: cells, most });
        }
        let mut mesh = Mesh {
            elements: Vec::new(),
            of_prim: HashMap::new(),
            of_cell: Vec::with_capacity(charts.len()),
            charts,
            grids,
        };
        for index in 0..mesh.charts.len() {
            mesh.add(scene, index, settings.samples)?;
        }
        Ok(mesh)
    }

    fn add(&mut self, scene: &Scene, index: usize, samples: u32) -> Result<(), SolveError> {
        let (chart, grid) = (&self.charts[index], &self.grids[index]);
        self.of_prim.insert(chart.prim, index as u32);
        if chart.is_affine() && !chart.is_triangle() {
            self.of_prim.insert(chart.prim + 1, index as u32);
        }
        let any = scene.chart_point(chart, [0.25, 0.25]);
        let [front, back] = reflectances(scene.bsdf(&any)).ok_or_else(|| {
            SolveError::Refused(format!(
                "shape '{}' is not diffuse",
                scene.shapes()[chart.shape as usize].name
            ))
        })?;
        let emission = any.emitter().map(|e| (e, scene.emitters().area_radiance(e)));
        let area = chart.area() / grid.len() as f64;
        let mut of_cell = [Vec::new(), Vec::new()];
        for cell in grid.cells() {
            let place = |x: u32| (f64::from(x) + 0.5) / f64::from(samples);
            let squares = (0..samples).flat_map(|i| (0..samples).map(move |j| (i, j)));
            let points: Vec<SurfacePoint> = squares
                .map(|(i, j)| scene.chart_point(chart, cell.at([place(i), place(j)])))
                .collect();
            let corners: Vec<DVec3> =
                cell.corners().into_iter().map(|c| chart.position(c)).collect();
            let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let radius = corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max);
            let polygon = if chart.is_affine() { corners } else { Vec::new() };
            let sides = [(1.0, front, emission), (-1.0, back, None)];
            for (slot, (side, reflectance, emission)) in sides.into_iter().enumerate() {
                let element = Element {
                    chart: index as u32,
                    side,
                    reflectance,
                    emission,
                    area,
                    radius,
                    center,
                    open: vec![false; points.len()],
                    fine: [Vec::new(), Vec::new()],
                    cover: Vec::new(),
                    share: 0.0,
                    points: points.clone(),
                    polygon: polygon.clone(),
                    cell,
                };
                of_cell[slot].push(if element.spreads() {
                    self.elements.push(element);
                    self.elements.len() as u32 - 1
                } else {
                    NONE
                });
            }
        }
        self.of_cell.push(of_cell);
        Ok(())
    }

    /// Leaves out the elements that no light reaches.
    pub(super) fn drop_closed(&mut self) {
        let mut renumbered = vec![NONE; self.elements.len()];
        let mut kept = 0;
        for (old, element) in self.elements.iter().enumerate() {
            if element.share > 0.0 {
                renumbered[old] = kept;
                kept += 1;
            }
        }
        self.elements.retain(|element| element.share > 0.0);
        for slot in self.of_cell.iter_mut().flatten().flatten() {
            if *slot != NONE {
                *slot = renumbered[*slot as usize];
            }
        }
    }

    /// The element that is seen at a point of a surface from direction `d` (away from the surface); `None` where it
    /// is black.
    pub fn find(&self, point: &SurfacePoint, d: glam::Vec3) -> Option<usize> {
        let chart = *self.of_prim.get(&point.prim)? as usize;
        let cell = self.grids[chart].find(self.charts[chart].locate(point.p));
        let slot = usize::from(point.n_g.dot(d) <= 0.0);
        let element = self.of_cell[chart][slot][cell];
        (element != NONE).then_some(element as usize)
    }

    /// The point of a cell that the point (x, y) of the unit square is, equal areas to equal areas.
    pub(super) fn point(&self, scene: &Scene, element: &Element, at: [f64; 2]) -> SurfacePoint {
        scene.chart_point(&self.charts[element.chart as usize], element.cell.at(at))
    }

    /// A fine set of a cell, [`FINE`]² samples of equal area.
    pub(super) fn fine(&self, scene: &Scene, element: &Element, set: usize) -> Vec<SurfacePoint> {
        fine_points(scene, &self.charts[element.chart as usize], &element.cell, FINE[set])
    }
}

/// `count`² samples of a cell, of equal area.
fn fine_points(scene: &Scene, chart: &Chart, cell: &Cell, count: u32) -> Vec<SurfacePoint> {
    let place = |x: u32| (f64::from(x) + 0.5) / f64::from(count);
    let squares = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    squares.map(|(i, j)| scene.chart_point(chart, cell.at([place(i), place(j)]))).collect()
}

/// ρ in front and behind; `None` for anything but Lambert's model.
fn reflectances(bsdf: &Bsdf) -> Option<[Rgb; 2]> {
    match bsdf {
        Bsdf::OneSided(Opaque::Diffuse(front)) => Some([front.reflectance(), Rgb::BLACK]),
        Bsdf::TwoSided { front: Opaque::Diffuse(front), back: Opaque::Diffuse(back) } => {
            Some([front.reflectance(), back.reflectance()])
        }
        _ => None,
    }
}
