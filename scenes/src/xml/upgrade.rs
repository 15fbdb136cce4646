//! Names of files older than version 2.0, brought to the names of Mitsuba 3.
//!
//! Mitsuba 3.9.1 turns camelCase property names into underscores, and `diffuse_reflectance` of
//! `diffuse` into `reflectance`. Real files of version 0.5 need three more things that Mitsuba 3
//! refuses: `ldrfilm` (read as `hdrfilm`), `<lookAt>` (read as `<lookat>`) and the conductors'
//! `ext_eta`.

use super::graph::Object;

/// Name of an element in present files: 0.3 and earlier wrote some otherwise.
pub(crate) fn tag(tag: &str, old: bool) -> &str {
    match tag {
        "luminaire" if old => "emitter",
        "camera" if old => "sensor",
        other => other,
    }
}

/// Plug-ins and their properties that were called otherwise before 0.5: class, old and new name.
const PLUGINS: [(&str, &str, &str); 8] = [
    ("bsdf", "lambertian", "diffuse"),
    ("bsdf", "roughglass", "roughdielectric"),
    ("bsdf", "bump", "bumpmap"),
    ("bsdf", "composite", "mixturebsdf"),
    ("bsdf", "mixture", "mixturebsdf"),
    ("bsdf", "blend", "blendbsdf"),
    ("bsdf", "roughmetal", "roughconductor"),
    ("film", "ldrfilm", "hdrfilm"),
];

/// Names of light before 0.4: plug-in, old and new property.
const LIGHT: [(&str, &str, &str); 3] = [
    ("area", "intensity", "radiance"),
    ("constant", "intensity", "radiance"),
    ("directional", "intensity", "irradiance"),
];

/// Renames an object from an old file and its properties.
pub(crate) fn upgrade(object: &mut Object) {
    for property in &mut object.properties {
        property.name = underscored(&property.name);
    }
    if object.plugin == "diffuse" {
        for property in object.properties.iter_mut().filter(|p| p.name == "diffuse_reflectance") {
            property.name = "reflectance".into();
        }
    }
    for (class, from, to) in PLUGINS {
        if object.class == class && object.plugin == from {
            object.plugin = to.into();
        }
    }
    for (plugin, from, to) in LIGHT {
        if object.class == "emitter" && object.plugin == plugin {
            for property in object.properties.iter_mut().filter(|p| p.name == from) {
                property.name = to.into();
            }
        }
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
