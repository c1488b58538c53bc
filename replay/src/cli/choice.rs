//! Parsers of values that a user picks by name: help, completions and errors show the names.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use sim::registry::Choice;

/// The values of a type, as help lists them.
pub(super) fn possible_values<T: Choice>() -> impl Iterator<Item = PossibleValue> {
    let values = T::choices().iter();
    values.map(|value| PossibleValue::new(value.choice_name()).help(value.help()))
}

/// The value of a name.
fn named<T: Choice>(name: &str) -> Result<T, String> {
    let mut values = T::choices().iter().copied();
    let found = values.find(|value| value.choice_name() == name);
    found.ok_or_else(|| {
        let names: Vec<_> = T::choices()
            .iter()
            .map(|value| value.choice_name())
            .collect();
        format!("expected {}", names.join(" or "))
    })
}

/// Parses a value by its name.
pub(super) fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(possible_values::<T>()).try_map(|name| named(&name))
}
