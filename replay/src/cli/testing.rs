//! Helpers that the subcommands' tests share.

pub use sim::stream::testing::file_of;

/// Splits a text into lines.
pub fn lines(text: &[u8]) -> Vec<String> {
    let text = std::str::from_utf8(text).unwrap();
    text.lines().map(str::to_owned).collect()
}
