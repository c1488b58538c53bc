//! Terminal output: results on stdout, everything else on stderr, with control characters replaced.

use super::outputs::Output;
use formats::container::is_stdout;
use formats::text::printable_lines;
use std::collections::BTreeSet;
use std::io::{self, BufWriter, IsTerminal, Stdout, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Exit code of wrong use or unreadable input, also used by clap.
pub(crate) const USAGE: u8 = 2;

/// `--quiet`, set once before the command starts.
static QUIET: AtomicBool = AtomicBool::new(false);

/// The warnings so far.
static WARNED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

fn warned() -> MutexGuard<'static, BTreeSet<String>> {
    WARNED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// True if the program has warned.
pub fn has_warned() -> bool {
    !warned().is_empty()
}

pub(crate) fn set_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Writes a result to stdout, with a line feed at its end.
///
/// # Errors
/// Errors of writing.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut out = stdout();
    let text = text.trim_end_matches('\n');
    if io::stdout().is_terminal() {
        writeln!(out, "{}", printable_lines(text))?;
    } else {
        writeln!(out, "{text}")?;
    }
    Ok(out.flush()?)
}

/// Prints a result beside output files: on stdout, or on stderr as a figure about the run if an output takes
/// stdout.
///
/// # Errors
/// Errors of writing.
pub fn print_beside(outputs: &[Output], text: &str) -> anyhow::Result<()> {
    if outputs.iter().any(|output| is_stdout(output.path())) {
        note(text);
        return Ok(());
    }
    print(text)
}

/// Buffered standard output with errors that name it. The caller flushes it.
pub fn stdout() -> impl Write + Send {
    BufWriter::new(Named(io::stdout()))
}

/// Standard output that adds its name to errors.
struct Named(Stdout);

impl Write for Named {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes).map_err(named)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush().map_err(named)
    }
}

fn named(error: io::Error) -> io::Error {
    io::Error::new(
        error.kind(),
        format!("cannot write standard output: {error}"),
    )
}

/// Prints a figure about the run on stderr. Such figures vary between runs and are not results.
pub fn note(message: &str) {
    if !is_quiet() {
        print_message("", message);
    }
}

/// Prints a warning on stderr, the same one once; the command continues.
pub fn warn(message: &str) {
    if !warned().insert(message.to_owned()) {
        return;
    }
    print_message("\u{1b}[1;33mwarning\u{1b}[0m: ", message);
}

/// Prints on stderr why a check failed or the command ended.
pub fn error(message: &str) {
    print_message("\u{1b}[1;31merror\u{1b}[0m: ", message);
}

fn print_message(label: &str, message: &str) {
    // A message starts on a new line instead of inside a progress bar.
    let clear = if io::stderr().is_terminal() {
        "\r\u{1b}[K"
    } else {
        ""
    };
    // An unwritable log (a full disk, a closed handle) is no reason to stop the command.
    let mut out = anstream::stderr().lock();
    let _untold = writeln!(out, "{clear}{label}{}", printable_lines(message));
}
