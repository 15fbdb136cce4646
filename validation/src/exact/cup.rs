//! Caustics of a cup: light that a cylindrical mirror throws onto its floor, by flux.
//!
//! Seen from above, a ray that meets the circle of radius R at the angle of incidence i is
//! reflected along a chord of length 2R cos i and touches the caustic at the distance s' behind the
//! wall, 1/s + 1/s' = 2/(R cos i) (Coddington's equation for the plane of incidence) with s the
//! horizontal distance of the source: s' = ½R cos i from infinity, a nephroid; s' = ⅔R cos i from a
//! source on the circle, s = 2R cos i, a cardioid. Heights fall along the unfolded ray as if there
//! were no mirror. Where the ray reaches the floor at the horizontal distance t behind the wall,
//! the irradiance is
//!
//! E = ρ E₀ sin β |s'/(s' − t)|, tan β = height / horizontal distance,
//!
//! E₀ the beam's irradiance across itself if the wall only bent it; for a point of intensity I,
//! E₀ = I (s + t)/(s D²), D the length of the whole ray. E is infinite on the caustic, its integral
//! over a rectangle is not.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use pathspace_core::Rgb;
use pathspace_core::description::{EmitterDescription, FilmDescription};
use pathspace_core::film::Families;

use super::quadrature::interval;
use super::{ExactLength, ExactScene, up_to};
use crate::scene_builder::SceneBuilder;

/// Reflectance of the mirror.
const MIRROR: f32 = 0.9;
/// Reflectance of the floor: what it sends back to the mirror needs longer paths.
const FLOOR: f32 = 0.5;
/// Height of the mirror; its radius is 1.
const HEIGHT: f64 = 1.0;
/// Panels of a quadrature: flux as a function of the chord has kinks and roots.
const PANELS: usize = 1 << 14;

/// Every scene of this file.
pub fn all() -> Vec<ExactScene> {
    let (beam, point) = (Light::beam(), Light::on_the_rim());
    let [whole, of_nephroid, of_cardioid] = bins();
    vec![
        scene("nephroid", &beam, whole),
        scene("nephroid, a quarter", &beam, of_nephroid),
        scene("cardioid", &point, whole),
        scene("cardioid, a quarter", &point, of_cardioid),
    ]
}

/// Nearly all of the floor, and for each caustic a quarter with the cusp, one fold, and both sides
/// of them.
fn bins() -> [Bin; 3] {
    [
        Bin { x: [-0.52, 0.76], y: [-0.55, 0.55] },
        Bin { x: [0.3, 0.8], y: [0.0, 0.5] },
        Bin { x: [-0.1, 0.5], y: [0.0, 0.75] },
    ]
}

/// A rectangle of the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// Range of x.
    pub x: [f64; 2],
    /// Range of y.
    pub y: [f64; 2],
}

/// What shines into the cup of radius 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light that travels towards +x and downwards.
    Beam {
        /// Irradiance across the beam.
        irradiance: f64,
        /// Tangent of the angle β to the floor.
        tan: f64,
    },
    /// A point above the rim at (−1, 0).
    Rim {
        /// Intensity.
        intensity: f64,
        /// Height above the floor, more than the mirror's.
        height: f64,
    },
}

/// A ray from the light to the wall as seen from above.
struct Chord {
    /// Where it meets the wall.
    wall: DVec2,
    /// Unit direction behind it.
    out: DVec2,
    /// Cosine of the angle of incidence; the chord behind the wall is twice as long.
    cos: f64,
    /// Horizontal way from the light to the wall; 0 for a beam.
    way: f64,
}

impl Light {
    fn beam() -> Self {
        Light::Beam { irradiance: 1.0, tan: 1.0 }
    }

    fn on_the_rim() -> Self {
        Light::Rim { intensity: 1.0, height: 1.25 * HEIGHT }
    }

    /// The chord of parameter p: the y of a beam's ray, the horizontal angle to +x of a point's.
    fn chord(&self, p: f64) -> Chord {
        let (direction, angle, way) = match self {
            Light::Beam { .. } => (DVec2::X, p.asin(), 0.0),
            // The angle at the centre is twice that on the circle.
            Light::Rim { .. } => (DVec2::from_angle(p), 2.0 * p, 2.0 * p.cos()),
        };
        let wall = DVec2::from_angle(angle);
        let cos = direction.dot(wall);
        Chord { wall, out: direction - 2.0 * cos * wall, cos, way }
    }

    /// Flux per dp of the rays that would reach the height 0 at horizontal distances in [l0, l1]
    /// from the light, or from the wall for a beam.
    fn flux(&self, l0: f64, l1: f64) -> f64 {
        match *self {
            Light::Beam { irradiance, tan } => {
                let sin = tan / (1.0 + tan * tan).sqrt();
                irradiance * sin * (l1 - l0)
            }
            Light::Rim { intensity, height } => {
                let sin = |l: f64| height / (height * height + l * l).sqrt();
                intensity * (sin(l0) - sin(l1))
            }
        }
    }

