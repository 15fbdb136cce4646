//! Film, reconstruction filter and sampler.

use pathspace_core::description::{Crop, FilmDescription, FilterKind};

use super::Context;
use super::props::Props;
use crate::error::Result;
use crate::note::NoteKind;

/// Largest width and height: a row must fit in memory many times.
const MAX_SIZE: u32 = 1 << 16;

/// Most pixels: 2 Gpixel would be 50 GB of sums.
const MAX_PIXELS: u64 = 1 << 28;

/// Mitsuba's default film, without an element.
pub(super) fn default_film() -> FilmDescription {
    let mut film = FilmDescription::new(768, 576);
    film.filter = DEFAULT_FILTER;
    film
}

/// Mitsuba's default filter.
const DEFAULT_FILTER: FilterKind = FilterKind::Gaussian { stddev: 0.5 };

/// Reads the film with this index.
pub(super) fn read(context: &mut Context<'_>, index: usize) -> Result<FilmDescription> {
    let object = &context.graph.objects[index];
    if object.plugin != "hdrfilm" {
        let text = format!("{} is read as \"hdrfilm\"", object.title());
        context.note(NoteKind::Differs, text, &object.place);
    }
    let mut props = Props::new(context.graph, object);
    let width = props.count("width", 1, MAX_SIZE)?.unwrap_or(768);
    let height = props.count("height", 1, MAX_SIZE)?.unwrap_or(576);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(props.error(format!("{width} x {height} are more than {MAX_PIXELS} pixels")));
    }
    let crop = Crop {
        x: props.count("crop_offset_x", 0, MAX_SIZE)?.unwrap_or(0),
        y: props.count("crop_offset_y", 0, MAX_SIZE)?.unwrap_or(0),
        width: props.count("crop_width", 1, MAX_SIZE)?.unwrap_or(width),
        height: props.count("crop_height", 1, MAX_SIZE)?.unwrap_or(height),
    };
    if crop.x + crop.width > width || crop.y + crop.height > height {
        return Err(props.error(format!(
            "crop window {}x{} at ({}, {}) is larger than the film {width}x{height}",
            crop.width, crop.height, crop.x, crop.y
        )));
    }
    let filter = match props.nested_one("rfilter")? {
        Some(filter) => read_filter(context, filter)?,
        None => DEFAULT_FILTER,
    };
    let files = ["filename", "file_format", "pixel_format", "component_format"];
    props.ignore(context, &files, "images are written as float32 RGB");
    let display = ["banner", "gamma", "exposure", "key", "burn", "tonemap_method", "label"];
    props.ignore(context, &display, "it concerns display only");
    let sums = ["compensate", "sample_border", "high_quality_edges"];
    props.ignore(context, &sums, "the film is summed in its own way");
    props.finish(context)?;
    Ok(FilmDescription { width, height, crop, filter })
}

fn read_filter(context: &mut Context<'_>, index: usize) -> Result<FilterKind> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let filter = match object.plugin.as_str() {
        "box" => FilterKind::Box,
        "tent" => FilterKind::Tent { radius: width(&mut props, "radius", 1.0)? },
        "gaussian" => FilterKind::Gaussian { stddev: width(&mut props, "stddev", 0.5)? },
        // Filters with negative lobes: splats would make negative pixels.
        _ => {
            let text = format!("{} is read as \"gaussian\"", object.title());
            context.note(NoteKind::Differs, text, &object.place);
            return Ok(DEFAULT_FILTER);
        }
    };
    props.finish(context)?;
    Ok(filter)
}

/// Widths beyond some pixels make a filter that covers the image.
fn width(props: &mut Props<'_>, name: &str, default: f64) -> Result<f64> {
    match props.positive(name)? {
        Some(v) if v > 32.0 => Err(props.refuse(name, "at most 32 pixels")),
        other => Ok(other.unwrap_or(default)),
    }
}

/// Sample count of the sampler with this index; `None` where it does not say.
pub(super) fn read_sampler(context: &mut Context<'_>, index: usize) -> Result<Option<u32>> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let name = object.plugin.as_str();
    if name != "independent" {
        let text = format!("sampler \"{name}\" is read as \"independent\"");
        context.note(NoteKind::Mended, text, &object.place);
    }
    let count = props.count("sample_count", 1, u32::MAX)?;
    let why = "random numbers are addressed by the seed of the run";
    let names = ["seed", "jitter", "dimension", "scramble", "strength"];
    props.ignore(context, &names, why);
    props.finish(context)?;
    Ok(count)
}
