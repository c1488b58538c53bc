//! Study of rendering techniques, from the measurements of `tracegen techniques`.

use super::inputs::Inputs;
use super::metric::{Metric, metric};
use super::study::{Choice, Study, StudyError};
use crate::techniques::{Timing, picture_figures};
use sim::result::scene_name;

const FIGURES: [Metric; 2] = [
    metric("flip_mean", "mean FLIP", ""),
    metric("flip_p99", "mean of the pictures' 99th percentiles", ""),
];

pub const TECHNIQUES: Study = Study {
    key: "techniques",
    title: "Rendering techniques",
    about: "Work that a frame may skip or do at lower quality. Errors are against each eye rendered in full; docs/models/techniques.md describes all figures.",
    time: "frame through the capturing rasteriser, over the baseline's (median)",
    reference: "per-eye",
    recommended: "per-eye",
    reason: "time and image quality must be weighed; hollow points are dominated and never the right choice",
    figures: &FIGURES,
    measure: measured,
};

fn measured(inputs: &Inputs<'_>) -> Result<Vec<Choice>, StudyError> {
    let mut choices = Vec::new();
    for folder in inputs.techniques {
        let manifest = &folder.manifest;
        let figures = picture_figures(folder, &|_| ())?;
        for (row, pictures) in manifest.rows.iter().zip(&figures) {
            if row.technique == manifest.baseline {
                continue;
            }
            choices.push(Choice {
                name: row.technique.clone(),
                scene: scene_name(&manifest.scene).to_owned(),
                time_ratio: Timing::of(row).map(|timing| timing.ratio.median),
                values: vec![Some(pictures.flip_mean), Some(pictures.flip_p99)],
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
    use crate::techniques::{Folder, testing};

    #[test]
    fn each_technique_except_the_baseline_is_a_choice() {
        let root = tempfile::tempdir().unwrap();
        testing::folder(root.path());
        let folders = [Folder::open(root.path()).unwrap()];
        let trace = small_trace();
        let mut inputs = inputs(&trace);
        inputs.techniques = &folders;
        let choices = measured(&inputs).unwrap();
        let names: Vec<&str> = choices.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["superfrustum", "grey"]);
        assert_eq!(choices[0].time_ratio, Some(0.5));
        assert_eq!(choices[0].values[0], Some(0.0));
        assert!(choices[1].values[0] > Some(0.0));
    }
}
