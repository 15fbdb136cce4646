//! Sun and sky: the model of Hosek and Wilkie 2012 ("An Analytic Model for Full Spectral Sky-Dome
//! Radiance") as an environment map, and the sun as a direction.

mod sun;

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::{DMat3, DVec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use pathspace_core::description::EmitterDescription;
use pathspace_core::texture::Bitmap;

use super::Context;
use super::emitter::rotation;
use super::props::{Props, rounded};
use crate::error::Result;
use crate::note::NoteKind;
use crate::spectrum::Meaning;

/// Size of the map; a row lies on the horizon.
const SIZE: [u32; 2] = [512, 257];

/// Mitsuba's normalisation of luminance: what the data of the model count in.
const NORMALISATION: f64 = 1.0 / 106.750_259_4;

/// Reads `sunsky` of Mitsuba 3, or `sky`, `sun` and `sunsky` of 0.x.
pub(super) fn read(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
) -> Result<Vec<EmitterDescription>> {
    let old = props.object.old;
    let plugin = props.object.plugin.as_str();
    let turbidity = props.float("turbidity")?.unwrap_or(3.0);
    if !(1.0..=10.0).contains(&turbidity) {
        return Err(props.refuse("turbidity", "a number from 1 to 10"));
    }
    let albedo = props.colour(context, "albedo", Meaning::Factor, [0.0, 1.0])?;
    let albedo = albedo.unwrap_or([if old { 0.15 } else { 0.3 }; 3]);
    let mut scale = |name: &str| match props.float(name)? {
        Some(v) if v < 0.0 => Err(props.refuse(name, "a number ≥ 0")),
        other => Ok(other.unwrap_or(1.0)),
    };
    let all = if old { scale("scale")? } else { 1.0 };
    let (sun_scale, sky_scale) = (all * scale("sun_scale")?, all * scale("sky_scale")?);
    let to_world = match props.transform("to_world")? {
        Some(t) => rotation(props, t.matrix3)?,
        None => DMat3::IDENTITY,
    };
    // Up is +z in Mitsuba 3, +y in 0.x.
    let up = if old { DMat3::IDENTITY } else { DMat3::from_rotation_x(FRAC_PI_2) };
    let map_to_world = to_world * up;
    let sun = match props.vector("sun_direction")? {
        Some(d) => match d.try_normalize() {
            Some(d) if old => to_world * d,
            Some(d) => d,
            None => return Err(props.refuse("sun_direction", "a direction other than 0, 0, 0")),
        },
        None => {
            let [zenith, azimuth] = sun_angles(props)?;
            let (sin, cos) = zenith.sin_cos();
            // From the direction that both versions call north.
            let local = match old {
                true => DVec3::new(azimuth.sin() * sin, cos, -azimuth.cos() * sin),
                false => DVec3::new(azimuth.cos() * sin, azimuth.sin() * sin, cos),
            };
            to_world * local
        }
    };
    let aperture = ["sun_aperture", "complex_sun", "sun_radius_scale", "resolution", "stretch"];
    props.ignore(context, &aperture, "the sun is a direction here");
    let local = map_to_world.transpose() * sun;
    let elevation = local.y.clamp(-1.0, 1.0).asin();
    let mut emitters = Vec::new();
    if elevation < 0.0 {
        let text = format!("{}: the sun is below the horizon: all is dark", props.object.title());
        context.note(NoteKind::Mended, text, props.place());
    }
    if old {
        let text = format!("{} is that of Mitsuba 3, with its data", props.object.title());
        context.note(NoteKind::Differs, text, props.place());
    }
    if plugin != "sun" && sky_scale > 0.0 {
        let bitmap = map(turbidity, albedo, local, sky_scale)
            .ok_or_else(|| props.error("has a sky that can not be computed"))?;
        emitters.push(EmitterDescription::Environment {
            bitmap: Arc::new(bitmap),
            to_world: map_to_world,
            scale: 1.0,
        });
    }
    if plugin != "sky" && sun_scale > 0.0 && elevation > 0.0 {
        let text = format!(
            "the sun of {} is a direction: its shadows are sharp, and mirrors do not show its disk",
            props.object.title()
        );
        context.note(NoteKind::Differs, text, props.place());
        let irradiance = sun::irradiance(turbidity, elevation).map(|v| v * sun_scale);
        emitters.push(EmitterDescription::Directional {
            direction: -sun,
            irradiance: rounded(irradiance),
        });
    }
    Ok(emitters)
}

/// The sky over all directions of an environment map, +y up, black below the horizon; `sun` in its
/// space.
fn map(turbidity: f64, albedo: [f64; 3], sun: DVec3, scale: f64) -> Option<Bitmap> {
    let [width, height] = SIZE;
    let mut texels = vec![0.0; 3 * width as usize * height as usize];
    let elevation = sun.y.clamp(-1.0, 1.0).asin();
    if elevation >= 0.0 {
        let params = SkyParams {
            elevation: (elevation as f32).min(std::f32::consts::FRAC_PI_2),
            turbidity: turbidity as f32,
            albedo: albedo.map(|a| a as f32),
        };
        let state = SkyState::new(&params).ok()?;
        let mut at = 0;
        for j in 0..=height / 2 {
            let theta = PI * f64::from(j) / f64::from(height - 1);
            let (sin, cos) = theta.sin_cos();
            for i in 0..width {
                let phi = TAU * (f64::from(i) + 0.5) / f64::from(width);
                let d = DVec3::new(phi.sin() * sin, cos, -phi.cos() * sin);
                let gamma = d.dot(sun).clamp(-1.0, 1.0).acos() as f32;
                for channel in [Channel::R, Channel::G, Channel::B] {
                    let radiance = f64::from(state.radiance(theta as f32, gamma, channel));
                    texels[at] = (radiance * NORMALISATION * scale).max(0.0) as f32;
                    at += 1;
                }
            }
        }
    }
    Bitmap::from_floats(width, height, 3, texels).ok()
}

/// Zenith angle and azimuth of the sun from place and time (Blanco-Muriel et al. 2001, "Computing
/// the Solar Vector").
fn sun_angles(props: &mut Props<'_>) -> Result<[f64; 2]> {
    let mut number =
        |name: &str, default: f64| -> Result<f64> { Ok(props.float(name)?.unwrap_or(default)) };
    let latitude = number("latitude", 35.6894)?.to_radians();
    let (longitude, timezone) = (number("longitude", 139.6917)?, number("timezone", 9.0)?);
    let (year, month, day) = (number("year", 2010.0)?, number("month", 7.0)?, number("day", 10.0)?);
    let (hour, minute, second) =
        (number("hour", 15.0)?, number("minute", 0.0)?, number("second", 0.0)?);
    let hours = hour - timezone + (minute + second / 60.0) / 60.0;
    let days = days_since_2000(year as i64, month as i64, day as i64) + hours / 24.0;
    // The ecliptic.
    let omega = 2.1429 - 0.0010394594 * days;
    let anomaly = 6.2400600 + 0.0172019699 * days;
    let longitude_of_sun = 4.8950630
        + 0.017202791698 * days
        + 0.03341607 * anomaly.sin()
        + 0.00034894 * (2.0 * anomaly).sin()
        - 0.0001134
        - 0.0000203 * omega.sin();
    let obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * omega.cos();
    // The sky.
    let ascension =
        (obliquity.cos() * longitude_of_sun.sin()).atan2(longitude_of_sun.cos()).rem_euclid(TAU);
    let declination = (obliquity.sin() * longitude_of_sun.sin()).asin();
    // The place.
    let sidereal = 6.6974243242 + 0.0657098283 * days + hours;
    let hour_angle = (sidereal * 15.0 + longitude).to_radians() - ascension;
    let cos_zenith =
        latitude.cos() * hour_angle.cos() * declination.cos() + declination.sin() * latitude.sin();
    let zenith = cos_zenith.clamp(-1.0, 1.0).acos();
    let azimuth = (-hour_angle.sin())
        .atan2(declination.tan() * latitude.cos() - latitude.sin() * hour_angle.cos());
    // Parallax: the radius of the earth over its distance from the sun.
    let parallax = 6371.01 / 149_597_890.0 * zenith.sin();
    Ok([zenith + parallax, azimuth - PI])
}

/// Days from noon of 1 January 2000 to midnight of a date of the Gregorian calendar.
fn days_since_2000(year: i64, month: i64, day: i64) -> f64 {
    let before_march = (month - 14) / 12;
    let number = (1461 * (year + 4800 + before_march)) / 4
        + (367 * (month - 2 - 12 * before_march)) / 12
        - (3 * ((year + 4900 + before_march) / 100)) / 4
        + day
        - 32075;
    number as f64 - 0.5 - 2_451_545.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_counted_from_2000() {
        assert_eq!(days_since_2000(2000, 1, 1), -0.5);
        assert_eq!(days_since_2000(2010, 7, 10), 3842.5);
    }

    #[test]
    fn the_sky_is_blue_above_and_black_below() {
        let sun = DVec3::new(0.0, 0.5, -0.75_f64.sqrt());
        let sky = map(3.0, [0.3; 3], sun, 1.0).unwrap();
        let zenith = sky.texel(7, 0);
        assert!(zenith.b > 2.0 * zenith.r && zenith.r > 0.0, "{zenith:?}");
        assert!(sky.texel(7, 140).is_black() && !sky.texel(7, 128).is_black());
    }

    #[test]
    fn a_low_sun_is_red_and_a_high_one_nearly_white() {
        let [r, g, b] = sun::irradiance(3.0, 10_f64.to_radians());
        assert!(r > g && g > b && b > 0.0);
        // Measured in Mitsuba 3.9.1 at 60°.
        let high = sun::irradiance(3.0, 60_f64.to_radians());
        for (found, expected) in high.iter().zip([1.50232, 1.2580, 0.96884]) {
            assert!((found / expected - 1.0).abs() < 0.01, "{high:?}");
        }
    }
}
