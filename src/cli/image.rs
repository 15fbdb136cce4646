//! A film as files to look at.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use anyhow::Result;
use pathspace_benches::output::{
    Metadata, NamedLayer, Output, Picture, Weighting, exposure, technique_sheet,
};
use pathspace_core::film::{Film, LayerKey};

/// Beyond this many stops from the automatic exposure a picture shows little.
const FAR: f64 = 3.0;

/// Exposure of pictures, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stops {
    /// This many; at 0 a radiance of 1 is nearly white.
    Fixed(f64),
    /// That of the brightest twentieth.
    Auto,
}

impl Default for Stops {
    fn default() -> Self {
        Stops::Fixed(0.0)
    }
}

impl Stops {
    /// What radiance is multiplied by, where it is given.
    pub(super) fn factor(self) -> Option<f64> {
        match self {
            Stops::Fixed(s) => Some(s.exp2()),
            Stops::Auto => None,
        }
    }
}

impl fmt::Display for Stops {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stops::Fixed(s) => s.fmt(f),
            Stops::Auto => f.write_str("auto"),
        }
    }
}

impl FromStr for Stops {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("auto") {
            return Ok(Stops::Auto);
        }
        let stops: Option<f64> = text.parse().ok();
        let stops = stops.filter(|s| s.abs() <= 100.0).map(Stops::Fixed);
        stops.ok_or_else(|| "expected stops, such as -1.5, or auto".into())
    }
}

/// What was written.
#[derive(Debug)]
pub(super) struct Written {
    pub(super) files: Vec<PathBuf>,
    /// Exposure of the PNG, in stops.
    pub(super) stops: f64,
    /// A word on the exposure, where there is one to say.
    pub(super) note: Option<String>,
}

impl Written {
    /// The names, in one line.
    pub(super) fn names(&self) -> String {
        let names: Vec<String> = self.files.iter().map(|p| p.display().to_string()).collect();
        names.join(", ")
    }
}

/// Writes the image with its layers, the PNG, and the pyramids of techniques.
pub(super) fn write(
    output: &Output,
    film: &Film,
    metadata: Metadata,
    stops: Stops,
) -> Result<Written> {
    let pixels = film.image();
    let layer = |key: &LayerKey| {
        film.layer_image(*key).map(|pixels| NamedLayer { name: key.name(), pixels })
    };
    let layers: Vec<NamedLayer> = film.planes().keys().filter_map(layer).collect();
    let picture = Picture { film: *film.description(), pixels: &pixels, layers: &layers, metadata };
    let auto = exposure(&pixels).log2();
    let (stops, note) = match stops {
        Stops::Auto => (auto, Some(format!("exposure {auto:+.1} EV"))),
        Stops::Fixed(s) if (auto - s).abs() > FAR => {
            let seems = if auto > s { "dark" } else { "bright" };
            let note = format!(
                "at {s} EV the picture is {seems}: --exposure auto would take {auto:+.1} EV"
            );
            (s, Some(note))
        }
        Stops::Fixed(s) => (s, None),
    };
    output.write(&picture, stops.exp2())?;
    let mut files = output.files();
    for (weighting, suffix) in
        [(Weighting::Weighted, "techniques.png"), (Weighting::Unweighted, "unweighted.png")]
    {
        if let Some(sheet) = technique_sheet(film, weighting) {
            files.push(output.write_beside(suffix, &sheet)?);
        }
    }
    Ok(Written { files, stops, note })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_are_numbers_or_automatic() {
        assert_eq!("-1.5".parse(), Ok(Stops::Fixed(-1.5)));
        assert_eq!("Auto".parse(), Ok(Stops::Auto));
        for bad in ["", "bright", "nan", "inf", "1e9"] {
            assert!(bad.parse::<Stops>().is_err(), "{bad}");
        }
    }
}
