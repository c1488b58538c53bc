//! The work and the cache misses of each tile, with both eyes completely traced and with reprojection.

use super::cache::{self, DeviceCaches, Misses};
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::detect::Decision;
use super::energy_bounds::relative_bounds;
use super::frame::{Frame, FrameError, RaySource};
use super::run::Run;
use super::work::{BatchWork, RayClass};
use formats::raytrace::{BvhSummary, RayTile, Visit};
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
    pub fn relative_performance(&self) -> f64 {
        self.reprojected.performance_over(&self.reference)
    }

    /// Energy of reprojection relative to the reference.
    pub fn relative_energy(&self) -> f64 {
        self.reprojected.energy_over(&self.reference)
    }

    /// Least and most relative energy, if the energies are scaled to 14 nm.
    pub(super) fn relative_energy_bounds(&self) -> [f64; 2] {
        relative_bounds(&self.reprojected.energy, &self.reference.energy)
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

/// What remains to be done with reuse: the work of each tile, and the rays that are traced.
pub(super) struct RemainingWork {
    /// By tile.
    pub(super) tiles: Vec<TileWork>,
    /// By right sample and [`RayClass`].
    traced: Vec<[bool; 3]>,
}

impl RemainingWork {
    pub(super) fn new(frame: &Frame, decisions: &[Decision], reuse: Reuse) -> Self {
        let traced = |decision: &Decision| RayClass::ALL.map(|of| is_traced(decision, of, reuse));
        Self {
            tiles: tile_work(frame, decisions, reuse),
            traced: decisions.par_iter().map(traced).collect(),
        }
    }

    /// True if rays of a class are traced for a right sample.
    pub(super) fn traces(&self, sample: usize, class: RayClass) -> bool {
        self.traced[sample][class as usize]
    }
}

/// The work of each tile, for given decisions and reuse, by tile number.
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
    let is_shaded = match reuse {
        Reuse::Primary | Reuse::Shadow => true,
        Reuse::Color => !decision.looks_alike,
        Reuse::Pixel => false,
    };
    if is_shaded {
        batch.shaded += 1 + u64::from(pixel.secondary_shaded);
    }
}

