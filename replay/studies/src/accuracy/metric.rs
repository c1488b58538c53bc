//! What a study measures of each choice.

/// A measured quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Metric {
    /// Key in JSON and CSV.
    pub key: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
}

/// Makes a metric.
pub const fn metric(key: &'static str, name: &'static str, unit: &'static str) -> Metric {
    Metric { key, name, unit }
}
