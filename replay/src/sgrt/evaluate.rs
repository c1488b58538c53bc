//! A frame through the whole model: both eyes traced in full, and with reprojection.
//!
//! The units and the cores form a pipeline over tiles: while the units trace a tile, the cores
//! shade the one before, so a batch (a tile of one eye) takes the slower of the two and a frame
//! the sum over its batches.

use super::cache::{self, Hierarchy, Misses};
use super::compose::Reuse;
use super::config::SgrtConfig;
use super::energy::{self, Activity, EnergyPj};
use super::frame::{Frame, FrameError, RaySource};
use super::gbuffer::{self, Traffic};
use super::reject::Decision;
use super::srp::{self, SrpCycles};
use super::tni::{self, TniCycles};
use super::work::{BatchWork, RayClass};
use formats::raytrace::RayTile;
use formats::view::Eye;
use rayon::prelude::*;

/// One way of rendering the frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    /// Work of all batches.
    pub work: BatchWork,
    /// Misses of all batches.
    pub misses: Misses,
    /// Unit cycles by resource, summed over batches.
    pub tni: TniCycles,
    /// Unit cycles: the scarcest resource of each batch, summed.
    pub tni_cycles: f64,
    /// Kernel cycles.
    pub srp: SrpCycles,
    /// Time of the frame.
    pub time_ns: f64,
    /// G-buffer traffic of this way.
    pub gbuffer: Traffic,
    /// Energy by component.
    pub energy: EnergyPj,
}

/// Both ways, and the right eye's share.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evaluation {
    /// Both eyes traced in full.
    pub reference: Run,
    /// With reprojection, tile by tile.
    pub reprojected: Run,
    /// G-buffer traffic if the whole screen's were in DRAM.
    pub whole_screen: Traffic,
    /// Energy of reprojection with the G-buffer in DRAM.
    pub whole_screen_energy_pj: f64,
    /// Unit cycles of the right eye traced in full.
    pub right_full_tni_cycles: f64,
    /// Unit cycles of the right eye with reprojection.
    pub right_tni_cycles: f64,
}

impl Evaluation {
    /// Frames per second over the reference's.
    #[must_use]
    pub fn relative_performance(&self) -> f64 {
        self.reference.time_ns / self.reprojected.time_ns
    }

    /// Energy over the reference's.
    #[must_use]
    pub fn relative_energy(&self) -> f64 {
        self.reprojected.energy.total() / self.reference.energy.total()
    }
}

/// Work of every tile: left, right in full, right with reprojection.
#[derive(Clone, Debug)]
pub struct TileWork {
    /// By tile number.
    pub tiles: Vec<[BatchWork; 3]>,
}

/// Sums each tile's work under a decision and a level of reuse.
#[must_use]
pub fn tile_work(frame: &Frame, decisions: &[Decision], reuse: Reuse) -> TileWork {
    let tiles = (0..frame.tables.tile_count())
        .into_par_iter()
        .map(|tile| {
            let [mut left, mut full, mut right] = [BatchWork::default(); 3];
            for i in frame.tile_samples(tile) {
                left.add_traced(&frame.left().work[i]);
                left.reprojected += 1;
                full.add_traced(&frame.right().work[i]);
                add_right(frame, &decisions[i], i, reuse, &mut right);
            }
            [left, full, right]
        })
        .collect();
    TileWork { tiles }
}

fn add_right(frame: &Frame, decision: &Decision, i: usize, reuse: Reuse, batch: &mut BatchWork) {
    let pixel = &frame.right().work[i];
    batch.detected += 1;
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
    if !(reuse == Reuse::Color && looks_alike) {
        batch.shaded += 1 + u64::from(pixel.secondary_shaded);
    }
}

/// True where rays of a class are traced for a right sample.
fn is_traced(decision: &Decision, class: RayClass, reuse: Reuse) -> bool {
    match class {
        _ if !decision.class.is_reused() => true,
        RayClass::Primary => false,
        RayClass::Shadow => reuse == Reuse::Primary,
        RayClass::Secondary => true,
    }
}

/// Misses of every tile's batches: left and right of the reference, left and right reprojected.
pub type TileMisses = Vec<[Misses; 4]>;

/// Misses by the configuration's hit rates.
#[must_use]
pub fn misses_by_rates(work: &TileWork, frame: &Frame, config: &SgrtConfig) -> TileMisses {
    let of = |batch: &BatchWork| cache::by_rates(batch, &frame.tables.bvh, config);
    let tile = |[left, full, right]: &[BatchWork; 3]| [of(left), of(full), of(left), of(right)];
    work.tiles.par_iter().map(tile).collect()
}

