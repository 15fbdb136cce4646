//! The command `pathspace` with the integrators that come with it.

fn main() -> std::process::ExitCode {
    pathspace::cli::run(pathspace::integrators::Registry::builtin())
}
