//! The error for captures that cannot be compared.

use serde::Serialize;

/// A property that the captures do not share.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: expected the same in both traces, found {left} and {right}")]
pub struct NotComparable {
    /// The property.
    pub what: String,
    /// Its value in the first trace.
    pub left: String,
    /// Its value in the second trace.
    pub right: String,
}

/// Fails if the values differ.
pub fn same<T: PartialEq + Serialize>(
    what: impl FnOnce() -> String,
    left: &T,
    right: &T,
) -> Result<(), NotComparable> {
    if left == right {
        return Ok(());
    }
    Err(NotComparable {
        what: what(),
        left: shown(left),
        right: shown(right),
    })
}

/// A value in the JSON form of the tables.
fn shown(value: &impl Serialize) -> String {
    serde_json::to_string(value).map_or_else(
        |_| "a value that JSON cannot hold".to_owned(),
        |text| text.replace('"', "").replace(',', ", "),
    )
}
