//! The command line, one file per subcommand.

#[cfg(feature = "programs")]
pub mod app;
mod cache_args;
mod capture_cache;
mod capture_steps;
mod choice;
mod drivers;
#[cfg(feature = "programs")]
mod failed_run;
mod file_uses;
mod frames_arg;
pub mod lens_args;
mod light_args;
#[cfg(not(all(feature = "lab", feature = "programs")))]
mod not_built;
mod objective_args;
#[cfg(feature = "programs")]
pub mod page;
mod path_args;
mod pose_args;
#[cfg(feature = "lab")]
pub mod precision;
mod prepared;
#[cfg(feature = "programs")]
mod program_args;
#[cfg(feature = "programs")]
mod program_run;
pub mod raster;
mod raster_args;
mod raster_auto;
mod raster_frames;
mod raster_plan;
mod raster_summary;
pub mod rays;
pub mod scene_args;
pub mod scenes;
pub mod shadows;
#[cfg(feature = "lab")]
pub mod stress;
pub mod sweep;
mod technique_args;
pub mod techniques;
mod values;
#[cfg(feature = "lab")]
pub mod verified_trace;
#[cfg(feature = "lab")]
mod verify;
#[cfg(feature = "programs")]
pub mod xr;

use clap::{Parser, Subcommand};
#[cfg(not(feature = "programs"))]
use not_built::{app, page, xr};
#[cfg(not(feature = "lab"))]
use not_built::{precision, stress, verify};
use shell::{Common, Documents, SuperviseArgs};
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  tracegen scenes
  tracegen scenes model.gltf --json
  tracegen raster atrium -o atrium.textrace --image atrium.png
  tracegen raster sponza.gltf --camera gallery --shadows -o sponza.textrace
  tracegen app -o program.textrace --frames 10..13 -- ./program --stereo
  tracegen techniques atrium --path head -o atrium-techniques
  tracegen sweep captures.toml -o traces
  tracegen verify atrium --tiles 200 --colour
  tracegen rays chess -o chess.raytrace --image chess.png";

/// Renders a scene for both eyes and captures every texture sample or every ray into a trace.
#[derive(Debug, Parser)]
#[command(name = "tracegen", version = shell::VERSION.as_str(), after_help = EXAMPLES, max_term_width = 100)]
pub struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the built-in scenes, or the cameras and contents of a file.
    Scenes(scenes::ScenesArgs),
    /// Render a stereo frame and capture its texture samples into a .textrace file.
    Raster(Box<raster_args::RasterArgs>),
    /// Capture the texture samples of an unmodified Vulkan or OpenGL program into a .textrace file.
    App(Box<app::AppArgs>),
    /// Capture the texture samples of an unmodified OpenXR program, without a headset, into a .textrace file.
    Xr(Box<xr::XrArgs>),
    /// Capture the texture samples of a page of WebGL or WebXR in Chromium into a .textrace file.
    Page(Box<page::PageArgs>),
    /// Measure stereo rendering techniques along a path: times, pictures and traces into a folder.
    Techniques(Box<techniques::TechniquesArgs>),
    /// Measure the error of shadow maps in smaller formats: pictures, and distances from shadows' edges.
    Shadows(Box<shadows::ShadowsArgs>),
    /// Capture every combination of a manifest's scenes, cameras and displays; an interrupted sweep resumes.
    Sweep(sweep::SweepArgs),
    /// Compare a captured frame with a reference in double precision: coverage, coordinates, levels, colours.
    Verify(Box<verify::VerifyArgs>),
    /// Trace a stereo frame and capture its rays into a .raytrace file.
    Rays(Box<rays::RaysArgs>),
    /// Capture extreme inputs and compare them with a reference: errors and their bounds near the limits of
    /// arithmetic.
    Stress(stress::StressArgs),
    /// Measure the cost and the errors of rays in single and in double precision, near the origin and far
    /// from it.
    Precision(precision::PrecisionArgs),
    /// Run a program for `app`, `xr` or `page`.
    #[command(hide = true)]
    Supervise(SuperviseArgs),
    #[command(flatten)]
    Documents(Documents),
}

/// Parses the arguments, runs the subcommand and returns its exit code.
pub fn main() -> ExitCode {
    shell::run(
        std::env::args_os().collect(),
        file_uses::FILES,
        |cli: &Cli| cli.common,
        |cli| {
            match cli.command {
                Command::Scenes(args) => scenes::run(args)?,
                Command::Raster(args) => raster::run(&args)?,
                Command::App(args) => return app::run(&args),
                Command::Xr(args) => return xr::run(&args),
                Command::Page(args) => return page::run(&args),
                Command::Techniques(args) => techniques::run(&args)?,
                Command::Shadows(args) => shadows::run(&args)?,
                Command::Sweep(args) => sweep::run(&args)?,
                Command::Verify(args) => return verify::run(&args),
                Command::Rays(args) => rays::run(&args)?,
                Command::Stress(args) => return stress::run(&args),
                Command::Precision(args) => return precision::run(&args),
                Command::Supervise(args) => return args.run(),
                Command::Documents(documents) => return documents.run::<Cli>(),
            }
            Ok(ExitCode::SUCCESS)
        },
    )
}

/// Name and version of the program, as traces record it.
pub(crate) fn tool() -> String {
    format!("tracegen {}", env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_command_line_is_well_formed_and_no_output_replaces_an_input() {
        shell::assert_command_line(
            &<super::Cli as clap::CommandFactory>::command(),
            super::file_uses::FILES,
        );
    }
}
