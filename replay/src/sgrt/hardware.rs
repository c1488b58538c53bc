//! The hardware model: a frame with both eyes completely traced, and with reprojection.
//!
//! Units, cores and memory form a pipeline over tiles: while the units trace a tile, the cores shade the
//! previous one and DMA fetches the rows of the next. A batch (a tile of one eye) therefore takes the
//! maximum of the three, and a frame the sum over its batches.

use super::cache::{self, DeviceCaches, Misses};
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::detect::Decision;
use super::dram::DramBytes;
use super::energy;
use super::frame::{Frame, FrameError, RaySource};
use super::gbuffer::{self, Keeping, RightTile, Traffic};
use super::reads::Reads;
use super::rows::RowNeeds;
use super::run::Run;
use super::srp;
use super::tni;
use super::work::{BatchWork, RayClass};
use formats::raytrace::{RayTile, Visit};
use formats::view::Eye;
use rayon::prelude::*;

/// The frame rendered in three ways, with the right eye's share.
#[derive(Clone, Copy, Debug, Default)]
pub struct Comparison {
    /// Both eyes completely traced.
    pub reference: Run,
    /// Reprojection, tile by tile.
    pub reprojected: Run,
    /// Reprojection, with the whole screen's G-buffer in DRAM.
    pub whole_screen: Run,
    /// Unit cycles of the right eye, completely traced.
    pub right_full_tni_cycles: f64,
    /// Unit cycles of the right eye with reprojection.
    pub right_tni_cycles: f64,
}

impl Comparison {
    /// Frames per second of reprojection relative to the reference.
    #[must_use]
    pub fn relative_performance(&self) -> f64 {
        self.reprojected.performance_over(&self.reference)
    }

    /// Energy of reprojection relative to the reference.
    #[must_use]
    pub fn relative_energy(&self) -> f64 {
        self.reprojected.energy_over(&self.reference)
    }
}

/// Pixels of a warp: two rows of a tile.
const WARP_PIXELS: usize = 32;

/// Work of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileWork {
    /// Left eye.
    pub left: BatchWork,
    /// Right eye, completely traced.
    pub right_full: BatchWork,
    /// Right eye with reprojection.
    pub right: BatchWork,
}

/// The work of each tile, for given decisions and reuse, by tile number.
#[must_use]
pub(super) fn tile_work(frame: &Frame, decisions: &[Decision], reuse: Reuse) -> Vec<TileWork> {
    (0..frame.tables.tile_count())
        .into_par_iter()
        .map(|tile| {
            let mut work = TileWork::default();
            let mut warp = [0u64; 2];
            for (at, i) in frame.tile_samples(tile).enumerate() {
                work.left.add_traced(&frame.left().work[i]);
                work.left.reprojected += 1;
                work.right_full.add_traced(&frame.right().work[i]);
                add_right(frame, &decisions[i], i, reuse, &mut work.right);
                if at % WARP_PIXELS == 0 {
                    let [traced, reused] = std::mem::take(&mut warp);
                    work.right.add_warp(traced, reused);
                }
                warp[usize::from(decisions[i].class.is_reused())] += 1;
            }
            work.right.add_warp(warp[0], warp[1]);
            work
        })
        .collect()
}

fn add_right(frame: &Frame, decision: &Decision, i: usize, reuse: Reuse, batch: &mut BatchWork) {
    let pixel = &frame.right().work[i];
    batch.detected += 1;
    batch.row_tests += u64::from(frame.size_px[0]);
    batch.retest_rays += u64::from(decision.tests > 0);
    batch.retest_tests += u64::from(decision.tests);
    if !decision.class.is_reused() {
        batch.add_traced(pixel);
        return;
    }
    batch.reused += 1;
    for class in RayClass::ALL {
        if is_traced(decision, class, reuse) {
            batch.add_class(pixel, class);
        }
    }
    let left = &frame.left().samples[decision.source as usize];
    let material = frame.tables.materials.get(left.material as usize);
    let looks_alike = !left.is_sky() && material.is_some_and(|m| !m.view_dependent());
    let is_shaded = match reuse {
        Reuse::Primary | Reuse::Shadow => true,
        Reuse::Color => !looks_alike,
        Reuse::Pixel => false,
    };
    if is_shaded {
        batch.shaded += 1 + u64::from(pixel.secondary_shaded);
    }
}

