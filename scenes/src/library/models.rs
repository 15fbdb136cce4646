//! The meshes of the library's scenes. Lengths are those of their scenes.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use super::heightfield::heightfield;
use super::mesh::{Corner, Mesh, MeshBuilder};
use super::revolve::Profile;

/// `ring-caustic`: a thin-walled ring standing on y = 0, inner radius 1.
pub fn ring() -> Mesh {
    const INNER: f64 = 1.0;
    const OUTER: f64 = 1.04;
    const TOP: f64 = 0.32;
    Profile::new()
        .line((OUTER, 0.0), (OUTER, TOP))
        .line((OUTER, TOP), (INNER, TOP))
        .line((INNER, TOP), (INNER, 0.0))
        .line((INNER, 0.0), (OUTER, 0.0))
        .revolve(256)
}

/// `glass-lamp`: a closed bulb of glass, pear-shaped, its widest part about the origin: an outer
/// and an inner surface whose normals both point away from the glass.
pub fn bulb() -> Mesh {
    const WALL: f64 = 0.008;
    // A ball of radius 0.16 drawn out upwards into a rounded neck.
    let pear = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let lift = 0.5 * (1.0 + sin);
        (0.16 * cos * (1.0 - 0.55 * lift * lift * lift), 0.19 * sin + 0.09 * lift * lift)
    };
    let outer = move |t: f64| pear(PI * (t - 0.5));
    let inner = move |t: f64| parallel(pear, PI * (0.5 - t), WALL);
    let mut builder = MeshBuilder::default();
    Profile::new().curve(96, outer).revolve_into(96, &mut builder);
    Profile::new().curve(96, inner).revolve_into(96, &mut builder);
    builder.build()
}

/// Point at `angle` of the curve that runs inside `curve` at the distance `depth`.
fn parallel(curve: impl Fn(f64) -> (f64, f64), angle: f64, depth: f64) -> (f64, f64) {
    const H: f64 = 1e-5;
    let ((r0, y0), (r, y), (r1, y1)) = (curve(angle - H), curve(angle), curve(angle + H));
    let (dr, dy) = (r1 - r0, y1 - y0);
    let length = dr.hypot(dy);
    (r - depth * dy / length, y + depth * dr / length)
}

/// `ajar-door`, `glass-egg`: an egg standing on y = 0, 0.24 high, the thick end down.
pub fn egg() -> Mesh {
    const HALF_HEIGHT: f64 = 0.12;
    Profile::new()
        .curve(64, |t| {
            let (sin, cos) = (PI * (t - 0.5)).sin_cos();
            (0.09 * cos * (1.0 - 0.16 * sin), HALF_HEIGHT * (1.0 + sin))
        })
        .revolve(96)
}

/// `ajar-door`: a vase standing on y = 0, 0.34 high, hollow, with a rounded rim.
pub fn vase() -> Mesh {
    const RIM: f64 = 0.006;
    const HEIGHT: f64 = 0.34;
    // Belly below, neck above, as a function of the height over the foot.
    let radius = |y: f64| {
        let t = y / HEIGHT;
        0.055 + 0.055 * (PI * (1.1 * t)).sin() + 0.02 * t * t * t
    };
    let wall = move |y: f64| (radius(y), y);
    let foot = radius(0.0);
    let lip = radius(HEIGHT);
    const FLOOR: f64 = 0.012;
    let inside = move |y: f64| (radius(y) - 2.0 * RIM, y);
    Profile::new()
        .line((0.0, 0.0), (foot, 0.0))
        .curve(64, move |t| wall(t * HEIGHT))
        .arc((lip - RIM, HEIGHT), RIM, (0.0, PI), 12)
        .curve(64, move |t| inside(HEIGHT + t * (FLOOR - HEIGHT)))
        .line((radius(FLOOR) - 2.0 * RIM, FLOOR), (0.0, FLOOR))
        .revolve(96)
}

/// `kajiya`: a solid column of radius 1 standing on y = 0, 1 high, with rounded edges.
pub fn column() -> Mesh {
    const EDGE: f64 = 0.06;
    Profile::new()
        .line((0.0, 0.0), (1.0, 0.0))
        .line((1.0, 0.0), (1.0, 1.0 - EDGE))
        .arc((1.0 - EDGE, 1.0 - EDGE), EDGE, (0.0, FRAC_PI_2), 8)
        .line((1.0 - EDGE, 1.0), (0.0, 1.0))
        .revolve(96)
}

