//! Configurations that stand for others, and how far their figures are from theirs.

use crate::config::{LodFormula, Mode, Order, RunConfig};
use crate::engine::{ReplayError, replay};
use crate::result::RunResult;
use crate::stream::TileSource;
use crate::tmu::closed_form;
use std::time::{Duration, Instant};

/// What a variant's error is an error of, in the report's table of errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contribution {
    /// Functional or timed.
    Timing,
    /// Formula of the level of detail.
    Lod,
    /// Numbers of the cycle model that were calibrated.
    Calibration,
    /// Another cycle model.
    Model,
}

/// A configuration in place of another.
pub struct Variant {
    /// Which choice it is about.
    pub study: &'static str,
    /// What is chosen.
    pub name: &'static str,
    /// What of the headline figures' error it is; none where it is no choice of theirs.
    pub contribution: Option<Contribution>,
    /// What it stands for.
    pub reference: fn(RunConfig) -> RunConfig,
    /// The variant.
    pub config: fn(RunConfig) -> RunConfig,
}

fn timed(config: RunConfig) -> RunConfig {
    RunConfig {
        mode: Mode::Timed,
        ..config
    }
}

fn functional(config: RunConfig) -> RunConfig {
    RunConfig {
        mode: Mode::Functional,
        ..config
    }
}

fn lod(config: RunConfig, formula: LodFormula) -> RunConfig {
    let mut config = functional(config);
    config.sampling.lod = formula;
    config
}

fn looping(config: RunConfig, mode: Mode, cycles: u32) -> RunConfig {
    let mut config = RunConfig { mode, ..config };
    config.tmu.loop_cycles = cycles;
    config
}

const fn variant(
    study: &'static str,
    name: &'static str,
    contribution: Option<Contribution>,
    reference: fn(RunConfig) -> RunConfig,
    config: fn(RunConfig) -> RunConfig,
) -> Variant {
    Variant {
        study,
        name,
        contribution,
        reference,
        config,
    }
}

/// The variants. What was calibrated is moved as far as docs/tmu-model.md and
/// docs/paper-comparison.md say that it may be.
#[rustfmt::skip]
pub static VARIANTS: [Variant; 8] = {
    use Contribution::{Calibration, Lod, Model, Timing};
    [
        variant("mode", "functional for timed", Some(Timing), timed, functional),
        variant("lod", "fast logarithm for exact", Some(Lod), |c| lod(c, LodFormula::Exact), |c| lod(c, LodFormula::Llvmpipe)),
        variant("lod", "larger axis for exact", None, |c| lod(c, LodFormula::Exact), |c| lod(c, LodFormula::Softpipe)),
        variant("calibration", "loop 36 for 64", Some(Calibration), timed, |c| looping(c, Mode::Timed, 36)),
        variant("calibration", "loop 74 for 64", Some(Calibration), timed, |c| looping(c, Mode::Timed, 74)),
        variant("model", "first miss for timed", Some(Model), timed, |c| looping(c, Mode::FirstMiss, 24)),
        variant("model", "first miss, loop 20 for 24", None, |c| looping(c, Mode::FirstMiss, 24), |c| looping(c, Mode::FirstMiss, 20)),
        variant("model", "first miss, loop 28 for 24", None, |c| looping(c, Mode::FirstMiss, 24), |c| looping(c, Mode::FirstMiss, 28)),
    ]
};

/// A figure that has an error: key, name, unit of the error.
pub type ErrorFigure = (&'static str, &'static str, &'static str);

/// The headline figures.
pub const ERROR_FIGURES: [ErrorFigure; 6] = [
    ("external_bytes", "external bytes", "%"),
    ("l1_miss_pct", "L1 miss rate", "points"),
    ("l2_miss_pct", "L2 miss rate", "points"),
    ("reduction_pct", "saved against Morton", "points"),
    ("tmu_util_pct", "TMU utilisation", "points"),
    ("tmu_ratio", "TMU utilisation over Morton's", "%"),
];

/// How far a variant is from its reference on a trace.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Variant's error, figure by figure as in [`ERROR_FIGURES`]; the larger of both orders.
    pub errors: [Option<f64>; 6],
    /// Utilisation that the closed form gives for the variant's rates of first look-ups less its
    /// own, points, in Morton order; none where it counts no first look-ups.
    pub closed_form_points: Option<f64>,
    /// Time of the variant over the reference's; not part of what is the same everywhere.
    pub time_ratio: f64,
}

