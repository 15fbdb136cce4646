//! Spectra brought to linear sRGB, as Mitsuba 3 does it in its variant `scalar_rgb`.
//!
//! A spectrum s(λ), piecewise linear and 0 beyond its ends, has the tristimulus values X = ∫ s(λ)
//! w(λ) x̄(λ) dλ / ∫ ȳ(λ) dλ. For light w = 1, so that equal energy is no white; for factors such
//! as reflectances w is the illuminant D65, so that 1 at all wavelengths is (1, 1, 1).

mod cie;

use crate::error::{Place, Result, SceneFileError};
use crate::numbers::{bad, number, tokens};

/// Steps of the sum that stands for the integral, Mitsuba's number.
const STEPS: usize = 1000;

/// ∫ ȳ dλ as Mitsuba has it.
const Y_INTEGRAL: f64 = 106.750_259_399_414_06;

/// Most entries of one spectrum.
const MAX_SAMPLES: usize = 1 << 16;

/// Samples of a spectrum, wavelengths in nm and rising.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sampled(Vec<(f64, f64)>);

/// What a spectrum stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// Emitted light.
    Light,
    /// A factor: reflectance, refractive index.
    Factor,
}

impl Sampled {
    /// Samples in the order of rising wavelengths.
    ///
    /// # Errors
    /// Fewer than two samples, or wavelengths that do not rise.
    pub(crate) fn new(place: &Place, what: &str, samples: Vec<(f64, f64)>) -> Result<Self> {
        let refuse = |value: &str, expected: &str| Err(bad(place, what, value, expected));
        if samples.len() < 2 || samples.len() > MAX_SAMPLES {
            let count = format!("{} samples", samples.len());
            return refuse(&count, &format!("a spectrum of 2 to {MAX_SAMPLES} samples"));
        }
        if let Some(pair) = samples.windows(2).find(|w| w[0].0 >= w[1].0) {
            let value = format!("{}, {}", pair[0].0, pair[1].0);
            return refuse(&value, "a list of rising wavelengths");
        }
        Ok(Sampled(samples))
    }

    /// `400:0.1, 700:0.9`.
    pub(crate) fn from_pairs(place: &Place, what: &str, text: &str) -> Result<Self> {
        let mut samples = Vec::new();
        for token in tokens(text) {
            let Some((wavelength, value)) = token.split_once(':') else {
                return Err(bad(place, what, token, "a pair wavelength:value"));
            };
            samples.push((number(place, what, wavelength)?, number(place, what, value)?));
        }
        Sampled::new(place, what, samples)
    }

    /// A file of one `wavelength value` a line; `#` begins a comment.
    pub(crate) fn from_file(bytes: &[u8], file: &str) -> Result<Self> {
        let text = String::from_utf8_lossy(bytes);
        let mut samples = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let line_number = u32::try_from(index + 1).unwrap_or(u32::MAX);
            let place = Place { file: file.into(), line: line_number };
            let line = line.split('#').next().unwrap_or("");
            match tokens(line).as_slice() {
                [] => {}
                [wavelength, value] => samples.push((
                    number(&place, "wavelength", wavelength)?,
                    number(&place, "spectral value", value)?,
                )),
                _ => return Err(bad(&place, "spectrum", line.trim(), "a wavelength and a value")),
            }
            if samples.len() > MAX_SAMPLES {
                let reason = format!("more than {MAX_SAMPLES} samples");
                return Err(SceneFileError::Scene { place, reason });
            }
        }
        Sampled::new(&Place::file(file), "spectrum", samples)
    }

    /// Values at equal distances from `first` to `last` nm.
    pub(crate) fn regular(
        place: &Place,
        what: &str,
        [first, last]: [f64; 2],
        values: &[f64],
    ) -> Result<Self> {
        let step = (last - first) / (values.len().max(2) - 1) as f64;
        let at = |i: usize| first + step * i as f64;
        Sampled::new(place, what, values.iter().enumerate().map(|(i, v)| (at(i), *v)).collect())
    }

    /// Planck's law in W·m⁻²·sr⁻¹·nm⁻¹ at a temperature in kelvin.
    pub(crate) fn black_body(kelvin: f64) -> Self {
        let samples = (0..cie::COUNT).map(|i| {
            let nm = cie::FIRST + cie::STEP * i as f64;
            (nm, planck(nm * 1e-9, kelvin))
        });
        Sampled(samples.collect())
    }

    /// Each value times `factor`.
    pub(crate) fn scaled(mut self, factor: f64) -> Self {
        self.0.iter_mut().for_each(|(_, v)| *v *= factor);
        self
    }

    /// Linear sRGB; colours outside its gamut are cut to non-negative components, and factors that
    /// must not exceed 1 to that as well.
    pub(crate) fn to_srgb(&self, meaning: Meaning) -> [f64; 3] {
        let mut xyz = [0.0; 3];
        for i in 0..STEPS {
            let x = cie::FIRST + i as f64 / (STEPS - 1) as f64 * (cie::LAST - cie::FIRST);
            let Some(value) = self.at(x) else { continue };
            let (cmf, d65) = tables(x);
            let weight = if meaning == Meaning::Factor { d65 } else { 1.0 };
            for c in 0..3 {
                xyz[c] += value * weight * cmf[c];
            }
        }
        let norm = (cie::LAST - cie::FIRST) / STEPS as f64 / Y_INTEGRAL;
        xyz_to_srgb(xyz.map(|v| v * norm)).map(|v| v.max(0.0))
    }

    /// Piecewise linear; nothing beyond the ends.
    fn at(&self, x: f64) -> Option<f64> {
        let samples = &self.0;
        let last = samples.len() - 1;
        if x < samples[0].0 || x > samples[last].0 {
            return None;
        }
        let i = samples.partition_point(|s| s.0 <= x).clamp(1, last);
        let ((x0, y0), (x1, y1)) = (samples[i - 1], samples[i]);
        Some(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
    }
}

