//! The order in which the cores' quads meet in what they share, where no latencies are known: a
//! footprint is the unit of time.

use super::{Consumer, Stream, StreamError, TileSource};
use crate::config::Assign;
use crate::order::{Phase, WorkItem};

/// A core's state.
#[derive(Clone, Copy, Debug, Default)]
struct Core {
    busy: bool,
    /// Footprints done, the clock of first-idle assignment.
    clock: u64,
}

/// Sends all quads of `phases` to `consumer`. What comes when does not depend on the consumer.
///
/// # Errors
/// A tile that cannot be read.
pub fn interleave<S: TileSource + ?Sized>(
    stream: &mut Stream<'_, S>,
    phases: &[Phase],
    assign: Assign,
    consumer: &mut impl Consumer,
) -> Result<(), StreamError> {
    let mut cores = vec![Core::default(); stream.cores()];
    for phase in phases {
        match assign {
            Assign::FirstIdle => first_idle(stream, &mut cores, phase, consumer)?,
            Assign::Static => lockstep(stream, phase, consumer)?,
        }
        let end = cores.iter().map(|core| core.clock).max().unwrap_or(0);
        cores.iter_mut().for_each(|core| core.clock = end);
    }
    Ok(())
}

/// The core that is furthest behind runs a quad; if it has none left, it takes the next item.
fn first_idle<S: TileSource + ?Sized>(
    stream: &mut Stream<'_, S>,
    cores: &mut [Core],
    phase: &[WorkItem],
    consumer: &mut impl Consumer,
) -> Result<(), StreamError> {
    let mut items = phase.iter();
    cores.iter_mut().for_each(|core| core.busy = true);
    while let Some(behind) = furthest_behind(cores) {
        if let Some(footprints) = stream.next_quad(behind, consumer) {
            // An untextured quad takes its turn, too.
            cores[behind].clock += u64::from(footprints.max(1));
            continue;
        }
        match items.next() {
            Some(item) => stream.load(behind, item)?,
            None => cores[behind].busy = false,
        }
    }
    Ok(())
}

/// The busy core with the lowest clock, the first of equals.
#[inline]
fn furthest_behind(cores: &[Core]) -> Option<usize> {
    let busy = cores.iter().enumerate().filter(|(_, core)| core.busy);
    busy.min_by_key(|(_, core)| core.clock)
        .map(|(index, _)| index)
}

/// Round robin: the cores' i-th items start together and run quad by quad in turn; who is done
/// first waits. Free-running streams would drift apart and invent locality effects.
fn lockstep<S: TileSource + ?Sized>(
    stream: &mut Stream<'_, S>,
    phase: &[WorkItem],
    consumer: &mut impl Consumer,
) -> Result<(), StreamError> {
    for items in phase.chunks(stream.cores()) {
        for (core, item) in items.iter().enumerate() {
            stream.load(core, item)?;
        }
        let mut busy: Vec<usize> = (0..items.len()).collect();
        while !busy.is_empty() {
            busy.retain(|&core| stream.next_quad(core, consumer).is_some());
        }
    }
    Ok(())
}
