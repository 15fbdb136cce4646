//! Perturbations that start at the sensor: the lens perturbation and, where a non-specular vertex
//! sees the rest of the path by specular vertices only, the multi-chain perturbation (Veach 1997,
//! §11.4.3.1 and §11.4.3.3).
//!
//! The film position moves, the walk follows the specular vertices of the path to the first
//! non-specular vertex. If the next one can be connected to, the rest of the path stays. Else the
//! direction there is perturbed as well, and so on; a chain that leads to the emitter itself must
//! hit an emitter again.

use pathspace_core::Scene;
use pathspace_core::bsdf::{Event, TransportMode};
use pathspace_core::math::Ray;
use pathspace_core::measure::Density;
use pathspace_core::path::{Path, Vertex};
use pathspace_core::random::RandomStream;

use super::super::emission;
use super::super::mutator::{Candidate, Kept, Mutator};
use super::super::path::MltPath;
use super::Sizes;
use super::kernel::LogUniform;
use super::walk::{follow, hit_like, same_kind, sure_density};

/// Where the walk from the sensor ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mlt) struct Plan {
    /// x₀ … x_{kept−1} stay; the walk makes the vertices from x_{k−1} down to x_kept.
    pub kept: usize,
    /// Vertices whose direction is perturbed, besides the film position.
    pub turns: usize,
}

impl Plan {
    /// `None` where no walk from the sensor can end: a specular vertex in front of a light that can
    /// not be hit.
    fn of(x: &MltPath) -> Option<Plan> {
        let mut turns = 0;
        let mut i = x.length() - 1;
        loop {
            while i > 0 && x.is_specular(i) {
                i -= 1;
            }
            if i == 0 {
                return (!x.is_specular(0)).then_some(Plan { kept: 0, turns });
            }
            if i == 1 || !x.is_specular(i - 1) {
                return Some(Plan { kept: i, turns });
            }
            turns += 1;
            i -= 1;
        }
    }

    fn kept(self) -> Kept {
        Kept { light: self.kept, sensor: 1 }
    }
}

/// Perturbation of the film position, and of directions at vertices on the way.
#[derive(Clone, Debug)]
pub(in crate::mlt) struct SensorSide {
    /// Distance on the film in pixels.
    film: LogUniform,
    /// Angle at vertices that spread.
    angle: LogUniform,
    /// Area of the film in pixels: converts densities on the film to densities of the camera's
    /// samples.
    film_area: f64,
}

impl SensorSide {
    pub(in crate::mlt) fn new(scene: &Scene, sizes: &Sizes) -> Self {
        let crop = scene.sensor().crop();
        SensorSide {
            film: sizes.on_film(scene),
            angle: sizes.on_film(scene).scaled(scene.sensor().pixel_angle()).within_right_angle(),
            film_area: f64::from(crop.width) * f64::from(crop.height),
        }
    }

    /// The vertices of `x` with those from x_{k−1} down to x_kept moved.
    pub(in crate::mlt) fn walk(
        &self,
        scene: &Scene,
        x: &MltPath,
        plan: Plan,
        u: &mut RandomStream,
    ) -> Option<Vec<Vertex>> {
        let k = x.length();
        let sensor = scene.sensor();
        let film = x.film() + self.film.sample_plane(u);
        let lens = x.vertices()[k].position()?;
        let mut ray = Ray::new(lens, sensor.direction(lens, film));
        sensor.film_position(lens, ray.d)?;
        let mut vertices = x.vertices().to_vec();
        let mode = TransportMode::Radiance;
        for i in (plan.kept..k).rev() {
            if i == 0 {
                vertices[0] = match scene.intersect(&ray) {
                    Some(point) => Vertex::Surface(point),
                    None => emission::background(scene, ray.d)?,
                };
                break;
            }
            let point = hit_like(scene, &ray, x, i)?;
            vertices[i] = Vertex::Surface(point);
            if i > plan.kept {
                ray = if x.is_specular(i) {
                    follow(scene, &point, -ray.d, x.event(i), mode)?
                } else {
                    point.spawn(self.angle.sample_direction(-x.edge(i - 1).direction(), u))
                };
            }
        }
        Some(vertices)
    }

