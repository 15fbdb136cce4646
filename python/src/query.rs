//! Queries on arrays, for integrators written in NumPy: to teach and to try ideas, not for speed.
//!
//! Lengths and positions are those of the normalised scene (its bounding sphere has radius 1 about
//! the origin), directions are unit vectors that point away from the surface, densities are per
//! solid angle at the point that asks.

use std::sync::Arc;

use numpy::{
    AllowTypeChange, PyArray1, PyArray2, PyArrayLike2, PyArrayMethods, PyReadonlyArray1,
    PyUntypedArrayMethods,
};
use pathspace::core::Scene as World;
use pathspace::core::bsdf::TransportMode;
use pathspace::core::glam::Vec3;
use pathspace::core::math::Ray;
use pathspace::core::measure::{Density, Edge, End};
use pathspace::core::path::Vertex;
use pathspace::core::scene::SurfacePoint;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::scene::Scene;

type Triples<'py> = PyArrayLike2<'py, f32, AllowTypeChange>;
type Rows<'py> = Bound<'py, PyArray2<f32>>;
type Column<'py, T> = Bound<'py, PyArray1<T>>;

/// Direction, radiance, density, whether no ray meets it, whether nothing is in between.
type Sampled = ([f32; 3], [f32; 3], f64, bool, bool);

/// Rows of `N` numbers.
fn rows<const N: usize>(array: &Triples<'_>, what: &str) -> PyResult<Vec<[f32; N]>> {
    if array.shape()[1] != N {
        let shape = array.shape();
        return Err(PyValueError::new_err(format!("{what} has shape {shape:?}, not (n, {N})")));
    }
    let rows = array.as_array();
    Ok(rows.outer_iter().map(|row| std::array::from_fn(|c| row[c])).collect())
}

fn of_length<T>(rows: Vec<T>, count: usize, what: &str) -> PyResult<Vec<T>> {
    match rows.len() == count {
        true => Ok(rows),
        false => {
            let text = format!("{what} has {} rows, there are {count} rays", rows.len());
            Err(PyValueError::new_err(text))
        }
    }
}

fn triples<'py>(py: Python<'py>, rows: impl IntoIterator<Item = [f32; 3]>) -> PyResult<Rows<'py>> {
    let flat: Vec<f32> = rows.into_iter().flatten().collect();
    let count = flat.len() / 3;
    PyArray1::from_vec(py, flat).reshape([count, 3])
}

fn column<'py, T: numpy::Element>(
    py: Python<'py>,
    values: impl IntoIterator<Item = T>,
) -> Column<'py, T> {
    PyArray1::from_vec(py, values.into_iter().collect())
}

/// Camera rays through points of the film: `(film (n, 2), o (n, 3), d (n, 3))`.
///
/// `pixels` are numbers of pixels of the crop window, row by row; `u` (n, 4) in [0, 1) are the
/// place in the pixel and on the lens. The rays are distributed as W_e |cos θ|, so that a pixel is
/// the mean of the radiance they carry.
#[pyfunction]
pub(crate) fn sample_sensor<'py>(
    py: Python<'py>,
    scene: &Scene,
    pixels: PyReadonlyArray1<'py, i64>,
    u: Triples<'py>,
) -> PyResult<(Rows<'py>, Rows<'py>, Rows<'py>)> {
    let crop = scene.world.film().crop;
    let count = i64::from(crop.width) * i64::from(crop.height);
    let pixels: Vec<i64> = pixels.as_array().iter().copied().collect();
    let u = of_length(rows::<4>(&u, "u")?, pixels.len(), "u")?;
    if let Some(bad) = pixels.iter().find(|p| !(0..count).contains(*p)) {
        return Err(PyValueError::new_err(format!("there is no pixel {bad}, they are {count}")));
    }
    let sampled = py.detach(|| {
        let sample = |(p, u): (&i64, &[f32; 4])| {
            let (x, y) = (*p as u32 % crop.width, *p as u32 / crop.width);
            let pixel = Some([crop.x + x, crop.y + y]);
            scene.world.sensor().sample(pixel, [u[0], u[1]], [u[2], u[3]])
        };
        pixels.par_iter().zip(&u).map(sample).collect::<Vec<_>>()
    });
    let film: Vec<f32> = sampled.iter().flat_map(|s| s.film.to_array()).collect();
    Ok((
        PyArray1::from_vec(py, film).reshape([sampled.len(), 2])?,
        triples(py, sampled.iter().map(|s| s.ray.o.to_array()))?,
        triples(py, sampled.iter().map(|s| s.ray.d.to_array()))?,
    ))
}