/// True if rays of a class are traced for a right sample.
fn is_traced(decision: &Decision, class: RayClass, reuse: Reuse) -> bool {
    match class {
        _ if !decision.class.is_reused() => true,
        RayClass::Primary => false,
        RayClass::Shadow => reuse == Reuse::Primary || decision.retraces_shadows,
        RayClass::Secondary => reuse != Reuse::Pixel,
    }
}

/// Misses of a tile's batches. The left eye's rays are the same with and without reprojection, but find
/// other lines in the caches.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileMisses {
    /// Left eye of the reference.
    pub left_full: Misses,
    /// Right eye of the reference.
    pub right_full: Misses,
    /// Left eye with reprojection.
    pub left: Misses,
    /// Right eye with reprojection.
    pub right: Misses,
}

/// Misses by the configured hit rates, by tile number.
#[must_use]
pub(super) fn misses_by_rates(
    work: &[TileWork],
    frame: &Frame,
    config: &SgrtConfig,
) -> Vec<TileMisses> {
    let of = |batch: &BatchWork| cache::by_rates(batch, &frame.tables.bvh, config);
    let tile = |work: &TileWork| {
        let left = of(&work.left);
        TileMisses {
            left_full: left,
            right_full: of(&work.right_full),
            left,
            right: of(&work.right),
        }
    };
    work.par_iter().map(tile).collect()
}

/// Misses of the addresses in the trace, simulated in the configured caches: tiles in order, left before
/// right, pixels assigned to the units round robin. The triangle of a re-test counts by hit rate, because
/// its address is not in the trace.
///
/// # Errors
/// [`FrameError`] for an unreadable tile.
pub(super) fn misses_by_addresses(
    source: &dyn RaySource,
    frame: &Frame,
    decisions: &[Decision],
    reuse: Reuse,
    work: &[TileWork],
    config: &SgrtConfig,
) -> Result<Vec<TileMisses>, FrameError> {
    let bvh = &frame.tables.bvh;
    let last = bvh.triangles.checked_sub(1);
    let end = last.map_or(0, |last| bvh.address(Visit::Triangle(last as u32)));
    let lines = (end + u64::from(bvh.bytes_per_triangle)) / config.cache.line_bytes;
    if lines >= DeviceCaches::MOST_LINES {
        return Err(FrameError::Lines { lines });
    }
    let [mut reference, mut reprojected] = [(); 2].map(|()| DeviceCaches::new(config));
    let mut tile_data = RayTile::default();
    let mut out = vec![TileMisses::default(); work.len()];
    for ((tile, misses), work) in (0u32..).zip(&mut out).zip(work) {
        for eye in [Eye::Left, Eye::Right] {
            source
                .tile(eye, tile, &mut tile_data)
                .map_err(|source| FrameError::Tile { eye, tile, source })?;
            let (full, reused) = match eye {
                Eye::Left => (&mut misses.left_full, &mut misses.left),
                Eye::Right => (&mut misses.right_full, &mut misses.right),
            };
            let mut at = 0usize;
            let pixels = tile_data.pixels.iter().zip(frame.tile_samples(tile));
            for (turn, (pixel, i)) in pixels.enumerate() {
                for ray in tile_data.rays_of(pixel) {
                    let end = at.saturating_add(ray.visit_count() as usize);
                    let visits = tile_data.visits.get(at..end).unwrap_or(&[]);
                    at = end;
                    let kept =
                        eye == Eye::Left || is_traced(&decisions[i], RayClass::of(ray), reuse);
                    for &visit in visits {
                        reference.visit(turn, visit, bvh, full);
                        if kept {
                            reprojected.visit(turn, visit, bvh, reused);
                        }
                    }
                }
            }
        }
        let retests = BatchWork {
            retest_tests: work.right.retest_tests,
            ..BatchWork::default()
        };
        misses.right.add(&cache::by_rates(&retests, bvh, config));
    }
    Ok(out)
}

