//! `$name` in attributes, `<default>` and the values given on the command line.

use std::collections::HashMap;

use crate::error::{Known, Place, Result, SceneFileError};

struct Parameter {
    value: String,
    used: bool,
}

/// Longest value of an attribute after parameters are put in, bytes.
const MAX_VALUE: usize = 1 << 20;

/// Most bytes that all parameters of a scene may put in: defaults that double each other would fill
/// the memory.
const MAX_TOTAL: usize = 1 << 28;

/// All parameters. `$width2` is not read as `$width` and a `2` where there is a parameter `width2`:
/// the longest name counts.
pub(crate) struct Parameters {
    by_name: HashMap<String, Parameter>,
    /// Bytes of the longest name.
    longest: usize,
    /// Bytes that were put in.
    total: usize,
}

impl Parameters {
    /// The values given from outside; they win over `<default>`.
    pub(crate) fn new(given: &[(String, String)]) -> Self {
        let mut all = Parameters { by_name: HashMap::new(), longest: 0, total: 0 };
        // Of two values for one name the later one counts, as on a command line.
        for (name, value) in given.iter().rev() {
            all.add(name, value, false);
        }
        all
    }

    fn add(&mut self, name: &str, value: &str, used: bool) {
        if !name.is_empty() && !self.by_name.contains_key(name) {
            self.longest = self.longest.max(name.len());
            self.by_name.insert(name.into(), Parameter { value: value.into(), used });
        }
    }

    /// `<default>`: counts only where the parameter is not given yet.
    pub(crate) fn default(&mut self, name: &str, value: &str) {
        self.add(name, value, true);
    }

    /// Replaces every `$name`; `\$` stands for a dollar sign.
    pub(crate) fn substitute(&mut self, text: &str, place: &Place) -> Result<String> {
        if !text.contains('$') {
            return Ok(text.into());
        }
        let mut out = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            if rest[..at].ends_with('\\') {
                out.push_str(&rest[..at - 1]);
                out.push('$');
                rest = &rest[at + 1..];
                continue;
            }
            out.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let lengths = (1..=self.longest.min(rest.len())).rev();
            let name =
                lengths.filter_map(|n| rest.get(..n)).find(|n| self.by_name.contains_key(*n));
            let Some((name, parameter)) =
                name.and_then(|name| Some((name, self.by_name.get_mut(name)?)))
            else {
                return Err(self.undefined(rest, place));
            };
            parameter.used = true;
            out.push_str(&parameter.value);
            self.total += parameter.value.len();
            rest = &rest[name.len()..];
            if out.len() > MAX_VALUE || self.total > MAX_TOTAL {
                let reason = format!(
                    "parameter \"${name}\" makes a value of more than {MAX_VALUE} bytes, or all of more than {MAX_TOTAL}"
                );
                return Err(SceneFileError::Parameter { place: place.clone(), reason });
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    fn undefined(&self, rest: &str, place: &Place) -> SceneFileError {
        let letters = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_');
        let name: String = letters.take(100).collect();
        let known = Known::new(self.by_name.keys().cloned());
        let reason = format!(
            "parameter \"${name}\" is not defined; known: {known} (give it with -D {name}=… or <default>)"
        );
        SceneFileError::Parameter { place: place.clone(), reason }
    }

    /// Refuses values from outside that no `$name` asked for.
    pub(crate) fn check_used(&self, place: &Place) -> Result<()> {
        let unused = self.by_name.iter().filter(|(_, p)| !p.used).min_by_key(|(name, _)| *name);
        match unused {
            Some((name, p)) => {
                let used =
                    self.by_name.iter().filter(|(_, p)| p.used).map(|(name, _)| name.clone());
                let reason = format!(
                    "parameter \"{name}={}\" is not used by the scene; known: {}",
                    p.value,
                    Known::new(used)
                );
                Err(SceneFileError::Parameter { place: place.clone(), reason })
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(pairs: &[(&str, &str)]) -> Parameters {
        let pairs: Vec<_> = pairs.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        Parameters::new(&pairs)
    }

    #[test]
    fn the_longest_name_wins() {
        let mut p = given(&[("w", "1"), ("width", "640")]);
        assert_eq!(p.substitute("$width x $w", &Place::file("t")).unwrap(), "640 x 1");
    }

    #[test]
    fn an_escaped_dollar_stays() {
        assert_eq!(given(&[]).substitute("a\\$b", &Place::file("t")).unwrap(), "a$b");
    }

    #[test]
    fn defaults_give_way_to_given_values() {
        let mut p = given(&[("n", "7")]);
        p.default("n", "3");
        p.default("m", "4");
        assert_eq!(p.substitute("$n$m", &Place::file("t")).unwrap(), "74");
    }

    #[test]
    fn defaults_that_double_each_other_are_refused() {
        let mut p = given(&[]);
        p.default("a0", "0123456789abcdef");
        let place = Place::file("t");
        let grown = (1..64).try_for_each(|i| {
            let last = i - 1;
            let value = p.substitute(&format!("$a{last}$a{last}"), &place)?;
            p.default(&format!("a{i}"), &value);
            Ok::<(), SceneFileError>(())
        });
        assert_eq!(
            grown.unwrap_err().to_string(),
            "t: parameter \"$a16\" makes a value of more than 1048576 bytes, or all of more than 268435456"
        );
    }
}