/// Spectral radiance of a black body, W·m⁻²·sr⁻¹·nm⁻¹, at a wavelength in metres.
fn planck(lambda: f64, kelvin: f64) -> f64 {
    // 2hc² and hc/k (CODATA 2018).
    let (c1, c2) = (1.191_042_972e-16, 1.438_776_877e-2);
    1e-9 * c1 / lambda.powi(5) / (c2 / (lambda * kelvin)).exp_m1()
}

/// Colour matching functions and D65 at x nm.
fn tables(x: f64) -> ([f64; 3], f64) {
    let t = (x - cie::FIRST) / cie::STEP;
    let i = (t as usize).min(cie::COUNT - 2);
    let f = t - i as f64;
    let mix = |a: f64, b: f64| a + (b - a) * f;
    let (a, b) = (cie::XYZ[i], cie::XYZ[i + 1]);
    let xyz = [mix(a[0], b[0]), mix(a[1], b[1]), mix(a[2], b[2])];
    (xyz, mix(cie::D65[i], cie::D65[i + 1]))
}

/// Linear Rec. 709 primaries with the white of D65.
fn xyz_to_srgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240479 * x - 1.537150 * y - 0.498535 * z,
        -0.969256 * x + 1.875991 * y + 0.041556 * z,
        0.055648 * x - 0.204043 * y + 1.057311 * z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, meaning: Meaning) -> [f64; 3] {
        Sampled::from_pairs(&Place::file("t"), "s", text).unwrap().to_srgb(meaning)
    }

    fn assert_close(found: [f64; 3], expected: [f64; 3]) {
        for c in 0..3 {
            assert!((found[c] - expected[c]).abs() < 2e-6, "{found:?} {expected:?}");
        }
    }

    /// The numbers are what Mitsuba 3.9.1 (`scalar_rgb`) has after loading the same lists.
    #[test]
    fn lists_have_the_colours_of_mitsuba() {
        let hill = "400:0.1, 500:0.5, 600:0.9, 700:0.3";
        assert_close(of(hill, Meaning::Light), [0.999234, 0.6597, 0.229444]);
        assert_close(of(hill, Meaning::Factor), [0.854797, 0.68754, 0.265015]);
        let flat = "360:1, 830:1";
        assert_close(of(flat, Meaning::Light), [1.204884, 0.948228, 0.909267]);
        assert_close(of(flat, Meaning::Factor), [0.998985, 0.998874, 0.998802]);
    }

    #[test]
    fn colours_outside_the_gamut_lose_their_negative_components() {
        assert_close(of("500:1, 520:1", Meaning::Light), [0.0, 0.179048, 0.013249]);
        assert_close(of("500:1, 520:1", Meaning::Factor), [0.0, 0.193768, 0.014586]);
        assert_close(of("440:0.0,450:1, 460:0", Meaning::Light), [0.013305, 0.0, 0.175353]);
    }

    #[test]
    fn files_have_comments_and_two_columns() {
        let text = b"# a\n400 0.1\n 500\t0.5 # b\n\n600, 0.9\n700 0.3\n";
        let colour = Sampled::from_file(text, "t.spd").unwrap().to_srgb(Meaning::Light);
        assert_close(colour, [0.999234, 0.6597, 0.229444]);
        let broken = Sampled::from_file(b"400 1\n500\n", "t.spd").unwrap_err().to_string();
        assert_eq!(broken, "t.spd:2: spectrum: \"500\" is not a wavelength and a value");
    }

    #[test]
    fn wavelengths_must_rise() {
        let error = Sampled::from_pairs(&Place::file("t"), "s", "500:1, 400:1").unwrap_err();
        assert_eq!(error.to_string(), "t: s: \"500, 400\" is not a list of rising wavelengths");
    }

    /// Wien: the maximum lies at 2.897771955 mm·K / T.
    #[test]
    fn a_black_body_has_its_maximum_where_wien_says() {
        let (at, around) = (2.897_771_955e-3 / 5500.0, 1e-9);
        let peak = planck(at, 5500.0);
        assert!(peak > planck(at - around, 5500.0) && peak > planck(at + around, 5500.0));
        let warm = Sampled::black_body(3000.0).to_srgb(Meaning::Light);
        assert!(warm[0] > warm[1] && warm[1] > warm[2]);
    }
}
