//! Stand-ins for the commands that the program is built without.

use std::ffi::OsString;
use std::process::ExitCode;

/// Any arguments of a command that is not built.
#[derive(clap::Args, Clone, Debug)]
pub struct NotBuilt {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    arguments: Vec<OsString>,
}

macro_rules! not_built {
    ($($command:ident $arguments:ident),*) => {$(
        pub mod $command {
            pub use super::NotBuilt as $arguments;

            pub fn run(_: &$arguments) -> anyhow::Result<super::ExitCode> {
                anyhow::bail!(
                    "this program is built without the command `{}`: `make build` builds it with all commands",
                    stringify!($command)
                )
            }
        }
    )*};
}

#[cfg(not(feature = "programs"))]
not_built!(app AppArgs, page PageArgs, xr XrArgs);
#[cfg(not(feature = "lab"))]
not_built!(precision PrecisionArgs, stress StressArgs, verify VerifyArgs);
