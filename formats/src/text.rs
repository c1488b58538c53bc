//! Text from files made fit for a terminal.

use std::borrow::Cow;

/// A name as one harmless line: control characters, which could steer a terminal, and characters
/// that turn the reading direction become escapes such as `\u{1b}`.
#[must_use]
pub fn printable(name: &str) -> Cow<'_, str> {
    escaped(name, steers)
}

/// [`printable`] for whole messages, which may have several lines.
#[must_use]
pub fn printable_lines(message: &str) -> Cow<'_, str> {
    escaped(message, |c| steers(c) && c != '\n' && c != '\t')
}

fn steers(c: char) -> bool {
    let turns =
        matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() || turns || matches!(c, '\u{2028}' | '\u{2029}')
}

fn escaped(text: &str, is_bad: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_bad) {
        return Cow::Borrowed(text);
    }
    let mut safe = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_bad(c) {
            safe.extend(c.escape_default());
        } else {
            safe.push(c);
        }
    }
    Cow::Owned(safe)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminal_escapes_become_text() {
        assert_eq!(printable("a\u{1b}[31m\u{9b}b\n"), "a\\u{1b}[31m\\u{9b}b\\n");
        assert_eq!(printable("evil\u{202e}gnp"), "evil\\u{202e}gnp");
        assert_eq!(printable_lines("a\r\n\tb"), "a\\r\n\tb");
    }

    #[test]
    fn names_in_any_script_are_left_alone() {
        for name in ["brick.png", "Wände/Ziegel 2", "煉瓦", "مبنى"] {
            assert!(matches!(printable(name), Cow::Borrowed(_)), "{name}");
        }
    }
}
