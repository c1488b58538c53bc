//! The texture mapping unit: "looping for the next chance" (RayCore, TOG 2014), as in the Z2 paper's
//! simulator. `docs/models/texture-unit.md` describes the model and its parameters.

mod closed_form;
mod pipeline;
mod waiting;

pub use closed_form::closed_form;
pub use pipeline::{Pipeline, PipelineStats, Turn};
pub use waiting::{Pending, Waiting};
