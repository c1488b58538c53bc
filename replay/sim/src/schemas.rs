//! Schemas of types with their own serialisation, and of types of other crates.

use crate::config::{BetweenFrames, LevelConfig, Levels};
use crate::registry::{Named, Row};
use formats::footprint::SamplingOptions;
use formats::layout::LayoutConfig;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Value, json};
use std::borrow::Cow;

/// The members of a schema that is written where it is used.
macro_rules! inline {
    ($name:literal) => {
        fn inline_schema() -> bool {
            true
        }

        fn schema_name() -> Cow<'static, str> {
            $name.into()
        }
    };
}

impl<R: Row> JsonSchema for Named<R> {
    inline!("Name");

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "examples": R::names() })
    }
}

impl JsonSchema for Levels {
    inline!("Levels");

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let level = generator.subschema_for::<LevelConfig>();
        json_schema!({ "type": "array", "items": level, "minItems": 2, "maxItems": Self::MOST })
    }
}

impl JsonSchema for BetweenFrames {
    inline!("BetweenFrames");

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "pattern": "^(keep|flush|lose-(100|[1-9][0-9]?))$" })
    }
}

/// The tables of a trace.
pub struct Meta;

impl JsonSchema for Meta {
    inline!("Meta");

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "object", "description": "The trace's chunk META (FORMAT.md)." })
    }
}

/// The schema of an object like this one. A null stands for an optional text.
fn like(example: &Value, description: &str) -> Schema {
    let members = example.as_object().expect("an object").iter();
    let properties = members.map(|(key, value)| {
        let kind = match value {
            Value::Null => json!(["string", "null"]),
            Value::Bool(_) => json!("boolean"),
            Value::Number(n) if n.is_f64() => json!("number"),
            Value::Number(_) => json!("integer"),
            Value::String(_) => json!("string"),
            Value::Array(_) | Value::Object(_) => unreachable!("members are plain"),
        };
        (key.clone(), json!({ "type": kind }))
    });
    let properties: Value = properties.collect::<serde_json::Map<_, _>>().into();
    json_schema!({ "type": "object", "description": description, "properties": properties })
}

/// How footprints are computed from coordinates.
pub struct Sampling;

impl JsonSchema for Sampling {
    inline!("Sampling");

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let example = json!(SamplingOptions::default());
        like(
            &example,
            "How footprints follow from coordinates (docs/use/configuration.md).",
        )
    }
}

/// How texels are placed in memory.
pub struct Layout;

impl JsonSchema for Layout {
    inline!("Layout");

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let example = json!(LayoutConfig::default());
        like(
            &example,
            "How texels are placed in memory (docs/models/caches.md).",
        )
    }
}
