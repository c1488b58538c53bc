//! Warnings about results that are right but say little. They go to standard error.

use sim::config::{RunConfig, TmuModel};
use sim::preset::Preset;
use sim::result::RunResult;
use sim::stream::TileSource;
use studies::experiment::{Outcome, Plan, Subject};

/// Pictures of which less than this share is covered are warned of, percent.
const LEAST_COVERED_PCT: f64 = 20.0;

/// A replay of a trace.
pub(super) type Replay<'a> = (&'a Subject<'a>, &'a RunConfig, &'a RunResult);

/// Warns of the results of an experiment.
pub(super) fn of_outcome(outcome: &Outcome<'_>) {
    of_first_miss_bytes(outcome.plan);
    let rows = outcome.rows();
    let replays = rows
        .iter()
        .map(|row| (row.subject, &row.point.config, row.result));
    of_replays(outcome.subjects, &replays.collect::<Vec<_>>());
}

/// Warns of traces whose traffic no order or cache can reduce, and of traces with few covered pixels.
pub(super) fn of_replays(subjects: &[Subject<'_>], replays: &[Replay<'_>]) {
    let named = |is_bad: &dyn Fn(&[&Replay<'_>]) -> bool| {
        let of_subject = |subject: &&Subject<'_>| {
            let own = replays
                .iter()
                .filter(|(of, ..)| std::ptr::eq(*of, *subject));
            let own: Vec<_> = own.collect();
            !own.is_empty() && is_bad(&own)
        };
        let bad = subjects.iter().filter(of_subject);
        bad.map(|subject| subject.label.as_str())
            .collect::<Vec<_>>()
    };
    of_bound(&named(&|own| {
        own.iter()
            .all(|(_, config, result)| is_bound(config, result))
    }));
    let few = named(&|own| {
        let covered = own
            .first()
            .and_then(|(subject, _, result)| most_covered_pct(subject.source, result.lanes));
        covered.is_some_and(|covered| covered < LEAST_COVERED_PCT)
    });
    if !few.is_empty() {
        shell::warn(&format!(
            "{}: less than {LEAST_COVERED_PCT} % of the pixels are covered, so the figures are those of a small part of the \
             picture; capture a view from inside the scene",
            few.join(", ")
        ));
    }
}

/// Warns of traces whose external traffic is the compulsory minimum in every order.
pub(super) fn of_bound(labels: &[&str]) {
    if !labels.is_empty() {
        shell::warn(&format!(
            "{}: the caches fetch each distinct line once in every order replayed, so no order can fetch less; use a \
             smaller L2 or a larger picture to compare orders",
            labels.join(", ")
        ));
    }
}

/// Whether the external traffic is that of an infinite cache. Unknown, and so false, if a level has longer lines.
fn is_bound(config: &RunConfig, result: &RunResult) -> bool {
    let line_bytes = config.line_bytes;
    let last = config.level.named(line_bytes).last();
    last.is_some_and(|(.., of_last)| of_last == line_bytes)
        && result.unique_lines > 0
        && result.external_bytes <= result.unique_lines * u64::from(line_bytes)
}

/// The largest share of the pixels that can be covered, percent: pixels with several surfaces count several times.
fn most_covered_pct(source: &dyn TileSource, lanes: u64) -> Option<f64> {
    let seen = source.tables().passes.iter().filter(|pass| pass.is_seen());
    let pixels: u64 = seen
        .map(|pass| u64::from(pass.size_px[0]) * u64::from(pass.size_px[1]))
        .sum();
    (pixels > 0).then(|| 100.0 * lanes as f64 / pixels as f64)
}

/// Warns of memory traffic of the first-miss model on a machine other than the Z2 paper's.
fn of_first_miss_bytes(plan: &Plan) {
    let mut others = plan.points.iter().filter_map(|point| {
        let config = &point.config;
        let changed = Preset::Z2_PAPER.changed_in(config);
        (config.tmu_model() == Some(TmuModel::FirstMiss) && !changed.is_empty()).then_some(changed)
    });
    if let Some(changed) = others.next() {
        shell::warn(&format!(
            "the first-miss model, but not the machine of --preset z2-paper ({} differs): external bytes count every \
             fetch from memory, also of lines that were replaced before the waiting thread used them. They can be several \
             times the memory traffic of --tmu looping; use --tmu looping for memory traffic",
            changed.join(", ")
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::config::{LevelConfig, Levels, Mode, Order};
    use sim::engine::replay;
    use sim::stream::testing::Synthetic;

    #[test]
    fn a_cache_that_holds_everything_is_at_the_bound_and_a_small_one_is_not() {
        let trace = Synthetic::one_layer([128, 128], 120).generate();
        let config = |l2_bytes| RunConfig {
            mode: Mode::Functional,
            order: Order::Z2_STA,
            level: Levels::two(LevelConfig::lru(1 << 10), LevelConfig::lru(l2_bytes)),
            ..RunConfig::default()
        };
        let at_bound = |l2_bytes| {
            is_bound(
                &config(l2_bytes),
                &replay(&trace, &config(l2_bytes)).unwrap(),
            )
        };
        assert!(at_bound(64 << 20));
        assert!(!at_bound(1 << 10));
    }

    #[test]
    fn the_share_of_covered_pixels_is_of_the_pictures() {
        let trace = Synthetic::one_layer([64, 64], 120).generate();
        assert_eq!(trace.tables.passes.len(), 2);
        assert_eq!(most_covered_pct(&trace, 2 * 64 * 64 / 4), Some(25.0));
    }
}
