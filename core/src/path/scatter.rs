//! Scattering at a surface point in path space: shading normals, adjoint factor and roulette in one
//! place.
//!
//! Path space has one BSDF per vertex, f̄(ω_l, ω_c), with ω_l towards the emitter and ω_c towards
//! the sensor, and G with geometric normals. A shading normal n_s turns it into (Veach 1997, §5.3)
//!
//! f̄ = f(ω_c, ω_l) |ω_l·n_s| / |ω_l·n_g| .
//!
//! Walks from the sensor then carry f |ω_l·n_s|, walks from the emitter carry f |ω_c·n_s| times the
//! adjoint factor
//! |ω_l·n_s||ω_c·n_g| / (|ω_l·n_g||ω_c·n_s|) (eq. 5.19).
//!
//! A specular component has coefficient c and probability m. Densities on the two sides of a
//! refraction live in measures that differ by n² (n² dσ⊥ is invariant), so a specular event counts
//! in densities as m n_to² |ω_to·n_s| per solid angle and in f̄ as c_radiance n_l²
//! |ω_l·n_s|/|ω_l·n_g|, n_s the normal that the component is about: relative to one common delta
//! function, the same from both sides, so that ratios of densities, and quotients f/p, are exact.

use glam::Vec3;

use crate::bsdf::{Bsdf, Event, ScatterPdf, SpecularLaw, TransportMode};
use crate::color::Rgb;
use crate::measure::{Density, Mass, SolidAngle};
use crate::scene::{Scene, SurfacePoint};

/// Largest probability to go on, so that walks in lossless media end.
const MAX_SURVIVAL: f64 = 0.95;

/// A step of a walk.
#[derive(Clone, Copy, Debug)]
pub struct ScatterSample {
    /// World direction, unit length.
    pub direction: Vec3,
    /// f̄ |ω·n_g| / p: what the throughput is multiplied by, adjoint factor included, roulette not.
    pub weight: Rgb,
    /// Density of the direction; relative to the common delta function where the event is specular.
    pub pdf: Density<SolidAngle>,
    /// Which component was taken.
    pub event: Event,
    /// Probability to survive Russian roulette here, where roulette plays: min(max weight, 0.95),
    /// the compression of radiance by η² left out. It depends on this event alone, so that it is
    /// part of the density from both sides.
    pub survival: Mass,
}

/// A vertex seen by a connection.
#[derive(Clone, Copy, Debug)]
pub struct ScatterValue {
    /// f̄.
    pub value: Rgb,
    /// Density with which the walk itself would have gone on that way; 0 where it could not.
    pub pdf: Density<SolidAngle>,
    /// Probability to survive roulette on that way, where roulette plays.
    pub survival: Mass,
}

/// A vertex at the end of a connection, as walks from either side see it.
#[derive(Clone, Copy, Debug)]
pub struct TwoWayScatter {
    /// f̄.
    pub value: Rgb,
    /// Density of the walk that came here and would have gone on along the connection.
    pub forward: Density<SolidAngle>,
    /// Density of the opposite walk, that came along the connection and would have gone on to where
    /// this walk came from.
    pub backward: Density<SolidAngle>,
    /// Survival of roulette on the way forward.
    pub survival_forward: Mass,
    /// Survival of roulette on the way back.
    pub survival_backward: Mass,
}

impl Scene {
    /// True where the side of ω has a non-specular component: a connection may end at the point.
    #[inline]
    pub fn is_connectible(&self, point: &SurfacePoint, w: Vec3) -> bool {
        self.bsdf(point).is_connectible(point.frame.to_local(w))
    }

    /// f̄(ω_l, ω_c) of the non-specular components.
    #[inline]
    pub fn scatter(&self, point: &SurfacePoint, to_light: Vec3, to_sensor: Vec3) -> Rgb {
        let (l, c) = (point.frame.to_local(to_light), point.frame.to_local(to_sensor));
        let f = self.bsdf(point).eval(c, l, TransportMode::Radiance);
        if f.is_black() { f } else { f * shading_ratio(point, to_light, l.z) }
    }

