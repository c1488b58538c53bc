//! What is in work at the same time: as much as there is memory for.
//!
//! A frame's lines stay in memory while anything reads them. Were all traces and streams in work at once, that
//! memory would run out, and tiles would be expanded again for every pass; were it one at a time, threads would
//! wait for its last passes. So the next one starts when there is memory for it, or threads would wait.

use rayon::Scope;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What waits and what is in work.
struct State<T> {
    waiting: std::vec::IntoIter<T>,
    /// In work, and not yet ending.
    busy: usize,
    /// Of those, which have not said yet that they hold what they need: their weight.
    growing: usize,
}

/// How far an item in work has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// It holds the memory that it needs for now.
    Grown,
    /// All that is left of it is in somebody's hands.
    Ending,
}

/// Calls `work` on all items; each says how far it has come by the function that `work` is given. The next
/// one is started when all before it have grown and `room` says that there is more memory; or when all
/// before it are ending, so that there is something else to do. Items lighter than `enough`, by their weight,
/// grow at the same time.
pub fn in_turn<T: Send>(
    items: Vec<(usize, T)>,
    enough: usize,
    room: impl Fn() -> bool + Sync,
    work: impl Fn(T, &(dyn Fn(Stage) + Sync)) + Sync,
) {
    let state = Mutex::new(State {
        waiting: items.into_iter(),
        busy: 0,
        growing: 0,
    });
    let turns = Turns {
        state,
        enough,
        room,
        work,
    };
    rayon::scope(|scope| turns.start(scope));
}

struct Turns<T, R, W> {
    state: Mutex<State<(usize, T)>>,
    enough: usize,
    room: R,
    work: W,
}

impl<T, R, W> Turns<T, R, W>
where
    T: Send,
    R: Fn() -> bool + Sync,
    W: Fn(T, &(dyn Fn(Stage) + Sync)) + Sync,
{
    /// Starts what may be started.
    fn start<'s>(&'s self, scope: &Scope<'s>) {
        let mut state = self.state();
        while state.busy == 0 || (state.growing < self.enough && (self.room)()) {
            let Some((weight, item)) = state.waiting.next() else {
                return;
            };
            state.busy += 1;
            state.growing += weight;
            scope.spawn(move |scope| self.work(weight, item, scope));
        }
    }

    fn work<'s>(&'s self, weight: usize, item: T, scope: &Scope<'s>) {
        // What it adds to `growing` and to `busy`.
        let own = Mutex::new((weight, 1));
        let comes_to = |stage| {
            let mut own = own.lock().unwrap_or_else(PoisonError::into_inner);
            let (growing, busy) = &mut *own;
            let mut state = self.state();
            state.growing -= std::mem::take(growing);
            if stage == Stage::Ending {
                state.busy -= std::mem::take(busy);
            }
            drop(state);
            self.start(scope);
        };
        (self.work)(item, &comes_to);
        comes_to(Stage::Ending);
    }

    fn state(&self) -> MutexGuard<'_, State<(usize, T)>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Items that take memory and give it back: how much was taken at most.
    fn most_taken(sizes: &[usize], limit: usize, enough: usize, threads: usize) -> usize {
        let (taken, most, done) = Default::default();
        let (taken, most, done): (AtomicUsize, AtomicUsize, AtomicUsize) = (taken, most, done);
        let room = || 2 * taken.load(Ordering::SeqCst) <= limit;
        let work = |size, comes_to: &(dyn Fn(Stage) + Sync)| {
            let now = size + taken.fetch_add(size, Ordering::SeqCst);
            most.fetch_max(now, Ordering::SeqCst);
            comes_to(Stage::Grown);
            std::thread::sleep(std::time::Duration::from_micros(100));
            taken.fetch_sub(size, Ordering::SeqCst);
            done.fetch_add(1, Ordering::SeqCst);
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let items = sizes.iter().map(|&size| (1, size)).collect();
        let run = || in_turn(items, enough, room, work);
        pool.unwrap().install(run);
        assert_eq!(done.load(Ordering::SeqCst), sizes.len());
        most.load(Ordering::SeqCst)
    }

    #[test]
    fn nothing_starts_without_room_and_everything_is_done() {
        for threads in [1, 2, 8] {
            // Each takes more than half: one at a time, also where one alone takes more than there is.
            assert_eq!(most_taken(&[60; 40], 100, 1, threads), 60);
            assert_eq!(most_taken(&[300; 5], 100, 1, threads), 300);
            // Room for those that half of the memory holds, and one more.
            assert!(most_taken(&[20; 40], 100, 1, threads) <= 80);
            assert!(most_taken(&[1; 100], 100, 8, threads) <= 100);
        }
        most_taken(&[], 100, 1, 2);
    }

    #[test]
    fn light_items_grow_together() {
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let together = std::sync::Barrier::new(4);
        let work = |(), comes_to: &(dyn Fn(Stage) + Sync)| {
            most.fetch_max(1 + now.fetch_add(1, Ordering::SeqCst), Ordering::SeqCst);
            together.wait();
            now.fetch_sub(1, Ordering::SeqCst);
            comes_to(Stage::Grown);
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build();
        let run = || in_turn(vec![(2, ()); 4], 8, || true, work);
        pool.unwrap().install(run);
        assert_eq!(most.load(Ordering::SeqCst), 4);
    }

    #[test]
    fn the_next_item_starts_while_the_one_before_is_ending() {
        let together = std::sync::Barrier::new(2);
        let work = |(), comes_to: &(dyn Fn(Stage) + Sync)| {
            comes_to(Stage::Ending);
            // Two of them are here at the same time, or this never ends.
            together.wait();
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
        let run = || in_turn(vec![(1, ()); 6], 1, || false, work);
        pool.unwrap().install(run);
    }
}
