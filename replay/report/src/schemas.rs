//! JSON Schemas of tables, by their columns.

use crate::columns::{Heading, Kind};
use crate::table::Table;
use formats::schemas::Published;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value, json};
use std::borrow::Cow;

/// Describes the rows of a document's tables by their columns.
pub(crate) fn with_tables(mut published: Published, tables: Vec<(&str, Table)>) -> Published {
    let properties = published.schema.get_mut("properties").expect("an object");
    for (key, table) in tables {
        properties[key] = json!({ "type": "array", "items": row(&table.headings) });
    }
    published
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
    let required: Vec<String> = properties.keys().cloned().collect();
    let about =
        "Members of the row with their lowest and highest value, and the reason of the difference.";
    properties.insert(
        "figures".to_owned(),
        json!({ "type": "object", "additionalProperties": true, "description": about }),
    );
    json!({ "type": "object", "required": required, "properties": properties })
}

/// Rows of columns. [`with_tables`] describes the columns where they are the same in every run.
impl JsonSchema for Table {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Rows".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "array", "items": { "type": "object" } })
    }
}
