//! The JSON Schemas in `schemas/`, derived from the types that the commands print. `UPDATE_SCHEMAS=1 cargo test -p
//! replay schemas` rewrites the files.

mod types;

pub(crate) use types::{Layout, Meta, Sampling};

use crate::report::columns::{Heading, Kind};
use crate::{experiment, report};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::{env, fs};

/// A document with its schema.
pub(crate) struct Published {
    /// Name and version, as in the document's key `schema`.
    name: &'static str,
    schema: Schema,
}

impl Published {
    /// The schema of a type.
    pub(crate) fn of<T: JsonSchema>(name: &'static str) -> Self {
        let settings = SchemaSettings::draft2020_12().for_serialize();
        let mut schema = settings.into_generator().into_root_schema_for::<T>();
        schema.insert("title".to_owned(), name.into());
        schema.remove("description");
        schema.insert("properties".to_owned(), {
            let mut properties = schema.get("properties").cloned().unwrap_or_default();
            properties["schema"] = json!({ "const": name });
            properties
        });
        Self { name, schema }
    }

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
    ]
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas")
}

/// `replay.run/2` is in `schemas/replay.run-2.json`.
fn file(name: &str) -> String {
    format!("{}.json", name.replace('/', "-"))
}

#[test]
fn published_schemas_equal_those_of_the_types() {
    let update = env::var_os("UPDATE_SCHEMAS").is_some();
    let mut expected: Vec<String> = Vec::new();
    for Published { name, schema } in all() {
        let path = folder().join(file(name));
        let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
        if update {
            fs::write(&path, &text).unwrap();
        }
        let found = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == text,
            "{} differs from the types: run with UPDATE_SCHEMAS=1 and raise the version if a key changed",
            path.display()
        );
        expected.push(file(name));
    }
    let found = fs::read_dir(folder()).unwrap();
    for entry in found {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            !name.starts_with("replay.") || expected.contains(&name),
            "schemas/{name}: no document has this schema"
        );
    }
}

#[test]
fn names_are_unique() {
    let mut names: Vec<&str> = all().iter().map(|p| p.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all().len());
}
