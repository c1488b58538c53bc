//! Error from the limited precision of captures: compares each capture with the reference of
//! `tracegen verify --write-reference`.

use super::configurations::functional;
use super::headline::TEXTURE_FIGURES;
use super::inputs::Inputs;
use super::study::{Choice, Contribution, Study, StudyError};
use crate::compare::comparable;
use crate::experiment::Subject;

pub const CAPTURE: Study = Study {
    key: "capture",
    title: "Capture precision",
    about: "Captures by drivers, which calculate in single precision and round, replayed in functional mode. Errors are against the reference in double precision.",
    time: "capture, over the reference's",
    reference: "double precision",
    recommended: "llvmpipe",
    reason: "its rounding has much less effect than timing and level of detail; softpipe serves as an independent check",
    figures: &TEXTURE_FIGURES,
    measure: captures,
};

fn captures(inputs: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    let config = functional(inputs.config);
    let mut choices = Vec::new();
    for truth in &inputs.truths {
        let of_views = |s: &&Subject<'_>| {
            comparable([truth.source.tables(), s.source.tables()]).is_ok()
                && s.source.tables().meta.scene == truth.source.tables().meta.scene
        };
        let captures: Vec<&Subject<'_>> = inputs.stills().chain(&inputs.captures).collect();
        let mut captures = captures.into_iter().filter(of_views).peekable();
        if captures.peek().is_none() {
            return Err(format!("{}: no capture of its views", truth.label).into());
        }
        let expected = inputs.replays.of(truth, config)?;
        for capture in captures {
            let name = driver(&capture.source.tables().meta.driver);
            let found = inputs.replays.of(capture, config)?;
            let seconds = |label: &str| {
                let mut times = inputs.seconds.iter();
                times.find(|(name, _)| name == label).map(|(_, s)| *s)
            };
            let times = seconds(&capture.label).zip(seconds(&truth.label));
            choices.push(Choice {
                // The error of the default driver counts as the error of the figures.
                contribution: (name == CAPTURE.recommended).then_some(Contribution::Capture),
                name: name.to_owned(),
                scene: scene(truth),
                time_ratio: times.map(|(ours, theirs)| ours / theirs.max(1e-9)),
                values: found.errors(&expected),
                ..Choice::default()
            });
        }
    }
    Ok(choices)
}

/// The rasteriser's name in the driver string.
fn driver(driver: &str) -> &str {
    ["llvmpipe", "softpipe"]
        .into_iter()
        .find(|name| driver.contains(name))
        .unwrap_or(driver)
}

fn scene(subject: &Subject<'_>) -> String {
    sim::result::scene_name(&subject.source.tables().meta.scene).to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{inputs, small_trace, subject};
    use super::*;
    use sim::stream::MemoryTrace;

    /// As captured by a driver, with texture coordinates changed by `off` steps.
    fn captured(trace: &MemoryTrace, driver: &str, off: i32) -> MemoryTrace {
        let mut trace = trace.clone();
        trace.tables.meta.driver = driver.to_owned();
        let records = trace.tiles.iter_mut().flatten();
        for record in records.flat_map(|tile| &mut tile.records) {
            record.uv[0] += off;
        }
        trace
    }

    #[test]
    fn a_capture_is_compared_with_the_truth_of_its_views_and_the_default_driver_counts() {
        let truth = small_trace();
        let exact = captured(&truth, "llvmpipe (LLVM 15)", 0);
        let off = captured(&truth, "softpipe", 5 * 2048);
        let mut inputs = inputs(&exact);
        inputs.subjects = vec![subject(&exact, "a")];
        inputs.captures = vec![subject(&off, "b")];
        inputs.truths = vec![subject(&truth, "truth")];
        inputs.seconds = vec![("a".into(), 2.0), ("truth".into(), 8.0)];
        let choices = captures(&inputs).unwrap();
        assert_eq!(choices[0].name, "llvmpipe");
        assert_eq!(choices[0].contribution, Some(Contribution::Capture));
        assert_eq!(
            (choices[0].values[0], choices[0].time_ratio),
            (Some(0.0), Some(0.25))
        );
        assert_eq!(
            (choices[1].name.as_str(), choices[1].contribution),
            ("softpipe", None)
        );
        assert!(choices[1].values[0].unwrap().abs() > 0.0, "{choices:?}");
    }

    #[test]
    fn a_truth_of_other_views_is_refused() {
        let (trace, mut other) = (small_trace(), small_trace());
        other.tables.passes[0].size_px = [8, 8];
        let mut inputs = inputs(&trace);
        inputs.truths = vec![subject(&other, "other")];
        let error = captures(&inputs).unwrap_err().to_string();
        assert_eq!(error, "other: no capture of its views");
    }
}
