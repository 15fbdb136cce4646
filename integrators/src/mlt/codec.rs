//! States as bytes of checkpoints. Only the vertices and their events are kept: the rest follows
//! from them, to the bit.

use glam::Vec3;
use pathspace_core::Scene;
use pathspace_core::bsdf::{Component, Event};
use pathspace_core::math::Frame;
use pathspace_core::medium::{MediumIndex, MediumPoint};
use pathspace_core::path::{Path, Vertex};
use pathspace_core::scene::{NO_EMITTER, SurfacePoint};

use super::path::MltPath;
use crate::chain::{Reader, Writer};

const SURFACE: u8 = 0;
const POINT: u8 = 1;
const INFINITE: u8 = 2;
const SENSOR: u8 = 3;
const MEDIUM: u8 = 4;

/// Beyond every number of a specular component.
const NON_SPECULAR: u8 = u8::MAX;

/// Fewest bytes of a vertex.
const SMALLEST: usize = 18;

pub(super) fn encode(x: &MltPath, out: &mut Writer) {
    out.len(x.vertices().len());
    for (vertex, event) in x.vertices().iter().zip(&x.path().events) {
        out.u8(match event {
            Event::NonSpecular => NON_SPECULAR,
            Event::Specular(component) => component.0,
        });
        match vertex {
            Vertex::Surface(s) => {
                out.u8(SURFACE);
                for v in [s.p, s.n_g, s.frame.s, s.frame.t, s.frame.n] {
                    vector(v, out);
                }
                out.f32(s.error);
                for index in [s.shape, s.prim, s.material, s.emitter] {
                    out.u32(index);
                }
            }
            Vertex::Medium(point) => {
                out.u8(MEDIUM);
                out.u32(point.medium.number());
                vector(point.p, out);
            }
            Vertex::PointEmitter { emitter, p } => {
                out.u8(POINT);
                out.u32(*emitter);
                vector(*p, out);
            }
            Vertex::InfiniteEmitter { emitter, to } => {
                out.u8(INFINITE);
                out.u32(*emitter);
                vector(*to, out);
            }
            Vertex::Sensor { p, n } => {
                out.u8(SENSOR);
                vector(*p, out);
                vector(*n, out);
            }
        }
    }
}

pub(super) fn decode(scene: &Scene, bytes: &mut Reader<'_>) -> Option<MltPath> {
    let n = bytes.len(SMALLEST)?;
    let mut path = Path::default();
    for _ in 0..n {
        path.events.push(match bytes.u8()? {
            NON_SPECULAR => Event::NonSpecular,
            component => Event::Specular(Component(component)),
        });
        path.vertices.push(vertex(scene, bytes)?);
    }
    // Only the emitter's end may be at infinity or a point.
    let inner = path.vertices.get(1..n.checked_sub(1)?)?;
    if !inner.iter().all(Vertex::scatters) {
        return None;
    }
    MltPath::new(scene, path).filter(|x| x.target().is_finite() && x.target() > 0.0)
}

fn vertex(scene: &Scene, bytes: &mut Reader<'_>) -> Option<Vertex> {
    let emitters = scene.emitters().list().len();
    let known = |emitter: u32| ((emitter as usize) < emitters).then_some(emitter);
    Some(match bytes.u8()? {
        SURFACE => {
            let (p, n_g) = (read_vector(bytes)?, read_vector(bytes)?);
            let (s, t, n) = (read_vector(bytes)?, read_vector(bytes)?, read_vector(bytes)?);
            let error = bytes.f32()?;
            let (shape, prim, material) = (bytes.u32()?, bytes.u32()?, bytes.u32()?);
            let emitter = bytes.u32()?;
            if shape as usize >= scene.shapes().len()
                || material as usize >= scene.materials().len()
                || (emitter != NO_EMITTER && known(emitter).is_none())
            {
                return None;
            }
            let frame = Frame { s, t, n };
            let media = [MediumIndex::NONE; 2];
            Vertex::Surface(SurfacePoint {
                p,
                n_g,
                frame,
                error,
                shape,
                prim,
                material,
                emitter,
                media,
            })
        }
        MEDIUM => {
            let medium = MediumIndex::new(bytes.u32()? as usize)?;
            scene.medium(medium)?;
            Vertex::Medium(MediumPoint { p: read_vector(bytes)?, medium })
        }
        POINT => Vertex::PointEmitter { emitter: known(bytes.u32()?)?, p: read_vector(bytes)? },
        INFINITE => {
            Vertex::InfiniteEmitter { emitter: known(bytes.u32()?)?, to: read_vector(bytes)? }
        }
        SENSOR => Vertex::Sensor { p: read_vector(bytes)?, n: read_vector(bytes)? },
        _ => return None,
    })
}

fn vector(v: Vec3, out: &mut Writer) {
    for c in v.to_array() {
        out.f32(c);
    }
}

fn read_vector(bytes: &mut Reader<'_>) -> Option<Vec3> {
    Some(Vec3::new(bytes.f32()?, bytes.f32()?, bytes.f32()?))
}
