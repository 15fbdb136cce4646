//! The command `pathspace` with vertex connection and merging beside the integrators that come with
//! it.

use pathspace::integrators::Registry;
use pathspace_vcm::{NAME, Vcm};

fn main() -> std::process::ExitCode {
    let registry =
        Registry::builtin().with(NAME, "vertex connection and merging", |spec, defaults| {
            Ok(Box::new(Vcm::from_spec(spec, defaults)?))
        });
    pathspace::cli::run(registry)
}
