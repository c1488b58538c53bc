//! The JSON Schemas in `schemas/`, derived from the types that the commands print. `UPDATE_SCHEMAS=1 cargo test -p
//! replay schemas` rewrites the files.

use crate::cli;
use formats::schemas::{Published, assert_published};
use std::path::Path;
use studies::experiment;

fn all() -> Vec<Published> {
    vec![
        cli::info::schema(),
        report::run::schema(),
        report::run::modes_schema(),
        report::addresses::schema(),
        report::sweep::schema(),
        report::sweep_plan::schema(),
        experiment::point_schema(),
        report::z2::model::schema(),
        report::compare::schema(),
        report::locality::schema(),
        report::orders::schema(),
        report::techniques::schema(),
        report::accuracy::schema(),
        report::calibration::schema(),
        report::sgrt::schema(),
        report::readings::schema(),
        report::temporal::schema(),
    ]
}

#[test]
fn published_schemas_equal_those_of_the_types() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas");
    assert_published("replay", &folder, &all());
}
