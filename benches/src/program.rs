//! Which program is running.

use std::fs;
use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;

/// A word for the program that is running: the BLAKE3 hash of its file, or its version where the
/// file cannot be read.
///
/// Another build, or a program with a plug-in, may use other random numbers under the same version:
/// what it has rendered is not gone on with.
pub fn program() -> &'static str {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let version = |_: io::Error| env!("CARGO_PKG_VERSION").to_owned();
        file().and_then(fs::read).map_or_else(version, |b| blake3::hash(&b).to_hex().to_string())
    })
}

/// On Linux the file that runs, also where another build has taken its place.
fn file() -> io::Result<PathBuf> {
    if cfg!(target_os = "linux") { Ok("/proc/self/exe".into()) } else { std::env::current_exe() }
}
