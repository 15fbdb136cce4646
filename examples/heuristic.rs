//! A heuristic of one's own, compared by the whole command: `bdpt` with g(r) = r√r beside the
//! built-in ones.
//!
//! `cargo run --release --example heuristic -- compare cornell-box -i bdpt -i bdpt-soft --seconds
//! 0.5`

use std::process::ExitCode;

use pathspace::core::mis::Heuristic;
use pathspace::integrators::Registry;
use pathspace::integrators::bdpt::Bdpt;

fn main() -> ExitCode {
    // Between balance (r) and power (r²); r is the density over the largest one of the path.
    let soft = Heuristic::custom("soft", |r| r * r.sqrt());
    let registry = Registry::builtin().with(
        "bdpt-soft",
        "bidirectional path tracing with the exponent 3/2",
        move |spec, defaults| {
            let mut bdpt = Bdpt::from_spec(spec, defaults)?;
            bdpt.heuristic = soft;
            Ok(Box::new(bdpt))
        },
    );
    pathspace::cli::run(registry)
}
