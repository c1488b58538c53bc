//! Settings that contradict each other or do not suit the display.

/// Settings that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}: expected {expected}, found {found}")]
pub struct SettingsError {
    /// Which setting.
    pub what: &'static str,
    /// The expected value.
    pub expected: String,
    /// The value found.
    pub found: String,
}