    /// ln of the density of that walk at `y`.
    pub(in crate::mlt) fn ln_walk(
        &self,
        scene: &Scene,
        x: &MltPath,
        y: &MltPath,
        plan: Plan,
    ) -> Option<f64> {
        let k = x.length();
        let moved = self.film.plane_density(f64::from(x.film().distance(y.film())));
        let first = y.edge(k - 1).reversed();
        let pdf = scene.sensor().pdf_direction(first.direction());
        let mut ln = (moved * self.film_area * first.to_area(pdf).value()).ln();
        // The walk at x_i chose the way to x_{i−1}.
        for i in (plan.kept + 1..k).rev() {
            let edge = y.edge(i - 1).reversed();
            let pdf = match y.event(i) {
                Event::Specular(component) => {
                    let point = y.vertices()[i].surface()?;
                    sure_density(scene, point, edge.direction(), component)
                }
                Event::NonSpecular => {
                    self.angle.direction_density(-x.edge(i - 1).direction(), edge.direction())
                }
            };
            ln += edge.to_area(Density::new(pdf)).value().ln();
        }
        ln.is_finite().then_some(ln)
    }

    fn propose(
        &self,
        scene: &Scene,
        x: &MltPath,
        plan: Plan,
        u: &mut RandomStream,
    ) -> Option<Candidate> {
        let vertices = self.walk(scene, x, plan, u)?;
        let path = MltPath::new(scene, Path::new(vertices, x.path().events.clone()))?;
        let v = path.vertices();
        let visible = plan.kept == 0 || scene.visible(&v[plan.kept], &v[plan.kept - 1]);
        visible.then(|| Candidate { path, kept: plan.kept() })
    }

    fn ln_transition(
        &self,
        scene: &Scene,
        x: &MltPath,
        y: &MltPath,
        plan: Plan,
        kept: Kept,
    ) -> Option<f64> {
        if kept != plan.kept() || !same_kind(x, y, plan.kept, x.length() - 1) {
            return None;
        }
        self.ln_walk(scene, x, y, plan)
    }
}

/// The lens perturbation: suffixes (D|L) D S* E, and L S* E seen directly or in mirrors (Veach
/// 1997, §11.4.3.1).
#[derive(Clone, Debug)]
pub struct Lens(SensorSide);

/// The multi-chain perturbation: suffixes (D|L) (D S⁺)⁺ … E, with a perturbed direction at every
/// non-specular vertex that sees the next one by specular vertices only (Veach 1997, §11.4.3.3).
#[derive(Clone, Debug)]
pub struct MultiChain(SensorSide);

impl Lens {
    /// The perturbation for this scene's film.
    pub fn new(scene: &Scene, sizes: &Sizes) -> Self {
        Lens(SensorSide::new(scene, sizes))
    }

    fn plan(x: &MltPath) -> Option<Plan> {
        Plan::of(x).filter(|plan| plan.turns == 0)
    }
}

impl MultiChain {
    /// The perturbation for this scene's film.
    pub fn new(scene: &Scene, sizes: &Sizes) -> Self {
        MultiChain(SensorSide::new(scene, sizes))
    }

    fn plan(x: &MltPath) -> Option<Plan> {
        Plan::of(x).filter(|plan| plan.turns > 0)
    }
}

macro_rules! sensor_side_mutator {
    ($mutator:ident, $name:literal) => {
        impl Mutator for $mutator {
            fn name(&self) -> &'static str {
                $name
            }

            fn applies(&self, x: &MltPath) -> bool {
                $mutator::plan(x).is_some()
            }

            fn propose(
                &self,
                scene: &Scene,
                x: &MltPath,
                u: &mut RandomStream,
            ) -> Option<Candidate> {
                self.0.propose(scene, x, $mutator::plan(x)?, u)
            }

            fn ln_transition(
                &self,
                scene: &Scene,
                x: &MltPath,
                y: &MltPath,
                kept: Kept,
            ) -> Option<f64> {
                self.0.ln_transition(scene, x, y, $mutator::plan(x)?, kept)
            }
        }
    };
}

sensor_side_mutator!(Lens, "lens");
sensor_side_mutator!(MultiChain, "multi");
