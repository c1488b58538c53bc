//! The texture mapping unit: "looping for the next chance" (RayCore, TOG 2014), as the Z2 paper's
//! simulator uses it. `docs/models/texture-unit.md` states the model and its parameters in one page.

mod closed_form;
mod pipeline;
mod waiting;

pub use closed_form::closed_form;
pub use pipeline::{Pipeline, PipelineStats, Turn};
pub use waiting::{Pending, Waiting};
