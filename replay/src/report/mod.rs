//! Tables, plots, JSON, CSV and the HTML report.

pub mod columns;
pub mod csv;
pub mod files;
pub mod html;
pub mod picture;
pub mod plots;
pub mod sgrt;
pub mod table;
pub mod theme;
pub mod z2;
