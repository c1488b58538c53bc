//! Starts as many traces and streams at a time as memory allows.
//!
//! A frame's lines stay in memory while replays read them. Replaying all traces at once would exhaust
//! memory, and tiles would have to be expanded for every replay. Replaying one trace at a time would leave
//! threads idle at its end. Therefore the next trace starts when there is memory for it, or when threads
//! would become idle.

use rayon::Scope;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Waiting items, and counts of the running ones.
struct State<T> {
    waiting: std::vec::IntoIter<T>,
    /// Running items that have replays left to start.
    busy: usize,
    /// Total weight of the items still loading.
    loading: usize,
}

/// Progress of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The lines of a frame are in memory.
    Loaded,
    /// The item's last replay has started.
    LastReplayStarted,
}

/// Runs `work` for all items. `work` reports stages through the function it receives. The next item starts
/// when all earlier items are loaded and `room` returns true, or when the last replays of all earlier items
/// have started. Items load concurrently while their total weight is less than `enough`.
pub(super) fn run_within_memory<T: Send>(
    items: Vec<(usize, T)>,
    enough: usize,
    room: impl Fn() -> bool + Sync,
    work: impl Fn(T, &(dyn Fn(Stage) + Sync)) + Sync,
) {
    let state = Mutex::new(State {
        waiting: items.into_iter(),
        busy: 0,
        loading: 0,
    });
    let scheduler = Scheduler {
        state,
        enough,
        room,
        work,
    };
    rayon::scope(|scope| scheduler.start(scope));
}

struct Scheduler<T, R, W> {
    state: Mutex<State<(usize, T)>>,
    enough: usize,
    room: R,
    work: W,
}

impl<T, R, W> Scheduler<T, R, W>
where
    T: Send,
    R: Fn() -> bool + Sync,
    W: Fn(T, &(dyn Fn(Stage) + Sync)) + Sync,
{
    /// Starts all items that can start.
    fn start<'s>(&'s self, scope: &Scope<'s>) {
        let mut state = self.state();
        while state.busy == 0 || (state.loading < self.enough && (self.room)()) {
            let Some((weight, item)) = state.waiting.next() else {
                return;
            };
            state.busy += 1;
            state.loading += weight;
            scope.spawn(move |scope| self.work(weight, item, scope));
        }
    }

    fn work<'s>(&'s self, weight: usize, item: T, scope: &Scope<'s>) {
        // The item's contributions to `loading` and `busy`.
        let own = Mutex::new((weight, 1));
        let report_stage = |stage| {
            let mut own = own.lock().unwrap_or_else(PoisonError::into_inner);
            let (loading, busy) = &mut *own;
            let mut state = self.state();
            state.loading -= std::mem::take(loading);
            if stage == Stage::LastReplayStarted {
                state.busy -= std::mem::take(busy);
            }
            drop(state);
            self.start(scope);
        };
        (self.work)(item, &report_stage);
        report_stage(Stage::LastReplayStarted);
    }

    fn state(&self) -> MutexGuard<'_, State<(usize, T)>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Runs items that allocate and free memory, and returns the peak.
    fn most_taken(sizes: &[usize], limit: usize, enough: usize, threads: usize) -> usize {
        let (taken, most, done) = Default::default();
        let (taken, most, done): (AtomicUsize, AtomicUsize, AtomicUsize) = (taken, most, done);
        let room = || 2 * taken.load(Ordering::SeqCst) <= limit;
        let work = |size, report_stage: &(dyn Fn(Stage) + Sync)| {
            let now = size + taken.fetch_add(size, Ordering::SeqCst);
            most.fetch_max(now, Ordering::SeqCst);
            report_stage(Stage::Loaded);
            std::thread::sleep(std::time::Duration::from_micros(100));
            taken.fetch_sub(size, Ordering::SeqCst);
            done.fetch_add(1, Ordering::SeqCst);
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let items = sizes.iter().map(|&size| (1, size)).collect();
        let run = || run_within_memory(items, enough, room, work);
        pool.unwrap().install(run);
        assert_eq!(done.load(Ordering::SeqCst), sizes.len());
        most.load(Ordering::SeqCst)
    }

    #[test]
    fn items_start_only_with_room_and_all_are_completed() {
        for threads in [1, 2, 8] {
            // Each takes more than half of the memory, so they run one at a time, even if one exceeds the limit.
            assert_eq!(most_taken(&[60; 40], 100, 1, threads), 60);
            assert_eq!(most_taken(&[300; 5], 100, 1, threads), 300);
            // Half of the memory is filled, and one more item starts.
            assert!(most_taken(&[20; 40], 100, 1, threads) <= 80);
            assert!(most_taken(&[1; 100], 100, 8, threads) <= 100);
        }
        most_taken(&[], 100, 1, 2);
    }

    #[test]
    fn light_items_load_concurrently() {
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let together = std::sync::Barrier::new(4);
        let work = |(), report_stage: &(dyn Fn(Stage) + Sync)| {
            most.fetch_max(1 + now.fetch_add(1, Ordering::SeqCst), Ordering::SeqCst);
            together.wait();
            now.fetch_sub(1, Ordering::SeqCst);
            report_stage(Stage::Loaded);
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build();
        let run = || run_within_memory(vec![(2, ()); 4], 8, || true, work);
        pool.unwrap().install(run);
        assert_eq!(most.load(Ordering::SeqCst), 4);
    }

    #[test]
    fn the_next_item_starts_while_the_previous_one_finishes() {
        let together = std::sync::Barrier::new(2);
        let work = |(), report_stage: &(dyn Fn(Stage) + Sync)| {
            report_stage(Stage::LastReplayStarted);
            // Both items must be running at the same time, or this blocks forever.
            together.wait();
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
        let run = || run_within_memory(vec![(1, ()); 6], 1, || false, work);
        pool.unwrap().install(run);
    }
}
