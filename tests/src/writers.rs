//! Commands that write files, for tests that kill them or fill their disk.

use crate::{program, root, run_ok};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// A command that writes into its own folder.
pub struct Writer {
    /// Name in messages.
    pub name: &'static str,
    /// The command, for a folder of inputs and a folder of outputs.
    pub command: fn(inputs: &Path, folder: &Path) -> Command,
    /// Whether it measures times, so that only the form of its JSON files is predictable.
    pub measures: bool,
    /// Whether it needs the driver.
    pub draws: bool,
}

impl Writer {
    /// One that measures no times and needs no driver.
    const fn new(name: &'static str, command: fn(&Path, &Path) -> Command) -> Self {
        Self {
            name,
            command,
            measures: false,
            draws: false,
        }
    }

    /// One that measures times.
    const fn measuring(self) -> Self {
        Self {
            measures: true,
            ..self
        }
    }

    /// One that needs the driver.
    const fn drawing(self) -> Self {
        Self {
            draws: true,
            ..self
        }
    }
}

/// All writers; the first [`QUICK`] take a fraction of a second and need no driver.
pub const ALL: &[Writer] = &[
    Writer::new("tracegen rays", |_, folder| {
        let mut command = tracegen(&["rays", "teapot", "--size", "96x96", "-o"]);
        command.arg(folder.join("a.raytrace"));
        command.arg("--image").arg(folder.join("a.png"));
        command
    }),
    Writer::new("replay convert --to textrace", |_, folder| {
        let mut command = replay("convert", "atrium-shadows.textrace");
        command.args(["--to", "textrace", "--encoding", "planes", "-o"]);
        command.arg(folder.join("a.textrace"));
        command
    }),
    Writer::new("tracegen sweep", |inputs, folder| {
        let mut command = tracegen(&["sweep"]);
        command.arg(inputs.join("captures.toml"));
        command.arg("-o").arg(folder);
        command
    }),
    Writer::new("replay sweep", sweep),
    Writer::new("replay paper", |_, folder| {
        let mut command = replay("paper", "atrium-shadows.textrace");
        command.arg("--csv").arg(folder.join("table.csv"));
        command.arg("--parquet").arg(folder.join("table.parquet"));
        command.arg("--html").arg(folder.join("page.html"));
        command
    }),
    Writer::new("replay convert --to din", |_, folder| {
        let mut command = replay("convert", "atrium-shadows.textrace");
        command.args(["--to", "din", "-o"]);
        command.arg(folder.join("a.din.gz"));
        command
    }),
    Writer::new("replay run", |_, _| {
        replay("run", "atrium-shadows.textrace")
    }),
    Writer::new("replay report", |_, folder| {
        let mut command = replay("report", "atrium-shadows.textrace");
        command.arg("-o").arg(folder.join("report.html"));
        command
    }),
    Writer::new("replay reproject", |_, folder| {
        let mut command = replay("reproject", "teapot-rays.raytrace");
        command.arg("--html").arg(folder.join("page.html"));
        command.arg("--image").arg(folder.join("a.png"));
        command
    }),
    Writer::new("tracegen raster", |_, folder| {
        let mut command = tracegen(&["raster", "teapot", "--size", "64x72", "-o"]);
        command.arg(folder.join("a.textrace"));
        command.arg("--image").arg(folder.join("a.png"));
        command
    })
    .drawing(),
    Writer::new("tracegen techniques", |_, folder| {
        let mut command = tracegen(&["techniques", "atrium-plain", "--path", "head"]);
        command.args(["--size", "64x72", "--path-frames", "4", "--frames", "2"]);
        command.args(["--repeats", "1", "--only", "superfrustum,conical", "-o"]);
        command.arg(folder);
        command
    })
    .measuring()
    .drawing(),
];

/// Number of entries of [`ALL`] that every test run uses.
pub const QUICK: usize = 3;

