//! Access to an object's properties that notices what nobody asked for.
//!
//! The reader of a plug-in asks for every property that it knows, then calls [`Props::finish`];
//! the names that were asked for are the plug-in's table of known properties.

use glam::{DAffine3, DVec3};
use pathspace_core::Rgb;

use super::Context;
use crate::error::{Known, Place, Result, SceneFileError};
use crate::xml::value::{Value, bad};
use crate::xml::{Graph, Object, Property};

/// The properties of one object.
pub(crate) struct Props<'a> {
    graph: &'a Graph,
    pub(crate) object: &'a Object,
    known: Vec<String>,
    taken: Vec<bool>,
}

/// A colour and how the file gave it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Colour {
    Rgb([f64; 3]),
    /// One number without a unit of spectrum: the same in every channel.
    Grey(f64),
    /// A spectrum of one value at all wavelengths.
    Spectrum(f64),
}

impl Colour {
    /// As a factor without a unit (reflectance, refractive index).
    pub(crate) fn factor(self) -> Rgb {
        match self {
            Colour::Rgb(v) => Rgb::from(v.map(|c| c as f32)),
            Colour::Grey(v) | Colour::Spectrum(v) => Rgb::grey(v as f32),
        }
    }

    /// As light. Equal energy at all wavelengths is not the white of sRGB (D65), and Mitsuba
    /// gives it these linear components; measured in its variant `scalar_rgb`.
    pub(crate) fn light(self) -> Rgb {
        match self {
            Colour::Spectrum(v) => Rgb::new(1.204_794, 0.948_290, 0.908_916) * v as f32,
            other => other.factor(),
        }
    }
}

impl<'a> Props<'a> {
    pub(crate) fn new(graph: &'a Graph, object: &'a Object) -> Self {
        let taken = vec![false; object.properties.len()];
        Props { graph, object, known: Vec::new(), taken }
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

    fn what(&self, name: &str) -> String {
        format!("{}: property \"{name}\"", self.object.title())
    }

    fn wrong_kind(&self, p: &Property, expected: &str) -> SceneFileError {
        let value = match &p.value {
            Value::Object(index) => self.graph.objects[*index].title(),
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

    /// A colour whose components are at least 0 and at most `max`.
    pub(crate) fn colour(&mut self, name: &str, max: f64) -> Result<Option<Colour>> {
        let Some(p) = self.take(name) else { return Ok(None) };
        let colour = match p.value {
            Value::Rgb(v) => Colour::Rgb(v),
            Value::Float(v) => Colour::Grey(v),
            Value::Integer(v) => Colour::Grey(v as f64),
            Value::Spectrum(v) => Colour::Spectrum(v),
            _ => {
                let expected = "an <rgb>, <srgb>, <float> or constant <spectrum> (no textures)";
                return Err(self.wrong_kind(p, expected));
            }
        };
        let values = match colour {
            Colour::Rgb(v) => v,
            Colour::Grey(v) | Colour::Spectrum(v) => [v; 3],
        };
        if !values.iter().all(|v| (0.0..=max).contains(v)) {
            let expected = if max.is_finite() {
                format!("a colour with components from 0 to {max}")
            } else {
                "a colour without negative components".into()
            };
            return Err(self.refuse(name, &expected));
        }
        Ok(Some(colour))
    }

    /// A factor on scattering, 0 to 1, with Mitsuba's default.
    pub(crate) fn reflectance(&mut self, name: &str, default: f32) -> Result<Rgb> {
        Ok(self.colour(name, 1.0)?.map_or(Rgb::grey(default), Colour::factor))
    }

    /// Emitted light, ≥ 0; Mitsuba's default is 1 in every channel.
    pub(crate) fn light(&mut self, name: &str) -> Result<Rgb> {
        Ok(self.colour(name, f64::INFINITY)?.map_or(Rgb::WHITE, Colour::light))
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

    /// Properties that make no difference here: a warning, once for each kind.
    pub(crate) fn ignore(&mut self, context: &mut Context<'_>, names: &[&str], why: &str) {
        for name in names {
            if let Some(p) = self.take(name) {
                context.warn_once(
                    &format!("{}: property \"{name}\" is ignored: {why}", self.object.title()),
                    &p.place,
                );
            }
        }
    }

    /// Refuses what was not asked for.
    pub(crate) fn finish(self) -> Result<()> {
        let Some(at) = self.taken.iter().position(|t| !t) else { return Ok(()) };
        let p = &self.object.properties[at];
        let known = Known::new(self.known.iter().cloned());
        let place = p.place.clone();
        match self.graph.target(p)? {
            Some(index) => Err(SceneFileError::Element {
                place,
                element: self.graph.objects[index].class.into(),
                within: self.object.title(),
                known,
            }),
            None => Err(SceneFileError::Property {
                place,
                property: p.name.clone(),
                owner: self.object.title(),
                known,
            }),
        }
    }
}
