//! Options whose values are names of values of a library.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Parses the name of a choice; choices are names, values and their help.
pub fn choice<T: Clone + Send + Sync + 'static>(
    choices: impl IntoIterator<Item = (&'static str, T, &'static str)>,
) -> impl TypedValueParser<Value = T> {
    let choices: Vec<_> = choices.into_iter().collect();
    let names = choices
        .iter()
        .map(|(name, _, help)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(names).try_map(move |found| {
        let chosen = choices.iter().find(|(name, ..)| *name == found);
        chosen
            .map(|(_, value, _)| value.clone())
            .ok_or("a name of none")
    })
}
