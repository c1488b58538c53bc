//! The JSON Schemas of `tracegen` in `schemas/`, derived from the types that the commands print.
//! `UPDATE_SCHEMAS=1 cargo test -p tracegen schemas` rewrites the files.

use crate::{cli, study};
use lab::{stress, verify};
use std::path::Path;

#[test]
fn published_schemas_equal_those_of_the_types() {
    let mut all = vec![
        cli::precision::schema(),
        cli::sweep::schema(),
        stress::report::schema(),
        study::folder::schema(),
        verify::report::schema(),
    ];
    all.extend(cli::scenes::schemas());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas");
    formats::schemas::assert_published("tracegen", &folder, &all);
}