fn tracegen(arguments: &[&str]) -> Command {
    let mut command = program("tracegen");
    let (subcommand, rest) = arguments.split_at(1);
    command.args(subcommand).arg("--quiet").args(rest);
    command
}

fn replay(subcommand: &str, trace: &str) -> Command {
    let mut command = program("replay");
    command.arg(subcommand).arg("--quiet");
    command.arg(root().join("traces").join(trace));
    command
}

/// `replay sweep` of [`write_inputs`]' experiment.
pub fn sweep(inputs: &Path, folder: &Path) -> Command {
    let mut command = program("replay");
    command.arg("sweep").arg("--quiet");
    command.arg(inputs.join("experiment.toml"));
    command.arg(root().join("traces/atrium-shadows.textrace"));
    command.arg("--out").arg(folder);
    for variable in ["ID", "COUNT", "MIN", "MAX", "STEP"] {
        command.env_remove(format!("SLURM_ARRAY_TASK_{variable}"));
    }
    command
}

/// Writes the inputs of the writers.
///
/// # Panics
/// The folder is not writable.
pub fn write_inputs(inputs: &Path) {
    let experiment = "[base]\nmode = \"functional\"\n[axes]\norder = [\"morton\", \"z2-sta\"]\n\
        l1.size_bytes = [\"4KiB\", \"8KiB\"]\n[one-at-a-time]\nl2.replacement = [\"fifo\"]\n";
    let captures = "[[captures]]\ncommand = \"rays\"\nscene = \"teapot\"\n\
        size = [\"48x48\", \"64x64\"]\n";
    for (name, text) in [("experiment.toml", experiment), ("captures.toml", captures)] {
        fs::write(inputs.join(name), text).expect("a file");
    }
}

/// Runs a writer to its end and ignores its output.
///
/// # Panics
/// The writer fails.
pub fn run_to_completion(mut command: Command) {
    run_ok(command.stdout(Stdio::null()));
}

/// A folder's files by their paths in it.
#[derive(Debug, Default)]
pub struct Files {
    /// Files with final names.
    pub finished: BTreeMap<String, Vec<u8>>,
    /// Names of unfinished files.
    pub unfinished: Vec<String>,
}

impl Files {
    /// Reads all files below a folder.
    ///
    /// # Panics
    /// The folder is unreadable.
    pub fn below(folder: &Path) -> Self {
        let mut files = Self::default();
        let mut open = vec![folder.to_owned()];
        while let Some(path) = open.pop() {
            let Some(name) = path.file_name() else {
                continue;
            };
            let name = name.to_string_lossy();
            // The rows of a sweep's points are a log: each row has a checksum, and an incomplete last row
            // is replayed.
            if name == "points" {
                continue;
            }
            if path.is_dir() {
                let entries = fs::read_dir(&path).expect("a folder");
                open.extend(entries.map(|entry| entry.expect("an entry").path()));
                continue;
            }
            let place = path.strip_prefix(folder).expect("inside");
            let place = place.display().to_string();
            if name.starts_with('.') && name.ends_with(".part") {
                files.unfinished.push(place);
            } else {
                let bytes = fs::read(&path).expect("a file");
                files.finished.insert(place, bytes);
            }
        }
        files
    }

    /// Compares every finished file with that of an undisturbed run.
    ///
    /// # Panics
    /// A file differs, or the JSON of a writer that measures is invalid.
    pub fn assert_part_of(&self, whole: &Self, writer: &Writer, place: &str) {
        for (name, bytes) in &self.finished {
            let expected = whole.finished.get(name);
            let expected = expected.unwrap_or_else(|| panic!("{place}: {name} is new"));
            if writer.measures && name.ends_with(".json") {
                let value = serde_json::from_slice::<serde_json::Value>(bytes);
                assert!(value.is_ok(), "{place}: {name} is half written");
            } else {
                assert!(bytes == expected, "{place}: {name} differs");
            }
        }
    }
}
