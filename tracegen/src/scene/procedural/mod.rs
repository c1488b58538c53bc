//! Built-in scenes that need no file.

use super::Scene;

/// Names and one-line descriptions.
#[must_use]
pub fn names() -> &'static [(&'static str, &'static str)] {
    &[]
}

/// Builds a scene by name.
#[must_use]
pub fn build(_name: &str) -> Option<Scene> {
    None
}
