//! The quantity that `--auto` minimises.

use crate::study::auto::{Budget, Objective};
use anyhow::ensure;
use clap::Args;

/// The option, shared by `raster` and `techniques`.
#[derive(Args, Clone, Copy, Debug)]
pub struct ObjectiveArgs {
    /// Quantity that `--auto` minimises under an error budget: a count, which is the same in every run, or
    /// time [default: energy].
    #[arg(
        long,
        value_enum,
        value_name = "NAME",
        help_heading = "Techniques",
        requires = "auto"
    )]
    objective: Option<Objective>,
}

impl ObjectiveArgs {
    /// The objective for a budget.
    ///
    /// # Errors
    /// A time budget with an objective.
    pub fn of(self, budget: Option<Budget>) -> anyhow::Result<Objective> {
        if let Some(Budget::FrameMs(_)) = budget {
            let other = self.objective.filter(|other| *other != Objective::Time);
            ensure!(
                other.is_none(),
                "--objective: expected time with --auto budget-ms, found {}",
                other.map(Objective::name).unwrap_or_default()
            );
            return Ok(Objective::Time);
        }
        Ok(self.objective.unwrap_or_default())
    }
}
