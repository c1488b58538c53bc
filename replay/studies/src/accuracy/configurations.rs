//! Studies that compare configurations of the replay. A choice is one line here.

use super::headline::TEXTURE_FIGURES;
use super::inputs::{Inputs, time_ratio};
use super::study::{Choice, Contribution, Study, StudyError};
use sim::config::{LodFormula, Mode, RunConfig, TmuModel};

/// A named configuration.
struct Variant {
    name: &'static str,
    contribution: Option<Contribution>,
    config: fn(RunConfig) -> RunConfig,
}

const fn variant(
    name: &'static str,
    contribution: Option<Contribution>,
    config: fn(RunConfig) -> RunConfig,
) -> Variant {
    Variant {
        name,
        contribution,
        config,
    }
}

/// Replays every single-frame trace with the reference and with each variant.
fn measured(
    inputs: &Inputs<'_>,
    reference: fn(RunConfig) -> RunConfig,
    variants: &[Variant],
) -> Result<Vec<Choice>, StudyError> {
    let mut choices = Vec::new();
    for subject in inputs.stills() {
        let expected = inputs.replays.of(subject, reference(inputs.config))?;
        for variant in variants {
            let found = inputs
                .replays
                .of(subject, (variant.config)(inputs.config))?;
            choices.push(Choice {
                name: variant.name.to_owned(),
                scene: subject.label.clone(),
                contribution: variant.contribution,
                time_ratio: Some(time_ratio(found.time, expected.time)),
                values: found.errors(&expected),
                ..Choice::default()
            });
        }
    }
    Ok(choices)
}

fn timed(config: RunConfig) -> RunConfig {
    looping(config, TmuModel::Looping, config.tmu.loop_cycles)
}

pub(super) fn functional(config: RunConfig) -> RunConfig {
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

/// A model whose threads return to the first stage after this many cycles.
pub(super) fn looping(mut config: RunConfig, model: TmuModel, cycles: u32) -> RunConfig {
    config.mode = Mode::Timed;
    (config.tmu.model, config.tmu.loop_cycles) = (model, cycles);
    config
}

const REPLAY_TIME: &str = "replay, over the reference's";

pub(super) const MODE: Study = Study {
    key: "mode",
    title: "Functional or timed",
    about: "Caches without latencies instead of the cycle model. Errors are against the timed replay.",
    time: REPLAY_TIME,
    reference: "timed",
    recommended: "functional",
    reason: "faster, with the same bytes and miss rates unless a cache set is crowded, as by linear shadow maps: there, timed replay counts fewer bytes because misses in flight occupy no way. Utilisation and cycles need timed replay",
    figures: &TEXTURE_FIGURES,
    measure: |inputs| {
        let variants = [variant(
            "functional",
            Some(Contribution::Timing),
            functional,
        )];
        measured(inputs, timed, &variants)
    },
};

pub const LOD: Study = Study {
    key: "lod",
    title: "Level of detail",
    about: "Formulas for levels from derivatives, in functional mode. Errors are against the exact logarithm of each lane's own derivatives.",
    time: REPLAY_TIME,
    reference: "exact logarithm, per lane",
    recommended: "fast logarithm, per quad",
    reason: "used by such hardware and by the capturing driver; the logarithm has no effect, and one level per quad changes fewer bytes than timing does",
    figures: &TEXTURE_FIGURES,
    measure: |inputs| {
        let variants = [
            variant("fast logarithm, per quad", Some(Contribution::Lod), |c| {
                lod(c, LodFormula::Llvmpipe)
            }),
            variant("exact logarithm, per quad", None, |c| {
                lod(c, LodFormula::Exact)
            }),
            variant("larger axis, per quad", None, |c| {
                lod(c, LodFormula::Softpipe)
            }),
        ];
        measured(inputs, |c| lod(c, LodFormula::PerLane), &variants)
    },
};

/// The range of loop lengths that docs/models/texture-unit.md allows.
pub(super) const LOOP: Study = Study {
    key: "loop",
    title: "Calibrated loop of the cycle model",
    about: "Cycles until a thread that missed tries again, at both ends of the calibrated range. Errors are against 64 cycles.",
    time: REPLAY_TIME,
    reference: "64 cycles",
    recommended: "64 cycles",
    reason: "the middle of the calibrated range; its ends change utilisation by two to three points, and bytes by hundredths of a per cent",
    figures: &TEXTURE_FIGURES,
    measure: |inputs| {
        let calibration = Some(Contribution::Calibration);
        let variants = [
            variant("36 cycles", calibration, |c| {
                looping(c, TmuModel::Looping, 36)
            }),
            variant("74 cycles", calibration, |c| {
                looping(c, TmuModel::Looping, 74)
            }),
        ];
        measured(inputs, |c| looping(c, TmuModel::Looping, 64), &variants)
    },
};

pub const MODEL: Study = Study {
    key: "model",
    title: "Cycle model",
    about: "Threads that stop at their first miss (the machine of --preset z2-paper) instead of threads that go on. Errors are against the latter.",
    time: REPLAY_TIME,
    reference: "primary misses",
    recommended: "primary misses",
    reason: "its misses are real traffic; it is unknown which model's level of utilisation is right, so rely on ratios of utilisation rather than on its level",
    figures: &TEXTURE_FIGURES,
    measure: |inputs| {
        let model = Some(Contribution::Model);
        let variants = [variant("first miss", model, |c| {
            looping(c, TmuModel::FirstMiss, 24)
        })];
        measured(inputs, timed, &variants)
    },
};

/// The range of loop lengths that docs/models/z2.md allows.
pub(super) const FIRST_MISS_LOOP: Study = Study {
    key: "first-miss-loop",
    title: "Calibrated loop of the first-miss model",
    about: "The same for threads that stop at their first miss. Errors are against 24 cycles.",
    time: REPLAY_TIME,
    reference: "24 cycles",
    recommended: "24 cycles",
    reason: "found by search on half of the paper's scenes; neighbouring values change utilisation by three points, and bytes by less than a tenth of a per cent",
    figures: &TEXTURE_FIGURES,
    measure: |inputs| {
        let variants = [
            variant("20 cycles", None, |c| looping(c, TmuModel::FirstMiss, 20)),
            variant("28 cycles", None, |c| looping(c, TmuModel::FirstMiss, 28)),
        ];
        measured(inputs, |c| looping(c, TmuModel::FirstMiss, 24), &variants)
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{inputs, small_trace};
    use super::*;
    use sim::config::Order;
    use sim::engine::replay;

    #[test]
    fn the_reference_has_no_error_and_another_variant_has_one() {
        let trace = small_trace();
        let inputs = inputs(&trace);
        let same = measured(&inputs, timed, &[variant("itself", None, timed)]).unwrap();
        assert_eq!(same[0].values, [Some(0.0); 6]);
        let found = &(MODE.measure)(&inputs).unwrap()[0];
        let bytes = |config: RunConfig, order| {
            let result = replay(&trace, &RunConfig { order, ..config }).unwrap();
            result.external_bytes as f64
        };
        let by_order = [Order::MORTON, Order::Z2_STA].map(|order| {
            let config = inputs.config;
            100.0 * (bytes(functional(config), order) / bytes(timed(config), order) - 1.0)
        });
        let largest = by_order
            .into_iter()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        assert_eq!(found.values[0], largest);
        // Functional replay has no texture unit.
        assert_eq!(found.values[4], None);
    }
}
