//! Sensors, with Mitsuba's angle of view brought to the horizontal one.

use glam::{DAffine3, DMat3, DVec3};
use pathspace_core::description::{FilmDescription, SensorDescription};

use super::props::Props;
use super::{Context, film, support};
use crate::error::Result;
use crate::note::NoteKind;

/// What a sensor element gives.
pub(super) struct Sensor {
    pub(super) sensor: SensorDescription,
    pub(super) film: FilmDescription,
    /// Samples per pixel of its sampler.
    pub(super) spp: Option<u32>,
    /// Index of the medium that it stands in.
    pub(super) medium: Option<usize>,
}

/// A sensor of Mitsuba's defaults, for scenes without one.
pub(super) fn default_sensor() -> Sensor {
    let film = film::default_film();
    let fov_x_degrees = fov_x(diagonal_of_50_mm(), Axis::Diagonal, &film);
    let sensor = SensorDescription { fov_x_degrees, ..SensorDescription::default() };
    Sensor { sensor, film, spp: None, medium: None }
}

/// Reads the sensor with this index.
pub(super) fn read(context: &mut Context<'_>, index: usize) -> Result<Sensor> {
    let object = &context.graph.objects[index];
    let thin_lens = match object.plugin.as_str() {
        "perspective" => false,
        "thinlens" => true,
        "orthographic" => return orthographic(context, index),
        "distant" | "irradiancemeter" | "radiancemeter" => {
            let props = Props::new(context.graph, object);
            return Err(props.error("makes no image, and the file has no other sensor"));
        }
        _ => return Err(support::unknown(object)),
    };
    let mut props = Props::new(context.graph, object);
    let film = match props.nested_one("film")? {
        Some(index) => film::read(context, index)?,
        None => film::default_film(),
    };
    let spp = match props.nested_one("sampler")? {
        Some(index) => film::read_sampler(context, index)?,
        None => None,
    };
    let medium = props.nested_one("medium")?;
    let fov_x_degrees = read_fov(&mut props, &film)?;
    let to_world = match props.transform("to_world")? {
        Some(t) => rigid(&props, t)?,
        None => DAffine3::IDENTITY,
    };
    // Mitsuba focuses on the far plane where the file does not say.
    let far = props.positive("far_clip")?.unwrap_or(1e4);
    props.ignore(context, &["near_clip", "far_clip"], "nothing is clipped");
    props.ignore(context, &["shutter_open", "shutter_close"], "nothing moves");
    let (aperture_radius, focus_distance) = if thin_lens {
        let Some(radius) = props.float("aperture_radius")? else {
            return Err(props.error("needs the property \"aperture_radius\""));
        };
        if radius < 0.0 {
            return Err(props.refuse("aperture_radius", "a number ≥ 0"));
        }
        (radius, props.positive("focus_distance")?.unwrap_or(far))
    } else {
        if object.old || props.has("focus_distance") {
            props.ignore(context, &["focus_distance"], "a pinhole is in focus everywhere");
        }
        (0.0, 1.0)
    };
    let principal_point_offset = [
        props.float("principal_point_offset_x")?.unwrap_or(0.0),
        props.float("principal_point_offset_y")?.unwrap_or(0.0),
    ];
    props.finish(context)?;
    let sensor = SensorDescription {
        to_world,
        fov_x_degrees,
        aperture_radius,
        focus_distance,
        principal_point_offset,
    };
    Ok(Sensor { sensor, film, spp, medium })
}

/// True for sensors that make an image.
pub(super) fn makes_an_image(plugin: &str) -> bool {
    matches!(plugin, "perspective" | "thinlens" | "orthographic")
}

/// Distance of the camera that stands for parallel rays, in widths of the image.
const FAR: f64 = 4096.0;

/// Parallel rays: a camera far behind the sensor, with an angle of view that spans its square.
fn orthographic(context: &mut Context<'_>, index: usize) -> Result<Sensor> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let film = match props.nested_one("film")? {
        Some(index) => film::read(context, index)?,
        None => film::default_film(),
    };
    let spp = match props.nested_one("sampler")? {
        Some(index) => film::read_sampler(context, index)?,
        None => None,
    };
    let medium = props.nested_one("medium")?;
    let own = props.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
    let m = own.matrix3;
    let [x, y] = [m.x_axis.length(), m.y_axis.length()];
    if !(x > 0.0 && (x - y).abs() < 1e-3 * x && m.z_axis.length() > 0.0) {
        return Err(props.complain("to_world", "x and y must be scaled alike"));
    }
    props.ignore(context, &["near_clip", "far_clip"], "nothing is clipped");
    props.ignore(context, &["shutter_open", "shutter_close"], "nothing moves");
    props.finish(context)?;
    let axes = DMat3::from_cols(m.x_axis / x, m.y_axis / y, m.z_axis.normalize());
    let distance = 2.0 * x * FAR;
    let to_world =
        DAffine3 { matrix3: axes, translation: own.translation - axes.z_axis * distance };
    let text = format!(
        "{} is a perspective camera from {FAR} widths behind: what is behind its plane is seen, too",
        object.title()
    );
    context.note(NoteKind::Differs, text, &object.place);
    let fov_x_degrees = 2.0 * (x / distance).atan().to_degrees();
    let sensor = SensorDescription { to_world, fov_x_degrees, ..SensorDescription::default() };
    Ok(Sensor { sensor, film, spp, medium })
}

