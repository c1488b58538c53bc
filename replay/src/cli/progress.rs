//! Progress on stderr: a bar on a terminal, a line every few seconds elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Time between lines where stderr is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// How far a number of like steps is.
pub struct Progress {
    bar: ProgressBar,
    unit: &'static str,
    last_line: Mutex<Instant>,
}

impl Progress {
    /// `steps` steps of a `unit` (in the plural).
    #[must_use]
    pub fn new(steps: usize, unit: &'static str) -> Self {
        let template = format!("{{bar:30}} {{pos}}/{{len}} {unit} ({{per_sec}}, {{eta}} left)");
        let bar = ProgressBar::new(steps as u64);
        Self {
            bar: match ProgressStyle::with_template(&template) {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            },
            unit,
            last_line: Mutex::new(Instant::now()),
        }
    }

    /// Some more steps are done.
    pub fn add(&self, steps: usize) {
        self.bar.inc(steps as u64);
        if std::io::stderr().is_terminal() {
            return;
        }
        let Ok(mut last) = self.last_line.try_lock() else {
            return;
        };
        if last.elapsed() >= LINE_EVERY {
            *last = Instant::now();
            let (done, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
            let left = self.bar.eta().as_secs();
            anstream::eprintln!("{done}/{all} {}, about {left} s left", self.unit);
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
