//! Arguments that both programs share, and the arguments that a trace records.

use anyhow::Context;
use std::error::Error;
use std::ffi::OsString;
use std::sync::LazyLock;

/// `--threads`.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Threads {
    /// Worker threads; results do not depend on their number [default: all cores]
    #[arg(long = "threads", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub count: Option<u16>,
}

impl Threads {
    /// Starts rayon's threads: this number, or one per core. Called once, before any parallel work, because
    /// rayon would otherwise start them at first use and panic on failure.
    ///
    /// # Errors
    /// The threads cannot be started.
    pub fn start(self) -> anyhow::Result<()> {
        let count = self.count.map_or(0, usize::from);
        let started = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build_global();
        match started {
            // The pool is already running, and any number of threads is fine.
            Err(error) if count == 0 && error.source().is_none() => Ok(()),
            started => started.with_context(|| match self.count {
                Some(count) => format!("--threads {count}: cannot start the threads"),
                None => "cannot start a thread for each core (--threads starts fewer)".to_owned(),
            }),
        }
    }
}

/// Names of the arguments that do not affect the content of a trace: [`lasting_arguments`] removes them.
pub static WITHOUT_EFFECT: LazyLock<Vec<&str>> =
    LazyLock::new(|| [&OPTIONS_WITHOUT_EFFECT[..], &SWITCHES_WITHOUT_EFFECT].concat());

/// Options with a value that do not affect the content of a trace.
const OPTIONS_WITHOUT_EFFECT: [&str; 6] = [
    "--no-skip",
    "--output",
    "--image",
    "--modules",
    "--threads",
    "--record-budget",
];
/// Switches that do not affect the content of a trace.
const SWITCHES_WITHOUT_EFFECT: [&str; 3] = ["--no-plain", "--no-cache", "--quiet"];

/// The arguments that affect the content of a trace. Output paths and options without effect on it are
/// removed, so that equal captures have equal bytes.
pub fn lasting_arguments(arguments: impl IntoIterator<Item = OsString>) -> Vec<String> {
    let mut kept = Vec::new();
    let mut arguments = arguments
        .into_iter()
        .map(|argument| argument.to_string_lossy().into_owned());
    while let Some(argument) = arguments.next() {
        if argument == "--" {
            // Arguments after this one belong to another program.
            kept.push(argument);
            kept.extend(arguments);
            break;
        }
        let (name, value) = match argument.split_once('=') {
            Some((name, value)) => (name, Some(value)),
            None => (argument.as_str(), None),
        };
        // `-o`, with its value attached or separate, possibly after a `-q`.
        let output = argument
            .strip_prefix('-')
            .map(|letters| letters.trim_start_matches('q'))
            .and_then(|letters| letters.strip_prefix('o'));
        if OPTIONS_WITHOUT_EFFECT.contains(&name) {
            if value.is_none() {
                arguments.next();
            }
        } else if let Some(attached) = output {
            if attached.is_empty() {
                arguments.next();
            }
        } else if !SWITCHES_WITHOUT_EFFECT.contains(&name) && argument != "-q" {
            kept.push(argument);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_of_another_program_are_all_recorded() {
        let line = "app -o a -- program -o b --threads 2";
        let kept = lasting_arguments(line.split(' ').map(OsString::from));
        assert_eq!(kept, ["app", "--", "program", "-o", "b", "--threads", "2"]);
    }

    #[test]
    fn arguments_that_do_not_affect_the_trace_are_not_recorded() {
        for line in [
            "raster s.gltf -o a --shadows --image=b.png --camera -x",
            "raster s.gltf --output=a --shadows --threads 2 --no-skip all --no-plain --camera -x --record-budget 4MiB -ob",
            "-q raster s.gltf -qo a --shadows --quiet --no-cache --image b -o=c --camera -x",
        ] {
            let kept = lasting_arguments(line.split(' ').map(OsString::from));
            assert_eq!(
                kept,
                ["raster", "s.gltf", "--shadows", "--camera", "-x"],
                "{line}"
            );
        }
    }
}
