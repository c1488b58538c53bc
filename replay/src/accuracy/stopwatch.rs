//! Time that this thread has worked, which does not depend on what else the machine does.

use std::time::{Duration, Instant};

/// A running measurement; the work has to stay on the thread that started it.
pub struct Stopwatch {
    started: Instant,
    worked: Option<Duration>,
}

impl Stopwatch {
    /// Starts.
    pub fn start() -> Self {
        Self {
            started: Instant::now(),
            worked: worked(),
        }
    }

    /// Time on a processor since the start; by the clock where the system does not tell.
    pub fn elapsed(&self) -> Duration {
        let worked = worked()
            .zip(self.worked)
            .map(|(now, then)| now.saturating_sub(then));
        worked.unwrap_or_else(|| self.started.elapsed())
    }
}

/// What Linux says that the thread has spent on processors.
fn worked() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds = text.split_whitespace().next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleep_is_no_work_where_the_system_tells() {
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
