//! The meshes of the library's scenes. Lengths are those of their scenes.

use std::f64::consts::{FRAC_PI_2, PI};

use super::mesh::{Mesh, MeshBuilder};
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

/// `ajar-door`: a glass egg standing on y = 0, 0.24 high, the thick end down.
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
