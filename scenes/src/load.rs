//! Loading a scene: from a file, or from a text with its own set of files.

use std::path::Path;

use pathspace_core::description::SceneDescription;

use crate::error::{Place, Result, SceneFileError};
use crate::note::Note;
use crate::plugins::{Context, RenderDefaults, read_scene};
use crate::source::{Disk, FileSource};
use crate::xml::{Files, Parameters, parse_scene};

/// A scene and what its file says beside it.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The scene in world units.
    pub description: SceneDescription,
    /// How the file wants to be rendered.
    pub defaults: RenderDefaults,
    /// What was ignored, mended or not known, in the order of the file.
    pub notes: Vec<Note>,
    /// BLAKE3 of the content, in hexadecimal: elements and attributes after parameters are put
    /// in, and mesh files. Comments, white space and file names do not count.
    pub hash: String,
    /// Name of the file without its ending; of its folder where the file is called `scene`.
    pub name: String,
}

/// What a caller may ask of the reader.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Values for `$name` in the file.
    pub params: Vec<(String, String)>,
    /// Makes errors of what the reader does not know or reads as something else; see
    /// [`crate::NoteKind`].
    pub strict: bool,
    /// Which of several sensors is meant, from 0 in the order of the file.
    pub sensor: usize,
}

/// Reads a scene file. `params` are values for `$name` in the file.
///
/// # Errors
/// Everything that is not understood, with file and line; see [`crate::SceneFileError`].
pub fn load(path: &Path, params: &[(String, String)]) -> Result<LoadedScene> {
    load_from(&Disk, path, params)
}

/// Reads a scene file from a set of files; see [`load`].
///
/// # Errors
/// As [`load`].
pub fn load_from(
    source: &dyn FileSource,
    path: &Path,
    params: &[(String, String)],
) -> Result<LoadedScene> {
    let options = LoadOptions { params: params.into(), ..LoadOptions::default() };
    load_with(source, path, &options)
}

/// Reads a scene file with all options.
///
/// # Errors
/// As [`load`]; also what [`LoadOptions::strict`] makes an error, and a sensor that the file does
/// not have.
pub fn load_with(
    source: &dyn FileSource,
    path: &Path,
    options: &LoadOptions,
) -> Result<LoadedScene> {
    let file = path.display().to_string();
    let folder = path.parent().unwrap_or(Path::new(""));
    let files = Files::new(source, folder);
    let text = files.read(path, &Place::file(file.clone()))?;
    read(&text, &file, files, options)
}

/// Reads a scene from a text; `file` is its name in messages, files that it refers to come from
/// `source`, relative to the folder of `file`.
///
/// # Errors
/// As [`load`].
pub fn load_str(
    text: &str,
    file: &str,
    source: &dyn FileSource,
    params: &[(String, String)],
) -> Result<LoadedScene> {
    let folder = Path::new(file).parent().unwrap_or(Path::new(""));
    let options = LoadOptions { params: params.into(), ..LoadOptions::default() };
    read(text.as_bytes(), file, Files::new(source, folder), &options)
}

fn read(
    text: &[u8],
    file: &str,
    mut files: Files<'_>,
    options: &LoadOptions,
) -> Result<LoadedScene> {
    let mut params = Parameters::new(&options.params);
    let mut graph = parse_scene(text, file, &mut files, &mut params)?;
    let notes = std::mem::take(&mut graph.notes);
    if options.sensor > 0 {
        files.hash(&options.sensor.to_le_bytes());
    }
    let mut context = Context::new(&graph, files, notes);
    let (description, defaults) = read_scene(&mut context, options.sensor)?;
    let Context { files, notes, .. } = context;
    if options.strict
        && let Some(note) = notes.strict_error()
    {
        return Err(SceneFileError::Strict(Box::new(note.clone())));
    }
    let hash = files.finish();
    Ok(LoadedScene { description, defaults, notes: notes.into_list(), hash, name: name_of(file) })
}

/// "…/cornell-box/scene.xml" → "cornell-box"; "a/b.xml" → "b".
fn name_of(file: &str) -> String {
    let path = Path::new(file);
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = path.parent().and_then(Path::file_name).map(|s| s.to_string_lossy().into_owned());
    match folder {
        Some(folder) if stem.starts_with("scene") => folder,
        _ => stem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_called_scene_takes_the_name_of_its_folder() {
        assert_eq!(name_of("x/cornell-box/scene.xml"), "cornell-box");
        assert_eq!(name_of("x/glass.xml"), "glass");
        assert_eq!(name_of("scene.xml"), "scene");
    }
}
