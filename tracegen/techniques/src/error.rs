//! Settings that contradict each other or do not suit the display.

/// A setting with an invalid value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}: expected {expected}, found {found}")]
pub struct SettingsError {
    /// Name of the setting.
    pub what: &'static str,
    /// The expected value.
    pub expected: String,
    /// The value found.
    pub found: String,
}
