//! Choices among the lobes of one model.

use std::ops::SubAssign;

use glam::Vec3;

use super::{BsdfSample, ScatterPdf, ScatterSide};
use crate::color::Rgb;
use crate::measure::{Density, SolidAngle};
use crate::random::{PrimarySample, coordinate_between};

/// The lobe in which `u` falls and where in it, from shares that sum to 1.
#[inline]
pub(super) fn pick<const N: usize>(shares: &[f32; N], u: f32) -> (usize, f32) {
    let mut low = 0.0;
    let last = shares.iter().rposition(|s| *s > 0.0).unwrap_or(0);
    for (i, share) in shares.iter().enumerate() {
        if (u < low + share && *share > 0.0) || i == last {
            return (i, within(u, low, *share));
        }
        low += share;
    }
    (last, 0.0)
}

/// (u − low)/share, in \[0, 1).
#[inline]
pub(super) fn within(u: f32, low: f32, share: f32) -> f32 {
    ((u - low) / share).clamp(0.0, 1.0 - f32::EPSILON / 2.0)
}

/// A lobe by its part of the density, and a number that makes [`pick`] take it. `None` where all
/// are 0.
pub(super) fn invert<const N: usize, U: PrimarySample>(
    shares: &[f32; N],
    densities: &[f32; N],
    free: &mut U,
) -> Option<(usize, f32)> {
    let sum: f32 = densities.iter().sum();
    let lobe = among(densities, free.next() * sum)?;
    let low: f32 = shares[..lobe].iter().sum();
    let number =
        coordinate_between(f64::from(low), f64::from(low) + f64::from(shares[lobe]), free.next())?;
    Some((lobe, number))
}

/// The place at which the running sum of the densities exceeds `number`, which is below their sum but
/// for rounding. `None` where all are 0.
pub(super) fn among<T: Copy + Default + PartialOrd + SubAssign>(
    densities: &[T],
    number: T,
) -> Option<usize> {
    let last = densities.iter().rposition(|d| *d > T::default())?;
    let mut left = number;
    for (i, d) in densities.iter().enumerate() {
        if left < *d {
            return Some(i);
        }
        left -= *d;
    }
    Some(last)
}

/// The density that the lobes have together.
#[inline]
pub(super) fn together<const N: usize>(densities: [f32; N]) -> Density<SolidAngle> {
    Density::new(f64::from(densities.iter().sum::<f32>()))
}

/// A sample of a density; `None` where the density is 0.
#[inline]
pub(super) fn sampled(
    wo: Vec3,
    wi: Vec3,
    value: Rgb,
    pdf: Density<SolidAngle>,
) -> Option<BsdfSample> {
    if pdf.is_zero() || !pdf.value().is_finite() {
        return None;
    }
    let side = if wo.z * wi.z >= 0.0 { ScatterSide::Reflection } else { ScatterSide::Transmission };
    Some(BsdfSample {
        wi,
        weight: value * (wi.z.abs() / pdf.value() as f32),
        pdf: ScatterPdf::NonSpecular(pdf),
        value,
        side,
        eta: 1.0,
    })
}