    /// Horizontal distances t behind the wall at which rays of a chord reach the floor that have
    /// come in above the rim, met the wall below it, and not yet the wall again.
    fn reach(&self, chord: &Chord) -> [f64; 2] {
        let again = 2.0 * chord.cos;
        match *self {
            Light::Beam { tan, .. } => {
                // Height at the wall: t·tan β ≤ H; where the ray came in: (t + 2 cos i) tan β ≥ H.
                let rim = HEIGHT / tan;
                [(rim - again).max(0.0), rim.min(again)]
            }
            // Height at the wall: h t/(way + t) ≤ H. The light itself is above the rim.
            Light::Rim { height, .. } => [0.0, again.min(chord.way * HEIGHT / (height - HEIGHT))],
        }
    }

    /// Range of the parameter of [`Light::chord`].
    fn range(&self) -> [f64; 2] {
        match self {
            Light::Beam { .. } => [-1.0, 1.0],
            Light::Rim { .. } => [-0.5 * PI, 0.5 * PI],
        }
    }

    /// Flux that falls into a rectangle of the floor after exactly one reflection by a perfect
    /// mirror: ∫ dp ∫ dt over the part of each chord within the rectangle, the inner integral in
    /// closed form.
    pub fn reflected(&self, bin: &Bin) -> f64 {
        let [from, to] = self.range();
        interval(from, to, PANELS, |p| {
            let chord = self.chord(p);
            let [t0, t1] = bin.clip(chord.wall, chord.out, self.reach(&chord));
            if t0 < t1 { self.flux(chord.way + t0, chord.way + t1) } else { 0.0 }
        })
    }

    /// Flux that falls into a rectangle of the floor without reflection.
    pub fn direct(&self, bin: &Bin) -> f64 {
        let [from, to] = self.range();
        match *self {
            Light::Beam { irradiance, tan } => {
                let sin = tan / (1.0 + tan * tan).sqrt();
                // The rim's shadow ends H/tan β behind the near wall at x = −√(1 − y²).
                interval(bin.y[0], bin.y[1], PANELS, |y| {
                    let lit = HEIGHT / tan - (1.0 - y * y).sqrt();
                    irradiance * sin * (bin.x[1] - bin.x[0].max(lit)).max(0.0)
                })
            }
            Light::Rim { .. } => interval(from, to, PANELS, |p| {
                let all = [0.0, 2.0 * p.cos()];
                let [t0, t1] = bin.clip(-DVec2::X, DVec2::from_angle(p), all);
                if t0 < t1 { self.flux(t0, t1) } else { 0.0 }
            }),
        }
    }
}

impl Bin {
    /// Part of `reach` in which o + t·d is within the rectangle.
    fn clip(&self, o: DVec2, d: DVec2, reach: [f64; 2]) -> [f64; 2] {
        let mut t = reach;
        for (o, d, [lo, hi]) in [(o.x, d.x, self.x), (o.y, d.y, self.y)] {
            if d == 0.0 {
                if o < lo || o > hi {
                    return [0.0, 0.0];
                }
            } else {
                let (a, b) = ((lo - o) / d, (hi - o) / d);
                t = [t[0].max(a.min(b)), t[1].min(a.max(b))];
            }
        }
        t
    }

    fn size(&self) -> DVec2 {
        DVec2::new(self.x[1] - self.x[0], self.y[1] - self.y[0])
    }
}

