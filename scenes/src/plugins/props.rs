//! Access to an object's properties that notices what nobody asked for.
//!
//! The reader of a plug-in asks for every property that it knows, then calls [`Props::finish`];
//! the names that were asked for are the plug-in's table of known properties.

use glam::{DAffine3, DVec3};
use pathspace_core::Rgb;

use super::{Context, spectrum};
use crate::error::{Known, Place, Result, SceneFileError};
use crate::note::NoteKind;
use crate::spectrum::Meaning;
use crate::xml::value::{Value, bad, number, tokens};
use crate::xml::{Graph, Object, Property};

/// The properties of one object.
pub(crate) struct Props<'a> {
    graph: &'a Graph,
    pub(crate) object: &'a Object,
    known: Vec<String>,
    taken: Vec<bool>,
}

/// Equal energy at all wavelengths as light: not the white of sRGB, which is D65. Mitsuba gives it
/// these linear components; measured in its variant `scalar_rgb`.
const EQUAL_ENERGY: [f64; 3] = [1.204_794, 0.948_290, 0.908_916];

impl<'a> Props<'a> {
    pub(crate) fn new(graph: &'a Graph, object: &'a Object) -> Self {
        let taken = vec![false; object.properties.len()];
        Props { graph, object, known: Vec::new(), taken }
    }

