//! Helpers that the subcommands' tests share.

use clap::Command;
pub use sim::stream::testing::file_of;
use std::ffi::OsString;

/// The arguments of a command, without its name.
pub fn arguments<A: clap::Args>(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> A {
    let command = A::augment_args(Command::new("test").no_binary_name(true));
    let matches = command.try_get_matches_from(words);
    A::from_arg_matches(&matches.expect("valid arguments")).expect("valid arguments")
}

/// Splits a text into lines.
pub fn lines(text: &[u8]) -> Vec<String> {
    let text = std::str::from_utf8(text).unwrap();
    text.lines().map(str::to_owned).collect()
}
