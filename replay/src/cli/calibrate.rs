//! `replay calibrate`: chooses settings on some scenes and evaluates them on others, against the Z2 paper.

use super::outputs::ReplayArgs;
use super::subjects::{Traces, replayed};
use anyhow::{Context, Result, anyhow, bail, ensure};
use report::calibration::CalibrationReport;
use sim::config::Mode;
use sim::paper::z2;
use sim::preset::Preset;
use std::path::PathBuf;
use std::process::ExitCode;
use studies::experiment::{self, Axis, Objective, Plan, SceneCaptures, Store, trials};
use toml::Value;

/// Arguments of `replay calibrate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay calibrate *.textrace --try tmu.loop_cycles=16,20,24,28,32
  replay calibrate *.textrace --held-out atrium,jungle --objective table \\
    --try sampling.max_anisotropy=1,2 --try layout.base_align_bytes=64,4096,65536
  replay calibrate *.textrace --by-ipd --held-out jungle --objective table \\
    --try sampling.lod_bias=0,-1 --mode functional

Rates are those of first look-ups where the mode is first-miss (the default), as the paper's very probably are; in other modes those of primary misses.")]
pub struct Args {
    /// Texture traces
    #[arg(required = true, value_name = "TRACE")]
    traces: Vec<PathBuf>,
    /// A configuration key and the values to try; with several keys, every combination is tried
    #[arg(long = "try", value_name = "KEY=V1,V2,...", required = true)]
    tries: Vec<String>,
    /// Treat traces of the same scene as captures with different eye distances (tracegen raster --ipd), and
    /// try every distance; each scene needs the same distances
    #[arg(long)]
    by_ipd: bool,
    /// Labels of the scenes to evaluate on, comma-separated; settings are chosen on the others [default:
    /// every second scene]
    #[arg(long, value_name = "LABELS")]
    held_out: Option<String>,
    /// Error to minimise
    #[arg(long, value_enum, default_value_t = Objective::Surface)]
    objective: Objective,
    /// Folder for results; a repeated search reads them and continues
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replay: ReplayArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// Wrong arguments, an invalid configuration, or an unreadable trace.
pub fn run(args: &Args) -> Result<ExitCode> {
    let preset = args.replay.machine.preset().unwrap_or(Preset::Z2_PAPER);
    let usual = sim::config::RunConfig::default();
    let base = args.replay.machine.resolve_over(preset.over(usual))?;
    ensure!(
        base.mode != Mode::Functional || args.objective != Objective::Surface,
        "--objective surface: expected a mode with a texture unit, found functional; try --objective table"
    );
    let tries: Vec<Axis> = args
        .tries
        .iter()
        .map(|text| axis(text))
        .collect::<Result<_>>()?;
    let sizes = |of: fn(&(u32, u32)) -> u32| {
        let mut sizes: Vec<u32> = z2::CACHES_KIB.iter().map(of).collect();
        sizes.sort_unstable();
        sizes.dedup();
        let bytes = |kib: u32| Value::Integer(i64::from(kib) << 10);
        sizes.into_iter().map(bytes).collect()
    };
    let name = |order: &sim::config::Order| Value::String(order.name().to_owned());
    let table = [
        ("l1.size_bytes", sizes(|c| c.0)),
        ("l2.size_bytes", sizes(|c| c.1)),
        ("order", z2::ORDERS.iter().map(name).collect()),
    ];
    let table = table.map(|(key, values)| Axis {
        key: key.to_owned(),
        values,
    });
    let axes: Vec<Axis> = tries.into_iter().chain(table).collect();
    let plan = Plan::cross(base, &axes, &[])?;
    let prints = args.replay.check::<CalibrationReport>(&args.traces)?;
    args.replay.threads.start()?;
    let traces = Traces::open(&args.traces)?;
    let subjects = traces.subjects();
    let mut scenes = match args.by_ipd {
        true => {
            SceneCaptures::by_ipd(&subjects).map_err(|message| anyhow!("--by-ipd: {message}"))?
        }
        false => SceneCaptures::one_each(&subjects),
    };
    let labels: Vec<&str> = scenes.iter().map(|s| s.label.as_str()).collect();
    let held_out = held_out(args.held_out.as_deref(), &labels)?;
    for (scene, held_out) in scenes.iter_mut().zip(held_out) {
        scene.held_out = held_out;
    }
    let store = args.out.as_deref().map(|out| Store::open(out, None));
    let store = store.transpose()?;
    let outcome = replayed(&plan, &subjects, store.as_ref())?;
    let trials = trials(&plan, &outcome, &scenes, args.objective);
    let report = CalibrationReport::new(base, args.objective, trials);
    args.replay.outputs.write(&report, prints)?;
    Ok(ExitCode::SUCCESS)
}

/// Parses `KEY=V1,V2,...`; values are numbers, booleans or text.
fn axis(text: &str) -> Result<Axis> {
    let axis = Axis::parse(text);
    let axis = axis.with_context(|| format!("--try {text}: expected KEY=V1,V2,..."))?;
    ensure!(
        !experiment::is_of_the_table(&axis.key),
        "--try {}: the paper's table already varies this key",
        axis.key
    );
    Ok(axis)
}

/// Which labels are held out.
fn held_out(asked: Option<&str>, labels: &[&str]) -> Result<Vec<bool>> {
    let Some(asked) = asked else {
        return Ok((0..labels.len()).map(|index| index % 2 == 1).collect());
    };
    let asked: Vec<&str> = asked.split(',').map(str::trim).collect();
    for label in &asked {
        if !labels.contains(label) {
            let known = labels.join(", ");
            bail!("--held-out: expected some of {known}, found `{label}`");
        }
    }
    Ok(labels.iter().map(|label| asked.contains(label)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_parsed_as_numbers_booleans_or_text() {
        let axis = axis("sampling.lod_bias=0,-0.5,true,softpipe").unwrap();
        assert_eq!(axis.key, "sampling.lod_bias");
        let values: Vec<String> = axis.values.iter().map(Value::to_string).collect();
        assert_eq!(values, ["0", "-0.5", "true", "\"softpipe\""]);
    }

    #[test]
    fn invalid_trials_are_refused() {
        for (text, message) in [
            ("loop", "--try loop: expected KEY=V1,V2,..."),
            (
                "order=morton",
                "--try order: the paper's table already varies this key",
            ),
        ] {
            assert_eq!(axis(text).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn every_second_scene_is_held_out_by_default() {
        let labels = ["a", "b", "c"];
        assert_eq!(held_out(None, &labels).unwrap(), [false, true, false]);
        assert_eq!(held_out(Some("a,c"), &labels).unwrap(), [true, false, true]);
        assert_eq!(
            held_out(Some("d"), &labels).unwrap_err().to_string(),
            "--held-out: expected some of a, b, c, found `d`"
        );
    }
}