    /// Everything a connection needs at a vertex that a walk reached from `from` and could have
    /// left towards `to`; non-specular components only.
    #[inline]
    pub fn evaluate_scatter(
        &self,
        point: &SurfacePoint,
        from: Vec3,
        to: Vec3,
        mode: TransportMode,
    ) -> Option<ScatterValue> {
        let bsdf = self.bsdf(point);
        let (wo, wi) = (point.frame.to_local(from), point.frame.to_local(to));
        let f = bsdf.eval(wo, wi, mode);
        if f.is_black() {
            return None;
        }
        let pdf = bsdf.pdf(wo, wi);
        let weight = uncompressed(&bsdf, f, wo, wi, mode) * (wi.z.abs() / pdf.value() as f32);
        let (value, weight) = match mode {
            TransportMode::Radiance => (f * shading_ratio(point, to, wi.z), weight),
            TransportMode::Importance => (
                f * shading_ratio(point, from, wo.z),
                weight * adjoint_factor(point, from, wo.z, to, wi.z),
            ),
        };
        Some(ScatterValue { value, pdf, survival: survival(weight.max_channel()) })
    }

    /// Samples the next direction of a walk that came from `from`. In radiance mode the walk comes
    /// from the sensor.
    #[inline]
    pub fn sample_scatter(
        &self,
        point: &SurfacePoint,
        from: Vec3,
        mode: TransportMode,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<ScatterSample> {
        let bsdf = self.bsdf(point);
        let wo = point.frame.to_local(from);
        let sample = bsdf.sample(wo, u_lobe, u, mode)?;
        let direction = point.frame.to_world(sample.wi);
        let mut weight = sample.weight;
        let uncompressed = match mode {
            TransportMode::Radiance => match sample.pdf {
                ScatterPdf::NonSpecular(pdf) if !bsdf.is_reciprocal() => {
                    let f = bsdf.eval(wo, sample.wi, TransportMode::Importance);
                    f.max_channel() * (sample.wi.z.abs() / pdf.value() as f32)
                }
                _ => weight.max_channel() * (sample.eta * sample.eta),
            },
            TransportMode::Importance => {
                weight *= adjoint_factor(point, from, wo.z, direction, sample.wi.z);
                weight.max_channel()
            }
        };
        let (pdf, event) = match sample.pdf {
            ScatterPdf::NonSpecular(p) => (p, Event::NonSpecular),
            ScatterPdf::Specular(component, mass) => {
                let law = bsdf.specular_law(sample.wi, component);
                (specular_density(mass, law), Event::Specular(component))
            }
        };
        Some(ScatterSample { direction, weight, pdf, event, survival: survival(uncompressed) })
    }

    /// Value and both densities at an end of a connection: a walk in `mode` came from `from` and is
    /// connected towards `to`. `None` where nothing is scattered that way by a non-specular
    /// component.
    #[inline]
    pub fn connect_scatter(
        &self,
        point: &SurfacePoint,
        from: Vec3,
        to: Vec3,
        mode: TransportMode,
    ) -> Option<TwoWayScatter> {
        let bsdf = self.bsdf(point);
        let (wo, wi) = (point.frame.to_local(from), point.frame.to_local(to));
        let f = bsdf.eval(wo, wi, mode);
        if f.is_black() {
            return None;
        }
        let (forward, backward) = (bsdf.pdf(wo, wi), bsdf.pdf(wi, wo));
        let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
        let ratio =
            |f: Rgb, p: Density<SolidAngle>, cos: f32| f.max_channel() * cos / p.value() as f32;
        // The walk in importance mode sees f, whichever of the two it is.
        let (f_on, f_back) = match mode {
            TransportMode::Radiance => (uncompressed(&bsdf, f, wo, wi, mode), f),
            TransportMode::Importance if bsdf.is_reciprocal() => (f, f),
            TransportMode::Importance => (f, bsdf.eval(wi, wo, TransportMode::Importance)),
        };
        let (mut on, mut back) = (ratio(f_on, forward, cos_i), ratio(f_back, backward, cos_o));
        let value = match mode {
            TransportMode::Radiance => {
                back *= adjoint_factor(point, to, wi.z, from, wo.z);
                f * shading_ratio(point, to, wi.z)
            }
            TransportMode::Importance => {
                on *= adjoint_factor(point, from, wo.z, to, wi.z);
                f * shading_ratio(point, from, wo.z)
            }
        };
        Some(TwoWayScatter {
            value,
            forward,
            backward,
            survival_forward: survival(on),
            survival_backward: survival(back),
        })
    }

    /// Density and survival of the step from `from` to `to` by `event`; `None` where the walk can
    /// not go that way. Of a specular component `to` is taken for the direction that it leads to,
    /// as far as the edges of a path can tell it: only the side is checked.
    pub fn scatter_event(
        &self,
        point: &SurfacePoint,
        from: Vec3,
        to: Vec3,
        mode: TransportMode,
        event: Event,
    ) -> Option<(Density<SolidAngle>, Mass)> {
        let bsdf = self.bsdf(point);
        let (wo, wi) = (point.frame.to_local(from), point.frame.to_local(to));
        let (pdf, mut weight) = match event {
            Event::Specular(component) => {
                let sample = bsdf.specular(wo, component, mode)?;
                if sample.wi.z * wi.z < 0.0 {
                    return None;
                }
                let (n_to, n_from) =
                    (bsdf.relative_ior(wi, component), bsdf.relative_ior(wo, component));
                let mut weight = sample.value * (1.0 / sample.mass.value() as f32);
                if mode == TransportMode::Radiance {
                    let eta = n_to / n_from;
                    weight *= eta * eta;
                }
                (specular_density(sample.mass, bsdf.specular_law(wi, component)), weight)
            }
            Event::NonSpecular => {
                let pdf = bsdf.pdf(wo, wi);
                if pdf.is_zero() {
                    return None;
                }
                let f = bsdf.eval(wo, wi, mode);
                let f = uncompressed(&bsdf, f, wo, wi, mode);
                (pdf, f * (wi.z.abs() / pdf.value() as f32))
            }
        };
        if mode == TransportMode::Importance {
            weight *= adjoint_factor(point, from, wo.z, to, wi.z);
        }
        Some((pdf, survival(weight.max_channel())))
    }

    /// f̄(ω_l, ω_c) of a vertex where `event` happens; of a specular component relative to the
    /// common delta function.
    pub fn scatter_value(
        &self,
        point: &SurfacePoint,
        to_light: Vec3,
        to_sensor: Vec3,
        event: Event,
    ) -> Rgb {
        let Event::Specular(component) = event else {
            return self.scatter(point, to_light, to_sensor);
        };
        let bsdf = self.bsdf(point);
        let (l, c) = (point.frame.to_local(to_light), point.frame.to_local(to_sensor));
        match bsdf.specular(c, component, TransportMode::Radiance) {
            Some(sample) if sample.wi.z * l.z >= 0.0 => {
                let SpecularLaw { n, cos } = bsdf.specular_law(l, component);
                let value = sample.value * (n * n) * shading_ratio(point, to_light, l.z);
                // About another normal than n_s.
                if cos == l.z.abs() { value } else { value * (cos / l.z.abs()) }
            }
            _ => Rgb::BLACK,
        }
    }
}

/// f(ω_o, ω_i) without the compression of radiance across a boundary: as importance has it. `f` is
/// the value in `mode`.
#[inline]
fn uncompressed(bsdf: &Bsdf, f: Rgb, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
    match mode {
        TransportMode::Radiance if !bsdf.is_reciprocal() => {
            bsdf.eval(wo, wi, TransportMode::Importance)
        }
        _ => f,
    }
}

/// Cosines below this are rounding: positions and normals are `f32`. A direction so near to a
/// tangent plane scatters nothing where n_s ≠ n_g, because the quotient of cosines would be noise
/// without bound there; it holds about 10⁻⁶ of the directions.
const MIN_COSINE: f32 = 1e-6;

/// |ω·n_s| / |ω·n_g|.
#[inline]
fn shading_ratio(point: &SurfacePoint, w: Vec3, cos_s: f32) -> f32 {
    if point.n_g == point.frame.n {
        return 1.0;
    }
    let cos_g = point.n_g.dot(w).abs();
    if cos_g < MIN_COSINE { 0.0 } else { cos_s.abs() / cos_g }
}

/// |ω_l·n_s||ω_c·n_g| / (|ω_l·n_g||ω_c·n_s|) (Veach 1997, eq. 5.19).
#[inline]
fn adjoint_factor(point: &SurfacePoint, l: Vec3, l_z: f32, c: Vec3, c_z: f32) -> f32 {
    if point.n_g == point.frame.n {
        return 1.0;
    }
    let (l_g, c_s) = (point.n_g.dot(l).abs(), c_z.abs());
    if l_g < MIN_COSINE || c_s < MIN_COSINE {
        return 0.0;
    }
    l_z.abs() * point.n_g.dot(c).abs() / (l_g * c_s)
}

/// m n_to² |ω_to·n_c|, n_c the normal that the component is about.
#[inline]
fn specular_density(mass: Mass, law: SpecularLaw) -> Density<SolidAngle> {
    let n = law.n as f64;
    Density::new(mass.value() * n * n * law.cos as f64)
}

#[inline]
pub(super) fn survival(uncompressed_weight: f32) -> Mass {
    Mass::new((uncompressed_weight as f64).clamp(0.0, MAX_SURVIVAL))
}
