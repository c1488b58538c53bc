//! Processor time of this thread, which does not depend on other load on the machine.

use std::time::{Duration, Instant};

/// A running measurement. The work must stay on the thread that started it.
pub(super) struct Stopwatch {
    started: Instant,
    worked: Option<Duration>,
}

impl Stopwatch {
    /// Starts the measurement.
    pub fn start() -> Self {
        Self {
            started: Instant::now(),
            worked: worked(),
        }
    }

    /// Processor time since the start; wall-clock time on systems that do not report it.
    pub fn elapsed(&self) -> Duration {
        let worked = worked()
            .zip(self.worked)
            .map(|(now, then)| now.saturating_sub(then));
        worked.unwrap_or_else(|| self.started.elapsed())
    }
}

/// Processor time of the thread, as Linux reports it.
fn worked() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds = text.split_whitespace().next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleep_takes_no_processor_time() {
        let watch = Stopwatch::start();
        std::thread::sleep(Duration::from_millis(60));
        let slept = watch.elapsed();
        if worked().is_some() {
            assert!(slept < Duration::from_millis(40), "{slept:?}");
        } else {
            assert!(slept >= Duration::from_millis(60), "{slept:?}");
        }
    }
}
