//! The command line, with one file per subcommand.

mod accuracy;
mod addresses;
mod calibrate;
mod capture;
mod choice;
mod compare;
mod config_args;
pub mod convert;
pub mod diff;
pub mod dump;
mod experiment_args;
mod file_uses;
pub mod info;
mod locality;
mod order_arg;
mod orders;
mod outputs;
mod paper;
mod predict;
mod readings;
mod report;
pub mod reproject;
mod reuse_args;
mod run;
mod sample;
mod schedule;
mod subjects;
mod sweep;
mod techniques;
mod temporal;
#[cfg(test)]
pub(crate) mod testing;
mod tiles;
pub mod validate;
mod view;
mod warnings;

pub use config_args::ConfigArgs;

use capture::Capture;
use clap::{Arg, Parser, Subcommand};
use shell::{Common, Documents};
use std::process::ExitCode;

pub use shell::print;

const EXAMPLES: &str = "\
Examples:
  replay info atrium.textrace
  replay run atrium.textrace --order z2-sta --l1 8KiB --l2 128KiB
  replay report atrium.textrace -o report.html --image atrium=atrium.png
  replay techniques out/plant --html out/techniques.html
  replay convert atrium.textrace --to din --order morton -o accesses.din
  replay reproject chess.raytrace --html chess.html
  replay orders -- tracegen raster model.glb --hmd quest2

In place of a trace, commands take `-- tracegen raster|rays|techniques|app|page|xr ...`, and capture it themselves.";

/// Replays Parallax traces through cache, texture-unit and ray-tracing-unit models.
#[derive(Debug, Parser)]
#[command(name = "replay", version = shell::VERSION.as_str(), after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Replay one trace in one tile order through one cache configuration.
    Run(Box<run::Args>),
    /// Print a summary of a trace.
    Info(info::InfoArgs),
    /// Check every checksum and invariant of a trace.
    Validate(validate::ValidateArgs),
    /// Print decoded records, quads or rays, as JSON Lines.
    Dump(dump::DumpArgs),
    /// Print the first difference between two traces.
    Diff(diff::DiffArgs),
    /// Compare two captures of the same views, fragment by fragment and by cache misses.
    #[command(mut_args(without(&["order", "details"])))]
    Compare(Box<compare::Args>),
    /// Write a trace's accesses for other simulators, or the trace in another encoding.
    Convert(Box<convert::ConvertArgs>),
    /// Replay the Z2 paper's experiment and compare it with the published figures.
    #[command(mut_args(without(&["order", "l1", "l2"])))]
    Paper(Box<paper::Args>),
    /// Measure the run time and the error of faster methods.
    Accuracy(Box<accuracy::Args>),
    /// Choose settings of the paper's machine on some scenes and evaluate them on others.
    #[command(mut_args(without(&["details"])))]
    Calibrate(Box<calibrate::Args>),
    /// Replay every point of an experiment file; an interrupted sweep continues.
    Sweep(Box<sweep::Args>),
    /// Write the Z2 paper's experiment as a self-contained page, with JSON and CSV files.
    #[command(mut_args(without(&["order", "l1", "l2"])))]
    Report(Box<report::Args>),
    /// Write a page to explore tiles: maps of misses, and orders as an animation.
    #[command(mut_args(without(&["order", "count_by"])))]
    View(Box<view::Args>),
    /// Compare stereo rendering techniques: frame time, image error, cache misses.
    Techniques(Box<techniques::Args>),
    /// Compare tile orders with each other and with lower bounds, with their hardware costs.
    #[command(mut_args(without(&["order", "l1", "l2"])))]
    Orders(Box<orders::Args>),
    /// Answer for a path from a sample of its frames, within a width that is asked for.
    #[command(mut_args(without(&["order", "l1", "l2", "details"])))]
    Sample(Box<sample::Args>),
    /// Predict what orders save at a larger picture size than the captured one.
    #[command(mut_args(without(&["order", "l3", "details", "mode", "prefetch", "dram", "frame"])))]
    Predict(Box<predict::Args>),
    /// Model frame time by scheduler: shaders, texture units, caches and DRAM in a closed loop.
    #[command(mut_args(without(&["order", "mode", "l3", "assign", "between_frames", "prefetch", "frame", "count_by", "tmu", "memory_cycles", "loop_cycles", "tmu_threads", "retry_footprints", "fetches_per_trip", "allocation"])))]
    Schedule(Box<schedule::Args>),
    /// Analyse reuse distances, working sets, miss-ratio curves, OPT and 3C misses, by order.
    #[command(mut_args(without(&["order", "l3", "prefetch", "dram", "frame"])))]
    Locality(Box<locality::Args>),
    /// Replay ray traces through a ray-tracing GPU that reuses the left image for the right.
    #[command(visible_alias = "sgrt")]
    Reproject(Box<reproject::ReprojectArgs>),
    /// Set every reading of the SGRT paper's figure 3 beside the paper.
    #[command(mut_args(without(&["details"])))]
    Readings(Box<readings::ReadingsArgs>),
    /// Compare reuse of the previous frame with reuse between the eyes, on ray traces of a sequence.
    Temporal(Box<temporal::TemporalArgs>),
    #[command(flatten)]
    Documents(Documents),
}

/// Hides the machine's flags that a command refuses.
fn without(refused: &'static [&'static str]) -> impl Fn(Arg) -> Arg {
    move |arg| {
        let refused = refused.contains(&arg.get_id().as_str());
        if refused { arg.hide(true) } else { arg }
    }
}

/// Parses the arguments, runs the subcommand and turns its outcome into an exit code.
pub fn main() -> ExitCode {
    if std::env::args_os()
        .nth(1)
        .is_some_and(|name| name == "sgrt")
    {
        shell::error(
            "sgrt: no command of this name; `replay reproject` replays ray traces through the SGRT model",
        );
        return ExitCode::from(2);
    }
    let (arguments, mut capture) = match Capture::split(std::env::args_os().collect()) {
        Ok(split) => split,
        Err(error) => {
            shell::error(&shell::described(&error));
            return ExitCode::from(2);
        }
    };
    shell::run(
        arguments,
        file_uses::FILES,
        |cli: &Cli| cli.common,
        |cli| {
            capture.as_mut().map_or(Ok(()), Capture::run)?;
            cli.command.run()
        },
    )
}

impl Command {
    fn run(self) -> anyhow::Result<ExitCode> {
        match self {
            Self::Run(args) => run::run(&args),
            Self::Info(args) => info::run(&args),
            Self::Validate(args) => validate::run(&args),
            Self::Dump(args) => dump::run(&args),
            Self::Diff(args) => diff::run(&args),
            Self::Compare(args) => compare::run(&args),
            Self::Convert(args) => convert::run(&args),
            Self::Paper(args) => paper::run(&args),
            Self::Accuracy(args) => accuracy::run(&args),
            Self::Calibrate(args) => calibrate::run(&args),
            Self::Sweep(args) => sweep::run(&args),
            Self::Report(args) => report::run(&args),
            Self::View(args) => view::run(&args),
            Self::Techniques(args) => techniques::run(&args),
            Self::Orders(args) => orders::run(&args),
            Self::Sample(args) => sample::run(&args),
            Self::Predict(args) => predict::run(&args),
            Self::Schedule(args) => schedule::run(&args),
            Self::Locality(args) => locality::run(&args),
            Self::Reproject(args) => reproject::run(*args),
            Self::Readings(args) => readings::run(&args),
            Self::Temporal(args) => temporal::run(&args),
            Self::Documents(documents) => documents.run::<Cli>(),
        }
    }
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