/// True if rays of a class are traced for a right sample.
pub(super) fn is_traced(decision: &Decision, class: RayClass, reuse: Reuse) -> bool {
    match class {
        _ if !decision.class.is_reused() => true,
        RayClass::Primary => false,
        RayClass::Shadow => reuse == Reuse::Primary || decision.retraces_shadows,
        RayClass::Secondary => match reuse {
            Reuse::Primary | Reuse::Shadow => true,
            // A material that looks the same from everywhere has no secondary rays but diffuse ones.
            Reuse::Color => !decision.looks_alike,
            Reuse::Pixel => false,
        },
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

/// Checks that the lines of a hierarchy can be numbered.
pub(super) fn check_lines(bvh: &BvhSummary, config: &SgrtConfig) -> Result<(), FrameError> {
    let last = bvh.triangles.checked_sub(1);
    let end = last.map_or(0, |last| bvh.address(Visit::Triangle(last as u32)));
    let lines = (end + u64::from(bvh.bytes_per_triangle)) / config.cache.line_bytes;
    if lines >= DeviceCaches::MOST_LINES {
        return Err(FrameError::Lines { lines });
    }
    Ok(())
}

/// Whether rays of a class are traced for a sample of an eye.
pub(super) type Kept<'a> = dyn Fn(Eye, usize, RayClass) -> bool + Sync + 'a;

/// Misses of the triangles of re-tests, by hit rate, because their addresses are not in the trace.
pub(super) fn misses_of_retests(work: &BatchWork, bvh: &BvhSummary, config: &SgrtConfig) -> Misses {
    let retests = BatchWork {
        retest_tests: work.retest_tests,
        ..BatchWork::default()
    };
    cache::by_rates(&retests, bvh, config)
}

/// Tiles that are decoded at a time.
const DECODED_TILES: usize = 32;

/// Misses of the addresses in the trace, by eye and tile, for each choice of rays and the caches that they visit. The
/// trace is read once: tiles in order, left before right, pixels assigned to the units round robin.
///
/// # Errors
/// [`FrameError`] for an unreadable tile.
pub(super) fn misses_of(
    source: &dyn RaySource,
    frame: &Frame,
    choices: &[(&Kept<'_>, &SgrtConfig)],
) -> Result<Vec<[Vec<Misses>; 2]>, FrameError> {
    let bvh = &frame.tables.bvh;
    let decode = |&(tile, eye): &(u32, Eye)| {
        let mut data = RayTile::default();
        let decoded = source.tile(eye, tile, &mut data);
        decoded.map_err(|source| FrameError::Tile { eye, tile, source })?;
        Ok(data)
    };
    let mut runs = Vec::new();
    for (kept, config) in choices {
        check_lines(bvh, config)?;
        runs.push((kept, DeviceCaches::new(config), [Vec::new(), Vec::new()]));
    }
    let tiles =
        (0..frame.tables.tile_count()).flat_map(|tile| [(tile, Eye::Left), (tile, Eye::Right)]);
    for places in tiles.collect::<Vec<_>>().chunks(DECODED_TILES) {
        let decoded: Vec<Result<RayTile, FrameError>> = places.par_iter().map(decode).collect();
        let decoded = decoded.into_iter().collect::<Result<Vec<_>, _>>()?;
        runs.par_iter_mut().for_each(|(kept, caches, misses)| {
            for (&(tile, eye), data) in places.iter().zip(&decoded) {
                let is_kept = |sample, class| kept(eye, sample, class);
                let of_tile = misses_of_tile(frame, tile, data, is_kept, caches);
                misses[eye as usize].push(of_tile);
            }
        });
    }
    Ok(runs.into_iter().map(|(.., misses)| misses).collect())
}

fn misses_of_tile(
    frame: &Frame,
    tile: u32,
    data: &RayTile,
    is_kept: impl Fn(usize, RayClass) -> bool,
    caches: &mut DeviceCaches,
) -> Misses {
    let mut misses = Misses::default();
    let mut at = 0usize;
    let pixels = data.pixels.iter().zip(frame.tile_samples(tile));
    for (turn, (pixel, sample)) in pixels.enumerate() {
        for ray in data.rays_of(pixel) {
            let end = at.saturating_add(ray.visit_count() as usize);
            let visits = data.visits.get(at..end).unwrap_or(&[]);
            at = end;
            if is_kept(sample, RayClass::of(ray)) {
                for &visit in visits {
                    caches.visit(turn, visit, &frame.tables.bvh, &mut misses);
                }
            }
        }
    }
    misses
}

/// Misses of the addresses in the trace, with both eyes completely traced and with reprojection, by run and tile.
///
/// # Errors
/// [`FrameError`] for an unreadable tile.
pub(super) fn misses_by_addresses(
    source: &dyn RaySource,
    frame: &Frame,
    runs: &[(&RemainingWork, &SgrtConfig)],
) -> Result<Vec<Vec<TileMisses>>, FrameError> {
    let all: &Kept<'_> = &|_, _, _| true;
    let mut references: Vec<&SgrtConfig> = runs.iter().map(|(_, config)| *config).collect();
    references.dedup_by(|a, b| std::ptr::eq(*a, *b));
    let kept = runs
        .iter()
        .map(|(work, _)| |eye, sample, class| eye == Eye::Left || work.traces(sample, class));
    let kept: Vec<_> = kept.collect();
    let reprojected = kept
        .iter()
        .zip(runs)
        .map(|(kept, (_, config))| (kept as &Kept<'_>, *config));
    let choices = references.iter().map(|config| (all, *config));
    let misses = misses_of(
        source,
        frame,
        &choices.chain(reprojected).collect::<Vec<_>>(),
    )?;
    let (of_references, of_runs) = misses.split_at(references.len());
    let run =
        |((work, config), [left, right]): (&(&RemainingWork, &SgrtConfig), &[Vec<Misses>; 2])| {
            let reference = references.iter().position(|of| std::ptr::eq(*of, *config));
            let [left_full, right_full] = &of_references[reference.unwrap_or(0)];
            let tile = |(tile, work): (usize, &TileWork)| {
                let mut right = right[tile];
                right.add(&misses_of_retests(&work.right, &frame.tables.bvh, config));
                TileMisses {
                    left_full: left_full[tile],
                    right_full: right_full[tile],
                    left: left[tile],
                    right,
                }
            };
            work.tiles.iter().enumerate().map(tile).collect()
        };
    Ok(runs.iter().zip(of_runs).map(run).collect())
}

#[cfg(test)]
mod tests;