/// Replays a trace in both orders and says how long that took.
fn replayed(
    trace: &dyn TileSource,
    config: RunConfig,
) -> Result<([RunResult; 2], Duration), ReplayError> {
    let start = Instant::now();
    let of = |order| replay(trace, &RunConfig { order, ..config });
    let results = [of(Order::MORTON)?, of(Order::Z2_STA)?];
    Ok((results, start.elapsed()))
}

/// The figures of a pair of results, in Morton order and Z2 STA.
fn figures([morton, sta]: &[RunResult; 2]) -> [[Option<f64>; 2]; 6] {
    let both = |of: fn(&RunResult) -> f64| [Some(of(morton)), Some(of(sta))];
    let tmu = |result: &RunResult| Some(100.0 * result.tmu.as_ref()?.utilization);
    let saved = 1.0 - sta.external_bytes as f64 / (morton.external_bytes.max(1)) as f64;
    let ratio = tmu(sta).zip(tmu(morton)).map(|(sta, morton)| sta / morton);
    [
        both(|r| r.external_bytes as f64),
        both(|r| 100.0 * r.l1.miss_rate),
        both(|r| 100.0 * r.l2.miss_rate),
        [None, Some(100.0 * saved)],
        [tmu(morton), tmu(sta)],
        [None, ratio],
    ]
}

/// The error of a figure: relative where its unit is percent.
fn error(unit: &str, variant: f64, reference: f64) -> Option<f64> {
    match unit {
        "%" => (reference > 0.0).then(|| 100.0 * (variant / reference - 1.0)),
        _ => Some(variant - reference),
    }
}

/// Measures a variant on a trace under the caches of `base`.
///
/// # Errors
/// See [`replay`].
pub fn measure(
    trace: &dyn TileSource,
    base: RunConfig,
    variant: &Variant,
) -> Result<Measured, ReplayError> {
    let (reference, reference_time) = replayed(trace, (variant.reference)(base))?;
    let (results, time) = replayed(trace, (variant.config)(base))?;
    let (theirs, ours) = (figures(&reference), figures(&results));
    let mut errors = [None; 6];
    for (index, (_, _, unit)) in ERROR_FIGURES.iter().enumerate() {
        let pairs = ours[index].iter().zip(&theirs[index]);
        let found = pairs.filter_map(|(a, b)| error(unit, (*a)?, (*b)?));
        errors[index] = found.max_by(|a, b| a.abs().total_cmp(&b.abs()));
    }
    let [morton, _] = &results;
    let form = morton.first_lookups.zip(morton.tmu.as_ref());
    let form = form.map(|(first, tmu)| {
        100.0 * (closed_form(first.l1_miss_rate, first.l2_miss_rate) - tmu.utilization)
    });
    Ok(Measured {
        errors,
        closed_form_points: form,
        time_ratio: time.as_secs_f64() / reference_time.as_secs_f64().max(1e-9),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::CacheConfig;
    use crate::stream::synthetic::Synthetic;

    #[test]
    fn a_variant_that_is_its_reference_has_no_error_and_another_one_has_its_own() {
        let trace = Synthetic {
            size_px: [96, 96],
            patch_px: 24,
            materials: 4,
            ..Synthetic::default()
        }
        .generate();
        let base = RunConfig {
            l2: CacheConfig::lru(16 << 10),
            ..RunConfig::default()
        };
        let same = variant("mode", "itself", None, timed, timed);
        let found = measure(&trace, base, &same).unwrap();
        assert_eq!(found.errors, [Some(0.0); 6]);
        let found = measure(&trace, base, &VARIANTS[0]).unwrap();
        let [timed, functional] =
            [timed(base), functional(base)].map(|c| replayed(&trace, c).unwrap().0);
        let bytes = |r: &RunResult| r.external_bytes as f64;
        let by_order = [0, 1].map(|o| 100.0 * (bytes(&functional[o]) / bytes(&timed[o]) - 1.0));
        let largest = by_order
            .into_iter()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        assert_eq!(found.errors[0], largest);
        // Functional replay has no texture unit.
        assert_eq!(found.errors[4], None);
        assert_eq!(found.closed_form_points, None);
    }
}
