//! Integrators by text: `pt:nee=false,max_depth=5`.

use std::fmt;
use std::str::FromStr;

use pathspace_core::mis::Heuristic;
use pathspace_core::path::WalkRules;
use pathspace_core::walk::TechniqueSet;

/// Name of an integrator with its options, as on the command line: `NAME[:key=value,…]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spec {
    /// Name in the registry.
    pub name: String,
    options: Vec<(String, String)>,
}

/// What a scene file says about how it wants to be rendered; options override it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Defaults {
    /// Length cap and roulette.
    pub rules: WalkRules,
}

/// Why a spec names no integrator.
#[derive(Debug, thiserror::Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum SpecError {
    /// No integrator of this name.
    #[error("unknown integrator '{name}' (known: {known})")]
    UnknownIntegrator {
        /// The name.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The integrator has no such option.
    #[error("{integrator} has no option '{option}' (known: {known})")]
    UnknownOption {
        /// The integrator.
        integrator: String,
        /// The option.
        option: String,
        /// The options there are.
        known: String,
    },
    /// The value is not one of the option.
    #[error("{integrator}: {option}={value}: expected {expected}")]
    BadValue {
        /// The integrator.
        integrator: String,
        /// The option.
        option: String,
        /// The value.
        value: String,
        /// What it should have been.
        expected: String,
    },
    /// Not of the form `NAME[:key=value,…]`.
    #[error("'{text}' is not NAME[:key=value,…]")]
    Syntax {
        /// The text.
        text: String,
    },
}

impl FromStr for Spec {
    type Err = SpecError;

    fn from_str(text: &str) -> Result<Self, SpecError> {
        let bad = || SpecError::Syntax { text: text.to_owned() };
        let (name, rest) = match text.split_once(':') {
            Some((name, rest)) => (name, Some(rest)),
            None => (text, None),
        };
        if name.is_empty() || name.contains([',', '=']) {
            return Err(bad());
        }
        let mut options: Vec<(String, String)> = Vec::new();
        for item in rest.into_iter().flat_map(|r| r.split(',')) {
            let (key, value) = item.split_once('=').ok_or_else(bad)?;
            if key.is_empty() || value.is_empty() || options.iter().any(|(k, _)| k == key) {
                return Err(bad());
            }
            options.push((key.to_owned(), value.to_owned()));
        }
        Ok(Spec { name: name.to_owned(), options })
    }
}

impl fmt::Display for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name)?;
        for (i, (key, value)) in self.options.iter().enumerate() {
            write!(f, "{}{key}={value}", if i == 0 { ':' } else { ',' })?;
        }
        Ok(())
    }
}

impl Spec {
    /// The options as key and value, in the order in which they were given.
    pub fn pairs(&self) -> impl Iterator<Item = (&str, &str)> {
        self.options.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// Reads the options one by one; [`Options::finish`] refuses what is left.
    pub fn options(&self) -> Options<'_> {
        Options { spec: self, asked: Vec::new() }
    }
}

/// The options of a [`Spec`] as an integrator reads them.
#[derive(Debug)]
pub struct Options<'a> {
    spec: &'a Spec,
    asked: Vec<&'static str>,
}

