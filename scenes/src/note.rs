//! What a reader tells beside the scene: things it did not need, did not know or read as something
//! near.

use std::fmt;

use crate::place::Place;

/// What a note is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum NoteKind {
    /// Understood, but it makes no difference here (image formats, display settings).
    Ignored,
    /// Read as something that gives the same image up to noise (a sampler as the independent one),
    /// or mended.
    Mended,
    /// Not known and passed over: an error where the reader is strict.
    Unknown,
    /// Known, but read as something near it, so that the image may differ: an error where the
    /// reader is strict.
    Differs,
}

impl NoteKind {
    /// True where [`LoadOptions::strict`](crate::LoadOptions::strict) makes an error of it.
    pub fn is_error_when_strict(self) -> bool {
        matches!(self, NoteKind::Unknown | NoteKind::Differs)
    }
}

/// One note, with the number of places where it arises.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What it is about.
    pub kind: NoteKind,
    /// The first place.
    pub place: Place,
    /// The text, without the place.
    pub text: String,
    /// In how many places it arises.
    pub count: usize,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.text)?;
        match self.count {
            0 | 1 => Ok(()),
            n => write!(f, " ({n} times)"),
        }
    }
}

/// Notes in the order in which they arise; the same text is kept once.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    list: Vec<Note>,
    by_text: std::collections::HashMap<String, usize>,
}

/// Most texts that are kept: a file with more odd things than these has one problem.
const MAX_NOTES: usize = 1000;

impl Notes {
    pub(crate) fn add(&mut self, kind: NoteKind, text: impl Into<String>, place: &Place) {
        let text = text.into();
        if let Some(at) = self.by_text.get(&text) {
            self.list[*at].count += 1;
        } else if self.list.len() < MAX_NOTES {
            self.by_text.insert(text.clone(), self.list.len());
            self.list.push(Note { kind, place: place.clone(), text, count: 1 });
        }
    }

    /// The first note that strictness makes an error of.
    pub(crate) fn strict_error(&self) -> Option<&Note> {
        self.list.iter().find(|n| n.kind.is_error_when_strict())
    }

    pub(crate) fn into_list(self) -> Vec<Note> {
        self.list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_text_is_kept_once_and_counted() {
        let mut notes = Notes::default();
        for line in [3, 5, 9] {
            let place = Place { file: "a.xml".into(), line };
            notes.add(NoteKind::Unknown, "who is it", &place);
        }
        let list = notes.into_list();
        assert_eq!(list.len(), 1);
        assert_eq!(list[0].to_string(), "a.xml:3: who is it (3 times)");
    }
}
