//! Measures the run time and the error of faster methods.
//!
//! A *study* varies one choice and compares each possibility with a reference. It is a file here and a line
//! of [`STUDIES`].

mod captures;
mod closed_form;
mod clusters;
mod configurations;
mod encodings;
mod headline;
mod inputs;
mod interval;
mod metric;
mod reprojection;
mod samples;
mod stopwatch;
mod study;
mod techniques;
#[cfg(test)]
mod testing;
mod traversal;

pub use headline::{REUSE, Replays, headline_figures};
pub use inputs::{Inputs, Rays, TraversalRow};
pub use metric::Metric;
pub use study::{Choice, Contribution, Study, StudyError};

/// Every study, in the order of the page.
pub static STUDIES: &[Study] = &[
    captures::CAPTURE,
    encodings::ENCODING,
    configurations::MODE,
    configurations::LOD,
    configurations::LOOP,
    configurations::MODEL,
    configurations::FIRST_MISS_LOOP,
    closed_form::CLOSED_FORM,
    samples::SETS,
    samples::TILES,
    samples::FRAMES,
    reprojection::RULES,
    reprojection::REUSED,
    traversal::TRAVERSAL,
    techniques::TECHNIQUES,
];

#[cfg(test)]
mod tests {
    use super::testing::{inputs, small_trace};
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_study_of_a_texture_trace_yields_its_figures_and_its_recommendation() {
        let trace = small_trace();
        let inputs = inputs(&trace);
        for study in STUDIES {
            let choices = (study.measure)(&inputs).unwrap();
            let names: BTreeSet<&str> = choices.iter().map(|c| c.name.as_str()).collect();
            for choice in &choices {
                assert_eq!(choice.values.len(), study.figures.len(), "{}", study.key);
                assert!(!names.contains(study.reference), "{}", study.key);
            }
            let known = study.recommended == study.reference || names.contains(study.recommended);
            assert!(known || choices.is_empty(), "{}", study.key);
        }
    }

    #[test]
    fn keys_of_studies_are_unique() {
        let keys: BTreeSet<&str> = STUDIES.iter().map(|study| study.key).collect();
        assert_eq!(keys.len(), STUDIES.len());
    }
}
