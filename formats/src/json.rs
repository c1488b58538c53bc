//! Reads and writes JSON chunks of both kinds of trace.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use crate::container::{ChunkTag, Container};
use crate::error::{FormatError, Result};
use serde::de::{DeserializeOwned, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::HashSet;
use std::fmt;

/// Writes a value that must be unchanged when read back.
///
/// # Errors
/// The value has a number that JSON cannot hold, such as NaN.
pub fn write<T: Serialize + DeserializeOwned + PartialEq>(
    what: &str,
    value: &T,
) -> Result<Vec<u8>> {
    let unwritable = |found: String| FormatError::Unwritable {
        what: what.to_owned(),
        expected: "finite numbers".to_owned(),
        found,
    };
    let json = serde_json::to_vec(value).map_err(|error| unwritable(error.to_string()))?;
    match parse::<T>(&json) {
        Ok(back) if back == *value => Ok(json),
        Ok(_) => Err(unwritable("numbers that change in JSON".to_owned())),
        Err(error) => Err(unwritable(error.to_string())),
    }
}

/// Reads a chunk.
///
/// # Errors
/// The chunk is damaged or not the JSON of a `T`; the error names the byte.
pub fn read<T: DeserializeOwned>(container: &Container, tag: ChunkTag, what: &str) -> Result<T> {
    let json = container.chunk(tag)?;
    parse(json).map_err(|error| {
        let before: usize = json
            .split_inclusive(|byte| *byte == b'\n')
            .take(error.line().saturating_sub(1))
            .map(<[u8]>::len)
            .sum();
        let offset = before.saturating_add(error.column().saturating_sub(1));
        container.malformed(tag, offset as u64, format!("the JSON of {what}"), error)
    })
}

fn parse<T: DeserializeOwned>(json: &[u8]) -> serde_json::Result<T> {
    serde_json::from_slice::<Sound>(json)?;
    serde_json::from_slice(json)
}

/// Checks that no JSON object has duplicate keys and that all numbers are finite as `f32`. A type's own
/// parser does not check skipped keys and narrowed numbers.
struct Sound;

impl<'de> Deserialize<'de> for Sound {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Self)
    }
}

impl<'de> Visitor<'de> for Sound {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self, A::Error> {
        let mut keys = HashSet::new();
        while let Some(key) = map.next_key::<String>()? {
            map.next_value::<Self>()?;
            if let Some(twice) = keys.replace(key) {
                return Err(A::Error::custom(format_args!("key {twice:?} twice")));
            }
        }
        Ok(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self, A::Error> {
        while seq.next_element::<Self>()?.is_some() {}
        Ok(self)
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Self, E> {
        if number.abs() <= f32::MAX.into() {
            return Ok(self);
        }
        Err(E::custom(format_args!(
            "a number of at most 3.4e38, found {number:e}"
        )))
    }

    fn visit_bool<E>(self, _: bool) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_u64<E>(self, _: u64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_i64<E>(self, _: i64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_str<E>(self, _: &str) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_unit<E>(self) -> Result<Self, E> {
        Ok(self)
    }
}
