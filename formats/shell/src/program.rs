//! From arguments to exit code.

use super::{memory, message, signals};
use clap::{CommandFactory, Parser};
use formats::container::VERSIONS;
use formats::text::printable_lines;
use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::LazyLock;

/// Exit code of wrong use or unreadable input; clap's own, too.
pub(crate) const USAGE: u8 = 2;

/// Version of the programs with that of the traces that they read and write.
pub static VERSION: LazyLock<String> = LazyLock::new(|| {
    let [first, second] = VERSIONS.map(|(major, minor)| format!("{major}.{minor}"));
    format!(
        "{} (.textrace formats {first} and {second}, .raytrace format {first})",
        env!("CARGO_PKG_VERSION")
    )
});

/// What every page of help ends with.
const FOOTER: &str = "\
An output named - is standard output, in place of the result that is printed there otherwise; \
binary ones are not written to a terminal. Outputs replace regular files only, and appear whole or \
not at all.
Exit codes: 0 done, 1 a check failed, 2 wrong use, unreadable input or an output that cannot be \
written.";

/// Flags of every command.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Common {
    /// Print results, warnings and errors only: no progress, no figures about the run
    #[arg(short, long, global = true, display_order = 1000)]
    quiet: bool,
}

/// Parses the command line, runs it, and turns its outcome into an exit code. Errors go to stderr;
/// a reader of our output who has gone (`... | head`) is no error.
pub fn run<C: Parser>(
    common: impl FnOnce(&C) -> Common,
    command: impl FnOnce(C) -> anyhow::Result<ExitCode>,
) -> ExitCode {
    let cli = parse::<C>();
    message::set_quiet(common(&cli).quiet);
    let outcome = memory::explain_aborts()
        .and_then(|()| signals::discard_unfinished_on_exit())
        .and_then(|()| command(cli));
    match outcome {
        Ok(code) => code,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            message::error(&described(&error));
            ExitCode::from(USAGE)
        }
    }
}

/// The command line of a program with the footer of its help, here and in its manual.
pub(crate) fn command<C: CommandFactory>() -> clap::Command {
    let command = C::command();
    let examples = command.get_after_help().map(ToString::to_string);
    command.after_help(examples.map_or_else(
        || FOOTER.to_owned(),
        |examples| format!("{examples}\n\n{FOOTER}"),
    ))
}

fn parse<C: Parser>() -> C {
    let parsed = command::<C>()
        .try_get_matches()
        .and_then(|matches| C::from_arg_matches(&matches));
    parsed.unwrap_or_else(|error| {
        let arguments: Vec<String> = (std::env::args_os())
            .map(|a| a.to_string_lossy().into_owned())
            .collect();
        // Clap quotes arguments as they are: a file name from `*` must not steer the terminal.
        if arguments.iter().all(|a| printable_lines(a) == a.as_str()) {
            error.exit();
        }
        let _untold = write!(io::stderr(), "{}", printable_lines(&error.to_string()));
        std::process::exit(USAGE.into());
    })
}

/// An error and its causes in one line, without those that it repeats itself.
fn described(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |text, cause| {
        let cause = cause.to_string();
        match text.as_str() {
            "" => cause,
            told if told.ends_with(&cause) => text,
            told => format!("{told}: {cause}"),
        }
    })
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>())
        .any(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_pipe_is_found_under_its_context() {
        let pipe = io::Error::from(io::ErrorKind::BrokenPipe);
        assert!(is_broken_pipe(&anyhow::Error::new(pipe).context("writing")));
        assert!(!is_broken_pipe(&anyhow::anyhow!("no such file")));
    }

    #[test]
    fn a_cause_that_its_error_repeats_is_told_once() {
        let cause = || anyhow::anyhow!("expected 3, found 4");
        let text =
            |context: &str| described(&cause().context(context.to_owned()).context("a.toml"));
        assert_eq!(text("key ways"), "a.toml: key ways: expected 3, found 4");
        assert_eq!(
            text("key ways: expected 3, found 4"),
            "a.toml: key ways: expected 3, found 4"
        );
    }
}
