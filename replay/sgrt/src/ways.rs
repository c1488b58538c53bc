//! The ways of rendering a frame: both eyes completely traced, and reprojection.
//!
//! Units, cores and memory form a pipeline over tiles: while the units trace a tile, the cores shade the
//! previous one and DMA fetches the rows of the next. A batch (a tile of one eye) therefore takes the
//! maximum of the three, and a frame the sum over its batches.

use super::cache::Misses;
use super::config::SgrtConfig;
use super::dram::DramBytes;
use super::energy;
use super::frame::Frame;
use super::gbuffer::{self, Keeping, RightTile, Traffic};
use super::hardware::{Comparison, TileMisses, TileWork};
use super::reads::Reads;
use super::rows::RowNeeds;
use super::run::Run;
use super::srp;
use super::tni::{self, TniCycles};
use super::work::BatchWork;
use formats::view::Eye;
use sim::order::rays::{RayPlan, eye_of, tiles_of};
use sim::order::{TileRef, WorkItem};

/// A way of rendering the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// Both eyes completely traced.
    Reference,
    /// Reprojection, tile by tile.
    Reprojected,
    /// Reprojection, with the whole screen's G-buffer in DRAM.
    WholeScreen,
    /// The right eye from a left one that is the previous frame: traced before, its G-buffer in DRAM.
    Previous,
    /// The left eye, shaded before, is only projected, tile by tile.
    Projected,
}

impl Way {
    /// The ways of a stereo frame, in the order of [`Comparison`]'s fields.
    pub const ALL: [Self; 3] = [Self::Reference, Self::Reprojected, Self::WholeScreen];
}

/// A tile of one eye, rendered in one way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TileBatch {
    /// Its work.
    pub work: BatchWork,
    /// G-buffer bytes.
    traffic: Traffic,
    /// Finished pixels.
    pixels: u64,
}

impl TileBatch {
    fn add(&mut self, other: &Self) {
        self.work.add(&other.work);
        self.traffic.on_chip_bytes += other.traffic.on_chip_bytes;
        self.traffic.dram_bytes += other.traffic.dram_bytes;
        self.pixels += other.pixels;
    }
}

/// A frame rendered in one way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WayRun {
    /// Cost of the frame.
    pub run: Run,
    /// Unit cycles of the right eye.
    pub right_tni_cycles: f64,
}

/// The inputs that all batches share.
pub(super) struct Model<'a> {
    pub frame: &'a Frame,
    /// Reads of error detection.
    pub reads: Reads,
    pub rows: &'a RowNeeds,
    pub config: &'a SgrtConfig,
}

