//! Media of a description: indices checked, boundaries checked for being closed, and what stands in
//! which medium.
//!
//! Rays through the whole scene tell whether boundaries fit together: what one says of the medium
//! behind it, the next one must say of the medium before it. A surface that bounds nothing may hide
//! the rest of a medium (a floor that closes a box of fog), so that nothing is said across it.

use glam::Vec3;

use super::media::{Crossing, TOUCHING, Volumes};
use super::shape::Shape;
use super::{Scene, SceneError};
use crate::description::{MediaDescription, SceneDescription};
use crate::emitter::Emitter;
use crate::geometry::Accel;
use crate::math::{NO_PRIM, Ray, warp};
use crate::medium::{Medium, MediumIndex};
use crate::random::{Address, PrimarySample, RandomStream};

/// Rays that try the boundaries.
const RAYS: u64 = 2048;

/// Surfaces along a ray at most.
const MOST: usize = 256;

/// One in this many rays may find boundaries that do not fit: edges of meshes.
const TOLERATED: usize = 200;

/// Points of an emitter that are looked at.
const POINTS: u64 = 32;

/// True where there is a medium that a surface bounds or the sensor stands in.
pub(super) fn has_media(media: &MediaDescription) -> bool {
    let named = |i: Option<usize>| i.is_some();
    named(media.sensor) || media.boundaries.iter().any(|b| named(b.interior) || named(b.exterior))
}

/// The media of a description.
pub(super) fn build(
    description: &SceneDescription,
    scale: f64,
    shapes: &mut [Shape],
    boundaries: Option<(Accel, Vec<u32>)>,
) -> Result<Option<Box<Volumes>>, SceneError> {
    let given = &description.media;
    let mut media = Vec::with_capacity(given.media.len());
    for m in &given.media {
        media.push(Medium::new(m, scale).map_err(|problem| bad(&m.name, problem))?);
    }
    if !has_media(given) {
        return Ok(None);
    }
    let index = |i: Option<usize>, of: &str| match i {
        None => Ok(MediumIndex::NONE),
        Some(i) => MediumIndex::new(i)
            .filter(|_| i < media.len())
            .ok_or_else(|| bad(of, format!("medium {i} does not exist"))),
    };
    for b in &given.boundaries {
        let Some(shape) = shapes.get_mut(b.shape) else {
            return Err(bad("boundary", format!("shape {} does not exist", b.shape)));
        };
        shape.media = [index(b.exterior, &shape.name)?, index(b.interior, &shape.name)?];
        shape.bounds = true;
    }
    let sensor = index(given.sensor, "sensor")?;
    let outside = MediumIndex::NONE;
    Ok(Some(Box::new(Volumes { media, boundaries, outside, sensor, emitters: Vec::new() })))
}

fn bad(medium: &str, problem: String) -> SceneError {
    SceneError::Medium { medium: medium.to_owned(), problem }
}

/// A surface on the way of a ray.
struct Passed {
    t: f64,
    shape: u32,
    /// Media before and behind, where it bounds one.
    sides: Option<[MediumIndex; 2]>,
    /// It is no vertex.
    matched: bool,
    rest: Ray,
}

impl Scene {
    /// Finds out which media are outside, around the sensor and around emitters.
    pub(super) fn settle_media(&mut self, said: &MediaDescription) -> Result<(), SceneError> {
        if self.volumes.is_none() {
            return Ok(());
        }
        let outside = self.check_boundaries()?;
        let sensor = self.medium_of_sensor(said.sensor.is_some(), outside)?;
        let outside = outside.unwrap_or(match self.around(self.sensor.position(), None) {
            Some(_) => MediumIndex::NONE,
            None => sensor,
        });
        if !outside.is_none() && self.emitters.list().iter().any(Emitter::is_far) {
            let problem = "is everywhere, so that light from infinity never arrives: bound it";
            return Err(bad(self.name_of(outside), problem.into()));
        }
        let mut emitters = vec![MediumIndex::NONE; self.emitters.list().len()];
        let mut around_shapes = Vec::new();
        for (i, e) in self.emitters.list().iter().enumerate() {
            match *e {
                Emitter::Point { position, .. } | Emitter::Beam { position, .. } => {
                    emitters[i] = self.around(position, None).unwrap_or(outside);
                }
                Emitter::Area { shape, .. } if !self.shapes[shape as usize].bounds => {
                    around_shapes.push((shape, self.around_shape(shape, outside)?));
                }
                _ => {}
            }
        }
        for (shape, medium) in around_shapes {
            self.shapes[shape as usize].media = [medium; 2];
        }
        if let Some(volumes) = &mut self.volumes {
            volumes.outside = outside;
            volumes.sensor = sensor;
            volumes.emitters = emitters;
        }
        Ok(())
    }

    fn name_of(&self, medium: MediumIndex) -> &str {
        self.medium(medium).map_or("empty space", Medium::name)
    }

    /// The next surface of either kind along a ray; `on_matched`: it starts on a boundary.
    fn next_surface(&self, ray: &Ray, on_matched: bool) -> Option<Passed> {
        let volumes = self.volumes.as_ref()?;
        let free = Ray { from: NO_PRIM, ..*ray };
        let (on_boundary, on_solid) = if on_matched { (ray, &free) } else { (&free, ray) };
        let matched = volumes.boundaries.as_ref().and_then(|b| self.crossing(b, on_boundary));
        let hit = self.accel.closest(on_solid);
        let nearer = |t: f64| hit.is_none_or(|hit| t <= hit.t);
        if let Some(Crossing { t, shape, sides, rest }) = matched.filter(|c| nearer(c.t)) {
            return Some(Passed { t, shape, sides, matched: true, rest });
        }
        let hit = hit?;
        let point = self.surface_point(&hit, on_solid);
        let [front, back] = point.media;
        let sides = if point.n_g.dot(ray.d) > 0.0 { [back, front] } else { [front, back] };
        let sides = self.shapes[point.shape as usize].bounds.then_some(sides);
        let (t, shape, rest) = (hit.t, point.shape, point.spawn(ray.d));
        Some(Passed { t, shape, sides, matched: false, rest })
    }

