//! The command line, one file a subcommand.

mod cache_args;
pub mod raster;
pub mod rays;
pub mod scene_args;
pub mod scenes;

use clap::{Parser, Subcommand};
use formats::container::{VERSION_MAJOR, VERSION_MINOR};
use std::io;
use std::process::ExitCode;
use std::sync::LazyLock;

/// Version with the format that this build writes.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    format!(
        "{} (writes .textrace and .raytrace format {VERSION_MAJOR}.{VERSION_MINOR})",
        env!("CARGO_PKG_VERSION")
    )
});

const EXAMPLES: &str = "\
Examples:
  tracegen scenes
  tracegen scenes model.gltf --json
  tracegen raster atrium -o atrium.textrace --image atrium.png
  tracegen raster sponza.gltf --camera gallery --shadows -o sponza.textrace
  tracegen rays chess -o chess.raytrace --image chess.png

Exit codes: 0 done, 2 wrong use or unreadable input.";

/// Renders a scene for both eyes and captures every texture sample or every ray into a trace.
#[derive(Debug, Parser)]
#[command(name = "tracegen", version = VERSION.as_str(), after_help = EXAMPLES, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the built-in scenes, or the cameras and contents of a file.
    Scenes(scenes::ScenesArgs),
    /// Render a stereo frame and capture its texture samples into a .textrace file.
    Raster(raster::RasterArgs),
    /// Trace a stereo frame and capture its rays into a .raytrace file.
    Rays(rays::RaysArgs),
}

/// Parses the arguments, runs the subcommand and turns its outcome into an exit code.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match cli.command {
        Command::Scenes(args) => scenes::run(args),
        Command::Raster(args) => raster::run(args),
        Command::Rays(args) => rays::run(args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads our output has seen enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            anstream::eprintln!("\u{1b}[1;31merror\u{1b}[0m: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>())
        .any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

/// Prints a warning on stderr.
pub fn warn(message: &str) {
    anstream::eprintln!("\u{1b}[1;33mwarning\u{1b}[0m: {message}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_broken_pipe_is_found_under_its_context() {
        let pipe = io::Error::from(io::ErrorKind::BrokenPipe);
        assert!(is_broken_pipe(&anyhow::Error::new(pipe).context("writing")));
        assert!(!is_broken_pipe(&anyhow::anyhow!("no such file")));
    }
}
