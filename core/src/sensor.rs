//! The sensor: perspective with a pinhole or a thin lens.
//!
//! W_e is scaled so that the importance that leaves the sensor towards the crop window integrates
//! to 1: ∫_lens ∫ W_e |cos θ| dσ dA = 1. A camera sample (uniform on lens and window) then has
//! W_e|cos θ|/p = 1, and a pixel is the sum of its contributions over the samples per pixel,
//! whatever the technique.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::description::{Crop, FilmDescription, SensorDescription};
use crate::error::SceneError;
use crate::math::{Ray, warp};
use crate::measure::{Area, Density, Mass, SolidAngle};
use crate::normalisation::{Ball, Normalisation};
use crate::random::nearest_coordinate;
use crate::vertex::Vertex;

/// Perspective sensor in the normalised scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    origin: DVec3,
    /// Camera axes in the scene: +x (left of the image), +y (up), +z (view).
    axes: [DVec3; 3],
    lens_radius: f64,
    focus_distance: f64,
    /// Size of a pixel on the plane z = 1.
    pixel: f64,
    /// Film position in pixels of the axis z.
    center: [f64; 2],
    crop: Crop,
    /// About the surfaces; none are met before it.
    start: Option<Ball>,
}

/// A camera sample: W_e|cos θ| over its density is 1.
#[derive(Clone, Copy, Debug)]
pub struct SensorSample {
    /// Position on the film in pixels.
    pub film: Vec2,
    /// The vertex on the lens.
    pub vertex: Vertex,
    /// The ray into the scene, unit direction.
    pub ray: Ray,
}

/// How many radii from the middle of the surfaces a camera counts as far.
const FAR: f64 = 16.0;

impl Sensor {
    /// # Errors
    /// Where the transform is not a rigid motion (a mirror is allowed) or an angle or length is out
    /// of range.
    pub(crate) fn new(
        description: &SensorDescription,
        film: &FilmDescription,
        normalisation: Normalisation,
        start: Option<Ball>,
    ) -> Result<Self, SceneError> {
        let bad = |problem: String| Err(SceneError::Sensor { problem });
        let m = description.to_world.matrix3;
        let axes = [m.x_axis, m.y_axis, m.z_axis];
        for (a, name) in axes.iter().zip(["x", "y", "z"]) {
            let length = a.length();
            if !((length - 1.0).abs() < 1e-3) {
                return bad(format!(
                    "to_world scales the {name} axis by {length}; only rotations, mirrors and translations are allowed"
                ));
            }
        }
        if axes[0]
            .dot(axes[1])
            .abs()
            .max(axes[1].dot(axes[2]).abs())
            .max(axes[2].dot(axes[0]).abs())
            > 1e-3
        {
            return bad(
                "to_world shears; only rotations, mirrors and translations are allowed".into()
            );
        }
        // The view axis is exact; the others are made orthogonal to it.
        let z = axes[2].normalize();
        let y = (axes[1] - z * z.dot(axes[1])).normalize();
        let handed = axes[0].dot(axes[1].cross(axes[2])).signum();
        let x = y.cross(z) * handed;
        let fov = description.fov_x_degrees;
        if !(fov > 0.0 && fov < 180.0) {
            return bad(format!("the angle of view {fov}° is not in (0°, 180°)"));
        }
        let (r, f) = (description.aperture_radius, description.focus_distance);
        if !(r >= 0.0 && r.is_finite()) {
            return bad(format!("aperture radius {r} is not a length"));
        }
        if r > 0.0 && !(f > 0.0 && f.is_finite()) {
            return bad(format!("focus distance {f} is not positive"));
        }
        let origin =
            (description.to_world.translation - normalisation.center) * normalisation.scale;
        if !origin.is_finite() {
            return bad("to_world is not finite".into());
        }
        let (w, h) = (film.width as f64, film.height as f64);
        let [ox, oy] = description.principal_point_offset;
        Ok(Sensor {
            // Vertices hold f32 positions: the origin itself is such a position.
            origin: origin.as_vec3().as_dvec3(),
            axes: [x, y, z],
            lens_radius: r * normalisation.scale,
            focus_distance: f * normalisation.scale,
            pixel: 2.0 * (fov.to_radians() * 0.5).tan() / w,
            center: [(0.5 - ox) * w, (0.5 - oy) * h],
            crop: film.crop,
            start,
        })
    }

    /// True without a lens: the sensor's vertex has a counting measure and can not be hit (t = 0).
    #[inline]
    pub fn is_pinhole(&self) -> bool {
        self.lens_radius == 0.0
    }

    /// Centre of the lens.
    pub fn position(&self) -> Vec3 {
        self.origin.as_vec3()
    }

