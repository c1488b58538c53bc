//! Lee, Hwang, Shin, Yoo, Ryu, "Fast Stereoscopic Rendering on Mobile Ray Tracing GPU for Virtual
//! Reality Applications", 2017: figure 3 and section IV.

use serde::{Deserialize, Serialize};

/// A scene of the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperScene {
    /// Name for `--as`.
    pub id: &'static str,
    /// Name in the figures.
    pub title: &'static str,
    /// Frames per second relative to the reference.
    pub relative_performance: f64,
    /// Energy relative to the reference.
    pub relative_energy: f64,
    /// Frames per second (section IV).
    pub frames_per_second: f64,
}

/// The paper's values shown for a trace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PaperValues {
    /// Scene in the paper.
    pub scene: String,
    /// Frames per second relative to the reference.
    pub relative_performance: f64,
    /// Energy relative to the reference.
    pub relative_energy: f64,
    /// Frames per second with reprojection.
    pub frames_per_second: f64,
}

/// Right pixels that could be shaded with the left image's results, average over the six scenes.
pub const REUSE_PCT: f64 = 91.54;
/// Reduction of the units' work.
pub const TNI_REDUCTION_PCT: f64 = 68.0;
/// Work added by the kernels.
pub const SRP_OVERHEAD_PCT: f64 = 10.0;

const fn scene(
    id: &'static str,
    title: &'static str,
    relative_performance: f64,
    relative_energy: f64,
    frames_per_second: f64,
) -> PaperScene {
    PaperScene {
        id,
        title,
        relative_performance,
        relative_energy,
        frames_per_second,
    }
}

/// Figure 3.
pub const SCENES: [PaperScene; 6] = [
    scene("teapot", "Teapot", 1.64, 0.96, 131.3),
    scene("chess", "Chess", 1.13, 1.02, 14.4),
    scene("bmw", "BMW", 1.42, 0.97, 18.2),
    scene("chemical-lab", "Chemical lab", 1.11, 0.99, 8.6),
    scene("music-box", "Music box", 1.28, 0.98, 28.9),
    scene("provence", "Provence", 1.51, 0.80, 44.5),
];

/// Built-in stand-in scenes with another name than the paper's scene.
const STAND_INS: [(&str, &str); 3] = [
    ("car", "bmw"),
    ("lab", "chemical-lab"),
    ("meadow", "provence"),
];

/// The paper's values for a trace: of the scene that `--as` assigns to its label, else of the scene with
/// exactly its name or for which it stands in.
///
/// # Errors
/// A value of `--as` that names no scene of the paper.
pub fn values(
    scene: &str,
    label: &str,
    assignments: &[String],
) -> Result<Option<PaperValues>, super::UnknownScene> {
    let ids = SCENES.map(|s| s.id);
    let named = || super::stand_in(scene, &ids.map(|id| (id, id))).copied();
    let id = super::assigned_scene(assignments, label, &ids)?
        .unwrap_or_else(|| super::stand_in(scene, &STAND_INS).copied().or_else(named));
    let found = SCENES.iter().find(|s| Some(s.id) == id);
    Ok(found.map(|s| PaperValues {
        scene: s.title.to_owned(),
        relative_performance: s.relative_performance,
        relative_energy: s.relative_energy,
        frames_per_second: s.frames_per_second,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_scenes_with_the_exact_name_or_requested_ones_are_compared() {
        let found = |scene, label, assignments: &[&str]| {
            let assignments: Vec<String> = assignments.iter().map(|&a| a.to_owned()).collect();
            let values = values(scene, label, &assignments).expect("known scenes");
            values.map(|v| v.scene)
        };
        assert_eq!(found("car", "car", &[]).as_deref(), Some("BMW"));
        assert_eq!(
            found("provence", "provence", &[]).as_deref(),
            Some("Provence")
        );
        for other in ["scarf.gltf", "labyrinth.obj", "cars/car.gltf", "teapot_16k"] {
            assert_eq!(found(other, other, &[]), None, "{other}");
        }
        let assigned = found("a/bmw_55k.gltf", "bmw_55k", &["bmw_55k=bmw"]);
        assert_eq!(assigned.as_deref(), Some("BMW"));
        assert_eq!(found("chess", "chess", &["none"]), None);
    }
}