/// The cup with a film that is exactly the rectangle, seen from within. Height over width of the
/// rectangle must be a whole number of 64ths.
fn scene(name: &'static str, light: &Light, bin: Bin) -> ExactScene {
    let mut b = SceneBuilder::new(64);
    let size = bin.size();
    b.description().film = FilmDescription::new(64, (64.0 * size.y / size.x).round() as u32);
    let (mirror, grey) = (b.mirror(MIRROR), b.diffuse(FLOOR));
    b.cylinder(DVec3::ZERO, DVec3::Z * HEIGHT, 1.0, mirror).flip_normals = true;
    b.disk(DVec3::ZERO, DVec3::Z, 1.0, grey);
    b.emitter(match *light {
        Light::Beam { irradiance, tan } => EmitterDescription::Directional {
            direction: DVec3::new(1.0, 0.0, -tan),
            irradiance: Rgb::grey(irradiance as f32),
        },
        Light::Rim { intensity, height } => EmitterDescription::Point {
            position: DVec3::new(-1.0, 0.0, height),
            intensity: Rgb::grey(intensity as f32),
        },
    });
    let below = DVec3::new(0.5 * (bin.x[0] + bin.x[1]), 0.5 * (bin.y[0] + bin.y[1]), 0.0);
    let eye = 0.5 * HEIGHT;
    let fov = 2.0 * (0.5 * size.x / eye).atan().to_degrees();
    b.look_at(below + DVec3::Z * eye, below, DVec3::Y, fov);
    let radiance = |flux: f64| FLOOR as f64 / PI * flux / (size.x * size.y);
    let expected = vec![
        ExactLength::new(2, radiance(light.direct(&bin)), Families::S1 | Families::T1),
        ExactLength::new(3, radiance(MIRROR as f64 * light.reflected(&bin)), Families::T1),
    ];
    ExactScene { name, description: b.finish(), rules: up_to(3), expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parameters of the chords through the point q of the floor, and where on them it lies.
    fn chords_through(light: &Light, q: DVec2) -> Vec<(Chord, f64)> {
        let [from, to] = light.range();
        let side = |p: f64| {
            let chord = light.chord(p);
            chord.out.perp_dot(q - chord.wall)
        };
        let at = |i: usize| from + (to - from) * (i as f64 + 0.5) / 4000.0;
        let found = (0..3999).filter(|&i| side(at(i)) * side(at(i + 1)) < 0.0).map(|i| {
            let (mut lo, mut hi) = (at(i), at(i + 1));
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                if side(lo) * side(middle) <= 0.0 { hi = middle } else { lo = middle }
            }
            let chord = light.chord(lo);
            let t = (q - chord.wall).dot(chord.out);
            (chord, t)
        });
        found
            .filter(|(chord, t)| {
                let [t0, t1] = light.reach(chord);
                (t0..=t1).contains(t)
            })
            .collect()
    }

    /// E at the distance t on a chord, from the formula.
    fn irradiance(light: &Light, chord: &Chord, t: f64) -> f64 {
        let (e0, tan, focus) = match *light {
            Light::Beam { irradiance, tan } => (irradiance, tan, 0.5 * chord.cos),
            Light::Rim { intensity, height } => {
                let (s, l) = (chord.way, chord.way + t);
                (intensity * l / (s * (l * l + height * height)), height / l, 2.0 / 3.0 * chord.cos)
            }
        };
        e0 * tan / (1.0 + tan * tan).sqrt() * (focus / (focus - t)).abs()
    }

    #[test]
    fn flux_into_a_small_square_is_the_irradiance_of_all_chords_through_it() {
        for light in [Light::beam(), Light::on_the_rim()] {
            // Outside the caustic one chord, inside it three.
            let mut counts = Vec::new();
            for q in [DVec2::new(0.75, 0.1), DVec2::new(0.2, 0.15), DVec2::new(0.35, -0.12)] {
                let h = 2e-3;
                let bin = Bin { x: [q.x - h, q.x + h], y: [q.y - h, q.y + h] };
                // The quadrature over all chords resolves it to a hundredth.
                let flux = light.reflected(&bin) / (4.0 * h * h);
                let chords = chords_through(&light, q);
                let sum: f64 = chords.iter().map(|(c, t)| irradiance(&light, c, *t)).sum();
                assert!((flux / sum - 1.0).abs() < 0.01, "{light:?} at {q}: {flux} against {sum}");
                counts.push(chords.len());
            }
            assert!(counts.iter().any(|n| *n >= 2), "{light:?}: {counts:?}");
        }
    }

    /// Neighbouring chords cross at the distance s' that the formula names.
    #[test]
    fn the_caustic_lies_where_neighbouring_chords_cross() {
        for (light, part) in [(Light::beam(), 0.5), (Light::on_the_rim(), 2.0 / 3.0)] {
            for p in [0.05, 0.3, 0.6] {
                let (a, b) = (light.chord(p - 1e-5), light.chord(p + 1e-5));
                let t = (b.wall - a.wall).perp_dot(b.out) / a.out.perp_dot(b.out);
                assert!((t - part * light.chord(p).cos).abs() < 1e-4, "{light:?} at {p}: {t}");
            }
        }
    }

    #[test]
    fn all_light_that_comes_in_reaches_the_floor_or_the_wall_again() {
        // Of a beam that just clears the near rim, the whole floor receives what the far wall
        // sends.
        let light = Light::Beam { irradiance: 1.0, tan: 1.0 };
        let all = Bin { x: [-1.0, 1.0], y: [-1.0, 1.0] };
        let chord = |y: f64| (1.0 - y * y).sqrt();
        let sin = 0.5_f64.sqrt();
        let strips = interval(-1.0, 1.0, PANELS, |y| {
            let reach = 2.0 * chord(y);
            sin * (reach.min(1.0) - (1.0 - reach).max(0.0)).max(0.0)
        });
        assert!((light.reflected(&all) / strips - 1.0).abs() < 1e-9);
    }

    #[test]
    fn films_have_the_shape_of_their_rectangles() {
        for bin in bins() {
            let rows = 64.0 * bin.size().y / bin.size().x;
            assert!((rows - rows.round()).abs() < 1e-9, "{bin:?}");
        }
    }

    #[test]
    fn the_quadrature_has_converged() {
        for scene in all() {
            assert!(scene.expected.iter().all(|e| e.mean > 0.0), "{}", scene.name);
        }
        for light in [Light::beam(), Light::on_the_rim()] {
            let bin = Bin { x: [0.35, 0.6], y: [-0.15, 0.1] };
            let halves = [[0.35, 0.45], [0.45, 0.6]].map(|x| light.reflected(&Bin { x, ..bin }));
            let whole = light.reflected(&bin);
            assert!((halves[0] + halves[1] - whole).abs() < 1e-6 * whole);
        }
    }
}