    /// Unit vector of view: the normal of the lens.
    #[inline]
    pub fn axis(&self) -> Vec3 {
        self.axes[2].as_vec3()
    }

    /// A camera sample in `pixel`, or anywhere in the crop window.
    #[inline]
    pub fn sample(&self, pixel: Option<[u32; 2]>, film: [f32; 2], lens: [f32; 2]) -> SensorSample {
        let Crop { x, y, width, height } = self.crop;
        let film = match pixel {
            Some([px, py]) => Vec2::new(px as f32 + film[0], py as f32 + film[1]),
            None => {
                Vec2::new(x as f32 + film[0] * width as f32, y as f32 + film[1] * height as f32)
            }
        };
        // Rounding may reach the next pixel's edge: stay in this one.
        let last = match pixel {
            Some([px, py]) => Vec2::new((px + 1) as f32, (py + 1) as f32),
            None => Vec2::new((x + width) as f32, (y + height) as f32),
        };
        let film = Vec2::new(below(film.x, last.x), below(film.y, last.y));
        let in_camera = DVec3::new(
            (self.center[0] - film.x as f64) * self.pixel,
            (self.center[1] - film.y as f64) * self.pixel,
            1.0,
        );
        let (p, d) = if self.is_pinhole() {
            (self.origin, self.to_scene(in_camera))
        } else {
            let q = warp::concentric_disk(lens).as_dvec2() * self.lens_radius;
            let on_lens = DVec3::new(q.x, q.y, 0.0);
            let d = in_camera * self.focus_distance - on_lens;
            (self.origin + self.to_scene(on_lens), self.to_scene(d))
        };
        let (o, d) = (self.start_of(p, d), d.normalize().as_vec3());
        SensorSample { film, vertex: self.vertex(p.as_vec3()), ray: Ray::new(o, d) }
    }

    /// Where a ray from the lens point `p` in direction `d` starts: at `p`, or from far outside the
    /// scene where it comes near the surfaces, computed before `d` is rounded. Errors of f32
    /// directions and origins grow with the way.
    #[inline]
    fn start_of(&self, p: DVec3, d: DVec3) -> Vec3 {
        let Some(ball) = &self.start else { return p.as_vec3() };
        let (to, radius) = (ball.center.as_dvec3() - p, f64::from(ball.radius));
        if to.length_squared() < FAR * FAR * radius * radius {
            return p.as_vec3();
        }
        // Two radii before the point nearest to the centre.
        let d = d.normalize();
        let t = to.dot(d) - 2.0 * radius;
        (p + d * t.max(0.0)).as_vec3()
    }

    /// The point of the film that [`Sensor::sample`] takes for these numbers, anywhere in the crop
    /// window.
    #[inline]
    pub fn film_point(&self, u: [f32; 2]) -> Vec2 {
        let Crop { x, y, width, height } = self.crop;
        let film = Vec2::new(x as f32 + u[0] * width as f32, y as f32 + u[1] * height as f32);
        Vec2::new(below(film.x, (x + width) as f32), below(film.y, (y + height) as f32))
    }

    /// Inverse of [`Sensor::film_point`] for a position in the crop window.
    pub fn invert_film(&self, film: Vec2) -> [f32; 2] {
        let Crop { x, y, width, height } = self.crop;
        let at = |v: f32, origin: u32, size: u32| {
            nearest_coordinate((v as f64 - origin as f64) / size as f64)
        };
        [at(film.x, x, width), at(film.y, y, height)]
    }

    /// Numbers by which [`Sensor::sample_vertex`] takes a point of the lens; none are read for a
    /// pinhole.
    pub fn invert_vertex(&self, p: Vec3) -> Option<[f32; 2]> {
        let q = (p.as_dvec3() - self.origin) / self.lens_radius;
        let q = DVec2::new(self.axes[0].dot(q), self.axes[1].dot(q)).as_vec2();
        (!self.is_pinhole()).then(|| warp::concentric_disk_inverse(q))
    }

    /// The unit direction in which a ray from the lens point `p` lands on `film`: the inverse of
    /// [`Sensor::film_position`].
    #[inline]
    pub fn direction(&self, p: Vec3, film: Vec2) -> Vec3 {
        let mut plane = DVec3::new(
            (self.center[0] - film.x as f64) * self.pixel,
            (self.center[1] - film.y as f64) * self.pixel,
            1.0,
        );
        if !self.is_pinhole() {
            let offset = p.as_dvec3() - self.origin;
            plane.x -= self.axes[0].dot(offset) / self.focus_distance;
            plane.y -= self.axes[1].dot(offset) / self.focus_distance;
        }
        self.to_scene(plane).normalize().as_vec3()
    }

