//! The work and the cache misses of each tile, with both eyes completely traced and with reprojection.

use super::cache::{self, DeviceCaches, Misses};
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::detect::Decision;
use super::energy_bounds::relative_bounds;
use super::frame::{Frame, FrameError, RaySource};
use super::ray_sort::{self, RaySort};
use super::run::Run;
use super::tile_orders::usual_plan;
use super::ways::Way;
use super::work::{BatchWork, RayClass};
use formats::raytrace::{BvhSummary, RayGeometry, RayRecord, RayTile, Visit};
use formats::view::Eye;
use rayon::prelude::*;
use sim::order::rays::{RayPlan, eye_of, tiles_of};
use sim::order::{TileRef, WorkItem};

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

impl TileMisses {
    /// Those of an eye's tile in a way.
    pub(super) fn of(&self, way: Way, at: TileRef) -> Misses {
        match (way, eye_of(at)) {
            (Way::Reference, Eye::Left) => self.left_full,
            (Way::Reference, Eye::Right) => self.right_full,
            (_, Eye::Left) => self.left,
            (_, Eye::Right) => self.right,
        }
    }
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

/// Whether a sort needs the geometry of rays.
///
/// # Errors
/// [`FrameError`] for a trace without.
pub(super) fn check_sort(source: &dyn RaySource, sort: RaySort) -> Result<bool, FrameError> {
    let needed = sort.row().needs_geometry;
    if needed && !source.has_geometry() {
        return Err(FrameError::NoColumns("tni.ray_sort", sort.name()));
    }
    Ok(needed)
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

/// Batches that are decoded at a time.
const DECODED_BATCHES: usize = 32;

/// The tiles of a batch, with the geometry of their rays if it is needed.
///
/// # Errors
/// [`FrameError`] for an unreadable tile.
pub(super) fn decoded(
    source: &dyn RaySource,
    batch: &[WorkItem],
    needs_geometry: bool,
) -> Result<Vec<RayTile>, FrameError> {
    let decode = |at: TileRef| {
        let (eye, tile) = (eye_of(at), at.tile);
        let mut data = RayTile::default();
        let decoded = if needs_geometry {
            source.tile_with_geometry(eye, tile, &mut data)
        } else {
            source.tile(eye, tile, &mut data)
        };
        decoded.map_err(|source| FrameError::Tile { eye, tile, source })?;
        Ok(data)
    };
    tiles_of(batch).map(decode).collect()
}

/// Misses of the addresses in the trace, by eye and tile, for each choice of rays in caches of its own. The trace is read
/// once, in the order of `plan`.
///
/// # Errors
/// [`FrameError`] for an unreadable tile.
pub(super) fn misses_of(
    source: &dyn RaySource,
    frame: &Frame,
    plan: &RayPlan,
    choices: &[(&Kept<'_>, &SgrtConfig)],
    caches: &mut [&mut DeviceCaches],
) -> Result<Vec<[Vec<Misses>; 2]>, FrameError> {
    let mut needs_geometry = false;
    for (_, config) in choices {
        check_lines(&frame.tables.bvh, config)?;
        needs_geometry |= check_sort(source, config.tni.ray_sort)?;
    }
    let none = vec![Misses::default(); frame.tables.tile_count() as usize];
    let mut found = vec![[none.clone(), none]; choices.len()];
    let batches: Vec<&[WorkItem]> = plan.batches().collect();
    for batches in batches.chunks(DECODED_BATCHES) {
        let tiles: Vec<Result<Vec<RayTile>, FrameError>> = (batches
            .par_iter()
            .map(|batch| decoded(source, batch, needs_geometry)))
        .collect();
        let tiles = tiles.into_iter().collect::<Result<Vec<_>, _>>()?;
        let runs = caches.par_iter_mut().zip(&mut found).zip(choices);
        runs.for_each(|((caches, found), (kept, config))| {
            for (batch, tiles) in batches.iter().zip(&tiles) {
                for_rays(frame, plan, config, batch, tiles, |of| {
                    if kept(eye_of(of.at), of.sample, RayClass::of(of.ray)) {
                        caches.tile = of.at.tile;
                        let misses = &mut found[of.at.pass as usize][of.at.tile as usize];
                        for &visit in of.visits {
                            caches.visit(of.unit, visit, &frame.tables.bvh, misses);
                        }
                    }
                });
            }
        });
    }
    Ok(found)
}

/// The same for choices with empty caches, in the default order.
///
/// # Errors
/// As [`misses_of`].
pub(super) fn misses_in_usual_order(
    source: &dyn RaySource,
    frame: &Frame,
    choices: &[(&Kept<'_>, &SgrtConfig)],
) -> Result<Vec<[Vec<Misses>; 2]>, FrameError> {
    let empty = choices.iter().map(|(_, config)| DeviceCaches::new(config));
    let mut caches: Vec<DeviceCaches> = empty.collect();
    let mut caches: Vec<&mut DeviceCaches> = caches.iter_mut().collect();
    let plan = usual_plan(&frame.tables);
    misses_of(source, frame, &plan, choices, &mut caches)
}

/// A ray in its turn.
#[derive(Clone, Copy)]
pub(super) struct RayTurn<'a> {
    pub at: TileRef,
    /// Its pixel in the eye's image.
    pub sample: usize,
    /// The unit that traces it, to be taken modulo the units.
    pub unit: usize,
    pub ray: &'a RayRecord,
    /// True for the first ray of its pixel.
    pub is_first: bool,
    pub visits: &'a [Visit],
    /// None if the tile was decoded without.
    pub geometry: Option<&'a RayGeometry>,
}

/// Calls `visit` for each ray of a batch, or for each part of a ray that waits between its parts, in the order of `plan`
/// and of the configured sort.
pub(super) fn for_rays(
    frame: &Frame,
    plan: &RayPlan,
    config: &SgrtConfig,
    batch: &[WorkItem],
    tiles: &[RayTile],
    visit: impl FnMut(RayTurn<'_>),
) {
    let sort = config.tni.ray_sort;
    if sort == ray_sort::none() {
        return for_rays_of_pixels(frame, plan, batch, tiles, visit);
    }
    let mut turns = Vec::new();
    for_rays_of_pixels(frame, plan, batch, tiles, |turn| turns.push(turn));
    let caches = (&frame.tables.bvh, config.cache.node_l1_bytes);
    let turns = ray_sort::sort(sort, turns, caches);
    turns.into_iter().for_each(visit);
}

fn for_rays_of_pixels<'a>(
    frame: &Frame,
    plan: &RayPlan,
    batch: &[WorkItem],
    tiles: &'a [RayTile],
    mut visit: impl FnMut(RayTurn<'a>),
) {
    let places: Vec<TileRef> = tiles_of(batch).collect();
    let pixels: Vec<usize> = tiles.iter().map(|tile| tile.pixels.len()).collect();
    let first_visits: Vec<Vec<usize>> = tiles.iter().map(first_visits).collect();
    let samples = places.iter().map(|at| frame.tile_samples(at.tile));
    let samples: Vec<Vec<usize>> = samples.map(Iterator::collect).collect();
    for turn in plan.turns(batch, &pixels) {
        let data = &tiles[turn.tile];
        let Some(&sample) = samples[turn.tile].get(turn.pixel) else {
            continue;
        };
        let mut first = first_visits[turn.tile][turn.pixel];
        let pixel = &data.pixels[turn.pixel];
        for (number, ray) in data.rays_of(pixel).iter().enumerate() {
            let end = first.saturating_add(ray.visit_count() as usize);
            visit(RayTurn {
                at: places[turn.tile],
                sample,
                unit: turn.unit,
                ray,
                is_first: number == 0,
                visits: data.visits.get(first..end).unwrap_or(&[]),
                geometry: data.geometry.get(pixel.first_ray as usize + number),
            });
            first = end;
        }
    }
}

/// The position of each pixel's first visit.
fn first_visits(tile: &RayTile) -> Vec<usize> {
    let mut next = 0usize;
    let first = |pixel| {
        let own = next;
        let visits = tile.rays_of(pixel).iter().map(RayRecord::visit_count);
        next = next.saturating_add(visits.sum::<u64>() as usize);
        own
    };
    tile.pixels.iter().map(first).collect()
}

/// Misses of the addresses in the trace, with both eyes completely traced and with reprojection, by run and tile. `count`
/// returns those of each choice of rays, the references first.
///
/// # Errors
/// Errors of `count`.
pub(super) fn misses_by_addresses(
    frame: &Frame,
    runs: &[(&RemainingWork, &SgrtConfig)],
    count: impl FnOnce(&[(&Kept<'_>, &SgrtConfig)]) -> Result<Vec<[Vec<Misses>; 2]>, FrameError>,
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
    let misses = count(&choices.chain(reprojected).collect::<Vec<_>>())?;
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
