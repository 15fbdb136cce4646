//! Spectra that are objects: `<spectrum type="…">`.

use super::props::Props;
use super::{Context, support, texture};
use crate::error::Result;
use crate::note::NoteKind;
use crate::spectrum::{Meaning, Sampled};

/// Linear sRGB of the spectrum with this index. Mitsuba 3.9.1 has no sampled spectra and no black
/// body as objects in its rgb variants; they are converted as its lists of wavelength:value are.
pub(super) fn read(context: &mut Context<'_>, index: usize, meaning: Meaning) -> Result<[f64; 3]> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let white = [1.0; 3];
    let colour = match object.plugin.as_str() {
        "uniform" => [props.float("value")?.unwrap_or(1.0); 3],
        "rawconstant" | "rgb" | "srgb" => {
            let name = if props.has("value") { "value" } else { "color" };
            match props.triple(name)? {
                Some(colour) => colour,
                None => return Err(props.error("needs the property \"value\"")),
            }
        }
        "d65" => {
            let scale = props.float("scale")?.unwrap_or(1.0);
            let name = if props.has("value") { "value" } else { "color" };
            props.triple(name)?.unwrap_or(white).map(|v| v * scale)
        }
        "blackbody" => {
            let Some(kelvin) = props.positive("temperature")? else {
                return Err(props.error("needs the property \"temperature\""));
            };
            let scale = props.float("scale")?.unwrap_or(1.0);
            Sampled::black_body(kelvin).scaled(scale).to_srgb(meaning)
        }
        "regular" => {
            let first = first_of(&mut props, ["wavelength_min", "lambda_min"])?;
            let last = first_of(&mut props, ["wavelength_max", "lambda_max"])?;
            let values = props.numbers("values")?;
            let what = props.what("values");
            Sampled::regular(props.place(), &what, [first, last], &values)?.to_srgb(meaning)
        }
        "irregular" => {
            let (wavelengths, values) = (props.numbers("wavelengths")?, props.numbers("values")?);
            if wavelengths.len() != values.len() {
                let (n, m) = (wavelengths.len(), values.len());
                return Err(props.error(format!("has {n} wavelengths and {m} values")));
            }
            let samples = wavelengths.into_iter().zip(values).collect();
            let what = props.what("wavelengths");
            Sampled::new(props.place(), &what, samples)?.to_srgb(meaning)
        }
        name if texture::VARYING.contains(&name) => {
            let text = format!("{} stands for its mean here", object.title());
            context.note(NoteKind::Differs, text, &object.place);
            let mean = texture::read(context, index, 0)?.mean();
            return Ok(mean.to_array().map(f64::from));
        }
        _ => return Err(support::unknown(object)),
    };
    props.finish(context)?;
    Ok(colour)
}

fn first_of(props: &mut Props<'_>, names: [&str; 2]) -> Result<f64> {
    let name = if props.has(names[1]) { names[1] } else { names[0] };
    match props.positive(name)? {
        Some(value) => Ok(value),
        None => Err(props.error(format!("needs the property \"{name}\""))),
    }
}
