//! Text of names and messages.

use serde::Serialize;
use std::borrow::Cow;

/// Escapes every character that controls a terminal or changes the reading direction: control characters
/// (C0, DEL, C1), line separators and bidirectional marks.
///
/// Names of materials, cameras, files and passes are escaped before they are stored in a scene or shown in
/// a message.
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, steers)
}

/// [`printable`] for whole messages, which may have line breaks and tabs.
pub fn printable_lines(message: &str) -> Cow<'_, str> {
    escaped(message, |c| steers(c) && c != '\n' && c != '\t')
}

/// The name of an enum's value in files and on the command line: the one by which serde writes it.
pub fn name_of(value: &impl Serialize) -> String {
    let value = serde_json::to_value(value).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

/// A document as indented JSON that ends in a line break.
///
/// # Errors
/// A value that JSON cannot express.
pub fn json_text(document: &impl Serialize) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// Text for a cell of a CSV file. A spreadsheet would run a name that begins with `=`, `+`, `-` or `@` as a
/// formula, so it gets an apostrophe in front. Numbers stay as they are.
pub fn csv_cell(text: &str) -> Cow<'_, str> {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.len() > 1;
    match is_formula && text.parse::<f64>().is_err() {
        true => Cow::Owned(format!("'{text}")),
        false => Cow::Borrowed(text),
    }
}

fn escaped(text: &str, is_bad: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_bad) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_bad(c) {
            escaped.extend(c.escape_default());
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

fn steers(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}')
        || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_no_formulas_in_csv_and_numbers_are_unchanged() {
        for name in ["=1+1", "+A1", "-A1", "@SUM(A1)", "-1-1", "=", "\t=1"] {
            let expected = match name.len() {
                1 => name.to_owned(),
                _ => format!("'{name}"),
            };
            assert_eq!(csv_cell(name), expected);
        }
        for plain in [
            "-1", "-0.25", "+3", "-1e-9", "-inf", "", "-", "z2-sta", "a=b", "'=1",
        ] {
            assert_eq!(csv_cell(plain), plain);
        }
    }

    #[test]
    fn control_characters_are_escaped_and_the_rest_is_unchanged() {
        for (text, expected) in [
            ("Größe 漢字 #25", "Größe 漢字 #25"),
            ("a\x1b[31mb", "a\\u{1b}[31mb"),
            ("a\nb\tc\r", "a\\nb\\tc\\r"),
            ("\u{9b}2J\u{7f}", "\\u{9b}2J\\u{7f}"),
            ("gpj.\u{202e}x", "gpj.\\u{202e}x"),
        ] {
            assert_eq!(printable(text), expected);
        }
        assert_eq!(printable_lines("a\r\n\tb"), "a\\r\n\tb");
    }
}
