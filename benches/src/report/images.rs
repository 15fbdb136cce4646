//! Images of an experiment, packed into the page within a budget of bytes.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};
use pathspace_core::color::luminance;
use serde::Serialize;

use super::radiance::pack;
use super::read::Radiance;
use crate::output::exposure;
use crate::results::{MethodResults, Results, SceneResults};

/// How much of the images is kept: the first of these whose page fits.
const LEVELS: [Level; 6] = [
    Level { factor: 1, frame: None },
    Level { factor: 1, frame: Some((512, 88)) },
    Level { factor: 1, frame: Some((256, 80)) },
    Level { factor: 2, frame: Some((192, 75)) },
    Level { factor: 4, frame: Some((128, 70)) },
    Level { factor: 8, frame: Some((96, 60)) },
];

/// A way to make images smaller.
#[derive(Clone, Copy)]
struct Level {
    /// Blocks of this many pixels a side become one.
    factor: usize,
    /// Largest side of a frame and quality of its JPEG; PNG files as they are where there is none.
    /// Sheets may be six times as large.
    frame: Option<(u32, u8)>,
}

/// A packed file: base64 text.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Blob {
    pub(super) id: usize,
    pub(super) base64: String,
}

/// All images.
#[derive(Debug, Default)]
pub(super) struct Gallery {
    pub(super) scenes: Vec<SceneImages>,
    pub(super) blobs: Vec<Blob>,
    /// What is not as in the folder, as sentences.
    pub(super) notes: Vec<String>,
}

/// Images of one scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneImages {
    /// Pixels of the images in the page are means over blocks of this many pixels a side.
    factor: usize,
    /// Radiance times this is what is packed.
    scale: f64,
    /// Exposure of a scaled value at 0 stops.
    exposure: f64,
    /// Mean luminance of a scaled image.
    level: f64,
    reference: Option<PackedRadiance>,
    methods: Vec<MethodImages>,
}

/// Images of one integrator.
#[derive(Debug, Default, Serialize)]
struct MethodImages {
    mean: Option<PackedRadiance>,
    techniques: Option<PackedPicture>,
    lengths: Vec<(u32, PackedPicture)>,
    frames: Vec<PackedPicture>,
    errors: Vec<PackedPicture>,
}

/// Radiance as [`pack`] leaves it.
#[derive(Debug, Serialize)]
struct PackedRadiance {
    blob: usize,
    sigma: Option<usize>,
    width: usize,
    height: usize,
    linear: bool,
}

/// A picture as a browser reads it.
#[derive(Debug, Serialize)]
struct PackedPicture {
    blob: usize,
    /// Media type.
    media: &'static str,
    width: u32,
    height: u32,
}

impl Gallery {
    /// Packs the images of `results`, whose files are in `folder`, into about `budget` bytes.
    ///
    /// A file that is missing or not readable becomes a note.
    pub(super) fn collect(results: &Results, folder: &Path, budget: usize) -> Gallery {
        let mut last = Gallery::default();
        for level in LEVELS {
            last = Gallery::collect_at(results, folder, level);
            let size: usize = last.blobs.iter().map(|b| b.base64.len()).sum();
            if size <= budget {
                break;
            }
        }
        last
    }

    fn collect_at(results: &Results, folder: &Path, level: Level) -> Gallery {
        let mut packer = Packer { folder, level, blobs: Vec::new(), failed: BTreeSet::new() };
        let scenes = results.scenes.iter().map(|scene| packer.scene(scene)).collect();
        let mut notes = Vec::new();
        if level.factor > 1 {
            notes.push(format!(
                "To keep this page small its images are means over {0}×{0} pixels; the EXR files beside it have them all.",
                level.factor
            ));
        }
        if level.frame.is_some() && packer.blobs.iter().any(|b| !b.base64.is_empty()) {
            notes.push(
                "To keep this page small, frames, sheets and strips are JPEG; the PNG files beside it are exact."
                    .into(),
            );
        }
        notes.extend(packer.failed.into_iter().map(|f| format!("Not shown: {f}.")));
        Gallery { scenes, blobs: packer.blobs, notes }
    }
}

/// Packs file after file.
struct Packer<'a> {
    folder: &'a Path,
    level: Level,
    blobs: Vec<Blob>,
    failed: BTreeSet<String>,
}