    /// The medium around `p` by the first boundary in one of some directions, all on the side of
    /// `n`; `None` where none is met.
    fn around(&self, p: Vec3, n: Option<Vec3>) -> Option<MediumIndex> {
        let mut hidden = None;
        for i in 0..14 {
            let u = [(i as f32 + 0.5) / 14.0, (i as f32 * 0.618_034).fract()];
            let d = warp::uniform_sphere(u);
            let d = match n {
                Some(n) if n.dot(d) < 0.0 => -d,
                _ => d,
            };
            let mut ray = Ray::new(p, d);
            let (mut clear, mut on_matched) = (true, false);
            for _ in 0..MOST {
                let Some(passed) = self.next_surface(&ray, on_matched) else { break };
                if let Some([near, _]) = passed.sides {
                    if clear {
                        return Some(near);
                    }
                    hidden = hidden.or(Some(near));
                    break;
                }
                // What is behind such a surface is most likely the same medium, but another
                // direction may tell for sure.
                clear &= passed.matched;
                (ray, on_matched) = (passed.rest, passed.matched);
            }
        }
        hidden
    }

    fn medium_of_sensor(
        &self,
        said: bool,
        outside: Option<MediumIndex>,
    ) -> Result<MediumIndex, SceneError> {
        let Some(volumes) = &self.volumes else { return Ok(MediumIndex::NONE) };
        let found = self.around(self.sensor.position(), None).or(outside);
        match found {
            Some(medium) if said && medium != volumes.sensor => {
                let (given, found) = (self.name_of(volumes.sensor), self.name_of(medium));
                let problem = format!("names the medium '{given}' but stands in '{found}'");
                Err(SceneError::Sensor { problem })
            }
            Some(medium) => Ok(medium),
            None => Ok(volumes.sensor),
        }
    }

    /// The medium around an emitting shape that bounds none.
    fn around_shape(&self, index: u32, outside: MediumIndex) -> Result<MediumIndex, SceneError> {
        let shape = &self.shapes[index as usize];
        let mut u = RandomStream::new(Address { seed: 5, step: 0, item: u64::from(index) });
        let mut all = (0..POINTS).map(|_| {
            let point = self.area_sample_point(shape.sample_area(u.next2()));
            let p = point.p + point.n_g * (2.0 * TOUCHING as f32);
            self.around(p, Some(point.n_g)).unwrap_or(outside)
        });
        let first = all.next().unwrap_or(outside);
        match all.find(|m| *m != first) {
            None => Ok(first),
            Some(other) => {
                let (a, b) = (self.name_of(first), self.name_of(other));
                let problem = format!("emits from '{a}' and from '{b}': cut it in two");
                Err(SceneError::Shape { shape: shape.name.clone(), problem })
            }
        }
    }

    /// The medium outside, where a boundary tells.
    ///
    /// # Errors
    /// Where boundaries overlap or are not closed.
    fn check_boundaries(&self) -> Result<Option<MediumIndex>, SceneError> {
        let ball = *self.ball();
        let mut outside: Option<MediumIndex> = None;
        let mut faults = Vec::new();
        let mut ends = Vec::new();
        for item in 0..RAYS {
            let mut u = RandomStream::new(Address { seed: 6, step: 0, item });
            let [a, b] = [warp::uniform_sphere(u.next2()), warp::uniform_sphere(u.next2())];
            let (from, to) = (ball.center + a * (2.0 * ball.radius), ball.center + b * ball.radius);
            let mut ray = Ray::new(from, (to - from).normalize());
            // The medium behind the last boundary and which that was; nothing is known behind other
            // surfaces.
            let (mut known, mut first, mut t, mut on_matched) = (None, true, 0.0, false);
            for _ in 0..MOST {
                let Some(passed) = self.next_surface(&ray, on_matched) else { break };
                t += passed.t;
                let shape = passed.shape;
                match (passed.sides, known) {
                    (Some([near, far]), _) if first => {
                        if near != *outside.get_or_insert(near) {
                            faults.push((shape, shape));
                        }
                        (known, t) = (Some((far, shape)), 0.0);
                    }
                    (Some([near, far]), Some((medium, before))) => {
                        if near != medium && t > TOUCHING {
                            faults.push((before, shape));
                        }
                        (known, t) = (Some((far, shape)), 0.0);
                    }
                    (Some([_, far]), None) => (known, t) = (Some((far, shape)), 0.0),
                    (None, _) if !passed.matched => known = None,
                    (None, _) => {}
                }
                first &= passed.matched && passed.sides.is_none();
                (ray, on_matched) = (passed.rest, passed.matched);
            }
            ends.extend(known);
        }
        if let Some(outside) = outside {
            let open = ends.iter().filter(|(medium, _)| *medium != outside);
            faults.extend(open.map(|(_, shape)| (*shape, *shape)));
        }
        if faults.len() * TOLERATED > RAYS as usize
            && let Some((a, b)) = faults.first()
        {
            let name = |i: u32| &self.shapes[i as usize].name;
            let problem = if a == b {
                "as a boundary of media it is not closed, or overlaps another one".to_owned()
            } else {
                format!("as a boundary of media it does not fit with shape '{}'", name(*b))
            };
            return Err(SceneError::Shape { shape: name(*a).clone(), problem });
        }
        Ok(outside)
    }
}
