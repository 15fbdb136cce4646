//! The scene's light: what it emits, and how x₀ is sampled for next-event estimation from a point
//! and for light subpaths.

mod cone;
mod inverse;

use std::f64::consts::PI;

use glam::Vec3;

use cone::Cone;

use super::{Scene, ShapeKind};
use crate::color::Rgb;
use crate::emitter::Emitter;
use crate::math::{Frame, Ray, warp};
use crate::measure::{Area, Density, Edge, End, Mass, SolidAngle};
use crate::vertex::{NO_EMITTER, SurfacePoint, Vertex};

/// x₀ sampled for a given x₁ (technique s = 1).
#[derive(Clone, Copy, Debug)]
pub struct DirectSample {
    /// x₀.
    pub vertex: Vertex,
    /// The emitter.
    pub emitter: u32,
    /// L_e(x₀→x₁).
    pub radiance: Rgb,
    /// Density of x₀ in its own measure, choice of emitter included.
    pub pdf: Density<Area>,
}

/// x₀ and the way to x₁ sampled for a light subpath (s ≥ 2).
#[derive(Clone, Copy, Debug)]
pub struct EmissionSample {
    /// x₀.
    pub vertex: Vertex,
    /// The emitter.
    pub emitter: u32,
    /// L_e towards x₁.
    pub radiance: Rgb,
    /// Density of x₀ in its own measure, choice of emitter included.
    pub pdf: Density<Area>,
    /// The ray that finds x₁.
    pub ray: Ray,
    /// Density of x₁ before it is known.
    pub next: NextDensity,
    /// |cos θ₀| of the geometry term, 1 where x₀ has no surface.
    pub cos: f32,
}

impl EmissionSample {
    /// L_e |cos θ₀| / p(x₀, direction): the throughput of the light subpath on its way to x₁. 0 for
    /// a direction in the surface itself, whose density is 0 as well.
    #[inline]
    pub fn throughput(&self) -> Rgb {
        let density = self.pdf.value() * self.next.value();
        if density > 0.0 { self.radiance * (self.cos as f64 / density) as f32 } else { Rgb::BLACK }
    }
}

/// Density of the second vertex of a light subpath as it is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NextDensity {
    /// A direction from a finite x₀.
    Direction(Density<SolidAngle>),
    /// A position across the beam from an x₀ at infinity.
    Across(Density<Area>),
}

impl NextDensity {
    /// The number, for throughputs.
    #[inline]
    pub fn value(self) -> f64 {
        match self {
            NextDensity::Direction(p) => p.value(),
            NextDensity::Across(p) => p.value(),
        }
    }

    /// Area density of x₁.
    #[inline]
    pub fn to_area(self, edge: &Edge) -> Density<Area> {
        match self {
            NextDensity::Direction(p) => edge.to_area(p),
            NextDensity::Across(p) => edge.beam_to_area(p),
        }
    }
}

impl Scene {
    /// Radiance that a surface point emits in direction `d`: one-sided, on the side of n_g.
    #[inline]
    pub fn emitted(&self, point: &SurfacePoint, d: Vec3) -> Rgb {
        if point.emitter != NO_EMITTER && point.n_g.dot(d) > 0.0 {
            self.emitters.area_radiance(point.emitter)
        } else {
            Rgb::BLACK
        }
    }

    /// x₀ and the radiance that an edge in direction `d` meets where it leaves the scene; no vertex
    /// without an environment.
    #[inline]
    pub fn background(&self, d: Vec3) -> (Option<Vertex>, Rgb) {
        let vertex = |emitter| Vertex::InfiniteEmitter { emitter, to: d };
        (self.emitters.background().map(vertex), self.emitters.background_radiance(d))
    }

    /// Samples x₀ for next-event estimation from `reference`. `None` where no emitter reaches it by
    /// this technique.
    ///
    /// Spheres seen from outside are sampled by solid angle (uniform in the cone, Shirley et al.
    /// 1996), other shapes by area, the environment uniformly over directions.
    #[inline]
    pub fn sample_direct(&self, reference: Vec3, pick: f32, u: [f32; 2]) -> Option<DirectSample> {
        let (emitter, mass) = self.emitters().pick(pick)?;
        let (vertex, radiance, pdf) = match *self.emitters().get(emitter) {
            Emitter::Area { shape, radiance } => {
                let (point, pdf) = self.sample_shape_from(shape, reference, u)?;
                let d = reference - point.p;
                if point.n_g.dot(d) <= 0.0 {
                    return None;
                }
                (Vertex::Surface(point), radiance, pdf)
            }
            Emitter::Point { position, intensity } => {
                (Vertex::PointEmitter { emitter, p: position }, intensity, at_delta())
            }
            Emitter::Beam { position, beam } => {
                let d = (reference - position).normalize_or_zero();
                let intensity = self.emitters().beam(beam).intensity(d);
                if intensity.is_black() {
                    return None;
                }
                (Vertex::PointEmitter { emitter, p: position }, intensity, at_delta())
            }
            Emitter::Directional { to, irradiance } => {
                (Vertex::InfiniteEmitter { emitter, to }, irradiance, at_delta())
            }
            Emitter::Constant { .. } | Emitter::Environment { .. } => {
                let to = self.emitters().sample_background(u);
                let radiance = self.emitters().background_radiance(to);
                let pdf = self.emitters().background_pdf(to);
                (Vertex::InfiniteEmitter { emitter, to }, radiance, pdf)
            }
        };
        Some(DirectSample { vertex, emitter, radiance, pdf: pdf * mass })
    }

