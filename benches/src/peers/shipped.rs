//! The adapters that come with pathspace, inside the program.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

/// Environment variable that names the Python interpreter of the adapters.
const PYTHON: &str = "PATHSPACE_PYTHON";

/// Names of peers, as in specs, with a word on each.
pub const PEERS: [(&str, &str); 3] = [
    ("mitsuba", "Mitsuba 3; integrator=path|ptracer|…, variant=scalar_rgb|llvm_ad_rgb|…"),
    (
        "luxcore",
        "LuxCore; engine=PATHCPU|BIDIRCPU, sampler=RANDOM|SOBOL|METROPOLIS, roulette=true|false, rings=N",
    ),
    ("external", "an adapter of your own; command=FILE and what it takes"),
];

const FILES: [(&str, &str); 4] = [
    ("common.py", include_str!("../../peers/common.py")),
    ("mitsuba_adapter.py", include_str!("../../peers/mitsuba_adapter.py")),
    ("luxcore_adapter.py", include_str!("../../peers/luxcore_adapter.py")),
    ("luxcore_scene.py", include_str!("../../peers/luxcore_scene.py")),
];

/// True where a spec of this name is another renderer.
pub fn is_peer(name: &str) -> bool {
    PEERS.iter().any(|(peer, _)| *peer == name)
}

/// The command of an adapter; those of ours are laid into `folder`.
pub(super) fn command(
    name: &str,
    options: &[(&str, &str)],
    folder: &Path,
) -> Result<Vec<OsString>, String> {
    if name == "external" {
        let command = options.iter().find(|(key, _)| *key == "command");
        let (_, file) = command.ok_or("external needs command=FILE")?;
        return Ok(vec![file.into()]);
    }
    for (file, text) in FILES {
        fs::write(folder.join(file), text).map_err(|e| format!("{file}: cannot write: {e}"))?;
    }
    let python = std::env::var_os(PYTHON).unwrap_or_else(|| "python3".into());
    Ok(vec![python, folder.join(format!("{name}_adapter.py")).into()])
}