impl<'a> Options<'a> {
    fn raw(&mut self, key: &'static str) -> Option<&'a str> {
        self.asked.push(key);
        self.spec.options.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// True where the option was given.
    fn has(&self, key: &str) -> bool {
        self.spec.options.iter().any(|(k, _)| k == key)
    }

    pub(crate) fn bad(&self, key: &str, value: &str, expected: &str) -> SpecError {
        SpecError::BadValue {
            integrator: self.spec.name.clone(),
            option: key.to_owned(),
            value: value.to_owned(),
            expected: expected.to_owned(),
        }
    }

    /// Refuses an option that was given and is not used; `with` says what it goes with.
    ///
    /// # Errors
    /// [`SpecError::BadValue`] where it was given and `used` is false.
    pub fn used_if(&self, key: &str, used: bool, with: &str) -> Result<(), SpecError> {
        match self.spec.options.iter().find(|(k, _)| k == key) {
            Some((_, value)) if !used => {
                Err(self.bad(key, value, &format!("nothing: it is used with {with} alone")))
            }
            _ => Ok(()),
        }
    }

    /// `true` or `false`.
    ///
    /// # Errors
    /// [`SpecError::BadValue`] for anything else.
    pub fn boolean(&mut self, key: &'static str, default: bool) -> Result<bool, SpecError> {
        match self.raw(key) {
            None => Ok(default),
            Some("true") => Ok(true),
            Some("false") => Ok(false),
            Some(value) => Err(self.bad(key, value, "true or false")),
        }
    }

    /// A number in a range.
    ///
    /// # Errors
    /// [`SpecError::BadValue`] for what is no number or outside.
    pub fn number(
        &mut self,
        key: &'static str,
        default: f64,
        range: std::ops::RangeInclusive<f64>,
    ) -> Result<f64, SpecError> {
        let Some(value) = self.raw(key) else { return Ok(default) };
        value.parse().ok().filter(|v| range.contains(v)).ok_or_else(|| {
            let expected = format!("a number from {} to {}", range.start(), range.end());
            self.bad(key, value, &expected)
        })
    }

    /// An integer in a range.
    ///
    /// # Errors
    /// [`SpecError::BadValue`] for what is no integer or outside.
    pub fn integer(
        &mut self,
        key: &'static str,
        default: u64,
        range: std::ops::RangeInclusive<u64>,
    ) -> Result<u64, SpecError> {
        Ok(self.optional_integer(key, range)?.unwrap_or(default))
    }

    /// An integer in a range; `None` where it is not given.
    ///
    /// # Errors
    /// [`SpecError::BadValue`] for what is no integer or outside.
    pub fn optional_integer(
        &mut self,
        key: &'static str,
        range: std::ops::RangeInclusive<u64>,
    ) -> Result<Option<u64>, SpecError> {
        let Some(value) = self.raw(key) else { return Ok(None) };
        value.parse().ok().filter(|v| range.contains(v)).map(Some).ok_or_else(|| {
            let expected = format!("an integer from {} to {}", range.start(), range.end());
            self.bad(key, value, &expected)
        })
    }

    /// An integer; −1 where `default` may be `None`.
    fn depth(
        &mut self,
        key: &'static str,
        default: Option<u32>,
        unlimited: bool,
    ) -> Result<Option<u32>, SpecError> {
        let Some(value) = self.raw(key) else { return Ok(default) };
        match value.parse::<i64>() {
            Ok(-1) if unlimited => Ok(None),
            Ok(n) if (0..=u16::MAX as i64 / 2).contains(&n) => Ok(Some(n as u32)),
            _ => {
                let expected = if unlimited {
                    "−1 (unlimited) or a small integer ≥ 0"
                } else {
                    "a small integer ≥ 0"
                };
                Err(self.bad(key, value, expected))
            }
        }
    }

    /// `roulette`, on by default. Walks without a cap end by roulette alone.
    ///
    /// # Errors
    /// [`SpecError::BadValue`], for `false` without a cap too.
    pub fn roulette(&mut self, max_length: Option<u32>) -> Result<bool, SpecError> {
        let roulette = self.boolean("roulette", true)?;
        if !roulette && max_length.is_none() {
            return Err(self.bad("roulette", "false", "true where max_depth is unlimited"));
        }
        Ok(roulette)
    }

    /// `max_depth` alone, for integrators whose roulette counts no vertices.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn max_length(&mut self, defaults: &Defaults) -> Result<Option<u32>, SpecError> {
        self.depth("max_depth", defaults.rules.max_length, true)
    }

    /// `max_depth` (edges of the longest path, −1 unlimited) and `rr_depth`, in Mitsuba's meaning.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn walk_rules(&mut self, defaults: &Defaults) -> Result<WalkRules, SpecError> {
        let rules = defaults.rules;
        Ok(WalkRules {
            max_length: self.max_length(defaults)?,
            rr_depth: self
                .depth("rr_depth", Some(rules.rr_depth), false)?
                .unwrap_or(rules.rr_depth),
        })
    }

