//! What goes to a terminal: results on stdout, everything else on stderr, no name printed raw.

use formats::text::printable_lines;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// `--quiet`, set once before the command starts.
static QUIET: AtomicBool = AtomicBool::new(false);

pub(crate) fn set_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Writes a result to stdout, with a line feed at its end.
///
/// # Errors
/// Those of writing.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    let text = text.trim_end_matches('\n');
    if out.is_terminal() {
        writeln!(out, "{}", printable_lines(text))?;
    } else {
        writeln!(out, "{text}")?;
    }
    Ok(out.flush()?)
}

/// Tells a figure about the run on stderr, which varies from run to run and is no result.
pub fn note(message: &str) {
    if !is_quiet() {
        tell("", message);
    }
}

/// Tells on stderr what the user should know though the work goes on.
pub fn warn(message: &str) {
    tell("\u{1b}[1;33mwarning\u{1b}[0m: ", message);
}

/// Tells on stderr why a check failed or the work ended.
pub fn error(message: &str) {
    tell("\u{1b}[1;31merror\u{1b}[0m: ", message);
}

fn tell(label: &str, message: &str) {
    // A message over a progress bar starts on a line of its own.
    let clear = if io::stderr().is_terminal() {
        "\r\u{1b}[K"
    } else {
        ""
    };
    anstream::eprintln!("{clear}{label}{}", printable_lines(message));
}
