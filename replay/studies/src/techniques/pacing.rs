//! Compares measured frame times, without scaling, with the refresh rates of displays.

/// Refresh rates of headsets.
pub const RATES_HZ: [u32; 5] = [72, 80, 90, 120, 144];

/// Frame pacing on a display with one refresh rate. A frame is shown at the first refresh after it is
/// finished, and the next frame starts at that refresh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pacing {
    /// Refresh rate.
    pub rate_hz: u32,
    /// Frames longer than a refresh interval, percent.
    pub missed_pct: f64,
    /// Mean number of refresh intervals per frame; 1 if no frame is late.
    pub steps: f64,
}

impl Pacing {
    /// From frame times in milliseconds; `None` if there are none.
    pub fn of(rate_hz: u32, times_ms: &[f64]) -> Option<Self> {
        let count = times_ms.len() as f64;
        if times_ms.is_empty() {
            return None;
        }
        let period_ms = 1e3 / f64::from(rate_hz);
        // Allow a millionth of the period for rounding.
        let steps = |ms: &f64| (ms / period_ms - 1e-6).ceil().max(1.0);
        let missed = times_ms.iter().filter(|ms| steps(ms) > 1.0).count();
        Some(Self {
            rate_hz,
            missed_pct: 100.0 * missed as f64 / count,
            steps: times_ms.iter().map(steps).sum::<f64>() / count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_takes_the_refreshes_that_its_time_spans() {
        // Periods of 10, 8.33 and 12.5 ms: frames of 9 and 10 ms miss the middle one.
        let pacing = |hz| Pacing::of(hz, &[9.0, 10.0, 21.0, 4.0]).unwrap();
        let at_100 = pacing(100);
        assert_eq!((at_100.missed_pct, at_100.steps), (25.0, 1.5));
        let at_120 = pacing(120);
        assert_eq!((at_120.missed_pct, at_120.steps), (75.0, 2.0));
        let at_80 = pacing(80);
        assert_eq!((at_80.missed_pct, at_80.steps), (25.0, 1.25));
        assert_eq!(Pacing::of(90, &[]), None);
    }

    #[test]
    fn steps_equal_those_of_a_simulated_display() {
        let times_ms: Vec<f64> = (0..200)
            .map(|i| 0.7 + f64::from(i * 37 % 83) * 0.61)
            .collect();
        for rate_hz in RATES_HZ {
            let period_ms = 1e3 / f64::from(rate_hz);
            let (mut refreshes, mut missed) = (0_u32, 0_u32);
            for time in &times_ms {
                let (mut clock, mut ticks) = (0.0, 0);
                while clock < *time {
                    clock += period_ms;
                    ticks += 1;
                }
                refreshes += ticks;
                missed += u32::from(ticks > 1);
            }
            let pacing = Pacing::of(rate_hz, &times_ms).unwrap();
            assert!(
                (pacing.steps - f64::from(refreshes) / 200.0).abs() < 1e-9,
                "{rate_hz}"
            );
            assert!(
                (pacing.missed_pct - f64::from(missed) / 2.0).abs() < 1e-9,
                "{rate_hz}"
            );
        }
    }
}