/// `glass-egg`: the bowl of a floor lamp about the y axis, its lowest point outside at the
/// origin, open above.
pub fn bowl() -> Mesh {
    const WALL: f64 = 0.012;
    const HEIGHT: f64 = 0.24;
    let outside = |t: f64| {
        let (sin, cos) = (t * FRAC_PI_2).sin_cos();
        (0.26 * sin, HEIGHT * (1.0 - cos))
    };
    let inside = |t: f64| {
        let (sin, cos) = (t * FRAC_PI_2).sin_cos();
        ((0.26 - WALL) * sin, HEIGHT - (HEIGHT - WALL) * cos)
    };
    Profile::new()
        .curve(24, outside)
        .line((0.26, HEIGHT), (0.26 - WALL, HEIGHT))
        .curve(24, |t| inside(1.0 - t))
        .revolve(64)
}

/// `glass-egg`: a tube about the y axis, closed below by a plate that lies under y = 0.01 and
/// open above.
pub fn tube() -> Mesh {
    const OUTER: f64 = 0.065;
    const INNER: f64 = 0.06;
    const PLATE: f64 = 0.01;
    const LENGTH: f64 = 0.4;
    Profile::new()
        .line((0.0, 0.0), (OUTER, 0.0))
        .line((OUTER, 0.0), (OUTER, LENGTH))
        .line((OUTER, LENGTH), (INNER, LENGTH))
        .line((INNER, LENGTH), (INNER, PLATE))
        .line((INNER, PLATE), (0.0, PLATE))
        .revolve(48)
}

/// `water-pool`: the surface of the water about y = 0, a little wider than the pool [−1,1]².
pub fn water() -> Mesh {
    // Amplitude, wave vector and phase of each wave.
    const WAVES: [(f64, DVec2, f64); 5] = [
        (0.0150, DVec2::new(7.0, 5.0), 0.3),
        (0.0130, DVec2::new(-5.5, 9.0), 1.9),
        (0.0090, DVec2::new(13.0, -3.5), 4.1),
        (0.0060, DVec2::new(4.0, 16.5), 2.6),
        (0.0040, DVec2::new(-19.0, -9.0), 5.2),
    ];
    heightfield(1.02, 96, |x, z| {
        let mut height = 0.0;
        let mut gradient = DVec2::ZERO;
        for (amplitude, wave, phase) in WAVES {
            let (sin, cos) = (wave.dot(DVec2::new(x, z)) + phase).sin_cos();
            height += amplitude * sin;
            gradient += amplitude * cos * wave;
        }
        (height, gradient)
    })
}

/// `water-pool`: the light squares of the chequered bottom, y = −0.6.
pub fn light_tiles() -> Mesh {
    tiles(0)
}

/// `water-pool`: the dark squares of the chequered bottom.
pub fn dark_tiles() -> Mesh {
    tiles(1)
}

/// The squares of [−1,1]² in y = −0.6, ten a side, whose column and row have this parity.
fn tiles(parity: usize) -> Mesh {
    const SIDE: usize = 10;
    let mut builder = MeshBuilder::default();
    let place = |i: usize| 2.0 * i as f64 / SIDE as f64 - 1.0;
    let corner = |i: usize, k: usize| Corner {
        position: DVec3::new(place(i), -0.6, place(k)),
        normal: DVec3::Y,
    };
    for k in 0..SIDE {
        for i in (0..SIDE).filter(|i| (i + k) % 2 == parity) {
            builder.quad([corner(i, k), corner(i, k + 1), corner(i + 1, k + 1), corner(i + 1, k)]);
        }
    }
    builder.build()
}

/// `smooth-shading`: the unit sphere in 10 × 6 facets with the sphere's own normals.
pub fn coarse_ball() -> Mesh {
    Profile::new().arc((0.0, 0.0), 1.0, (-FRAC_PI_2, FRAC_PI_2), 6).revolve(10)
}

/// `smooth-shading`: the torus of radii 1 and 0.35 about the y axis in 12 × 7 facets with the
/// torus' own normals.
pub fn coarse_torus() -> Mesh {
    Profile::new().arc((1.0, 0.0), 0.35, (0.0, 2.0 * PI), 7).revolve(12)
}
