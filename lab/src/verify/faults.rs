//! Contradictions between a trace's tables and its scene.

use serde::Serialize;

/// Contradictions between a trace's tables and its scene.
#[derive(Default)]
pub(super) struct Faults(pub Vec<String>);

impl Faults {
    /// Adds a fault unless both values are the same.
    pub fn hold<T: PartialEq + Serialize>(&mut self, place: &str, expected: &T, found: &T) {
        if expected != found {
            let json = |value| serde_json::to_string(value).unwrap_or_default();
            let (expected, found) = (json(expected), json(found));
            self.add(place, &expected, &found);
        }
    }

    pub fn add(&mut self, place: &str, expected: &str, found: &str) {
        (self.0).push(format!("{place}: expected {expected}, found {found}"));
    }
}
