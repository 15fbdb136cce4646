//! What can be wrong with a scene file, each as one line `file:line: message`.

use std::fmt;

use thiserror::Error;

use crate::note::Note;
pub use crate::place::Place;

/// The list of what is understood at a place, for messages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Known(pub Vec<String>);

impl Known {
    /// Sorts and removes doubles.
    pub fn new<S: Into<String>>(names: impl IntoIterator<Item = S>) -> Self {
        let mut names: Vec<String> = names.into_iter().map(Into::into).collect();
        names.sort();
        names.dedup();
        Known(names)
    }
}

impl fmt::Display for Known {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() { f.write_str("nothing") } else { f.write_str(&self.0.join(", ")) }
    }
}

/// An error in a scene file or in a file that it refers to.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum SceneFileError {
    /// A file cannot be read.
    #[error("{place}: cannot read \"{}\": {reason}", shortened(.file))]
    Read {
        /// The element that refers to the file, or the file itself.
        place: Place,
        /// The file that was wanted.
        file: String,
        /// What the system says.
        reason: String,
    },
    /// The file is not well-formed XML.
    #[error("{place}: malformed XML: {reason}")]
    Xml {
        /// Where the parser stopped.
        place: Place,
        /// What the parser says.
        reason: String,
    },
    /// An element that is not understood where it stands.
    #[error("{place}: element <{element}> is not understood in {within}; known: {known}")]
    Element {
        /// Place of the element.
        place: Place,
        /// Its tag.
        element: String,
        /// What it stands in.
        within: String,
        /// Tags that are understood there.
        known: Known,
    },
    /// An attribute that is missing, or not understood.
    #[error("{place}: {problem} attribute \"{attribute}\" in <{element}>; known: {known}")]
    Attribute {
        /// Place of the element.
        place: Place,
        /// "missing" or "unknown".
        problem: &'static str,
        /// Name of the attribute.
        attribute: String,
        /// Tag of the element.
        element: String,
        /// Attributes that are understood there.
        known: Known,
    },
    /// A plug-in type that is not understood.
    #[error("{place}: {class} type \"{plugin}\" is not understood{}; known: {known}", because(.reason))]
    Plugin {
        /// Place of the element.
        place: Place,
        /// "bsdf", "shape", …
        class: &'static str,
        /// The type that was asked for.
        plugin: String,
        /// Why it is not there, where that is known.
        reason: Option<&'static str>,
        /// Types that are understood.
        known: Known,
    },
    /// A property that a plug-in does not understand.
    #[error("{place}: property \"{property}\" is not understood by {owner}; known: {known}")]
    Property {
        /// Place of the property.
        place: Place,
        /// Its name.
        property: String,
        /// The plug-in, such as `bsdf "diffuse"`.
        owner: String,
        /// Properties that are understood there.
        known: Known,
    },
    /// A value that does not fit.
    #[error("{place}: {what}: \"{value}\" is not {expected}")]
    Value {
        /// Place of the value.
        place: Place,
        /// Property or attribute.
        what: String,
        /// The offending value.
        value: String,
        /// What would fit.
        expected: String,
    },
    /// A reference or a name that cannot be resolved, or that is given twice.
    #[error("{place}: {reason}")]
    Reference {
        /// Place of the reference.
        place: Place,
        /// What is wrong, with the name.
        reason: String,
    },
    /// A parameter that is used but not defined, or defined but not used.
    #[error("{place}: {reason}")]
    Parameter {
        /// Place of the use; the scene file for parameters that nobody uses.
        place: Place,
        /// What is wrong, with the name.
        reason: String,
    },
    /// A mesh file that cannot be used.
    #[error("{place}: {reason}")]
    Mesh {
        /// Place in the mesh file.
        place: Place,
        /// What is wrong, with the value.
        reason: String,
    },
    /// Several plug-ins that are not understood, all of a scene.
    #[error("{place}: {} are not understood: {}", count_things(.missing), .missing.join("; "))]
    Missing {
        /// Place of the first one.
        place: Place,
        /// What is missing, one entry for each kind, such as `bsdf "hair" (3 times, first in line
        /// 7)`.
        missing: Vec<String>,
    },
    /// A note of the reader where it is strict.
    #[error("{0} (an error because of --strict)")]
    Strict(Box<Note>),
    /// An image file that cannot be used.
    #[error("{place}: image \"{}\" {reason}", shortened(.file))]
    Image {
        /// The element that refers to it.
        place: Place,
        /// The file.
        file: String,
        /// What is wrong.
        reason: String,
    },
    /// A scene that is well-formed but makes no sense.
    #[error("{place}: {reason}")]
    Scene {
        /// Place of the element.
        place: Place,
        /// What is wrong.
        reason: String,
    },
}

/// A name that fits on a line: the end of a long path says more than its start.
fn shortened(name: &str) -> String {
    let plain: Vec<char> = name.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    match plain.len() {
        0..=200 => plain.into_iter().collect(),
        n => std::iter::once('…').chain(plain[n - 199..].iter().copied()).collect(),
    }
}

fn because(reason: &Option<&str>) -> String {
    reason.map_or(String::new(), |reason| format!(" ({reason})"))
}

fn count_things(missing: &[String]) -> String {
    format!("{} things", missing.len())
}

/// Result of everything that reads scene files.
pub type Result<T> = std::result::Result<T, SceneFileError>;
