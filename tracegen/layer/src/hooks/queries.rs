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
    /// Index of the query of each draw.
    of_draws: Mutex<HashMap<u32, u32>>,
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
        let mut of_draws = lock(&self.of_draws);
        of_draws.retain(|_, query| *query != place * PER_DRAW);
        of_draws.insert(draw, place * PER_DRAW);
        let flags = vk::QueryControlFlags::PRECISE;
        // SAFETY: as the caller promises; the query was reset.
        unsafe { (next.cmd_begin_query)(buffer, self.pool, place * PER_DRAW, flags) };
    }

    /// Ends the query of a draw.
    ///
    /// # Safety
    /// [`Self::begin`] was called for the same draw.
    pub unsafe fn end(&self, buffer: vk::CommandBuffer, draw: u32, next: &Next) {
        if let Some(query) = lock(&self.of_draws).get(&draw).copied() {
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
        for query in draws.iter().filter_map(|draw| of_draws.get(draw)) {
            // SAFETY: as the caller promises.
            unsafe { (next.reset_query_pool)(device, self.pool, *query, PER_DRAW) };
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
            let Some(&query) = of_draws.get(&draw) else {
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
