//! An independent reference that the capture is held against.
//!
//! A brute-force rasteriser in double precision that shares nothing with the drivers but their
//! documented rules: vertices snapped to 1/256 pixel, the top-left rule, a depth test with `Less`
//! in submission order, perspective-correct interpolation.

pub mod compare;
pub mod reference;

#[cfg(test)]
mod tests;
