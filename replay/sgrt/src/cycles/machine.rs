//! The configuration of the simulation in whole cycles of the units' clock.

use crate::config::{Prefetch, SgrtConfig};
use formats::raytrace::TraversalKind;
use sim::memory::{TICKS, ticks};

/// A kind of pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pipelines {
    /// Number per unit.
    pub count: u32,
    /// Ticks between two items of one pipeline.
    pub interval: u64,
    /// Cycles from issue to result.
    pub latency: u64,
}

impl Pipelines {
    /// Cycles between two items of one pipeline.
    pub fn interval_cycles(&self) -> f64 {
        self.interval as f64 / TICKS as f64
    }
}

/// Size of a cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheSize {
    /// Sets, a power of two.
    pub sets: u32,
    /// Ways.
    pub ways: u32,
    /// Lines that can be in flight.
    pub mshrs: u32,
}

/// The simulated machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// T&I units.
    pub units: usize,
    /// Slots per unit, one per ray or warp.
    pub slots: usize,
    /// Rays per warp; 1 for single rays.
    pub warp_rays: u32,
    /// Ticks between two rays of an input or output port.
    pub port_interval: u64,
    /// True if a unit returns its rays in order of dispatch.
    pub in_order_return: bool,
    /// Rays of a batch that return together; 1 for single rays.
    pub return_group_rays: usize,
    /// Traversal and intersection pipelines.
    pub pipelines: [Pipelines; 2],
    /// Node and triangle cache of each unit.
    pub l1: [CacheSize; 2],
    /// The shared cache.
    pub l2: CacheSize,
    /// Cycles from an L1 miss to data from the L2.
    pub l2_latency: u64,
    /// Cycles of a DRAM read.
    pub dram_latency: u64,
    /// Ticks that a line occupies the DRAM channel.
    pub dram_ticks_per_line: u64,
    /// Tiles that are between dispatch and the end of shading.
    pub tile_buffers: usize,
    /// True if lines are prefetched.
    pub has_prefetcher: bool,
}

impl Machine {
    /// The machine of a configuration, for traces of a tree of this kind.
    pub fn new(config: &SgrtConfig, tree: TraversalKind) -> Self {
        let (tni, cache, cycles) = (&config.tni, &config.cache, &config.cycles);
        let (step_cycles, _) = config.step(tree);
        let pipelines = |count, depth: u32, interval: f64| Pipelines {
            count,
            interval: ticks(interval),
            // As in the closed form, an item that occupies its pipeline longer also leaves it later.
            latency: u64::from(depth) + (interval - 1.0).max(0.0).ceil() as u64,
        };
        let size = |bytes: u64, ways: u32, mshrs| CacheSize {
            sets: (bytes / (u64::from(ways) * cache.line_bytes)) as u32,
            ways,
            mshrs,
        };
        let l1 = |bytes| size(bytes, cache.l1_ways, cycles.l1_mshrs);
        let cycles_per_ns = tni.clock_mhz * 1e-3;
        let line_ns = cache.line_bytes as f64 / config.memory.bandwidth_gb_s;
        Self {
            units: tni.units as usize,
            slots: (tni.rays_in_flight / cycles.warp_rays).max(1) as usize,
            warp_rays: cycles.warp_rays,
            port_interval: ticks(1.0 / tni.rays_per_cycle),
            in_order_return: cycles.in_order_return,
            return_group_rays: cycles.return_group_rays as usize,
            pipelines: [
                pipelines(tni.trv_pipelines, tni.trv_depth_cycles, step_cycles),
                pipelines(
                    tni.ist_pipelines,
                    tni.ist_depth_cycles,
                    tni.ist_cycles_per_test,
                ),
            ],
            l1: [l1(cache.node_l1_bytes), l1(cache.triangle_l1_bytes)],
            l2: size(cache.l2_bytes, cache.l2_ways, cycles.l2_mshrs),
            l2_latency: u64::from(cache.l2_latency_cycles),
            dram_latency: ((config.memory.latency_ns * cycles_per_ns).round() as u64).max(1),
            dram_ticks_per_line: ticks(line_ns * cycles_per_ns),
            tile_buffers: cycles.tile_buffers as usize,
            has_prefetcher: cycles.prefetch.prefetcher != Prefetch::default().prefetcher,
        }
    }
}