impl Model<'_> {
    /// The left and the right batch of a tile.
    pub(super) fn batches(&self, way: Way, tile: u32, work: &TileWork) -> [TileBatch; 2] {
        let (_, [width, height]) = self.frame.tables.tile_rect(tile);
        let pixels = u64::from(width) * u64::from(height);
        let batch = |work, traffic| TileBatch {
            work,
            traffic,
            pixels,
        };
        let keeping = match way {
            Way::Reference => {
                let left = BatchWork {
                    reprojected: 0,
                    ..work.left
                };
                return [left, work.right_full].map(|work| batch(work, Traffic::default()));
            }
            Way::Reprojected | Way::Projected => Keeping::Tile,
            Way::WholeScreen | Way::Previous => Keeping::Screen,
        };
        let (reads, g) = (self.reads, &self.config.gbuffer);
        let [band, band_and_beside] = self.rows.of_tile(self.frame, tile);
        let right_tile = RightTile {
            tested: work.right.detected,
            reused: work.right.reused,
            fetched_bytes: reads.fetched_bytes(g, band, band_and_beside, u64::from(width)),
            row_read_bytes: row_read_bytes(&work.right, self.config),
        };
        let left = match way {
            Way::Previous => gbuffer::previous_tile(work.left.reprojected, reads, g),
            _ => gbuffer::left_tile(work.left.reprojected, keeping, reads, g),
        };
        let right = gbuffer::right_tile(&right_tile, keeping, reads, g);
        let mut left = batch(work.left, left);
        if matches!(way, Way::Previous | Way::Projected) {
            left.pixels = 0;
            left.work = BatchWork {
                reprojected: work.left.reprojected,
                ..BatchWork::default()
            };
        }
        [left, batch(work.right, right)]
    }

    /// External memory traffic of a batch.
    pub(super) fn dram_bytes(&self, batch: &TileBatch, misses: &Misses) -> DramBytes {
        let memory = &self.config.memory;
        DramBytes {
            hierarchy_bytes: misses.dram_bytes(self.config.cache.line_bytes).round() as u64,
            gbuffer_bytes: batch.traffic.dram_bytes,
            shading_bytes: (batch.work.shaded as f64 * memory.shading_bytes).round() as u64,
            frame_buffer_bytes: batch.pixels * u64::from(memory.frame_buffer_bytes),
        }
    }

    /// The work of tiles that are traced together.
    pub(super) fn batch(&self, way: Way, items: &[WorkItem], work: &[TileWork]) -> TileBatch {
        let mut batch = TileBatch::default();
        for at in tiles_of(items) {
            let of_eyes = self.batches(way, at.tile, &work[at.tile as usize]);
            batch.add(&of_eyes[at.pass as usize]);
        }
        batch
    }

    /// Renders the frame in one way by the closed form. `misses` returns those of a tile, given the number of its batch.
    pub(super) fn run(
        &self,
        way: Way,
        plan: &RayPlan,
        work: &[TileWork],
        misses: impl Fn(usize, TileRef) -> Misses,
    ) -> WayRun {
        let mut out = WayRun::default();
        for (number, items) in plan.batches().enumerate() {
            let mut of_batch = Misses::default();
            for at in tiles_of(items) {
                let own = misses(number, at);
                of_batch.add(&own);
                if eye_of(at) == Eye::Right {
                    let right = &self.batches(way, at.tile, &work[at.tile as usize])[1].work;
                    let tree = self.frame.tables.bvh.traversal;
                    out.right_tni_cycles += tni::cycles(right, &own, tree, self.config).total();
                }
            }
            self.add(&mut out.run, &self.batch(way, items, work), &of_batch);
        }
        out.run.energy = energy::energy(&out.run, &self.frame.tables.bvh, self.config);
        out
    }

    /// Unit cycles of an eye, completely traced, by resource and in all. `misses` by tile.
    pub(super) fn eye(&self, eye: Eye, work: &[TileWork], misses: &[Misses]) -> (TniCycles, f64) {
        let tree = self.frame.tables.bvh.traversal;
        let (mut sum, mut total) = (TniCycles::default(), 0.0);
        for (tile, (work, misses)) in (0u32..).zip(work.iter().zip(misses)) {
            let batch = self.batches(Way::Reference, tile, work)[eye as usize];
            let cycles = tni::cycles(&batch.work, misses, tree, self.config);
            sum.add(&cycles);
            total += cycles.total();
        }
        (sum, total)
    }

    /// Adds a batch to a run.
    fn add(&self, run: &mut Run, batch: &TileBatch, misses: &Misses) {
        let (config, work) = (self.config, &batch.work);
        let tni = tni::cycles(work, misses, self.frame.tables.bvh.traversal, config);
        let srp = srp::cycles(work, config);
        let dram = self.dram_bytes(batch, misses);
        run.work.add(work);
        run.misses.add(misses);
        run.tni.add(&tni);
        run.tni_cycles += tni.total();
        run.srp.add(&srp);
        run.on_chip_bytes += batch.traffic.on_chip_bytes;
        run.dram.add(&dram);
        let tni_ns = tni.total() * 1e3 / config.tni.clock_mhz;
        let srp_ns = srp.total() * 1e3 / config.srp.clock_mhz;
        let dram_ns = dram.time_ns(config);
        run.time_ns += tni_ns.max(srp_ns).max(dram_ns);
        if dram_ns > tni_ns.max(srp_ns) {
            run.memory_bound_ns += dram_ns;
        }
    }
}

/// Batches of one eye, rendered in one way.
pub(super) struct FramePart<'a> {
    pub model: Model<'a>,
    pub way: Way,
    /// The eye of the pair.
    pub side: Eye,
    pub work: &'a [TileWork],
    /// By tile; empty if no ray is traced.
    pub misses: &'a [Misses],
}

/// A frame that consists of parts, by the closed form.
///
/// # Panics
/// There is no part.
pub(super) fn sum_of_parts(parts: &[FramePart<'_>]) -> Run {
    let mut run = Run::default();
    for tile in 0..parts[0].work.len() {
        for part in parts {
            let batches = part.model.batches(part.way, tile as u32, &part.work[tile]);
            let misses = part.misses.get(tile).copied().unwrap_or_default();
            let batch = &batches[part.side as usize];
            part.model.add(&mut run, batch, &misses);
        }
    }
    let model = &parts[0].model;
    run.energy = energy::energy(&run, &model.frame.tables.bvh, model.config);
    run
}

/// Bytes that tests against whole rows read from the row buffers: a warp reads each left pixel once for all its lanes.
fn row_read_bytes(work: &BatchWork, config: &SgrtConfig) -> u64 {
    if config.srp.row_test_cycles > 0.0 {
        work.row_tests * u64::from(config.gbuffer.detect_position_bytes)
            / u64::from(config.srp.lanes_per_core)
    } else {
        0
    }
}

/// Runs the three ways through the closed form, the reference and the ways that reproject in the order of a plan each.
pub fn compare(
    frame: &Frame,
    [full, reprojected]: [&RayPlan; 2],
    work: &[TileWork],
    misses: &[TileMisses],
    reads: Reads,
    rows: &RowNeeds,
    config: &SgrtConfig,
) -> Comparison {
    let model = Model {
        frame,
        reads,
        rows,
        config,
    };
    let ways = Way::ALL.map(|way| {
        let plan = if way == Way::Reference {
            full
        } else {
            reprojected
        };
        model.run(way, plan, work, |_, at| {
            misses[at.tile as usize].of(way, at)
        })
    });
    comparison(&ways)
}

/// The comparison of the three ways, in the order of [`Way::ALL`].
pub(super) fn comparison([reference, reprojected, whole_screen]: &[WayRun; 3]) -> Comparison {
    Comparison {
        reference: reference.run,
        reprojected: reprojected.run,
        whole_screen: whole_screen.run,
        right_full_tni_cycles: reference.right_tni_cycles,
        right_tni_cycles: reprojected.right_tni_cycles,
    }
}