/// The closest surface along each ray. A ray of direction 0 meets nothing.
#[pyfunction]
pub(crate) fn intersect(
    py: Python<'_>,
    scene: &Scene,
    o: Triples<'_>,
    d: Triples<'_>,
) -> PyResult<Hits> {
    let o = rows::<3>(&o, "o")?;
    let d = of_length(rows::<3>(&d, "d")?, o.len(), "d")?;
    let world = Arc::clone(&scene.world);
    let points = py.detach(|| {
        let hit = |(o, d): (&[f32; 3], &[f32; 3])| {
            world.intersect(&Ray::new(Vec3::from_array(*o), Vec3::from_array(*d)))
        };
        o.par_iter().zip(&d).map(hit).collect()
    });
    Ok(Hits { world, points, d })
}

/// Points where rays met surfaces, one for each ray.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Hits {
    world: Arc<World>,
    points: Vec<Option<SurfacePoint>>,
    d: Vec<[f32; 3]>,
}

/// Points on emitters, sampled for the points that asked, one for each.
#[pyclass(frozen, module = "pathspace._native")]
pub struct Lights {
    /// Unit directions towards the emitters (n, 3); 0 where no sample was made.
    #[pyo3(get)]
    d: Py<PyArray2<f32>>,
    /// Radiance that arrives where nothing is in between (n, 3); of point and directional lights,
    /// intensity/r² and irradiance.
    #[pyo3(get)]
    radiance: Py<PyArray2<f32>>,
    /// Density per solid angle at the point that asked, choice of emitter included; of point and
    /// directional lights the probability of the choice.
    #[pyo3(get)]
    pdf: Py<PyArray1<f64>>,
    /// True for point and directional lights, which no ray meets.
    #[pyo3(get)]
    delta: Py<PyArray1<bool>>,
    /// V: true where nothing is in between.
    #[pyo3(get)]
    visible: Py<PyArray1<bool>>,
}

#[pymethods]
impl Hits {
    fn __len__(&self) -> usize {
        self.points.len()
    }

