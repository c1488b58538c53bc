//! A document with its JSON Schema in `schemas/`. For tests.

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde_json::json;
use std::path::Path;
use std::{env, fs};

/// A document with its schema.
pub struct Published {
    /// Name and version, as in the document's key `schema`.
    pub name: &'static str,
    /// Its members and their types.
    pub schema: Schema,
}

impl Published {
    /// The schema of a type.
    pub fn of<T: JsonSchema>(name: &'static str) -> Self {
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
}

/// Compares the schemas of a program with the files, or writes the files if `UPDATE_SCHEMAS` is set.
pub fn assert_published(program: &str, folder: &Path, all: &[Published]) {
    let update = env::var_os("UPDATE_SCHEMAS").is_some();
    let mut expected: Vec<String> = Vec::new();
    for Published { name, schema } in all {
        // `replay.run/2` is in `replay.run-2.json`.
        let file = format!("{}.json", name.replace('/', "-"));
        assert!(!expected.contains(&file), "two documents have {name}");
        let path = folder.join(&file);
        let text = serde_json::to_string_pretty(schema).unwrap() + "\n";
        if update {
            fs::write(&path, &text).unwrap();
        }
        let found = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == text,
            "{} differs from the types: run with UPDATE_SCHEMAS=1 and raise the version if a key changed",
            path.display()
        );
        expected.push(file);
    }
    for entry in fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let of_program = name.split('.').next() == Some(program);
        assert!(
            !of_program || expected.contains(&name),
            "schemas/{name}: no document has this schema"
        );
    }
}
