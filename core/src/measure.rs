//! Measures as types, and [`Edge`], the only place where one becomes another.
//!
//! | measure | symbol | type |
//! | --- | --- | --- |
//! | area | dA(x), m² | [`Density<Area>`] |
//! | solid angle | dσ(ω), sr | [`Density<SolidAngle>`] |
//! | projected solid angle | dσ⊥(ω) = \|ω·n_g\| dσ(ω) | [`Density<ProjectedSolidAngle>`] |
//! | counting | probability of a discrete event | [`Mass`] |
//!
//! A vertex at infinity (environment, directional light) is a direction. Its own measure is solid
//! angle (or counting, for a directional light); where the code speaks of the *area* density of
//! such a vertex it means this measure, so that products over the vertices of a path read the same
//! everywhere. So it is with a point in a medium, whose measure is volume: with D = 1 in place of
//! |cos θ| the conversions of [`Edge`] are the right ones.
//!
//! Mixing measures does not compile:
//!
//! ```compile_fail,E0308
//! use pathspace_core::measure::{Area, Density, SolidAngle};
//! let a = Density::<Area>::new(1.0);
//! let w = Density::<SolidAngle>::new(1.0);
//! let sum = a + w; // an area density is no solid-angle density
//! ```
//!
//! ```compile_fail,E0308
//! use pathspace_core::measure::{Area, Density, Mass};
//! fn needs_density(_: Density<Area>) {}
//! needs_density(Mass::new(0.5)); // a probability is no density
//! ```
//!
//! ```compile_fail,E0277
//! use pathspace_core::measure::{Density, ProjectedSolidAngle, SolidAngle};
//! let ratio = Density::<ProjectedSolidAngle>::new(1.0) / Density::<SolidAngle>::new(1.0);
//! ```

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Add, Div, Mul};

use glam::Vec3;

mod sealed {
    pub trait Sealed {}
}

/// A measure that densities refer to. Sealed: the set of measures is closed.
pub trait Measure: sealed::Sealed + Copy + 'static {
    /// Unit of a density in this measure.
    const UNIT: &'static str;
}

macro_rules! measure {
    ($(#[$doc:meta])* $name:ident, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {}
        impl sealed::Sealed for $name {}
        impl Measure for $name {
            const UNIT: &'static str = $unit;
        }
    };
}

measure!(
    /// Surface area dA (of the normalised scene).
    Area, "1/A");
measure!(
    /// Solid angle dσ.
    SolidAngle, "1/sr");
measure!(
    /// Projected solid angle dσ⊥ = |ω·n_g| dσ (Veach 1997, eq. 3.1).
    ProjectedSolidAngle, "1/sr⊥");

/// Probability density with respect to the measure `M`. Kept in `f64`, so that ratios of products
/// over long paths neither overflow nor lose digits.
pub struct Density<M: Measure> {
    value: f64,
    measure: PhantomData<M>,
}

impl<M: Measure> Density<M> {
    /// Density 0: the event has no density (never a mark for "delta").
    pub const ZERO: Self = Density { value: 0.0, measure: PhantomData };

    /// A density of the given value.
    #[inline]
    pub const fn new(value: f64) -> Self {
        Density { value, measure: PhantomData }
    }

    /// The number, in 1/unit of the measure.
    #[inline]
    pub const fn value(self) -> f64 {
        self.value
    }

    /// The density times that of an independent step per unit of nothing, or of the length that the
    /// measure gains: a free flight.
    #[inline]
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Density::new(self.value * factor)
    }

    /// True where the density is 0.
    #[inline]
    pub fn is_zero(self) -> bool {
        self.value == 0.0
    }
}

impl Density<Area> {
    /// Density of a vertex whose own measure is counting (point light, pinhole, directional light):
    /// the probability itself. That such a vertex can not be hit is said by predicates, not by this
    /// number.
    #[inline]
    pub const fn at_delta(mass: Mass) -> Self {
        Density::new(mass.0)
    }
}

impl<M: Measure> Clone for Density<M> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<M: Measure> Copy for Density<M> {}
impl<M: Measure> PartialEq for Density<M> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}
impl<M: Measure> fmt::Debug for Density<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.value, M::UNIT)
    }
}
impl<M: Measure> Add for Density<M> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Density::new(self.value + other.value)
    }
}
/// Ratio of two densities of one measure: a pure number.
impl<M: Measure> Div for Density<M> {
    type Output = f64;
    fn div(self, other: Self) -> f64 {
        self.value / other.value
    }
}
/// Joint density of an independent discrete choice and a continuous one.
impl<M: Measure> Mul<Mass> for Density<M> {
    type Output = Self;
    #[inline]
    fn mul(self, mass: Mass) -> Self {
        Density::new(self.value * mass.0)
    }
}

/// Probability of a discrete event: a lobe, an emitter, survival of roulette.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Mass(f64);

impl Mass {
    /// The sure event.
    pub const ONE: Mass = Mass(1.0);
    /// The impossible event.
    pub const ZERO: Mass = Mass(0.0);

    /// A probability; debug builds check that it lies in [0, 1].
    #[inline]
    pub fn new(p: f64) -> Self {
        debug_assert!((0.0..=1.0 + 1e-6).contains(&p), "{p} is no probability");
        Mass(p)
    }

    /// The number.
    #[inline]
    pub const fn value(self) -> f64 {
        self.0
    }
}

impl Mul for Mass {
    type Output = Mass;
    #[inline]
    fn mul(self, other: Mass) -> Mass {
        Mass(self.0 * other.0)
    }
}