/// Runs the three ways through the models of units, cores, memory and energy.
#[must_use]
pub fn compare(
    frame: &Frame,
    work: &[TileWork],
    misses: &[TileMisses],
    reads: Reads,
    rows: &RowNeeds,
    config: &SgrtConfig,
) -> Comparison {
    let model = Model { frame, config };
    let g = &config.gbuffer;
    let [mut reference, mut reprojected, mut whole_screen] = [Run::default(); 3];
    let (mut right_full, mut right) = (0.0, 0.0);
    for ((tile, work), misses) in (0u32..).zip(work).zip(misses) {
        let (_, [width, height]) = frame.tables.tile_rect(tile);
        let pixels = u64::from(width) * u64::from(height);
        let [band, band_and_beside] = rows.of_tile(frame, tile);
        let right_tile = RightTile {
            tested: work.right.detected,
            reused: work.right.reused,
            fetched_bytes: reads.fetched_bytes(g, band, band_and_beside, u64::from(width)),
            row_read_bytes: row_read_bytes(&work.right, config),
        };
        let plain_left = BatchWork {
            reprojected: 0,
            ..work.left
        };
        let batch = |run: &mut Run, work: &BatchWork, misses: &Misses, traffic| {
            model.add(run, work, misses, traffic, pixels)
        };
        let none = Traffic::default();
        batch(&mut reference, &plain_left, &misses.left_full, none);
        right_full += batch(&mut reference, &work.right_full, &misses.right_full, none);
        for (run, keeping) in [
            (&mut whole_screen, Keeping::Screen),
            (&mut reprojected, Keeping::Tile),
        ] {
            let left = gbuffer::left_tile(work.left.reprojected, keeping, reads, g);
            batch(run, &work.left, &misses.left, left);
            let traffic = gbuffer::right_tile(&right_tile, keeping, reads, g);
            let cycles = batch(run, &work.right, &misses.right, traffic);
            if keeping == Keeping::Tile {
                right += cycles;
            }
        }
    }
    let [reference, reprojected, whole_screen] =
        [reference, reprojected, whole_screen].map(|run| Run {
            energy: energy::energy(&run, &frame.tables.bvh, config),
            ..run
        });
    Comparison {
        reference,
        reprojected,
        whole_screen,
        right_full_tni_cycles: right_full,
        right_tni_cycles: right,
    }
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

struct Model<'a> {
    frame: &'a Frame,
    config: &'a SgrtConfig,
}

impl Model<'_> {
    /// Adds a batch of `pixels` finished pixels to a run, and returns its unit cycles.
    fn add(
        &self,
        run: &mut Run,
        work: &BatchWork,
        misses: &Misses,
        gbuffer: Traffic,
        pixels: u64,
    ) -> f64 {
        let config = self.config;
        let tni = tni::cycles(work, misses, self.frame.tables.bvh.traversal, config);
        let srp = srp::cycles(work, config);
        let dram = DramBytes {
            hierarchy_bytes: misses.dram_bytes(config.cache.line_bytes).round() as u64,
            gbuffer_bytes: gbuffer.dram_bytes,
            shading_bytes: (work.shaded as f64 * config.memory.shading_bytes).round() as u64,
            frame_buffer_bytes: pixels * u64::from(config.memory.frame_buffer_bytes),
        };
        run.work.add(work);
        run.misses.add(misses);
        run.tni.add(&tni);
        run.tni_cycles += tni.total();
        run.srp.add(&srp);
        run.on_chip_bytes += gbuffer.on_chip_bytes;
        run.dram.add(&dram);
        let tni_ns = tni.total() * 1e3 / config.tni.clock_mhz;
        let srp_ns = srp.total() * 1e3 / config.srp.clock_mhz;
        let dram_ns = dram.time_ns(config);
        run.time_ns += tni_ns.max(srp_ns).max(dram_ns);
        if dram_ns > tni_ns.max(srp_ns) {
            run.memory_bound_ns += dram_ns;
        }
        tni.total()
    }
}

#[cfg(test)]
mod tests;
