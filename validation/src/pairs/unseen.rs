//! Techniques, and why an integrator can not make a path, in words.

use pathspace_core::film::Families;

/// What all paths have in common that no technique of `families` can make, on a film of its own
/// kind.
pub(super) fn reason(families: Families) -> String {
    let why: Vec<&str> = [
        (Families::S0, "whose emitter can not be hit"),
        (Families::S1, "whose vertex at the emitter is specular"),
        (Families::INNER, "without two neighbouring vertices that are not specular"),
        (Families::T1, "whose vertex at the sensor is specular"),
        (Families::T0, "whose sensor can not be hit"),
        (Families::MERGE, "all of whose vertices are specular"),
    ]
    .iter()
    .filter_map(|(family, words)| families.intersects(*family).then_some(*words))
    .collect();
    match why.as_slice() {
        [] => "paths of any kind".into(),
        _ => format!("paths {}", why.join(" and ")),
    }
}

/// Techniques of `families` as (s, t), vertices on the side of the emitter and of the sensor.
pub(crate) fn techniques(families: Families) -> Vec<String> {
    [
        (Families::S0, "(0,t) hitting the emitter"),
        (Families::S1, "(1,t) next-event estimation"),
        (Families::INNER, "(s,t) connecting subpaths"),
        (Families::T1, "(s,1) connecting to the sensor"),
        (Families::T0, "(s,0) hitting the lens"),
        (Families::MERGE, "merging"),
    ]
    .iter()
    .filter(|(family, _)| families.intersects(*family))
    .map(|(_, words)| (*words).to_owned())
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_tracing_misses_what_is_seen_in_mirrors() {
        assert_eq!(reason(Families::T1), "paths whose vertex at the sensor is specular");
    }

    #[test]
    fn path_tracing_misses_caustics_of_point_lights() {
        let words = reason(Families::S0 | Families::S1);
        assert!(
            words.contains("emitter can not be hit and whose vertex at the emitter"),
            "{words}"
        );
    }
}
