//! The record of a search in the manifest.

use super::budget::Budget;
use super::guard::Held;
use super::objective::Objective;
use super::schedule::Schedule;
use super::search::{Elsewhere, Found, Tried, Verdict};
use serde::{Deserialize, Serialize};
use techniques::Settings;

/// A search and its choice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct AutoRecord {
    /// The budget as given.
    pub budget: String,
    /// The quantity that was minimised.
    pub objective: Objective,
    /// The chosen combination.
    pub chosen: Chosen,
    /// The reason in words.
    pub reason: String,
    /// Frames that the search measured.
    pub search_frames: Vec<u32>,
    /// Frames on which the budget was checked and that the search did not measure.
    pub held_frames: Vec<u32>,
    /// Frames that are rendered with a safer combination, and that combination.
    pub fallbacks: Vec<Fallback>,
    /// The choice for every frame, in the form of `tracegen raster --technique`.
    pub schedule: String,
    /// The error of the worst frame of the whole path, in the budget's unit.
    pub worst_error: Option<f64>,
    /// The best single technique that keeps the budget.
    pub best_single: Chosen,
    /// Both on frames that the search did not measure, if the path has such frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elsewhere: Option<Elsewhere>,
    /// All combinations that the search tried.
    pub tried: Vec<Chosen>,
}

/// A combination and its results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Chosen {
    /// Name.
    pub technique: String,
    /// Settings of its capture.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    pub settings: Settings,
    /// Cost and error on the frames of the search.
    pub verdict: Verdict,
}

/// A frame in which the chosen combination exceeded the budget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Fallback {
    /// Number of the frame.
    pub frame: u32,
    /// The combination of the frame.
    pub technique: String,
}

impl From<&Tried> for Chosen {
    fn from(tried: &Tried) -> Self {
        Self {
            technique: tried.row.name.clone(),
            settings: tried.row.settings.clone(),
            verdict: tried.verdict,
        }
    }
}

impl AutoRecord {
    /// The record of a search over `search_frames`; `held` is its checked result.
    pub fn new(
        budget: Budget,
        objective: Objective,
        found: &Found,
        held: &Held,
        search_frames: Vec<u32>,
    ) -> Self {
        let path = 0..held.of_frame.len() as u32;
        let held_frames = path
            .filter(|frame| !search_frames.contains(frame))
            .collect();
        let fallbacks = (held.fallen_back().into_iter())
            .map(|frame| Fallback {
                frame,
                technique: held.row(frame).name.clone(),
            })
            .collect();
        Self {
            budget: budget.to_string(),
            objective,
            schedule: Schedule::of(held).to_string(),
            chosen: (&found.chosen).into(),
            reason: reason(budget, objective, found, held),
            search_frames,
            held_frames,
            fallbacks,
            worst_error: held.errors.iter().copied().reduce(f64::max),
            best_single: (&found.best_single).into(),
            elsewhere: found.elsewhere,
            tried: found.tried.iter().map(Chosen::from).collect(),
        }
    }
}

fn reason(budget: Budget, objective: Objective, found: &Found, held: &Held) -> String {
    let (chosen, single) = (&found.chosen, &found.best_single);
    let cost = match objective {
        Objective::Time => format!("{:.1} ms", chosen.per_frame() * 1e3),
        Objective::Energy => format!("{:.3} mJ", chosen.per_frame()),
        _ => format!("{:.0} {}", chosen.per_frame(), objective.unit()),
    };
    let what = match objective {
        Objective::Time => "frame time".to_owned(),
        other => other.name(),
    };
    let mut text = format!(
        "of {} tried, {} takes {:.3} of the baseline's {what} ({cost} a frame) at an error of {:.4}",
        found.tried.len(),
        chosen.row.name,
        chosen.ratio(),
        chosen.verdict.error,
    );
    text += &match budget {
        Budget::Flip(_) => ", FLIP".to_owned(),
        Budget::Pixels(limit) => format!(" px; every shift is at most {limit} px by construction"),
        Budget::FrameMs(limit) => {
            format!(", FLIP: the least that fits {limit} ms on this device, not scaled")
        }
    };
    text += &format!(
        "; the best single technique, {}, takes {:.3}",
        single.row.name,
        single.ratio()
    );
    if found.finalists > 0 {
        text += &format!(
            " (the {} cheapest and the baseline timed again, in turns)",
            found.finalists - 1
        );
    }
    if let Some(elsewhere) = found.elsewhere {
        text += &format!(
            "; on frames that the search did not see {:.2} and {:.2}",
            elsewhere.chosen.median, elsewhere.best_single.median
        );
        if elsewhere.overruled {
            text += ", where the quartiles of what was fastest before were not apart from something simpler, which took its place";
        }
    }
    let fallen = held.fallen_back().len();
    if let Some(worst) = held.errors.iter().copied().reduce(f64::max) {
        text += &format!(
            "; on all {} frames of the path the error is at most {worst:.4}, with a safer combination in {fallen} of them",
            held.errors.len()
        );
    }
    text
}
