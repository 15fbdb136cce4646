//! Options of the path-space integrators.

use pathspace_integrators::{Defaults, Registry};

fn error(spec: &str) -> String {
    let made = Registry::builtin().create(&spec.parse().unwrap(), &Defaults::default());
    made.err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn options_are_checked() {
    for (spec, part) in [
        ("mlt:lens=-1", "a number from 0"),
        ("mlt:colour=red", "mlt has no option 'colour'"),
        ("mlt:bidir=0,lens=0,caustic=0,multi=0,manifold=0", "a positive share"),
        ("mlt:rounds=two", "grow or one"),
        ("mlt:target=depth", "luminance or two-stage"),
        ("mlt:area=0", "a number from"),
        ("erpt:seeds=lt", "pt or bdpt"),
        ("erpt:mutations=0", "erpt"),
        ("erpt:bootstrap=7", "erpt has no option 'bootstrap'"),
    ] {
        let error = error(spec);
        assert!(error.contains(part), "{spec}: {error}");
    }
    for spec in
        ["mlt:bidir=2,manifold=0,step=0.5,area=0.1", "erpt:seeds=bdpt,mutations=50,chains=2"]
    {
        assert_eq!(error(spec), "", "{spec}");
    }
}