    pub(crate) fn graph(&self) -> &'a Graph {
        self.graph
    }

    pub(crate) fn place(&self) -> &'a Place {
        &self.object.place
    }

    /// The property, marked as understood.
    fn take(&mut self, name: &str) -> Option<&'a Property> {
        if !self.known.iter().any(|k| k == name) {
            self.known.push(name.into());
        }
        let at = self.object.properties.iter().position(|p| p.name == name)?;
        self.taken[at] = true;
        Some(&self.object.properties[at])
    }

    /// Marks a property as understood.
    pub(crate) fn mark(&mut self, name: &str) {
        self.take(name);
    }

    /// True where the file gives the property.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.object.properties.iter().any(|p| p.name == name)
    }

    /// An error about a property's value.
    pub(crate) fn refuse(&self, name: &str, expected: &str) -> SceneFileError {
        let property = self.object.properties.iter().find(|p| p.name == name);
        let (place, value) = match property {
            Some(p) => (&p.place, p.value.text()),
            None => (&self.object.place, String::new()),
        };
        bad(place, &self.what(name), &value, expected)
    }

    /// The same where the value itself would say nothing.
    pub(crate) fn complain(&self, name: &str, reason: &str) -> SceneFileError {
        let property = self.object.properties.iter().find(|p| p.name == name);
        let place = property.map_or(&self.object.place, |p| &p.place).clone();
        SceneFileError::Scene { place, reason: format!("{}: {reason}", self.what(name)) }
    }

    /// An error about the object as a whole.
    pub(crate) fn error(&self, reason: impl Into<String>) -> SceneFileError {
        let reason = format!("{}: {}", self.object.title(), reason.into());
        SceneFileError::Scene { place: self.object.place.clone(), reason }
    }

    pub(crate) fn what(&self, name: &str) -> String {
        format!("{}: property \"{name}\"", self.object.title())
    }

    fn wrong_kind(&self, p: &Property, expected: &str) -> SceneFileError {
        let value = match &p.value {
            Value::Object(index) => self.graph.objects[*index].title(),
            Value::Reference(id) => match self.graph.ids.get(id) {
                Some(index) => format!("{} with the id {id}", self.graph.objects[*index].title()),
                None => format!("reference to {id}"),
            },
            other => format!("<{}> {}", other.kind(), other.text()),
        };
        bad(&p.place, &self.what(&p.name), &value, expected)
    }

    pub(crate) fn boolean(&mut self, name: &str) -> Result<Option<bool>> {
        match self.take(name) {
            None => Ok(None),
            Some(Property { value: Value::Boolean(v), .. }) => Ok(Some(*v)),
            Some(p) => Err(self.wrong_kind(p, "a <boolean>")),
        }
    }

    pub(crate) fn integer(&mut self, name: &str) -> Result<Option<i64>> {
        match self.take(name) {
            None => Ok(None),
            Some(Property { value: Value::Integer(v), .. }) => Ok(Some(*v)),
            Some(p) => Err(self.wrong_kind(p, "an <integer>")),
        }
    }

    /// An integer of at least `min`, at most `max`.
    pub(crate) fn count(&mut self, name: &str, min: u32, max: u32) -> Result<Option<u32>> {
        match self.integer(name)? {
            None => Ok(None),
            Some(v) => match u32::try_from(v) {
                Ok(v) if (min..=max).contains(&v) => Ok(Some(v)),
                _ => Err(self.refuse(name, &format!("an integer from {min} to {max}"))),
            },
        }
    }

    pub(crate) fn float(&mut self, name: &str) -> Result<Option<f64>> {
        match self.take(name) {
            None => Ok(None),
            Some(Property { value: Value::Float(v), .. }) => Ok(Some(*v)),
            Some(Property { value: Value::Integer(v), .. }) => Ok(Some(*v as f64)),
            Some(p) => Err(self.wrong_kind(p, "a <float>")),
        }
    }

    /// A float > 0.
    pub(crate) fn positive(&mut self, name: &str) -> Result<Option<f64>> {
        match self.float(name)? {
            // Also positive after rounding to single precision.
            Some(v) if v as f32 <= 0.0 => Err(self.refuse(name, "a number > 0")),
            other => Ok(other),
        }
    }

    pub(crate) fn string(&mut self, name: &str) -> Result<Option<&'a str>> {
        match self.take(name) {
            None => Ok(None),
            Some(Property { value: Value::String(v), .. }) => Ok(Some(v)),
            Some(p) => Err(self.wrong_kind(p, "a <string>")),
        }
    }

    pub(crate) fn vector(&mut self, name: &str) -> Result<Option<DVec3>> {
        match self.take(name) {
            None => Ok(None),
            Some(Property { value: Value::Vector(v), .. }) => Ok(Some(*v)),
            Some(p) => Err(self.wrong_kind(p, "a <point> or <vector>")),
        }
    }

    pub(crate) fn transform(&mut self, name: &str) -> Result<Option<DAffine3>> {
        match self.take(name) {
            None => Ok(None),
            Some(Property { value: Value::Transform(v), .. }) => Ok(Some(*v)),
            Some(p) => Err(self.wrong_kind(p, "a <transform>")),
        }
    }

    /// Numbers in a `<string>`, separated by commas or white space.
    pub(crate) fn numbers(&mut self, name: &str) -> Result<Vec<f64>> {
        let Some(text) = self.string(name)? else {
            return Err(self.error(format!("needs the property \"{name}\"")));
        };
        let (place, what) = (self.place(), self.what(name));
        tokens(text).into_iter().map(|t| number(place, &what, t)).collect()
    }

    /// Three plain numbers, or one for all three.
    pub(crate) fn triple(&mut self, name: &str) -> Result<Option<[f64; 3]>> {
        match self.take(name) {
            None => Ok(None),
            Some(p) => match &p.value {
                Value::Rgb(v) => Ok(Some(*v)),
                Value::Vector(v) => Ok(Some(v.to_array())),
                Value::Float(v) | Value::Spectrum(v) => Ok(Some([*v; 3])),
                Value::Integer(v) => Ok(Some([*v as f64; 3])),
                _ => Err(self.wrong_kind(p, "an <rgb> or three numbers")),
            },
        }
    }

    /// A colour in linear sRGB whose components are at least `min` and at most `max`.
    pub(crate) fn colour(
        &mut self,
        context: &mut Context<'_>,
        name: &str,
        meaning: Meaning,
        [min, max]: [f64; 2],
    ) -> Result<Option<[f64; 3]>> {
        let Some(p) = self.take(name) else { return Ok(None) };
        let target = self.graph.target(p)?;
        let colour = match (&p.value, target) {
            (Value::Rgb(v), _) => *v,
            (Value::Float(v), _) => [*v; 3],
            (Value::Integer(v), _) => [*v as f64; 3],
            (Value::Spectrum(v), _) if meaning == Meaning::Light => EQUAL_ENERGY.map(|c| c * v),
            (Value::Spectrum(v), _) => [*v; 3],
            (Value::Sampled(samples), _) => {
                // Mitsuba 0.6 knows no illuminant.
                let meaning = if self.object.old { Meaning::Light } else { meaning };
                samples.to_srgb(meaning).map(|v| v.min(max))
            }
            (_, Some(index)) if self.graph.objects[index].class == "texture" => {
                spectrum::read(context, index, meaning)?
            }
            _ => return Err(self.wrong_kind(p, "an <rgb>, <srgb>, <float> or <spectrum>")),
        };
        if !colour.iter().all(|v| (min..=max).contains(v)) {
            let expected = if max.is_finite() {
                format!("a colour with components from {min} to {max}")
            } else {
                "a colour without negative components".into()
            };
            return Err(self.refuse(name, &expected));
        }
        Ok(Some(colour))
    }

    /// A factor on scattering, 0 to 1, with Mitsuba's default.
    pub(crate) fn reflectance(
        &mut self,
        context: &mut Context<'_>,
        name: &str,
        default: f32,
    ) -> Result<Rgb> {
        let colour = self.colour(context, name, Meaning::Factor, [0.0, 1.0])?;
        Ok(colour.map_or(Rgb::grey(default), rounded))
    }

    /// Emitted light, ≥ 0; Mitsuba's default is 1 in every channel.
    pub(crate) fn light(&mut self, context: &mut Context<'_>, name: &str) -> Result<Rgb> {
        let colour = self.colour(context, name, Meaning::Light, [0.0, f64::INFINITY])?;
        Ok(colour.map_or(Rgb::WHITE, rounded))
    }

    /// Nested objects and references of one class, in the order of the file.
    pub(crate) fn nested(&mut self, class: &'static str) -> Result<Vec<(usize, &'a Place)>> {
        self.known.push(format!("<{class}>"));
        let mut found = Vec::new();
        for (at, p) in self.object.properties.iter().enumerate() {
            if let Some(index) = self.graph.target(p)?
                && self.graph.objects[index].class == class
            {
                self.taken[at] = true;
                found.push((index, &p.place));
            }
        }
        Ok(found)
    }

    /// The nested object of a class that is given as property `name`; `None` where that is
    /// something else.
    pub(crate) fn named(&mut self, name: &str, class: &str) -> Result<Option<usize>> {
        let Some(p) = self.object.properties.iter().find(|p| p.name == name) else {
            return Ok(None);
        };
        let target = self.graph.target(p)?;
        let found = target.filter(|index| self.graph.objects[*index].class == class);
        if found.is_some() {
            self.mark(name);
        }
        Ok(found)
    }

    /// At most one nested object of a class.
    pub(crate) fn nested_one(&mut self, class: &'static str) -> Result<Option<usize>> {
        match self.nested(class)?.as_slice() {
            [] => Ok(None),
            [(index, _)] => Ok(Some(*index)),
            [_, (_, place), ..] => Err(SceneFileError::Scene {
                place: (*place).clone(),
                reason: format!("{} has more than one <{class}>", self.object.title()),
            }),
        }
    }

    /// Properties that make no difference here: a note.
    pub(crate) fn ignore(&mut self, context: &mut Context<'_>, names: &[&str], why: &str) {
        for name in names {
            if let Some(p) = self.take(name) {
                let text =
                    format!("{}: property \"{name}\" is ignored: {why}", self.object.title());
                context.note(NoteKind::Ignored, text, &p.place);
            }
        }
    }

    /// Notes what was not asked for.
    pub(crate) fn finish(self, context: &mut Context<'_>) -> Result<()> {
        let owner = self.object.title();
        for (p, _) in self.object.properties.iter().zip(&self.taken).filter(|(_, t)| !**t) {
            let known = Known::new(self.known.iter().cloned());
            let what = match self.graph.target(p)? {
                Some(index) => format!("<{}>", self.graph.objects[index].class),
                None => format!("property \"{}\"", p.name),
            };
            let text = format!("{what} is not understood by {owner} and ignored; known: {known}");
            context.note(NoteKind::Unknown, text, &p.place);
        }
        Ok(())
    }
}

/// In single precision.
pub(crate) fn rounded(colour: [f64; 3]) -> Rgb {
    Rgb::from(colour.map(|c| c as f32))
}
