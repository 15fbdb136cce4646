//! Elements: cells of the charts of all surfaces, one for each side that emits or reflects.

use std::collections::HashMap;

use glam::DVec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::{Bsdf, Opaque, Resolved};
use pathspace_core::color::Rgb;
use pathspace_core::scene::{Chart, SurfacePoint};

use super::grid::{Cell, Grid};
use super::{Settings, SolveError};

/// Marks a cell without element.
const NONE: u32 = u32::MAX;
/// Samples along the edge of a cell in its two fine sets; different counts, so that samples of an
/// element and itself never coincide.
pub(super) const FINE: [u32; 2] = [8, 9];
/// Height over a plane, in the normalised scene, up to which rounding of positions and normals to
/// `f32` may put a point of the plane. Whoever takes such a height for a real one sees from one
/// side of a plane to the other.
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
    /// Samples of equal area: of the whole cell while it is being found out what is open,
    /// afterwards of the open part alone.
    pub(super) points: Vec<SurfacePoint>,
    /// Which of them light can reach at all.
    pub(super) open: Vec<bool>,
    /// Which samples of the fine sets light can reach; empty where all of them are open.
    pub(super) fine: [Vec<bool>; 2],
    /// Samples of the whole cell, each with whether light can reach it; empty where all of it is
    /// open.
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

    /// Whether two samples of two elements lie on the side of each other that is meant, by more
    /// than rounding.
    pub(super) fn faces(&self, x: &SurfacePoint, other: &Element, y: &SurfacePoint) -> bool {
        let d = y.p.as_dvec3() - x.p.as_dvec3();
        d.dot(self.normal(x)) > FLAT && -d.dot(other.normal(y)) > FLAT
    }

    /// True where it sends light onwards once it has received some.
    pub(super) fn scatters(&self) -> bool {
        self.emission.is_some() || !self.reflectance.is_black()
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
    /// Cuts every surface into cells of edges about `settings.edge`. `most` bounds the number of
    /// cells.
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
            charts.iter().map(|chart| Grid::new(chart, &charts, h, settings.halvings)).collect();
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
        let model = scene.bsdf(&any);
        if matches!(model, Resolved::Here(_)) {
            let name = &scene.shapes()[chart.shape as usize].name;
            return Err(SolveError::Refused(format!("shape '{name}' has a texture")));
        }
        let [front, back] = reflectances(&model).ok_or_else(|| {
            SolveError::Refused(format!(
                "shape '{}' is not diffuse",
                scene.shapes()[chart.shape as usize].name
            ))
        })?;
        let emission = any.emitter().map(|e| (e, scene.emitters().area_radiance(e)));
        let mut of_cell = [Vec::new(), Vec::new()];
        for cell in grid.cells() {
            let area = chart.area() * cell.share();
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
                of_cell[slot].push(if element.scatters() {
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

    /// The element that is seen at a point of a surface from direction `d` (away from the surface);
    /// `None` where it is black.
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