/// One end of an [`Edge`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// A point of a surface with its geometric normal.
    Surface {
        /// Position.
        p: Vec3,
        /// Geometric normal, unit length.
        n: Vec3,
    },
    /// A point without a surface (point light, pinhole, medium): its cosine counts as 1.
    Point {
        /// Position.
        p: Vec3,
    },
    /// A vertex at infinity, seen in direction `to` (unit length) from everywhere.
    Infinite {
        /// Direction towards the vertex.
        to: Vec3,
    },
}

/// The segment between two path vertices: distance, direction, cosines, and with them every
/// conversion between measures and the geometry term.
///
/// Arithmetic is `f64` on `f32` positions, so that the conversion itself adds no error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    cos_a: f64,
    cos_b: f64,
    distance2: f64,
    /// Unit direction a → b.
    direction: Vec3,
    a_infinite: bool,
    b_infinite: bool,
}

impl Edge {
    /// The edge from `a` to `b`.
    ///
    /// # Panics
    /// In debug builds where both ends are at infinity.
    pub fn new(a: &End, b: &End) -> Self {
        let cos = |n: &End, d: glam::DVec3| match n {
            End::Surface { n, .. } => n.as_dvec3().dot(d).abs(),
            _ => 1.0,
        };
        match (*a, *b) {
            (End::Infinite { to }, _) => {
                debug_assert!(!matches!(b, End::Infinite { .. }), "both ends at infinity");
                Edge {
                    cos_a: 1.0,
                    cos_b: cos(b, to.as_dvec3()),
                    distance2: 1.0,
                    direction: -to,
                    a_infinite: true,
                    b_infinite: false,
                }
            }
            (_, End::Infinite { to }) => Edge {
                cos_a: cos(a, to.as_dvec3()),
                cos_b: 1.0,
                distance2: 1.0,
                direction: to,
                a_infinite: false,
                b_infinite: true,
            },
            (
                End::Surface { p: pa, .. } | End::Point { p: pa },
                End::Surface { p: pb, .. } | End::Point { p: pb },
            ) => {
                let v = pb.as_dvec3() - pa.as_dvec3();
                let distance2 = v.length_squared();
                let d = v / distance2.sqrt();
                Edge {
                    cos_a: cos(a, d),
                    cos_b: cos(b, d),
                    distance2,
                    direction: d.as_vec3(),
                    a_infinite: false,
                    b_infinite: false,
                }
            }
        }
    }

    /// The same segment from the second end to the first, to the bit as [`Edge::new`] with its ends
    /// exchanged.
    #[inline]
    pub fn reversed(&self) -> Edge {
        Edge {
            cos_a: self.cos_b,
            cos_b: self.cos_a,
            distance2: self.distance2,
            direction: -self.direction,
            a_infinite: self.b_infinite,
            b_infinite: self.a_infinite,
        }
    }

    /// Unit direction from the first end to the second.
    #[inline]
    pub fn direction(&self) -> Vec3 {
        self.direction
    }

    /// Squared length; 1 where an end is at infinity.
    #[inline]
    pub fn distance2(&self) -> f64 {
        self.distance2
    }

    /// |cos θ| at the first end (geometric normal; 1 for points and at infinity).
    #[inline]
    pub fn cos_a(&self) -> f64 {
        self.cos_a
    }

    /// |cos θ| at the second end.
    #[inline]
    pub fn cos_b(&self) -> f64 {
        self.cos_b
    }

    /// G(a,b) = |cos θ_a cos θ_b| / ‖a−b‖² (Veach 1997, eq. 8.2); |cos θ| of the finite end
    /// where the other is at infinity.
    #[inline]
    pub fn geometry_term(&self) -> f64 {
        self.cos_a * self.cos_b / self.distance2
    }

    /// Density of the second end where the direction was sampled at the first: p_A(b) = p_σ(a→b)
    /// |cos θ_b| / ‖a−b‖² (Veach 1997, eq. 8.10). A second end at infinity keeps its solid angle.
    #[inline]
    pub fn to_area(&self, p: Density<SolidAngle>) -> Density<Area> {
        if self.b_infinite {
            return Density::new(p.value);
        }
        debug_assert!(!self.a_infinite, "directions are not sampled at infinity: use beam_to_area");
        Density::new(p.value * self.cos_b / self.distance2)
    }

    /// Inverse of [`Edge::to_area`]: p_σ(a→b) = p_A(b) ‖a−b‖² / |cos θ_b|.
    #[inline]
    pub fn to_solid_angle(&self, p: Density<Area>) -> Density<SolidAngle> {
        if self.b_infinite {
            return Density::new(p.value);
        }
        Density::new(p.value * self.distance2 / self.cos_b)
    }

    /// Density on the surface of the second end of a parallel beam from a first end at infinity,
    /// given its density across the beam: p_A(b) = p_⊥ |cos θ_b|.
    #[inline]
    pub fn beam_to_area(&self, across: Density<Area>) -> Density<Area> {
        debug_assert!(self.a_infinite, "a beam starts at infinity");
        Density::new(across.value * self.cos_b)
    }

    /// Projected solid angle at the first end: p_σ⊥ = p_σ / |cos θ_a|.
    #[inline]
    pub fn to_projected(&self, p: Density<SolidAngle>) -> Density<ProjectedSolidAngle> {
        Density::new(p.value / self.cos_a)
    }

    /// Solid angle at the first end: p_σ = p_σ⊥ |cos θ_a|.
    #[inline]
    pub fn from_projected(&self, p: Density<ProjectedSolidAngle>) -> Density<SolidAngle> {
        Density::new(p.value * self.cos_a)
    }
}
