//! Why two captures cannot be held against each other.

use serde::Serialize;

/// What the captures do not have in common.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: expected the same in both traces, found {left} and {right}")]
pub struct NotComparable {
    /// Which part of the tables.
    pub what: String,
    /// The first trace's.
    pub left: String,
    /// The second one's.
    pub right: String,
}

/// Refuses what differs.
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

/// A value as the tables' JSON has it.
fn shown(value: &impl Serialize) -> String {
    serde_json::to_string(value).map_or_else(
        |_| "a value that JSON cannot hold".to_owned(),
        |text| text.replace('"', "").replace(',', ", "),
    )
}
