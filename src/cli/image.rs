//! A film as files to look at.

use anyhow::Result;
use pathspace_benches::output::{
    Metadata, NamedLayer, Output, Picture, Weighting, exposure, technique_sheet,
};
use pathspace_core::film::{Film, LayerKey};

/// Writes the EXR file with its layers, the PNG, and the pyramids of techniques.
pub(super) fn write(output: &Output, film: &Film, metadata: Metadata) -> Result<()> {
    let pixels = film.image();
    let layer = |key: &LayerKey| {
        film.layer_image(*key).map(|pixels| NamedLayer { name: key.name(), pixels })
    };
    let layers: Vec<NamedLayer> = film.planes().keys().filter_map(layer).collect();
    let picture = Picture { film: *film.description(), pixels: &pixels, layers: &layers, metadata };
    output.write(&picture, exposure(&pixels))?;
    for (weighting, suffix) in
        [(Weighting::Weighted, "techniques.png"), (Weighting::Unweighted, "unweighted.png")]
    {
        if let Some(sheet) = technique_sheet(film, weighting) {
            output.write_beside(suffix, &sheet)?;
        }
    }
    Ok(())
}
