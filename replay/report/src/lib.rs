//! Prints results as tables, plots, JSON, CSV and pages. Other modules compute them.

pub mod accuracy;
pub mod addresses;
pub mod answers;
pub mod calibration;
pub mod columns;
pub mod compare;
mod config_columns;
pub mod document;
pub mod errors;
pub mod figures;
pub mod html;
mod lists;
pub mod locality;
mod memory_columns;
pub mod notices;
pub mod orders;
pub mod parquet;
pub mod picture;
pub mod plots;
pub mod readings;
pub mod rows_parquet;
pub mod run;
pub mod sample;
pub mod schedule;
#[cfg(feature = "testing")]
mod schemas;
pub mod sgrt;
pub mod sweep;
pub mod sweep_plan;
pub mod table;
mod table_json;
pub mod techniques;
pub mod temporal;
pub mod theme;
pub mod timeline;
pub mod view;
pub mod z2;