    /// Angle that a pixel at the centre of the view covers, in radians (to first order).
    pub fn pixel_angle(&self) -> f64 {
        self.pixel
    }

    /// The part of the film that paths may land on.
    pub fn crop(&self) -> Crop {
        self.crop
    }

    /// A point of the lens (technique t = 1) with its density: 1/area, or the counting measure of a
    /// pinhole.
    #[inline]
    pub fn sample_vertex(&self, lens: [f32; 2]) -> (Vertex, Density<Area>) {
        let p = if self.is_pinhole() {
            self.origin
        } else {
            let q = warp::concentric_disk(lens).as_dvec2() * self.lens_radius;
            self.origin + self.to_scene(DVec3::new(q.x, q.y, 0.0))
        };
        (self.vertex(p.as_vec3()), self.pdf_vertex())
    }

    /// Where a ray crosses the lens from its front before length `end` (unit direction); `None` for
    /// a pinhole. The lens stops no light.
    pub fn hit_lens(&self, ray: &Ray, end: f32) -> Option<Vec3> {
        let (o, d) = (ray.o.as_dvec3() - self.origin, ray.d.as_dvec3());
        let across = self.axes[2].dot(d);
        if self.is_pinhole() || across >= 0.0 {
            return None;
        }
        let t = -self.axes[2].dot(o) / across;
        let p = o + d * t;
        let hit = t > 0.0 && t < end as f64 && p.length() < self.lens_radius;
        hit.then(|| (self.origin + p).as_vec3())
    }

    /// Density of a lens point.
    #[inline]
    pub fn pdf_vertex(&self) -> Density<Area> {
        if self.is_pinhole() {
            Density::at_delta(Mass::ONE)
        } else {
            Density::new(1.0 / (PI * self.lens_radius * self.lens_radius))
        }
    }

    /// Where light that comes from direction `d` (unit, pointing away from the sensor) to the lens
    /// point `p` lands on the film; `None` outside the crop window.
    #[inline]
    pub fn film_position(&self, p: Vec3, d: Vec3) -> Option<Vec2> {
        let d = d.as_dvec3();
        let local = DVec3::new(self.axes[0].dot(d), self.axes[1].dot(d), self.axes[2].dot(d));
        if local.z <= 0.0 {
            return None;
        }
        let mut plane = DVec3::new(local.x / local.z, local.y / local.z, 1.0);
        if !self.is_pinhole() {
            // The point in focus decides, seen from the centre of the lens.
            let offset = p.as_dvec3() - self.origin;
            plane.x += self.axes[0].dot(offset) / self.focus_distance;
            plane.y += self.axes[1].dot(offset) / self.focus_distance;
        }
        let x = self.center[0] - plane.x / self.pixel;
        let y = self.center[1] - plane.y / self.pixel;
        let c = self.crop;
        let inside = x >= c.x as f64
            && y >= c.y as f64
            && x < (c.x + c.width) as f64
            && y < (c.y + c.height) as f64;
        let (right, bottom) = ((c.x + c.width) as f32, (c.y + c.height) as f32);
        inside.then(|| Vec2::new(below(x as f32, right), below(y as f32, bottom)))
    }

    /// Density of the direction `d` (unit) of a camera sample: p_σ = 1/(A cos³θ), A the window's
    /// area at z = 1. The caller has made sure that `d` lands on the film.
    #[inline]
    pub fn pdf_direction(&self, d: Vec3) -> Density<SolidAngle> {
        let cos = self.axes[2].dot(d.as_dvec3());
        Density::new(1.0 / (self.window_area() * cos * cos * cos))
    }

    /// W_e towards unit direction `d`: 1/(A_lens A cos⁴θ), without 1/A_lens for a pinhole. The
    /// caller has made sure that `d` lands on the film.
    #[inline]
    pub fn importance(&self, d: Vec3) -> f64 {
        let cos = self.axes[2].dot(d.as_dvec3());
        self.pdf_direction(d).value() * self.pdf_vertex().value() / cos
    }

    fn window_area(&self) -> f64 {
        self.crop.width as f64 * self.crop.height as f64 * self.pixel * self.pixel
    }

    fn vertex(&self, p: Vec3) -> Vertex {
        Vertex::Sensor { p, n: self.axis() }
    }

    fn to_scene(&self, v: DVec3) -> DVec3 {
        self.axes[0] * v.x + self.axes[1] * v.y + self.axes[2] * v.z
    }
}

/// `x` or the largest `f32` below `end`.
#[inline]
fn below(x: f32, end: f32) -> f32 {
    if x < end { x } else { end.next_down() }
}
