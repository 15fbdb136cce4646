//! The objects of a scene file and how they refer to each other.

use std::collections::HashMap;

use super::value::Value;
use crate::error::{Place, Result, SceneFileError};
use crate::note::Notes;

/// A plug-in element: `<bsdf type="…">` and so on.
#[derive(Clone, Debug)]
pub(crate) struct Object {
    /// The tag: "bsdf", "shape", …
    pub(crate) class: &'static str,
    /// The type.
    pub(crate) plugin: String,
    pub(crate) id: Option<String>,
    pub(crate) place: Place,
    /// From a file older than version 2.0.
    pub(crate) old: bool,
    pub(crate) properties: Vec<Property>,
}

impl Object {
    /// Its id, or type and line: the name that messages about the built scene use.
    pub(crate) fn name(&self) -> String {
        match &self.id {
            Some(id) => id.clone(),
            None => format!("{} (line {})", self.plugin, self.place.line),
        }
    }

    /// `bsdf "diffuse"`, for messages.
    pub(crate) fn title(&self) -> String {
        if self.class == "scene" {
            "<scene>".into()
        } else {
            format!("{} \"{}\"", self.class, self.plugin)
        }
    }
}

/// A property of an object, or an object nested in it.
#[derive(Clone, Debug)]
pub(crate) struct Property {
    /// Empty for nested objects without a name.
    pub(crate) name: String,
    pub(crate) place: Place,
    pub(crate) value: Value,
}

/// All objects; the first one is the scene.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    pub(crate) objects: Vec<Object>,
    pub(crate) ids: HashMap<String, usize>,
    /// What arose while reading the elements.
    pub(crate) notes: Notes,
}

impl Graph {
    /// The object that a nested element or a reference stands for; `None` for plain values.
    pub(crate) fn target(&self, property: &Property) -> Result<Option<usize>> {
        match &property.value {
            Value::Object(index) => Ok(Some(*index)),
            Value::Reference(id) => match self.ids.get(id) {
                Some(index) => Ok(Some(*index)),
                None => {
                    let mut known: Vec<&str> = self.ids.keys().map(String::as_str).collect();
                    known.sort_unstable();
                    let more = known.len().saturating_sub(20);
                    known.truncate(20);
                    let mut list = known.join(", ");
                    match more {
                        0 if list.is_empty() => list.push_str("none"),
                        0 => {}
                        more => list.push_str(&format!(" and {more} more")),
                    }
                    let reason = format!("no object has the id \"{id}\"; known ids: {list}");
                    Err(SceneFileError::Reference { place: property.place.clone(), reason })
                }
            },
            _ => Ok(None),
        }
    }

    /// Records an id.
    pub(crate) fn name(&mut self, id: &str, index: usize, place: &Place) -> Result<()> {
        if let Some(previous) = self.ids.insert(id.into(), index) {
            let before = &self.objects[previous].place;
            let reason = format!("the id \"{id}\" is given twice, first at {before}");
            return Err(SceneFileError::Reference { place: place.clone(), reason });
        }
        Ok(())
    }
}
