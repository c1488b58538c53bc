//! Tables, plots, JSON, CSV and the HTML report.

pub mod html;
pub mod plots;
pub mod theme;
