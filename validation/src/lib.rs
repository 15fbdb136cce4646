//! Statistical validation of integrators: how pathspace knows that it is right.
//!
//! | Question | Where |
//! | --- | --- |
//! | Is my integrator right on this scene? | [`validate()`](validate::validate()) |
//! | Are all of them right, on all scenes? | [`suites`] |
//! | Do two of them agree? | [`pairs`] |
//! | Do images of two renderers agree? | [`mod@agree`] |
//! | Which scenes have an exact answer? | [`exact`] |
//! | What do finite elements say of a diffuse scene? | [`radiosity`] |
//! | How sure is a verdict? | [`stats`], pure functions on numbers that know nothing of rendering |
//! | How do I write a scene in code? | [`scene_builder`] |
//! | How are numbers read that JSON can not write? | [`json`] |
//! | Would the tests find a bug? | [`mutants`] |
//! | What do pages for the browser have in common? | [`page`] |

pub mod agree;
pub mod chains;
pub mod exact;
pub mod json;
pub mod mutants;
pub mod page;
pub mod pairs;
pub mod radiosity;
pub mod scene_builder;
pub mod stats;
pub mod suites;
pub mod validate;