    /// True where a surface was met (n,).
    #[getter]
    fn hit<'py>(&self, py: Python<'py>) -> Column<'py, bool> {
        column(py, self.points.iter().map(Option::is_some))
    }

    /// Positions (n, 3).
    #[getter]
    fn p<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        self.each(py, |p| p.p)
    }

    /// Geometric normals (n, 3).
    #[getter]
    fn n_g<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        self.each(py, |p| p.n_g)
    }

    /// Shading normals (n, 3).
    #[getter]
    fn n_s<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        self.each(py, |p| p.frame.n)
    }

    /// Index of the scattering model, −1 without a hit (n,).
    #[getter]
    fn material<'py>(&self, py: Python<'py>) -> Column<'py, i64> {
        column(py, self.points.iter().map(|p| p.map_or(-1, |p| i64::from(p.material))))
    }

    /// Radiance that is emitted back along each ray: by the surface, or by the surroundings where
    /// there is none (n, 3).
    #[getter]
    fn radiance<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        let back = self.points.iter().zip(&self.d).map(|(point, d)| match point {
            Some(p) => self.world.emitted(p, -Vec3::from_array(*d)).to_array(),
            None if *d == [0.0; 3] => [0.0; 3],
            None => self.world.emitters().background_radiance(Vec3::from_array(*d)).to_array(),
        });
        triples(py, back)
    }

    /// The closest surfaces in directions `d` (n, 3) from the points: rays that do not meet their
    /// own surface again.
    fn trace(&self, py: Python<'_>, d: Triples<'_>) -> PyResult<Hits> {
        let d = of_length(rows::<3>(&d, "d")?, self.points.len(), "d")?;
        let world = Arc::clone(&self.world);
        let points = py.detach(|| {
            let hit = |(point, d): (&Option<SurfacePoint>, &[f32; 3])| {
                world.intersect(&point.as_ref()?.spawn(Vec3::from_array(*d)))
            };
            self.points.par_iter().zip(&d).map(hit).collect()
        });
        // From where there is no point no ray leaves.
        let left = |(point, d): (&Option<SurfacePoint>, [f32; 3])| point.map_or([0.0; 3], |_| d);
        let d = self.points.iter().zip(d).map(left).collect();
        Ok(Hits { world, points, d })
    }

    /// f(ω_o, ω_i) in 1/sr without cosine, specular components left out (n, 3).
    fn bsdf_eval<'py>(
        &self,
        py: Python<'py>,
        wo: Triples<'py>,
        wi: Triples<'py>,
    ) -> PyResult<Rows<'py>> {
        let values = self.scattered(py, &wo, &wi, |world, point, wo, wi| {
            world.bsdf(point).eval(wo, wi, TransportMode::Radiance).to_array()
        })?;
        triples(py, values.into_iter().map(|v| v.unwrap_or_default()))
    }

    /// Density per solid angle with which `bsdf_sample` takes `wi` by a component that is not
    /// specular (n,).
    fn bsdf_pdf<'py>(
        &self,
        py: Python<'py>,
        wo: Triples<'py>,
        wi: Triples<'py>,
    ) -> PyResult<Column<'py, f64>> {
        let values =
            self.scattered(py, &wo, &wi, |world, p, wo, wi| world.bsdf(p).pdf(wo, wi).value())?;
        Ok(column(py, values.into_iter().map(Option::unwrap_or_default)))
    }

    /// Samples directions with `u` (n, 3) in [0, 1): `(wi (n, 3), weight (n, 3), pdf (n,), specular
    /// (n,))`.
    ///
    /// `weight` is f |cos θ_i|/p, `pdf` is per solid angle, 0 of specular components. Where nothing
    /// is scattered, all are 0.
    #[allow(clippy::type_complexity)]
    fn bsdf_sample<'py>(
        &self,
        py: Python<'py>,
        wo: Triples<'py>,
        u: Triples<'py>,
    ) -> PyResult<(Rows<'py>, Rows<'py>, Column<'py, f64>, Column<'py, bool>)> {
        let u = rows::<3>(&u, "u")?;
        let u = of_length(u, self.points.len(), "u")?;
        let wo = of_length(rows::<3>(&wo, "wo")?, self.points.len(), "wo")?;
        let sampled: Vec<([f32; 3], [f32; 3], f64, bool)> = py.detach(|| {
            let sample = |((point, wo), u): ((&Option<SurfacePoint>, &[f32; 3]), &[f32; 3])| {
                let none = ([0.0; 3], [0.0; 3], 0.0, false);
                let Some(p) = point else { return none };
                let (frame, bsdf) = (&p.frame, self.world.bsdf(p));
                let wo = frame.to_local(Vec3::from_array(*wo));
                let Some(s) = bsdf.sample(wo, u[0], [u[1], u[2]], TransportMode::Radiance) else {
                    return none;
                };
                let specular = s.event().is_specular();
                let pdf = if specular { 0.0 } else { bsdf.pdf(wo, s.wi).value() };
                (frame.to_world(s.wi).to_array(), s.weight.to_array(), pdf, specular)
            };
            self.points.par_iter().zip(&wo).zip(&u).map(sample).collect()
        });
        Ok((
            triples(py, sampled.iter().map(|s| s.0))?,
            triples(py, sampled.iter().map(|s| s.1))?,
            column(py, sampled.iter().map(|s| s.2)),
            column(py, sampled.iter().map(|s| s.3)),
        ))
    }

    /// Samples a point on an emitter for each point, with `u` (n, 3) in [0, 1).
    fn sample_emitters(&self, py: Python<'_>, u: Triples<'_>) -> PyResult<Lights> {
        let u = of_length(rows::<3>(&u, "u")?, self.points.len(), "u")?;
        let none = ([0.0; 3], [0.0; 3], 0.0, false, false);
        let sampled: Vec<Sampled> = py.detach(|| {
            let sample = |(point, u): (&Option<SurfacePoint>, &[f32; 3])| {
                let Some(p) = point else { return none };
                let Some(light) = self.world.sample_direct(p.p, u[0], [u[1], u[2]]) else {
                    return none;
                };
                let delta = self.world.emitters().get(light.emitter).is_delta();
                let edge = Edge::new(&End::Point { p: p.p }, &light.vertex.end());
                // What turns a density per solid angle into one of the emitter's own measure: |cos
                // θ|/r², 1 at infinity.
                let jacobian = edge.to_area(Density::new(1.0)).value();
                let visible = self.world.visible(&Vertex::Surface(*p), &light.vertex);
                let (radiance, pdf) = match delta {
                    true => (light.radiance * jacobian as f32, light.pdf.value()),
                    false if jacobian > 0.0 => (light.radiance, light.pdf.value() / jacobian),
                    false => return none,
                };
                (edge.direction().to_array(), radiance.to_array(), pdf, delta, visible)
            };
            self.points.par_iter().zip(&u).map(sample).collect()
        });
        Ok(Lights {
            d: triples(py, sampled.iter().map(|s| s.0))?.unbind(),
            radiance: triples(py, sampled.iter().map(|s| s.1))?.unbind(),
            pdf: column(py, sampled.iter().map(|s| s.2)).unbind(),
            delta: column(py, sampled.iter().map(|s| s.3)).unbind(),
            visible: column(py, sampled.iter().map(|s| s.4)).unbind(),
        })
    }

    /// Density per solid angle with which `sample_emitters` at the points of `before` would have
    /// taken the rays that made these hits; 0 where they met no emitter (n,).
    fn emitters_pdf<'py>(&self, py: Python<'py>, before: &Hits) -> PyResult<Column<'py, f64>> {
        if before.points.len() != self.points.len() {
            return Err(PyValueError::new_err("the points before are as many as the hits"));
        }
        let densities: Vec<f64> = py.detach(|| {
            let density = |((point, d), from): (
                (&Option<SurfacePoint>, &[f32; 3]),
                &Option<SurfacePoint>,
            )| {
                let Some(from) = from else { return 0.0 };
                let vertex = match point {
                    Some(p) => Vertex::Surface(*p),
                    None => match self.world.emitters().background() {
                        Some(emitter) if *d != [0.0; 3] => {
                            Vertex::InfiniteEmitter { emitter, to: Vec3::from_array(*d) }
                        }
                        _ => return 0.0,
                    },
                };
                let edge = Edge::new(&End::Point { p: from.p }, &vertex.end());
                let jacobian = edge.to_area(Density::new(1.0)).value();
                let area = self.world.pdf_direct(from.p, &vertex).value();
                if jacobian > 0.0 { area / jacobian } else { 0.0 }
            };
            self.points.par_iter().zip(&self.d).zip(&before.points).map(density).collect()
        });
        Ok(column(py, densities))
    }

    /// True where nothing stands between point i here and point i of `others` (n,).
    fn visible<'py>(&self, py: Python<'py>, others: &Hits) -> PyResult<Column<'py, bool>> {
        if others.points.len() != self.points.len() {
            return Err(PyValueError::new_err("both sides have as many points"));
        }
        let seen: Vec<bool> = py.detach(|| {
            let sees = |(a, b): (&Option<SurfacePoint>, &Option<SurfacePoint>)| match (a, b) {
                (Some(a), Some(b)) => {
                    self.world.visible(&Vertex::Surface(*a), &Vertex::Surface(*b))
                }
                _ => false,
            };
            self.points.par_iter().zip(&others.points).map(sees).collect()
        });
        Ok(column(py, seen))
    }
}

impl Hits {
    fn each<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&SurfacePoint) -> Vec3,
    ) -> PyResult<Rows<'py>> {
        triples(py, self.points.iter().map(|p| p.as_ref().map_or([0.0; 3], |p| of(p).to_array())))
    }

    /// A function of point and directions in the shading frame, for every hit.
    fn scattered<T: Send>(
        &self,
        py: Python<'_>,
        wo: &Triples<'_>,
        wi: &Triples<'_>,
        of: impl Fn(&World, &SurfacePoint, Vec3, Vec3) -> T + Sync,
    ) -> PyResult<Vec<Option<T>>> {
        let wo = of_length(rows::<3>(wo, "wo")?, self.points.len(), "wo")?;
        let wi = of_length(rows::<3>(wi, "wi")?, self.points.len(), "wi")?;
        let world = &*self.world;
        let one = |((point, wo), wi): ((&Option<SurfacePoint>, &[f32; 3]), &[f32; 3])| {
            point.as_ref().map(|p| {
                let local = |w: &[f32; 3]| p.frame.to_local(Vec3::from_array(*w));
                of(world, p, local(wo), local(wi))
            })
        };
        Ok(py.detach(|| self.points.par_iter().zip(&wo).zip(&wi).map(one).collect()))
    }
}
