//! Words of a command line: quoted for a shell, and the one that was meant.

/// The word as a shell reads it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// `; did you mean 'x'?`, where one of the known names is near; else nothing.
pub(super) fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let lower = word.to_lowercase();
    let near = known.into_iter().map(|name| {
        let likeness = strsim::jaro_winkler(&lower, &name.to_lowercase());
        // A transposition or a letter too many in a short name is far by Jaro.
        let steps = strsim::osa_distance(&lower, &name.to_lowercase());
        (if steps <= 1 { likeness.max(0.9) } else { likeness }, name)
    });
    let best = near.filter(|(l, _)| *l >= 0.8).max_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(String::new(), |(_, name)| format!("; did you mean '{name}'?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_cut_them() {
        assert_eq!(quoted("bdpt:s=0..1,t=2"), "bdpt:s=0..1,t=2");
        assert_eq!(
            (quoted("a b"), quoted("it's"), quoted("")),
            ("'a b'".into(), r"'it'\''s'".into(), "''".into())
        );
    }

    #[test]
    fn the_nearest_name_is_suggested_and_no_far_one() {
        let known = ["pt", "lt", "bdpt", "mmlt", "pssmlt"];
        assert_eq!(did_you_mean("bpdt", known), "; did you mean 'bdpt'?");
        assert_eq!(did_you_mean("mlmt", known), "; did you mean 'mmlt'?");
        assert_eq!(did_you_mean("ppt", known), "; did you mean 'pt'?");
        assert_eq!(did_you_mean("magic", known), "");
        assert_eq!(
            did_you_mean("cornell-bax", ["cornell-box", "furnace"]),
            "; did you mean 'cornell-box'?"
        );
    }
}