    /// `heuristic` = balance, power (with `beta`), cutoff (with `alpha`), maximum, uniform.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn heuristic(&mut self, default: Heuristic) -> Result<Heuristic, SpecError> {
        let beta = self.number("beta", 2.0, 1.0..=64.0)?;
        let alpha = self.number("alpha", 0.01, 0.0..=1.0)?;
        let heuristic = match self.raw("heuristic") {
            None if self.has("beta") && matches!(default, Heuristic::Power { .. }) => {
                Heuristic::Power { beta }
            }
            None => default,
            Some("balance") => Heuristic::Balance,
            Some("power") => Heuristic::Power { beta },
            Some("cutoff") => Heuristic::Cutoff { alpha },
            Some("maximum") => Heuristic::Maximum,
            Some("uniform") => Heuristic::Uniform,
            Some(value) => {
                let known = "balance, power, cutoff, maximum or uniform";
                return Err(self.bad("heuristic", value, known));
            }
        };
        let power = matches!(heuristic, Heuristic::Power { .. });
        let cutoff = matches!(heuristic, Heuristic::Cutoff { .. });
        self.used_if("beta", power, "heuristic=power")?;
        self.used_if("alpha", cutoff, "heuristic=cutoff")?;
        Ok(heuristic)
    }

    /// One of a few named values, the first by default.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn choice<T: Copy>(
        &mut self,
        key: &'static str,
        values: &[(&'static str, T)],
    ) -> Result<T, SpecError> {
        let value = self.raw(key).unwrap_or(values[0].0);
        values.iter().find(|(name, _)| *name == value).map(|(_, v)| *v).ok_or_else(|| {
            let names: Vec<_> = values.iter().map(|(name, _)| *name).collect();
            self.bad(key, value, &names.join(" or "))
        })
    }

    /// `s` and `t`, ranges of techniques: `2`, `0..3` (both ends count), `1..`.
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn techniques(&mut self) -> Result<TechniqueSet, SpecError> {
        let mut range = |key| match self.raw(key) {
            None => Ok(TechniqueSet::parse_range("0..").unwrap_or(0..=0)),
            Some(text) => TechniqueSet::parse_range(text)
                .ok_or_else(|| self.bad(key, text, "a range such as 2, 0..3 or 1..")),
        };
        let (s, t) = (range("s")?, range("t")?);
        Ok(TechniqueSet::new(s, t))
    }

    /// Ends the reading.
    ///
    /// # Errors
    /// [`SpecError::UnknownOption`] for an option that nobody asked for.
    pub fn finish(self) -> Result<(), SpecError> {
        match self.spec.options.iter().find(|(k, _)| !self.asked.contains(&k.as_str())) {
            None => Ok(()),
            Some((key, _)) => Err(SpecError::UnknownOption {
                integrator: self.spec.name.clone(),
                option: key.clone(),
                known: self.asked.join(", "),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specs_survive_a_round_trip() {
        for text in ["pt", "pt:nee=false", "bdpt:heuristic=power,beta=2"] {
            assert_eq!(text.parse::<Spec>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn malformed_specs_are_refused() {
        for text in ["", ":a=b", "pt:", "pt:nee", "pt:nee=", "pt:=1", "pt:a=1,a=2", "a=b"] {
            assert!(text.parse::<Spec>().is_err(), "{text}");
        }
    }

    #[test]
    fn options_without_use_are_refused() {
        let registry = crate::Registry::builtin();
        let create =
            |text: &str| registry.create(&text.parse().unwrap(), &Defaults::default()).map(|_| ());
        for (text, with) in [
            ("bdpt:heuristic=balance,beta=2", "heuristic=power"),
            ("bdpt:alpha=0.1", "heuristic=cutoff"),
            ("pssmlt:sigma=0.1", "kernel=gaussian"),
            ("pssmlt:kernel=gaussian,s1=0.1", "kernel=kelemen"),
            ("pssmlt:kernel=gaussian,s2=0.1", "kernel=kelemen"),
            ("pssmlt:large=0,stratify=true", "large steps"),
            ("radiosity:h=0.1,elements=100", "h left out"),
        ] {
            let error = create(text).unwrap_err().to_string();
            assert!(error.ends_with(&format!("it is used with {with} alone")), "{text}: {error}");
        }
        for text in ["bdpt:beta=3", "bdpt:heuristic=cutoff,alpha=0.1"] {
            assert!(create(text).is_ok(), "{text}");
        }
    }

    #[test]
    fn beta_is_that_of_the_power_heuristic_also_by_default() {
        let spec: Spec = "bdpt:beta=3".parse().unwrap();
        let heuristic = spec.options().heuristic(Heuristic::Power { beta: 2.0 }).unwrap();
        assert_eq!(heuristic, Heuristic::Power { beta: 3.0 });
    }

    #[test]
    fn unknown_options_are_named_with_the_known_ones() {
        let spec: Spec = "pt:nee=true,colour=red".parse().unwrap();
        let mut options = spec.options();
        options.boolean("nee", false).unwrap();
        let error = options.finish().unwrap_err().to_string();
        assert_eq!(error, "pt has no option 'colour' (known: nee)");
    }
}