/// Which side of the film an angle spans.
#[derive(Clone, Copy)]
enum Axis {
    X,
    Y,
    Diagonal,
}

/// `fov` along `fov_axis`, or the focal length of a 36 × 24 mm film along its diagonal.
pub(super) fn read_fov(props: &mut Props<'_>, film: &FilmDescription) -> Result<f64> {
    let fov = props.float("fov")?;
    let focal = props.string("focal_length")?;
    let (degrees, axis) = match (fov, focal) {
        (Some(_), Some(_)) => {
            return Err(props.error("has \"fov\" and \"focal_length\": give one of them"));
        }
        (Some(fov), None) => {
            if !(fov > 0.0 && fov < 180.0) {
                return Err(props.refuse("fov", "an angle between 0 and 180 degrees"));
            }
            (fov, read_axis(props, film)?)
        }
        (None, Some(text)) => {
            let digits = text.trim().trim_end_matches("mm").trim_end();
            match digits.parse::<f64>() {
                Ok(mm) if mm.is_finite() && mm > 0.0 => (diagonal_of(mm), Axis::Diagonal),
                _ => return Err(props.refuse("focal_length", "a length such as 50mm")),
            }
        }
        (None, None) => (diagonal_of_50_mm(), Axis::Diagonal),
    };
    let fov_x = fov_x(degrees, axis, film);
    if !(fov_x > 0.0 && fov_x < 180.0) {
        return Err(props.error(format!("horizontal angle of view {fov_x} is not within 0 to 180")));
    }
    Ok(fov_x)
}

fn read_axis(props: &mut Props<'_>, film: &FilmDescription) -> Result<Axis> {
    let wide = film.width > film.height;
    match props.string("fov_axis")? {
        None | Some("x") => Ok(Axis::X),
        Some("y") => Ok(Axis::Y),
        Some("diagonal") => Ok(Axis::Diagonal),
        Some("smaller") => Ok(if wide { Axis::Y } else { Axis::X }),
        Some("larger") => Ok(if wide { Axis::X } else { Axis::Y }),
        Some(_) => Err(props.refuse("fov_axis", "one of x, y, diagonal, smaller, larger")),
    }
}

/// Diagonal angle of view of a lens on 36 × 24 mm film.
fn diagonal_of(focal_mm: f64) -> f64 {
    2.0 * (36f64.hypot(24.0) / (2.0 * focal_mm)).atan().to_degrees()
}

fn diagonal_of_50_mm() -> f64 {
    diagonal_of(50.0)
}

/// tan(fov_x/2) = tan(fov/2) · width / length of the axis, on the whole film.
fn fov_x(degrees: f64, axis: Axis, film: &FilmDescription) -> f64 {
    let (w, h) = (f64::from(film.width), f64::from(film.height));
    let length = match axis {
        Axis::X => return degrees,
        Axis::Y => h,
        Axis::Diagonal => w.hypot(h),
    };
    2.0 * ((degrees / 2.0).to_radians().tan() * w / length).atan().to_degrees()
}

/// A camera may be turned, moved and mirrored, but not scaled (Mitsuba refuses it too). Rounding
/// in the file is removed, so that directions stay unit vectors.
pub(super) fn rigid(props: &Props<'_>, t: DAffine3) -> Result<DAffine3> {
    let m = t.matrix3;
    let gram = m.transpose() * m;
    let close = |v: DVec3, unit: DVec3| (v - unit).abs().max_element() < 1e-3;
    if !(close(gram.x_axis, DVec3::X)
        && close(gram.y_axis, DVec3::Y)
        && close(gram.z_axis, DVec3::Z))
    {
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
        let right = |a: DVec3, b: DVec3| (a.angle_between(b).to_degrees() - 90.0).abs();
        let skew =
            right(m.x_axis, m.y_axis).max(right(m.y_axis, m.z_axis)).max(right(m.z_axis, m.x_axis));
        let reason = format!(
            "a camera cannot be scaled or sheared (its axes are × {x:.4}, {y:.4}, {z:.4}, and up to {skew:.2}° from right angles)"
        );
        return Err(props.complain("to_world", &reason));
    }
    let z = m.z_axis.normalize();
    let y = (m.y_axis - z * m.y_axis.dot(z)).normalize();
    let x = y.cross(z) * m.determinant().signum();
    let matrix3 = glam::DMat3::from_cols(x, y, z);
    Ok(DAffine3 { matrix3, translation: t.translation })
}
