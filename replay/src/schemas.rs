//! The JSON Schemas in `schemas/`, derived from the types that the commands print. `UPDATE_SCHEMAS=1 cargo test -p
//! replay schemas` rewrites the files.

use crate::cli;
use formats::schemas::{Published, assert_published};
use report::document::published;
use report::{
    accuracy, addresses, calibration, compare, locality, orders, predict, readings, run, sample,
    schedule, sgrt, sweep, sweep_plan, techniques, temporal, z2,
};
use std::path::Path;
use studies::experiment;

fn all() -> Vec<Published> {
    vec![
        cli::info::schema(),
        published::<run::RunReport, run::RunJson>(),
        run::modes_schema(),
        published::<addresses::AddressesReport, addresses::AddressesJson>(),
        published::<sweep::SweepReport, sweep::SweepJson>(),
        published::<sweep_plan::SweepPlan, sweep_plan::PlanJson>(),
        experiment::point_schema(),
        published::<z2::model::PaperReport, z2::model::PaperJson>(),
        published::<compare::CompareReport, compare::CompareJson>(),
        published::<locality::LocalityReport, locality::LocalityJson>(),
        published::<orders::OrdersReport, orders::OrdersJson>(),
        published::<sample::SampleReport, sample::SampleJson>(),
        published::<sample::TrialReport, sample::TrialJson>(),
        published::<predict::PredictReport, predict::PredictJson>(),
        published::<schedule::ScheduleReport, schedule::ScheduleJson>(),
        published::<techniques::TechniquesReport, techniques::TechniquesJson>(),
        published::<accuracy::AccuracyReport, accuracy::AccuracyJson>(),
        published::<calibration::CalibrationReport, calibration::CalibrationReport>(),
        sgrt::schema(),
        published::<readings::ReadingsReport, readings::ReadingsReport>(),
        published::<temporal::TemporalReport, temporal::TemporalReport>(),
    ]
}

#[test]
fn published_schemas_equal_those_of_the_types() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas");
    assert_published("replay", &folder, &all());
}
