//! Points of primary sample space that mutate: what `pssmlt`, `mmlt` and `rjmlt` share.
//!
//! | what | file |
//! | --- | --- |
//! | symmetric perturbation of one coordinate | `kernel` |
//! | infinitely many coordinates, mutated when they are read | `vector` |
//! | film positions stratified across chains | `stratify` |
//! | a point with what it contributes | `state` |
//! | the chain itself | `target` |

mod kernel;
mod state;
mod stratify;
mod target;
mod vector;

pub use kernel::{Kernel, Perturbation};
pub use state::{PrimaryPoint, PrimaryState};
pub use stratify::Place;
pub use target::{Integrand, Jump, KINDS, PrimaryOptions, PrimaryTarget};
pub use vector::{Moving, PrimaryVector, Reading, Recorder};

use crate::spec::{Options, SpecError};

impl Kernel {
    /// From options: `kernel` = kelemen (`s1`, `s2`) | gaussian (`sigma`).
    ///
    /// # Errors
    /// [`SpecError::BadValue`].
    pub fn from_options(options: &mut Options<'_>) -> Result<Self, SpecError> {
        let least = 1.0 / 16_777_216.0;
        let (s1, s2) = match Kernel::KELEMEN {
            Kernel::Kelemen { s1, s2 } => (s1, s2),
            Kernel::Gaussian { .. } => (least, 0.5),
        };
        let s1 = options.number("s1", s1, least..=0.5)?;
        let s2 = options.number("s2", s2.max(s1), s1..=0.5)?;
        let sigma = options.number("sigma", 1.0 / 64.0, least..=1.0)?;
        let kernel = options.choice(
            "kernel",
            &[("kelemen", Kernel::Kelemen { s1, s2 }), ("gaussian", Kernel::Gaussian { sigma })],
        )?;
        let kelemen = matches!(kernel, Kernel::Kelemen { .. });
        options.used_if("s1", kelemen, "kernel=kelemen")?;
        options.used_if("s2", kelemen, "kernel=kelemen")?;
        options.used_if("sigma", !kelemen, "kernel=gaussian")?;
        Ok(kernel)
    }
}
