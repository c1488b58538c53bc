//! The corpus of the fuzz targets, run as plain tests.

mod corpus;
mod seeds;