/// Misses of the addresses that the trace lists, through the configuration's caches: tiles in
/// order, left before right, pixels of a tile over the units in turn. A re-test's triangle counts
/// by hit rate, since its address is not in the trace.
///
/// # Errors
/// [`FrameError`] where a tile cannot be read.
pub fn misses_by_addresses(
    source: &dyn RaySource,
    frame: &Frame,
    decisions: &[Decision],
    reuse: Reuse,
    work: &TileWork,
    config: &SgrtConfig,
) -> Result<TileMisses, FrameError> {
    let bvh = &frame.tables.bvh;
    let mut caches = [Hierarchy::new(config), Hierarchy::new(config)];
    let mut tile_data = RayTile::default();
    let mut out = vec![[Misses::default(); 4]; work.tiles.len()];
    for (tile, misses) in (0u32..).zip(&mut out) {
        for (eye, eye_index) in [(Eye::Left, 0), (Eye::Right, 1)] {
            source
                .tile(eye, tile, &mut tile_data)
                .map_err(|source| FrameError::Tile { eye, tile, source })?;
            let mut at = 0usize;
            for (turn, (pixel, i)) in tile_data
                .pixels
                .iter()
                .zip(frame.tile_samples(tile))
                .enumerate()
            {
                for ray in tile_data.rays_of(pixel) {
                    let end = at.saturating_add(ray.visit_count() as usize);
                    let visits = tile_data.visits.get(at..end).unwrap_or(&[]);
                    at = end;
                    let kept =
                        eye == Eye::Left || is_traced(&decisions[i], RayClass::of(ray), reuse);
                    for &visit in visits {
                        caches[0].visit(turn, visit, bvh, &mut misses[eye_index]);
                        if kept {
                            caches[1].visit(turn, visit, bvh, &mut misses[2 + eye_index]);
                        }
                    }
                }
            }
        }
        let retests = BatchWork {
            retest_tests: work.tiles[tile as usize][2].retest_tests,
            ..BatchWork::default()
        };
        misses[3].add(&cache::by_rates(&retests, bvh, config));
    }
    Ok(out)
}

/// Runs both ways through the unit, core and energy models.
#[must_use]
pub fn evaluate(
    frame: &Frame,
    work: &TileWork,
    misses: &TileMisses,
    config: &SgrtConfig,
) -> Evaluation {
    let mut reference = Accumulator::new(config);
    let mut reprojected = Accumulator::new(config);
    let (mut right_full, mut right) = (0.0, 0.0);
    for ([left, full, reused], m) in work.tiles.iter().zip(misses) {
        let plain_left = BatchWork {
            reprojected: 0,
            ..*left
        };
        reference.add(&plain_left, &m[0]);
        right_full += reference.add(full, &m[1]);
        reprojected.add(left, &m[2]);
        right += reprojected.add(reused, &m[3]);
    }
    let counts = gbuffer::Counts {
        left: reprojected.run.work.reprojected,
        right: reprojected.run.work.detected,
        reused: reprojected.run.work.reused,
    };
    let tiled = gbuffer::tiled(counts, &config.gbuffer);
    let screen = gbuffer::whole_screen(counts, &config.gbuffer);
    let finish = |run: Run, traffic| finish(run, traffic, frame, config);
    Evaluation {
        reference: finish(reference.run, Traffic::default()),
        whole_screen_energy_pj: finish(reprojected.run, screen).energy.total(),
        reprojected: finish(reprojected.run, tiled),
        whole_screen: screen,
        right_full_tni_cycles: right_full,
        right_tni_cycles: right,
    }
}

struct Accumulator<'a> {
    config: &'a SgrtConfig,
    run: Run,
}

impl<'a> Accumulator<'a> {
    fn new(config: &'a SgrtConfig) -> Self {
        Self {
            config,
            run: Run::default(),
        }
    }

    /// Adds a batch and returns its unit cycles.
    fn add(&mut self, work: &BatchWork, misses: &Misses) -> f64 {
        let tni = tni::cycles(work, misses, self.config);
        let srp = srp::cycles(work, self.config);
        let run = &mut self.run;
        run.work.add(work);
        run.misses.add(misses);
        run.tni.add(&tni);
        run.tni_cycles += tni.total();
        run.srp.add(&srp);
        let tni_ns = tni.total() * 1e3 / self.config.tni.clock_mhz;
        let srp_ns = srp.total() * 1e3 / self.config.srp.clock_mhz;
        run.time_ns += tni_ns.max(srp_ns);
        tni.total()
    }
}

fn finish(mut run: Run, gbuffer: Traffic, frame: &Frame, config: &SgrtConfig) -> Run {
    run.gbuffer = gbuffer;
    let pixels = u64::from(frame.size_px[0]) * u64::from(frame.size_px[1]);
    let activity = Activity {
        work: &run.work,
        misses: &run.misses,
        srp: &run.srp,
        gbuffer,
        frame_buffer_px: 2 * pixels,
        time_ns: run.time_ns,
    };
    run.energy = energy::energy(&activity, &frame.tables.bvh, config);
    run
}

#[cfg(test)]
mod tests;
