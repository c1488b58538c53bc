//! The JSON Schemas in `schemas/`, derived from the types that the commands print. `UPDATE_SCHEMAS=1 cargo test -p
//! replay schemas` rewrites the files.

use crate::cli;
use formats::schemas::{Published, assert_published};
use report::document::published;
use report::{
    accuracy, addresses, calibration, compare, locality, orders, readings, run, sgrt, sweep,
    sweep_plan, techniques, temporal, z2,
};
use std::path::Path;
use studies::experiment;

fn all() -> Vec<Published> {
    vec![
        cli::info::schema(),
        published::<run::RunReport<'_>>(),
        run::modes_schema(),
        published::<addresses::AddressesReport<'_>>(),
        published::<sweep::SweepReport<'_>>(),
        published::<sweep_plan::SweepPlan<'_>>(),
        experiment::point_schema(),
        published::<z2::model::PaperReport<'_>>(),
        published::<compare::CompareReport<'_>>(),
        published::<locality::LocalityReport>(),
        published::<orders::OrdersReport<'_>>(),
        published::<techniques::TechniquesReport<'_>>(),
        published::<accuracy::AccuracyReport>(),
        published::<calibration::CalibrationReport>(),
        sgrt::schema(),
        published::<readings::ReadingsReport>(),
        published::<temporal::TemporalReport>(),
    ]
}

#[test]
fn published_schemas_equal_those_of_the_types() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas");
    assert_published("replay", &folder, &all());
}
