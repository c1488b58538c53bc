//! What a quicker or another way of counting costs in accuracy, and what it spares in time.
//!
//! A *variant* is a configuration that stands for another one, its reference; both are replayed in
//! Morton order and Z2 STA. Sampling replays a part and estimates the whole, with an interval that
//! may lie.

mod clusters;
mod sampling;
mod variants;

pub use sampling::{Estimate, Sampled, sampled};
pub use variants::{Contribution, ERROR_FIGURES, Measured, VARIANTS, Variant, measure};
