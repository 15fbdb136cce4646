//! An element with its attributes after the parameters are put in.

use crate::error::{Known, Place, Result, SceneFileError};

/// Tag, attributes and place of an element.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) tag: String,
    pub(crate) place: Place,
    pub(crate) attributes: Vec<(String, String)>,
}

impl Element {
    /// An attribute's value.
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str())
    }

    /// The value of an attribute that must be there.
    pub(crate) fn need(&self, name: &str, known: &[&str]) -> Result<&str> {
        self.get(name).ok_or_else(|| self.attribute_error("missing", name, known))
    }

    /// Refuses attributes that are not in the list.
    pub(crate) fn only(&self, known: &[&str]) -> Result<()> {
        match self.attributes.iter().find(|(n, _)| !known.contains(&n.as_str())) {
            Some((name, _)) => Err(self.attribute_error("unknown", name, known)),
            None => Ok(()),
        }
    }

    fn attribute_error(&self, problem: &'static str, name: &str, known: &[&str]) -> SceneFileError {
        SceneFileError::Attribute {
            place: self.place.clone(),
            problem,
            attribute: name.into(),
            element: self.tag.clone(),
            known: Known::new(known.iter().copied()),
        }
    }
}
