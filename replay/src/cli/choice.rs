//! Parsers of values that a user picks by name: help, completions and errors show the names.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use sim::registry::Choice;

/// The values of a type, as help lists them.
pub(super) fn possible_values<T: Choice>() -> impl Iterator<Item = PossibleValue> {
    let values = T::choices().iter();
    values.map(|value| PossibleValue::new(value.choice_name()).help(value.help()))
}

/// Parses a value by its name.
pub(super) fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(possible_values::<T>()).try_map(|name| {
        let mut values = T::choices().iter().copied();
        let named = values.find(|value| value.choice_name() == name);
        named.ok_or_else(|| format!("no value `{name}`"))
    })
}