impl Packer<'_> {
    fn scene(&mut self, scene: &SceneResults) -> SceneImages {
        let reference = scene.reference.as_ref().and_then(|r| self.radiance(&r.image, None));
        let means: Vec<Option<Radiance>> = scene
            .methods
            .iter()
            .map(|a| self.radiance(&a.images.mean, Some(&a.images.png)))
            .collect();
        let linear = |r: &&Radiance| r.linear;
        let model = reference.iter().chain(means.iter().flatten()).find(linear);
        let (white, level) = model.map_or((1.0, 0.5), |m| {
            let pixels = m.pixels();
            let finite = pixels.iter().map(luminance).filter(|v| v.is_finite());
            (exposure(&pixels), finite.sum::<f64>() / pixels.len() as f64)
        });
        // A power of two near the exposure: half floats then reach as far below white as above.
        let scale = white.log2().round().clamp(-100.0, 100.0).exp2();
        let methods =
            scene.methods.iter().zip(means).map(|(method, mean)| self.method(method, mean, scale));
        let methods = methods.collect();
        SceneImages {
            factor: self.level.factor,
            scale,
            exposure: white / scale,
            level: level * scale,
            methods,
            reference: reference.and_then(|r| self.pack_radiance(r, scale)),
        }
    }

    fn method(
        &mut self,
        method: &MethodResults,
        mean: Option<Radiance>,
        scale: f64,
    ) -> MethodImages {
        let mut lengths = Vec::new();
        for (length, file) in &method.images.lengths {
            lengths.extend(self.picture(file, 1).map(|p| (*length, p)));
        }
        MethodImages {
            mean: mean.and_then(|m| self.pack_radiance(m, scale)),
            techniques: method.images.techniques.as_ref().and_then(|file| self.picture(file, 6)),
            lengths,
            frames: method.frames.iter().filter_map(|file| self.picture(file, 1)).collect(),
            errors: method.error_pngs.iter().filter_map(|file| self.picture(file, 1)).collect(),
        }
    }

    /// Reads an EXR file, or else the picture that stands for it.
    fn radiance(&mut self, file: &str, or: Option<&str>) -> Option<Radiance> {
        let read = match Radiance::from_exr(&self.folder.join(file)) {
            Ok(radiance) => Some(radiance),
            Err(reason) => {
                if !file.is_empty() {
                    self.failed.insert(format!("{file} ({reason})"));
                }
                or.filter(|f| !f.is_empty())
                    .and_then(|f| Radiance::from_picture(&self.folder.join(f)).ok())
            }
        };
        read.filter(|r| r.width > 0 && r.height > 0).map(|r| r.shrunk(self.level.factor))
    }

    fn pack_radiance(&mut self, radiance: Radiance, scale: f64) -> Option<PackedRadiance> {
        let (width, height, linear) = (radiance.width, radiance.height, radiance.linear);
        let radiance = if linear { radiance.scaled(scale as f32) } else { radiance };
        let blob = self.push(pack(&radiance.planes, width).ok()?);
        let sigma = radiance.sigma.and_then(|s| pack(&[s], width).ok()).map(|text| self.push(text));
        Some(PackedRadiance { blob, sigma, width, height, linear })
    }

    /// A PNG file, as it is or as a smaller JPEG; at most `times` as large as a frame.
    fn picture(&mut self, file: &str, times: u32) -> Option<PackedPicture> {
        let read = || -> Result<(Vec<u8>, &'static str, u32, u32), String> {
            let bytes = std::fs::read(self.folder.join(file)).map_err(|e| e.to_string())?;
            let image = image::load_from_memory(&bytes).map_err(|e| e.to_string())?.to_rgb8();
            let (width, height) = image.dimensions();
            let Some((side, quality)) = self.level.frame else {
                return Ok((bytes, "image/png", width, height));
            };
            let most = side * times;
            let small = if width.max(height) > most {
                let fit = |n: u32| (n * most / width.max(height)).max(1);
                resize(&image, fit(width), fit(height), FilterType::Triangle)
            } else {
                image
            };
            let (w, h) = small.dimensions();
            let mut jpeg = Cursor::new(Vec::new());
            JpegEncoder::new_with_quality(&mut jpeg, quality)
                .encode_image(&small)
                .map_err(|e| e.to_string())?;
            let jpeg = jpeg.into_inner();
            if (w, h) == (width, height) && bytes.len() <= jpeg.len() {
                return Ok((bytes, "image/png", w, h));
            }
            Ok((jpeg, "image/jpeg", w, h))
        };
        match read() {
            Ok((bytes, media, width, height)) => {
                let blob = self.push(STANDARD.encode(bytes));
                Some(PackedPicture { blob, media, width, height })
            }
            Err(reason) => {
                self.failed.insert(format!("{file} ({reason})"));
                None
            }
        }
    }

    fn push(&mut self, base64: String) -> usize {
        let id = self.blobs.len();
        self.blobs.push(Blob { id, base64 });
        id
    }
}
