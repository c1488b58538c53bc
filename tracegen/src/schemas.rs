//! The JSON Schemas of `tracegen` in `schemas/`, derived from the types that the commands print.
//! `UPDATE_SCHEMAS=1 cargo test -p tracegen schemas` rewrites the files.

#[path = "../../replay/src/schemas/published.rs"]
mod published;

pub(crate) use published::Published;

use crate::{cli, stress, study, verify};

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
    published::assert_published("tracegen", &all);
}
