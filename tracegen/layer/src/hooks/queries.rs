//! Occlusion queries around draws, with which the driver counts fragments independently.

use super::next::Next;
use crate::capture::lock;
use ash::vk;
use std::collections::HashMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// Occlusion queries of a device and the draws that they count.
pub(super) struct Queries {
    pool: vk::QueryPool,
    next: AtomicU32,
    of_draws: Mutex<OfDraws>,
}

/// Places of draws with pending results.
#[derive(Default)]
struct OfDraws {
    places: HashMap<u32, u32>,
    /// The draw at each place.
    draws: HashMap<u32, u32>,
}

impl OfDraws {
    /// Gives a draw a place, which another draw may lose.
    fn insert(&mut self, draw: u32, place: u32) {
        if let Some(earlier) = self.draws.insert(place, draw) {
            self.places.remove(&earlier);
        }
        if let Some(earlier) = self.places.insert(draw, place) {
            self.draws.remove(&earlier);
        }
    }

    /// Index of the first query of a draw.
    fn query(&self, draw: u32) -> Option<u32> {
        self.places.get(&draw).map(|place| place * PER_DRAW)
    }
}

/// Maximum number of draws with pending results.
const DRAWS: u32 = 1 << 15;
/// Queries per draw: one per view of a multiview pass, at most two.
const PER_DRAW: u32 = 2;

impl Queries {
    /// Creates the queries; `None` if the driver refuses.
    ///
    /// # Safety
    /// The device is open.
    pub unsafe fn new(device: vk::Device, next: &Next) -> Option<Self> {
        let info = vk::QueryPoolCreateInfo {
            query_type: vk::QueryType::OCCLUSION,
            query_count: DRAWS * PER_DRAW,
            ..Default::default()
        };
        let mut pool = vk::QueryPool::null();
        // SAFETY: the device is open.
        unsafe {
            let result = (next.create_query_pool)(device, &info, std::ptr::null(), &mut pool);
            if result != vk::Result::SUCCESS {
                return None;
            }
            (next.reset_query_pool)(device, pool, 0, DRAWS * PER_DRAW);
        }
        Some(Self {
            pool,
            next: AtomicU32::new(0),
            of_draws: Mutex::default(),
        })
    }

    /// Begins the query of a draw.
    ///
    /// # Safety
    /// The command buffer is being recorded, inside a render pass.
    pub unsafe fn begin(&self, buffer: vk::CommandBuffer, draw: u32, next: &Next) {
        let place = self.next.fetch_add(1, Ordering::Relaxed) % DRAWS;
        lock(&self.of_draws).insert(draw, place);
        let flags = vk::QueryControlFlags::PRECISE;
        // SAFETY: as the caller promises; the query was reset.
        unsafe { (next.cmd_begin_query)(buffer, self.pool, place * PER_DRAW, flags) };
    }

    /// Ends the query of a draw.
    ///
    /// # Safety
    /// [`Self::begin`] was called for the same draw.
    pub unsafe fn end(&self, buffer: vk::CommandBuffer, draw: u32, next: &Next) {
        if let Some(query) = lock(&self.of_draws).query(draw) {
            // SAFETY: as the caller promises.
            unsafe { (next.cmd_end_query)(buffer, self.pool, query) };
        }
    }

    /// Resets the queries of draws before they are executed.
    ///
    /// # Safety
    /// None of the draws is being executed.
    pub unsafe fn reset(&self, device: vk::Device, draws: &[u32], next: &Next) {
        let of_draws = lock(&self.of_draws);
        for query in draws.iter().filter_map(|draw| of_draws.query(*draw)) {
            // SAFETY: as the caller promises.
            unsafe { (next.reset_query_pool)(device, self.pool, query, PER_DRAW) };
        }
    }

    /// Counts of the draws that were executed once. The query of a repeated draw was not reset between its
    /// executions, so its result is undefined: lavapipe gives one of several counts.
    ///
    /// # Safety
    /// The draws have been executed.
    pub unsafe fn results(
        &self,
        device: vk::Device,
        draws: &[u32],
        next: &Next,
    ) -> Vec<(u32, u64)> {
        let of_draws = lock(&self.of_draws);
        let mut executions: HashMap<u32, u32> = HashMap::new();
        for &draw in draws {
            *executions.entry(draw).or_default() += 1;
        }
        let mut found = Vec::new();
        for &draw in draws.iter().filter(|draw| executions[draw] == 1) {
            let Some(query) = of_draws.query(draw) else {
                continue;
            };
            let mut count = [0_u64; PER_DRAW as usize];
            let mut sum = None;
            for (place, one) in (query..).zip(&mut count) {
                // SAFETY: the result has the size of the number.
                let result = unsafe {
                    (next.get_query_results)(
                        device,
                        self.pool,
                        place,
                        1,
                        size_of::<u64>(),
                        (&raw mut *one).cast(),
                        size_of::<u64>() as u64,
                        vk::QueryResultFlags::TYPE_64,
                    )
                };
                if result == vk::Result::SUCCESS {
                    sum = Some(sum.unwrap_or(0) + *one);
                }
            }
            found.extend(sum.map(|sum| (draw, sum)));
        }
        found
    }

    /// Destroys the queries with their device.
    ///
    /// # Safety
    /// No commands are being executed.
    pub unsafe fn destroy(&self, device: vk::Device, next: &Next) {
        // SAFETY: as the caller promises.
        unsafe { (next.destroy_query_pool)(device, self.pool, std::ptr::null()) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_loses_its_query_to_the_next_draw_at_its_place() {
        let mut of = OfDraws::default();
        of.insert(7, 0);
        of.insert(8, 1);
        of.insert(9, 0);
        assert_eq!(
            [7, 8, 9].map(|draw| of.query(draw)),
            [None, Some(PER_DRAW), Some(0)]
        );
        // A draw that is recorded again moves.
        of.insert(8, 2);
        of.insert(10, 1);
        assert_eq!(
            [8, 10].map(|draw| of.query(draw)),
            [Some(2 * PER_DRAW), Some(PER_DRAW)]
        );
    }
}
