//! Answers about a path from some of its frames, each with an interval.
//!
//! A plan knows what is in each frame without drawing it. [`strata`] groups frames that are alike, [`stages`] chooses how
//! many of each are captured, [`estimate`] computes figures and intervals from them, and [`trial`] repeats all of
//! that on paths whose every frame is known.

pub mod cold;
pub mod estimate;
pub mod of;
pub mod points;
mod run;
pub mod sample;
pub mod stages;
pub mod strata;
pub mod trial;
pub mod values;

#[cfg(test)]
mod tests;
