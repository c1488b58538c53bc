//! Runs a program from its arguments to its exit code.

use super::files::{FileUses, check};
use super::{memory, message, signals};
use clap::{ArgMatches, CommandFactory, Parser};
use formats::container::VERSIONS;
use formats::text::printable_lines;
use std::ffi::OsString;
use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::LazyLock;

/// Version of the programs, with the version of the trace formats.
pub static VERSION: LazyLock<String> = LazyLock::new(|| {
    let [first, second, third, fourth, fifth] =
        VERSIONS.map(|(major, minor)| format!("{major}.{minor}"));
    format!(
        "{} (.textrace formats {first}, {second}, {third}, {fourth} and {fifth}, .raytrace format {first})",
        env!("CARGO_PKG_VERSION")
    )
});

/// Footer of every help page.
const FOOTER: &str = "\
The output name - means standard output, instead of the command's own result; \
binary output is not written to a terminal. Outputs replace regular files only, and appear complete \
or not at all.
Exit codes: 0 done, 1 a check failed, 2 wrong use, unreadable input or an output that cannot be \
written.";

/// Flags of every command.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Common {
    /// Print only results, warnings and errors: no progress and no figures about the run
    #[arg(short, long, global = true, display_order = 1000)]
    quiet: bool,
}

/// Parses the arguments, checks the files that it names, runs the command and returns its exit code. Errors
/// go to stderr. A closed output pipe (`... | head`) is not an error.
pub fn run<C: Parser>(
    arguments: Vec<OsString>,
    files: &FileUses,
    common: impl FnOnce(&C) -> Common,
    command: impl FnOnce(C) -> anyhow::Result<ExitCode>,
) -> ExitCode {
    let (cli, matches) = parse::<C>(&arguments);
    message::set_quiet(common(&cli).quiet);
    let outcome = memory::explain_aborts()
        .and_then(|()| signals::discard_unfinished_on_exit())
        .and_then(|()| check(files, &matches))
        .and_then(|()| command(cli));
    match outcome {
        Ok(code) => code,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            message::error(&described(&error));
            ExitCode::from(message::USAGE)
        }
    }
}

/// Definition of a program's command line for its help and its manual, with the footer, and with a short help
/// that fits on a screen.
pub(crate) fn command<C: CommandFactory>() -> clap::Command {
    let mut command = C::command();
    let names: Vec<String> = (command.get_subcommands())
        .map(|subcommand| subcommand.get_name().to_owned())
        .collect();
    for name in names {
        command = command.mut_subcommand(name, |subcommand| {
            let text = subcommand.get_after_help().map(ToString::to_string);
            match text {
                Some(text) => subcommand
                    .after_help(shortened(&text))
                    .after_long_help(text),
                None => subcommand,
            }
        });
    }
    let examples = command.get_after_help().map(ToString::to_string);
    command.after_help(examples.map_or_else(
        || FOOTER.to_owned(),
        |examples| format!("{examples}\n\n{FOOTER}"),
    ))
}

/// The text after a subcommand's options as `-h` shows it: with at most two examples.
fn shortened(text: &str) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    if let Some(heading) = lines.iter().position(|line| *line == "Examples:") {
        lines.truncate(heading + 3);
    }
    // An example of several lines is left out if it would be cut.
    while lines.last().is_some_and(|line| line.ends_with('\\')) {
        lines.pop();
    }
    lines.join("\n")
}

fn parse<C: Parser>(arguments: &[OsString]) -> (C, ArgMatches) {
    let parsed = command::<C>()
        .try_get_matches_from(arguments)
        .and_then(|matches| Ok((C::from_arg_matches(&matches)?, matches)));
    parsed.unwrap_or_else(|error| {
        // Clap prints arguments unchanged, so control characters in file names must be replaced.
        let mut texts = arguments.iter().map(|argument| argument.to_string_lossy());
        if texts.all(|text| printable_lines(&text) == text) {
            error.exit();
        }
        let _untold = write!(io::stderr(), "{}", printable_lines(&error.to_string()));
        std::process::exit(message::USAGE.into());
    })
}

/// An error and its causes in one line. Causes that the error's own text repeats are skipped.
pub fn described(error: &anyhow::Error) -> String {
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
    fn a_cause_repeated_by_its_error_is_printed_once() {
        let cause = || anyhow::anyhow!("expected 3, found 4");
        let text =
            |context: &str| described(&cause().context(context.to_owned()).context("a.toml"));
        assert_eq!(text("key ways"), "a.toml: key ways: expected 3, found 4");
        assert_eq!(
            text("key ways: expected 3, found 4"),
            "a.toml: key ways: expected 3, found 4"
        );
    }

    #[test]
    fn short_help_has_two_whole_examples() {
        assert_eq!(shortened("Exit code: 0."), "Exit code: 0.");
        let text = "Note.\n\nExamples:\n  a\n  b\n  c";
        assert_eq!(shortened(text), "Note.\n\nExamples:\n  a\n  b");
        let text = "Examples:\n  a\n  b \\\n    --flag\n  c";
        assert_eq!(shortened(text), "Examples:\n  a");
    }
}
