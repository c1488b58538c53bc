//! Utilisation from a formula instead of a cycle model.

use super::configurations::{functional, looping};
use super::inputs::{Inputs, time_ratio};
use super::metric::{Metric, metric};
use super::study::{Choice, Study, StudyError};
use sim::config::TmuModel;
use sim::result::RunResult;
use sim::tmu::closed_form;

const FIGURES: [Metric; 1] = [metric("tmu_util_pct", "TMU utilisation", "points")];

pub(super) const CLOSED_FORM: Study = Study {
    key: "closed-form",
    title: "Closed form instead of a cycle model",
    about: "Utilisation from the surface through the paper's table: at the rates of first look-ups, as the paper counts, and at the rates of a functional replay. Errors are against the first-miss model.",
    time: "replay, over the first-miss model's",
    reference: "first-miss model",
    recommended: "first-miss model",
    reason: "the formula is accurate only at the model's own rates, so it saves no time; at other rates, its error exceeds the differences between orders",
    figures: &FIGURES,
    measure: forms,
};

fn forms(inputs: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    let mut choices = Vec::new();
    for subject in inputs.stills() {
        let of = |config| inputs.replays.of(subject, config);
        let model = of(looping(inputs.config, TmuModel::FirstMiss, 24))?;
        let functional = of(functional(inputs.config))?;
        let first = |r: &RunResult| {
            r.first_lookups
                .map(|f| (f.l1_footprint_miss_rate, f.l2_line_miss_rate))
        };
        let all = |r: &RunResult| Some((r.l1.footprint_miss_rate, r.l2.line_miss_rate));
        for (name, rates, from) in [
            ("at first look-ups", first as fn(&RunResult) -> _, &model),
            ("at functional rates", all, &functional),
        ] {
            let points = |(ours, theirs): (&RunResult, &RunResult)| {
                let (l1, l2) = rates(ours)?;
                Some(100.0 * (closed_form(l1, l2) - theirs.tmu.as_ref()?.utilization))
            };
            let found = from.results.iter().zip(&model.results).filter_map(points);
            choices.push(Choice {
                name: name.to_owned(),
                scene: subject.label.clone(),
                time_ratio: Some(time_ratio(from.time, model.time)),
                values: vec![found.max_by(|a, b| a.abs().total_cmp(&b.abs()))],
                ..Choice::default()
            });
        }
    }
    Ok(choices)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{inputs, small_trace};
    use super::*;

    #[test]
    fn the_closed_form_is_more_accurate_at_the_rates_it_was_fitted_to() {
        let trace = small_trace();
        let choices = forms(&inputs(&trace)).unwrap();
        let [first, functional] = &choices[..] else {
            panic!("{choices:?}");
        };
        let error = |choice: &Choice| choice.values[0].unwrap().abs();
        assert!(
            error(first) > 0.0 && error(first) < error(functional),
            "{choices:?}"
        );
    }
}