    /// Density with which [`Scene::sample_direct`] makes x₀ from `reference`, choice of emitter
    /// included.
    pub fn pdf_direct(&self, reference: Vec3, vertex: &Vertex) -> Density<Area> {
        let Some(emitter) = vertex.emitter() else { return Density::ZERO };
        let pdf = match (*self.emitters().get(emitter), vertex) {
            (Emitter::Area { shape, .. }, Vertex::Surface(point)) => {
                self.pdf_shape_from(shape, reference, point)
            }
            (
                Emitter::Constant { .. } | Emitter::Environment { .. },
                Vertex::InfiniteEmitter { to, .. },
            ) => self.emitters().background_pdf(*to),
            _ => at_delta(),
        };
        pdf * self.emitters().mass(emitter)
    }

    /// Samples x₀ and the ray to x₁ of a light subpath. `None` in a dark scene.
    pub fn sample_emission(
        &self,
        pick: f32,
        position: [f32; 2],
        direction: [f32; 2],
    ) -> Option<EmissionSample> {
        let (emitter, mass) = self.emitters().pick(pick)?;
        let beam = |to: Vec3, radiance: Rgb, pdf: Density<Area>| {
            let ball = self.ball();
            let frame = Frame::from_normal(to);
            let disk = warp::concentric_disk(direction) * ball.radius;
            // The origin lies outside the ball, wherever on the disk.
            let o = ball.center + to * (2.0 * ball.radius) + frame.s * disk.x + frame.t * disk.y;
            EmissionSample {
                vertex: Vertex::InfiniteEmitter { emitter, to },
                emitter,
                radiance,
                pdf: pdf * mass,
                ray: Ray::new(o, -to),
                next: NextDensity::Across(self.emitters().beam_density()),
                cos: 1.0,
            }
        };
        Some(match *self.emitters().get(emitter) {
            Emitter::Area { shape, radiance } => {
                let shape = &self.shapes()[shape as usize];
                let point = self.area_sample_point(shape.sample_area(position));
                let local = warp::cosine_hemisphere(direction);
                let d = Frame::from_normal(point.n_g).to_world(local);
                EmissionSample {
                    vertex: Vertex::Surface(point),
                    emitter,
                    radiance,
                    pdf: Density::new(1.0 / shape.area) * mass,
                    ray: point.spawn(d),
                    next: NextDensity::Direction(Density::new(local.z as f64 / PI)),
                    cos: local.z,
                }
            }
            Emitter::Point { position, intensity } => EmissionSample {
                vertex: Vertex::PointEmitter { emitter, p: position },
                emitter,
                radiance: intensity,
                pdf: at_delta() * mass,
                ray: Ray::new(position, warp::uniform_sphere(direction)),
                next: NextDensity::Direction(Density::new(0.25 / PI)),
                cos: 1.0,
            },
            Emitter::Beam { position, beam } => {
                let beam = self.emitters().beam(beam);
                let d = beam.sample(direction);
                EmissionSample {
                    vertex: Vertex::PointEmitter { emitter, p: position },
                    emitter,
                    radiance: beam.intensity(d),
                    pdf: at_delta() * mass,
                    ray: Ray::new(position, d),
                    next: NextDensity::Direction(beam.pdf(d)),
                    cos: 1.0,
                }
            }
            Emitter::Directional { to, irradiance } => beam(to, irradiance, at_delta()),
            Emitter::Constant { .. } | Emitter::Environment { .. } => {
                let to = self.emitters().sample_background(position);
                let radiance = self.emitters().background_radiance(to);
                beam(to, radiance, self.emitters().background_pdf(to))
            }
        })
    }

