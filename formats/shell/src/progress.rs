//! Progress on stderr: a bar on a terminal, lines at growing intervals elsewhere.

use super::message::is_quiet;
use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval between two drawings of a bar.
const BAR_INTERVAL: Duration = Duration::from_millis(200);
/// Time before the first line if stderr is not a terminal; each further interval is twice as long.
const LINE_INTERVAL: Duration = Duration::from_secs(3);
/// Longest interval between two lines.
const LONGEST_LINE_INTERVAL: Duration = Duration::from_secs(600);
const BAR_CHARACTERS: u64 = 24;

/// Shows the progress of a command until it is dropped; hidden by `--quiet`.
#[derive(Debug)]
pub struct Progress {
    stage: Arc<Mutex<Stage>>,
    // Dropping the sender ends the thread.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Clone, Debug)]
struct Stage {
    name: String,
    unit: &'static str,
    /// 0 if unknown.
    total: u64,
    done: u64,
    start: Instant,
}

impl Progress {
    /// Starts a stage of `total` units; 0 if their number is unknown.
    pub fn new(name: &str, total: u64, unit: &'static str) -> Self {
        let is_terminal = io::stderr().is_terminal();
        let interval = if is_terminal {
            BAR_INTERVAL
        } else {
            LINE_INTERVAL
        };
        let out = (!is_quiet()).then(io::stderr);
        Self::showing_on(out, interval, is_terminal, Stage::new(name, total, unit))
    }

    fn showing_on(
        out: Option<impl Write + Send + 'static>,
        interval: Duration,
        as_bar: bool,
        stage: Stage,
    ) -> Self {
        let stage = Arc::new(Mutex::new(stage));
        let (stop, stopped) = channel();
        let shown = Arc::clone(&stage);
        let thread = out.filter(|_| has_memory_for_thread()).and_then(|mut out| {
            let (start, started) = channel::<()>();
            let show = move || {
                drop(start);
                let mut pauses = Pauses::new(interval, as_bar);
                // A failure to show progress is no reason to stop the command.
                while stopped.recv_timeout(pauses.next()) == Err(RecvTimeoutError::Timeout) {
                    let stage = lock(&shown).clone();
                    let _ = if as_bar {
                        write!(out, "\r{}\u{1b}[K", stage.bar())
                    } else {
                        writeln!(out, "{}", stage.line())
                    };
                }
                if as_bar {
                    let _ = write!(out, "\r\u{1b}[K");
                }
            };
            let thread = std::thread::Builder::new().name("progress".to_owned());
            let thread = thread.spawn(show).ok();
            // Wait until the thread has its memory, because a thread without memory panics before its first
            // line.
            let _hung_up = thread.as_ref().map(|_| started.recv());
            thread
        });
        Self {
            stage,
            stop: Some(stop),
            thread,
        }
    }

    /// Starts another stage.
    pub fn stage(&self, name: &str, total: u64, unit: &'static str) {
        *lock(&self.stage) = Stage::new(name, total, unit);
    }

    /// Adds finished units.
    pub fn advance(&self, units: u64) {
        lock(&self.stage).done += units;
    }
}

/// Whether memory for a thread's stack and signal stack is available. Without progress, a command needs
/// less memory.
fn has_memory_for_thread() -> bool {
    const NEEDED_BYTES: usize = 4 << 20;
    Vec::<u8>::new().try_reserve_exact(NEEDED_BYTES).is_ok()
}

/// Growing intervals, so that the log of a long run stays short.
struct Pauses {
    next: Duration,
    as_bar: bool,
}

impl Pauses {
    fn new(first: Duration, as_bar: bool) -> Self {
        Self {
            next: first,
            as_bar,
        }
    }

    fn next(&mut self) -> Duration {
        let pause = self.next;
        if !self.as_bar {
            self.next = (2 * pause).min(LONGEST_LINE_INTERVAL);
        }
        pause
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn lock(stage: &Mutex<Stage>) -> std::sync::MutexGuard<'_, Stage> {
    stage.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Stage {
    fn new(name: &str, total: u64, unit: &'static str) -> Self {
        Self {
            name: formats::text::printable(name).into_owned(),
            unit,
            total,
            done: 0,
            start: Instant::now(),
        }
    }

    fn line(&self) -> String {
        let seconds = self.start.elapsed().as_secs_f64();
        let (done, total) = (self.done.min(self.total), self.total);
        let mut text = self.name.clone();
        if total > 0 {
            text += &format!(": {done} of {total} {}", self.unit);
        }
        text += &format!(", {seconds:.0} s");
        if done > 0 {
            let left = seconds * (total - done) as f64 / done as f64;
            text += &format!(", {left:.0} s left");
        }
        text
    }

    fn bar(&self) -> String {
        if self.total == 0 {
            return self.line();
        }
        let full = BAR_CHARACTERS * self.done.min(self.total) / self.total;
        let cells = (0..BAR_CHARACTERS).map(|cell| if cell < full { '=' } else { ' ' });
        format!("[{}] {}", cells.collect::<String>(), self.line())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Collects the printed text.
    #[derive(Clone, Default)]
    struct Shown(Arc<Mutex<Vec<u8>>>);

    impl Write for Shown {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// The printed text, once it contains `expected`.
    fn shown(as_bar: bool, expected: &str) -> String {
        let shown = Shown::default();
        let stage = Stage::new("loading", 0, "");
        let interval = Duration::from_millis(1);
        let progress = Progress::showing_on(Some(shown.clone()), interval, as_bar, stage);
        let text = || String::from_utf8(shown.0.lock().unwrap().clone()).unwrap();
        let deadline = Instant::now() + Duration::from_secs(60);
        while !text().contains("loading") && Instant::now() < deadline {
            std::thread::yield_now();
        }
        progress.stage("tracing", 8, "tiles");
        progress.advance(4);
        while !text().contains(expected) && Instant::now() < deadline {
            std::thread::yield_now();
        }
        drop(progress);
        text()
    }

    #[test]
    fn lines_are_plain_text_one_after_the_other() {
        let text = shown(false, "4 of 8 tiles");
        assert!(text.starts_with("loading, 0 s\n"), "{text:?}");
        assert!(
            text.contains("\ntracing: 4 of 8 tiles, 0 s, 0 s left\n"),
            "{text:?}"
        );
        assert!(!text.contains(['\r', '\u{1b}']), "{text:?}");
    }

    #[test]
    fn four_hours_of_lines_fit_on_a_page() {
        let mut pauses = Pauses::new(LINE_INTERVAL, false);
        let mut seconds = 0;
        let mut lines = 0;
        while seconds < 4 * 3600 {
            seconds += pauses.next().as_secs();
            lines += 1;
        }
        assert!((10..50).contains(&lines), "{lines} lines");
    }

    #[test]
    fn a_bar_is_drawn_in_place_and_removed_at_the_end() {
        let text = shown(true, "4 of 8 tiles");
        assert!(
            text.contains("\r[============            ] tracing: 4 of 8 tiles"),
            "{text:?}"
        );
        assert!(
            text.ends_with("\r\u{1b}[K") && !text.contains('\n'),
            "{text:?}"
        );
    }
}
