//! Captures on a command line: `replay orders -- tracegen raster SCENE` captures the trace that it replays.

use anyhow::{Context, Result, ensure};
use formats::container::ScratchFolder;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Runs a command that captures into `file`.
///
/// # Errors
/// The command fails, or writes no such file.
pub(super) fn run(command: &mut Command, file: &Path) -> Result<()> {
    // The answer alone goes to standard output.
    command.stdin(Stdio::null()).stdout(std::io::stderr());
    let program = Path::new(command.get_program()).display().to_string();
    let status = shell::run_child(command).with_context(|| program.clone())?;
    ensure!(
        status.success() && file.exists(),
        "{program}: expected to write {}, ended with {status}",
        file.display()
    );
    Ok(())
}

/// A command line that ends with `-- tracegen ...`.
pub(super) struct Capture {
    command: Command,
    output: PathBuf,
    /// Holds the output until the replay ends.
    _folder: ScratchFolder,
}

impl Capture {
    /// Separates a capture from the arguments of a command, and puts the name of its output in its place. Other
    /// command lines, and those of `sample`, which runs its command several times, stay as they are.
    ///
    /// # Errors
    /// No folder for the output.
    pub fn split(mut arguments: Vec<OsString>) -> Result<(Vec<OsString>, Option<Self>)> {
        let place = arguments.iter().position(|argument| argument == "--");
        let Some(place) = place.filter(|place| {
            let program = arguments.get(place + 1).map(Path::new);
            program.and_then(Path::file_stem) == Some(OsStr::new("tracegen"))
                && !is_sample(&arguments[..*place])
        }) else {
            return Ok((arguments, None));
        };
        let words = arguments.split_off(place);
        let kind = words.get(2).map(OsString::as_os_str).unwrap_or_default();
        let extension = match kind.to_str() {
            Some("raster" | "app" | "page" | "xr") => "textrace",
            Some("rays") => "raytrace",
            Some("techniques") => "",
            _ => anyhow::bail!(
                "-- tracegen: expected raster, rays, techniques, app, page or xr, found {}",
                kind.display()
            ),
        };
        let folder = std::env::temp_dir();
        let folder = ScratchFolder::create_in(&folder)
            .with_context(|| format!("{}: cannot write", folder.display()))?;
        let output = folder
            .path()
            .join(name(&words[3..]))
            .with_extension(extension);
        let mut command = Command::new(&words[1]);
        command.arg(kind).arg("-o").arg(&output);
        if kind == "raster" && !draws_plainly(&words[3..]) {
            command.arg("--no-plain");
        }
        command.args(&words[3..]);
        arguments.push(output.clone().into());
        let _folder = folder;
        Ok((
            arguments,
            Some(Self {
                command,
                output,
                _folder,
            }),
        ))
    }

    /// Captures.
    ///
    /// # Errors
    /// As of [`run`].
    pub fn run(&mut self) -> Result<()> {
        run(&mut self.command, &self.output)
    }
}

/// Whether a capture needs the render without capture, which takes as long again, or refuses the flag without it.
fn draws_plainly(words: &[OsString]) -> bool {
    let needing = ["--no-plain", "--image", "--auto", "--technique"];
    words.iter().any(|word| {
        let flag = word.to_str().unwrap_or_default();
        needing.contains(&flag.split('=').next().unwrap_or_default())
    })
}

/// Whether the command, the first argument of the program that is no flag, is `sample`.
fn is_sample(arguments: &[OsString]) -> bool {
    let mut words = arguments.iter().skip(1);
    let command = words.find(|word| !word.as_encoded_bytes().starts_with(b"-"));
    command.is_some_and(|word| word == "sample")
}

/// Name of the output: that of the scene, which is the first argument or a file of a known kind.
fn name(words: &[OsString]) -> String {
    let is_scene = |word: &&OsString| {
        let extension = Path::new(word).extension().and_then(OsStr::to_str);
        extension.is_some_and(|e| ["gltf", "glb", "obj", "html"].contains(&e))
    };
    let first = || {
        words
            .first()
            .filter(|word| !word.as_encoded_bytes().starts_with(b"-"))
    };
    let word = words.iter().find(is_scene).or_else(first);
    let stem = word.and_then(|word| Path::new(word).file_stem());
    stem.map_or_else(
        || "capture".into(),
        |stem| stem.to_string_lossy().replace('.', "-"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(words: &[&str]) -> Result<(Vec<OsString>, Option<Capture>)> {
        Capture::split(words.iter().map(OsString::from).collect())
    }

    #[test]
    fn a_capture_is_replaced_by_its_output() {
        let words = [
            "replay",
            "run",
            "--json",
            "--",
            "bin/tracegen",
            "raster",
            "--size",
            "64x64",
            "a.b.glb",
        ];
        let (arguments, capture) = split(&words).expect("a capture");
        let capture = capture.expect("a capture");
        assert_eq!(arguments[..3], ["replay", "run", "--json"]);
        assert_eq!(arguments.len(), 4);
        assert!(
            arguments[3].to_string_lossy().ends_with("a-b.textrace"),
            "{arguments:?}"
        );
        let words: Vec<&OsStr> = capture.command.get_args().collect();
        assert_eq!(words[..2], ["raster", "-o"]);
        assert_eq!(words[3..], ["--no-plain", "--size", "64x64", "a.b.glb"]);
        let output = capture.output.clone();
        drop(capture);
        assert!(!output.parent().expect("a folder").exists());
        let (arguments, _) =
            split(&["replay", "reproject", "--", "tracegen", "rays", "chess"]).expect("a capture");
        assert!(arguments[2].to_string_lossy().ends_with("chess.raytrace"));
    }

    #[test]
    fn other_command_lines_stay() {
        let words = [
            "replay", "view", "-o", "sample", "--", "tracegen", "raster", "atrium",
        ];
        assert!(split(&words).expect("a capture").1.is_some());
        for words in [
            &["replay", "run", "--", "-odd.textrace"][..],
            &[
                "replay", "-q", "sample", "--", "tracegen", "raster", "atrium",
            ],
            &["replay", "run", "--"],
        ] {
            let (arguments, capture) = split(words).expect("arguments");
            assert!(capture.is_none());
            assert_eq!(arguments, words);
        }
        let error = split(&["replay", "run", "--", "tracegen", "scenes"])
            .err()
            .expect("an error");
        assert!(error.to_string().contains("expected raster"), "{error}");
    }
}
