//! The interleaving of the cores' quads at shared resources without latencies: a footprint takes one unit of time.

use super::{Cores, QuadLines, StreamError};
use crate::config::Assign;
use crate::order::{Phase, WorkItem};

/// Receives the quads of a trace in the order in which cores run them.
pub trait Consumer {
    /// Runs a quad on `core`.
    fn quad(&mut self, core: usize, quad: QuadLines<'_>);

    /// Starts a work item on `core`.
    ///
    /// # Errors
    /// An unreadable tile.
    fn start_item(&mut self, _core: usize, _item: &WorkItem) -> Result<(), StreamError> {
        Ok(())
    }
}

/// Passes all quads of `phases` to `consumer`. The order does not depend on the consumer.
///
/// # Errors
/// An unreadable tile.
pub fn interleave(
    cores: &mut Cores<'_>,
    phases: &[Phase],
    assign: Assign,
    consumer: &mut impl Consumer,
) -> Result<(), StreamError> {
    for phase in phases {
        match assign {
            Assign::FirstIdle => first_idle(cores, phase, consumer)?,
            Assign::Static => lockstep(cores, phase, consumer)?,
        }
    }
    Ok(())
}

/// Runs a quad on the core that is furthest behind in footprints, or gives it the next item if it has no quads left.
fn first_idle(
    cores: &mut Cores<'_>,
    phase: &[WorkItem],
    consumer: &mut impl Consumer,
) -> Result<(), StreamError> {
    let mut items = phase.iter();
    // All cores start a phase together. A core without work has the maximum as its clock.
    let mut clocks = vec![0_u64; cores.count()];
    while let Some((behind, until)) = furthest_behind(&clocks) {
        let clock = &mut clocks[behind];
        // No other clock changes until this one exceeds `until`.
        while *clock <= until {
            if let Some(quad) = cores.next_quad(behind) {
                // An untextured quad takes one unit of time.
                *clock += u64::from(quad.footprints.max(1));
                consumer.quad(behind, quad);
            } else if let Some(item) = items.next() {
                consumer.start_item(behind, item)?;
                cores.load(behind, item)?;
            } else {
                *clock = u64::MAX;
            }
        }
    }
    Ok(())
}

/// The core with the lowest clock (the first one if equal), and the last cycle at which it still has the lowest.
#[inline]
pub fn furthest_behind(clocks: &[u64]) -> Option<(usize, u64)> {
    let (behind, &lowest) = clocks.iter().enumerate().min_by_key(|(_, clock)| **clock)?;
    if lowest == u64::MAX {
        return None;
    }
    // At equal clocks, cores with lower numbers run first.
    let before = clocks[..behind].iter().map(|&clock| clock - 1);
    let after = clocks[behind + 1..].iter().copied();
    let until = before.chain(after).min().unwrap_or(u64::MAX);
    Some((behind, until.min(u64::MAX - 1)))
}

/// Round robin: the i-th items of all cores start together and their quads alternate; a core that finishes
/// first waits. Independent streams would drift apart and create artificial locality effects.
fn lockstep(
    cores: &mut Cores<'_>,
    phase: &[WorkItem],
    consumer: &mut impl Consumer,
) -> Result<(), StreamError> {
    for items in phase.chunks(cores.count()) {
        for (core, item) in items.iter().enumerate() {
            consumer.start_item(core, item)?;
            cores.load(core, item)?;
        }
        let mut busy: Vec<usize> = (0..items.len()).collect();
        while !busy.is_empty() {
            busy.retain(|&core| {
                let quad = cores.next_quad(core);
                quad.is_some_and(|quad| {
                    consumer.quad(core, quad);
                    true
                })
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::furthest_behind;

    #[test]
    fn the_core_with_the_lowest_clock_runs_until_another_is_behind() {
        assert_eq!(furthest_behind(&[5, 5]), Some((0, 5)));
        assert_eq!(furthest_behind(&[6, 5]), Some((1, 5)));
        assert_eq!(furthest_behind(&[9, 5, 7]), Some((1, 7)));
        assert_eq!(furthest_behind(&[u64::MAX, 5]), Some((1, u64::MAX - 1)));
        assert_eq!(furthest_behind(&[u64::MAX; 3]), None);
        assert_eq!(furthest_behind(&[3]), Some((0, u64::MAX - 1)));
    }
}
