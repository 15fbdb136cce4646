//! Names of files older than version 2.0, brought to the names of Mitsuba 3.
//!
//! Mitsuba 3.9.1 turns camelCase property names into underscores, and `diffuse_reflectance` of
//! `diffuse` into `reflectance`. Real files of version 0.5 need three more things that Mitsuba 3
//! refuses: `ldrfilm` (read as `hdrfilm`), `<lookAt>` (read as `<lookat>`) and the conductors'
//! `ext_eta`.

use super::graph::Object;

/// Renames the properties of an object from an old file.
pub(crate) fn upgrade(object: &mut Object) {
    for property in &mut object.properties {
        property.name = underscored(&property.name);
    }
    if object.plugin == "diffuse" {
        for property in object.properties.iter_mut().filter(|p| p.name == "diffuse_reflectance") {
            property.name = "reflectance".into();
        }
    }
    if object.class == "film" && object.plugin == "ldrfilm" {
        object.plugin = "hdrfilm".into();
    }
}

/// `maxDepth` → `max_depth`, `intIOR` → `int_ior`: an upper-case run after a lower-case letter.
fn underscored(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let mut last = None;
    let mut in_run = false;
    for c in name.chars() {
        let starts = c.is_ascii_uppercase() && last.is_some_and(|l: char| l.is_ascii_lowercase());
        in_run = c.is_ascii_uppercase() && (starts || in_run);
        if starts {
            out.push('_');
        }
        out.push(if in_run { c.to_ascii_lowercase() } else { c });
        last = Some(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn camel_case_becomes_underscores() {
        assert_eq!(underscored("toWorld"), "to_world");
        assert_eq!(underscored("intIOR"), "int_ior");
        assert_eq!(underscored("fov"), "fov");
        assert_eq!(underscored("alphaU"), "alpha_u");
        assert_eq!(underscored("IORx"), "IORx");
        assert_eq!(underscored("extIORName"), "ext_iorname");
    }
}
