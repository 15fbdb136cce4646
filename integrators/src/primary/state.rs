//! Where a chain on primary sample space stands.

use glam::Vec2;
use pathspace_core::Rgb;
use pathspace_core::film::{Contribution, Families};

use super::{Place, PrimaryVector};
use crate::chain::{Reader, Writer};

/// A point with what it contributes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrimaryPoint {
    /// Its coordinates.
    pub vector: PrimaryVector,
    /// Its part.
    pub part: u16,
    /// f_j.
    pub contributions: Vec<Contribution>,
    /// f*.
    pub f: f64,
}

/// State of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct PrimaryState {
    /// Where it is.
    pub point: Box<PrimaryPoint>,
    pub(super) place: Place,
    /// Buffers for the next proposal.
    pub(super) spare: Option<Box<PrimaryPoint>>,
}

impl PrimaryState {
    /// Writes all of it but buffers.
    pub(super) fn encode(&self, w: &mut Writer) {
        self.place.encode(w);
        let point = &self.point;
        point.vector.encode(w);
        w.u32(point.part.into());
        w.f64(point.f);
        w.len(point.contributions.len());
        for c in &point.contributions {
            for v in [c.film.x, c.film.y, c.value.r, c.value.g, c.value.b, c.weight] {
                w.f32(v);
            }
            w.u32(u32::from(c.s) << 16 | u32::from(c.t));
            w.u32(c.emitter);
            w.u8(c.families.bits());
        }
    }

    /// Reads what [`PrimaryState::encode`] wrote; `None` where the bytes are no state.
    pub(super) fn decode(r: &mut Reader<'_>) -> Option<PrimaryState> {
        let place = Place::decode(r)?;
        let vector = PrimaryVector::decode(r)?;
        let part = u16::try_from(r.u32()?).ok()?;
        let f = r.f64()?;
        let mut point = Box::new(PrimaryPoint { vector, part, f, contributions: Vec::new() });
        for _ in 0..r.len(33)? {
            let mut v = [0.0; 6];
            for v in &mut v {
                *v = r.f32()?;
            }
            let technique = r.u32()?;
            point.contributions.push(Contribution {
                film: Vec2::new(v[0], v[1]),
                value: Rgb::new(v[2], v[3], v[4]),
                weight: v[5],
                s: (technique >> 16) as u16,
                t: technique as u16,
                emitter: r.u32()?,
                families: Families::from_bits(r.u8()?),
            });
        }
        (f > 0.0 && f.is_finite()).then_some(PrimaryState { point, place, spare: None })
    }
}
