//! A figure of a study's choice.

/// A figure of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figure {
    /// Key in JSON and CSV.
    pub key: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
}

/// Makes a figure.
pub const fn figure(key: &'static str, name: &'static str, unit: &'static str) -> Figure {
    Figure { key, name, unit }
}
