//! `$name` in attributes, `<default>` and the values given on the command line.

use crate::error::{Known, Place, Result, SceneFileError};

struct Parameter {
    name: String,
    value: String,
    used: bool,
}

/// All parameters, longest names first, so that `$width2` is not read as `$width` and a `2`.
pub(crate) struct Parameters(Vec<Parameter>);

impl Parameters {
    /// The values given from outside; they win over `<default>`.
    pub(crate) fn new(given: &[(String, String)]) -> Self {
        let mut all = Parameters(Vec::new());
        // Of two values for one name the later one counts, as on a command line.
        for (name, value) in given.iter().rev() {
            all.add(name, value, false);
        }
        all
    }

    fn add(&mut self, name: &str, value: &str, used: bool) {
        if self.0.iter().any(|p| p.name == name) {
            return;
        }
        let at = self.0.partition_point(|p| p.name.len() >= name.len());
        self.0.insert(at, Parameter { name: name.into(), value: value.into(), used });
    }

    /// `<default>`: counts only where the parameter is not given yet.
    pub(crate) fn default(&mut self, name: &str, value: &str) {
        self.add(name, value, true);
    }

    /// Replaces every `$name`; `\$` stands for a dollar sign.
    pub(crate) fn substitute(&mut self, text: &str, place: &Place) -> Result<String> {
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
            match self.0.iter_mut().find(|p| rest.starts_with(&p.name)) {
                Some(p) => {
                    p.used = true;
                    out.push_str(&p.value);
                    rest = &rest[p.name.len()..];
                }
                None => {
                    let name: String =
                        rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    let reason = format!(
                        "parameter \"${name}\" is not defined; known: {} (give it with -D {name}=… or <default>)",
                        self.known()
                    );
                    return Err(SceneFileError::Parameter { place: place.clone(), reason });
                }
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    fn known(&self) -> Known {
        Known::new(self.0.iter().map(|p| p.name.clone()))
    }

    /// Refuses values from outside that no `$name` asked for.
    pub(crate) fn check_used(&self, place: &Place) -> Result<()> {
        match self.0.iter().find(|p| !p.used) {
            Some(p) => {
                let known = Known::new(
                    self.0.iter().filter(|p| p.used).map(|p| p.name.clone()).collect::<Vec<_>>(),
                );
                let reason = format!(
                    "parameter \"{}={}\" is not used by the scene; known: {known}",
                    p.name, p.value
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
}
