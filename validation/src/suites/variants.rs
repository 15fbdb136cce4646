//! Options that are not the default ones, with little work each.

use super::Part;

/// Options of the bidirectional and the path tracer and of chains, each held to `bdpt` on two
/// scenes. (`refine=true` is left out: it is consistent, not unbiased, and says so.)
const SPECS: &[&str] = &[
    "pt:nee=false",
    "bdpt:connect=one",
    "bdpt:connect=cache",
    "pssmlt:over=pt",
    "pssmlt:mis=false",
    "pssmlt:kernel=gaussian",
    "pssmlt:stratify=true",
    "pssmlt:target=two-stage",
    "mmlt:lengths=step,mis=true",
    "mmlt:target=two-stage",
    "rjmlt:jump=0.3",
    "mlt:target=two-stage",
    "erpt:seeds=bdpt",
];
const SCENES: &[&str] = &["cornell-box", "thin-lens"];

/// Every part.
pub(super) fn all(rays: u64) -> Vec<Part> {
    let (scenes, specs) = (SCENES, SPECS);
    let options = Part::Variants { scenes, size: 16, specs, against: "bdpt", rays, mdb: 0.01 };
    vec![options, lens(rays), roulette(rays)]
}

/// Russian roulette from the first vertex on, at lengths that are known: it is the last vertices
/// that a mistake in it shows at.
pub(super) fn roulette(rays: u64) -> Part {
    Part::Exact {
        scenes: &["concentric spheres", "integrating sphere with both lights"],
        specs: &["pt:rr_depth=1", "lt:rr_depth=1"],
        rays,
        mdb: 0.01,
    }
}

/// One technique alone, which among all others has little weight: light that falls onto the lens,
/// connections of two subpaths, light tracing.
pub(super) fn lens(rays: u64) -> Part {
    Part::Exact {
        scenes: &["integrating sphere through a lens"],
        specs: &["bdpt:t=0..0", "bdpt:t=1..1", "bdpt:s=0..0", "bdpt:s=1..1"],
        rays,
        mdb: 0.01,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_integrators::{Defaults, Registry};

    #[test]
    fn every_variant_is_an_integrator() {
        for part in all(1) {
            let (Part::Variants { specs, .. } | Part::Exact { specs, .. }) = part else { continue };
            for spec in specs {
                let parsed = spec.parse().unwrap();
                let made = Registry::builtin().create(&parsed, &Defaults::default());
                assert!(made.is_ok(), "{spec}: {:?}", made.err());
            }
        }
    }
}
