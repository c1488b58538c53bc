//! The JSON Schemas in `schemas/`, derived from the types that the commands print. `UPDATE_SCHEMAS=1 cargo test -p
//! replay schemas` rewrites the files.

mod published;
mod types;

pub(crate) use published::Published;
pub(crate) use types::{Layout, Meta, Sampling};

use crate::report::columns::{Heading, Kind};
use crate::{cli, experiment, report};
use serde_json::{Map, Value, json};

impl Published {
    /// Describes the rows of an array by their columns.
    pub(crate) fn rows(mut self, key: &str, headings: &[Heading]) -> Self {
        let properties = self.schema.get_mut("properties").expect("an object");
        properties[key] = json!({ "type": "array", "items": row(headings) });
        self
    }
}

/// The type of a cell. Every cell can be null.
fn cell(heading: &Heading) -> Value {
    let kind = match heading.kind {
        Kind::Text => "string",
        Kind::Flag => "boolean",
        Kind::Whole => "integer",
        Kind::Real => "number",
    };
    let mut text = heading.about.to_owned();
    if text.is_empty() {
        text = heading.name.to_string();
    }
    if !heading.unit.is_empty() {
        text = format!("{text} ({})", heading.unit);
    }
    json!({ "type": [kind, "null"], "description": text })
}

/// An object of these columns; keys with a dot are nested objects, which are null if all their cells are.
fn row(headings: &[Heading]) -> Value {
    let mut properties = Map::new();
    for heading in headings {
        match heading.key.split_once('.') {
            None => {
                properties.insert(heading.key.to_string(), cell(heading));
            }
            Some((outer, inner)) => {
                let group = properties.entry(outer).or_insert_with(
                    || json!({ "type": ["object", "null"], "properties": {}, "required": [] }),
                );
                group["properties"][inner] = cell(heading);
                let required = group["required"].as_array_mut().expect("a list");
                required.push(inner.into());
            }
        }
    }
    let required: Vec<&String> = properties.keys().collect();
    json!({ "type": "object", "required": required, "properties": properties })
}

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
    published::assert_published("replay", &all());
}