    /// Density of x₀ in its own measure when a light subpath starts (s ≥ 2), choice of emitter
    /// included.
    pub fn pdf_emission_vertex(&self, vertex: &Vertex) -> Density<Area> {
        let Some(emitter) = vertex.emitter() else { return Density::ZERO };
        let pdf = match (*self.emitters().get(emitter), vertex) {
            (Emitter::Area { shape, .. }, _) => {
                Density::new(1.0 / self.shapes()[shape as usize].area)
            }
            (
                Emitter::Constant { .. } | Emitter::Environment { .. },
                Vertex::InfiniteEmitter { to, .. },
            ) => self.emitters().background_pdf(*to),
            _ => at_delta(),
        };
        pdf * self.emitters().mass(emitter)
    }

    /// Density with which a light subpath leaves x₀ in unit direction `d`; `None` behind a surface.
    pub fn next_of(&self, vertex: &Vertex, d: Vec3) -> Option<NextDensity> {
        match vertex {
            Vertex::Surface(point) => {
                let cos = point.n_g.as_dvec3().dot(d.as_dvec3());
                (cos > 0.0).then(|| NextDensity::Direction(Density::new(cos / PI)))
            }
            Vertex::PointEmitter { emitter, .. } => match *self.emitters().get(*emitter) {
                Emitter::Beam { beam, .. } => {
                    let pdf = self.emitters().beam(beam).pdf(d);
                    (!pdf.is_zero()).then_some(NextDensity::Direction(pdf))
                }
                _ => Some(NextDensity::Direction(Density::new(0.25 / PI))),
            },
            Vertex::InfiniteEmitter { .. } => {
                Some(NextDensity::Across(self.emitters().beam_density()))
            }
            Vertex::Medium(_) | Vertex::Sensor { .. } => None,
        }
    }

    /// Density of x₁ given x₀ when a light subpath goes along `edge` (x₀ → x₁).
    pub fn pdf_emission_next(&self, vertex: &Vertex, edge: &Edge) -> Density<Area> {
        self.next_of(vertex, edge.direction()).map_or(Density::ZERO, |next| next.to_area(edge))
    }

    /// L_e(x₀→x₁) of an emitter vertex in unit direction `d`.
    pub fn emitted_from(&self, vertex: &Vertex, d: Vec3) -> Rgb {
        match vertex {
            Vertex::Surface(point) => self.emitted(point, d),
            Vertex::PointEmitter { emitter, .. } => match *self.emitters().get(*emitter) {
                Emitter::Point { intensity, .. } => intensity,
                Emitter::Beam { beam, .. } => self.emitters().beam(beam).intensity(d),
                _ => Rgb::BLACK,
            },
            Vertex::InfiniteEmitter { emitter, to } => match *self.emitters().get(*emitter) {
                Emitter::Directional { irradiance, .. } => irradiance,
                Emitter::Constant { .. } | Emitter::Environment { .. } => {
                    self.emitters().background_radiance(*to)
                }
                _ => Rgb::BLACK,
            },
            Vertex::Medium(_) | Vertex::Sensor { .. } => Rgb::BLACK,
        }
    }

    /// A point of a shape for next-event estimation from `reference`, with its area density.
    fn sample_shape_from(
        &self,
        index: u32,
        reference: Vec3,
        u: [f32; 2],
    ) -> Option<(SurfacePoint, Density<Area>)> {
        let shape = &self.shapes()[index as usize];
        if let ShapeKind::Sphere { center, radius, .. } = shape.kind
            && let Some(cone) = Cone::new(reference, center, radius)
        {
            let point = self.curved_point(shape.first, cone.sample(u));
            // The density is that of the rounded point, so that sample and pdf agree.
            let pdf = self.pdf_shape_from(index, reference, &point);
            return (!pdf.is_zero()).then_some((point, pdf));
        }
        let point = self.area_sample_point(shape.sample_area(u));
        Some((point, Density::new(1.0 / shape.area)))
    }

    fn pdf_shape_from(&self, index: u32, reference: Vec3, point: &SurfacePoint) -> Density<Area> {
        let shape = &self.shapes()[index as usize];
        if let ShapeKind::Sphere { center, radius, .. } = shape.kind
            && let Some(cone) = Cone::new(reference, center, radius)
        {
            // The far side of the sphere is never sampled.
            let d = reference.as_dvec3() - point.p.as_dvec3();
            let outward = (point.p.as_dvec3() - center).dot(d);
            if outward <= 0.0 {
                return Density::ZERO;
            }
            return Edge::new(&End::Point { p: reference }, &point.end()).to_area(cone.pdf());
        }
        Density::new(1.0 / shape.area)
    }
}

/// Counting measure: the one place it can be.
fn at_delta() -> Density<Area> {
    Density::at_delta(Mass::ONE)
}
