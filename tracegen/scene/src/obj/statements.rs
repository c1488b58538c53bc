//! OBJ and MTL text: encoding, continued lines, comments and numbers.

use crate::error::SceneError;
use crate::files::{Origin, latin1};
use std::borrow::Cow;

/// The file as text: UTF-8 with or without a byte order mark, or else Latin-1, in which every byte
/// is a character.
///
/// # Errors
/// UTF-16, detected by its byte order mark.
pub(super) fn decode(bytes: Vec<u8>, origin: &Origin) -> Result<String, SceneError> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(origin.invalid("byte 0", "text in UTF-8 or Latin-1", "UTF-16"));
    }
    let mut text = String::from_utf8(bytes).unwrap_or_else(|e| latin1(e.as_bytes()));
    if text.starts_with('\u{feff}') {
        text.drain(..'\u{feff}'.len_utf8());
    }
    Ok(text)
}

/// One statement: a line with its continuation lines.
#[derive(Debug, PartialEq)]
pub(super) struct Statement<'a> {
    /// Number of its first line, from 1.
    pub line: usize,
    /// Its first word.
    pub keyword: &'a str,
    /// The text after the keyword, trimmed. It includes comments, because names may contain spaces
    /// and `#`.
    pub rest: &'a str,
}

impl Statement<'_> {
    /// The words before any comment.
    pub fn words(&self) -> impl Iterator<Item = &str> {
        without_comment(self.rest).split_ascii_whitespace()
    }

    /// The numbers before any comment. The first invalid word is the error.
    pub fn numbers(&self) -> Result<Vec<f64>, &str> {
        self.words().map(|w| number(w).ok_or(w)).collect()
    }
}

/// The text up to a word that starts with `#`.
pub(super) fn without_comment(text: &str) -> &str {
    let starts = |&(at, _): &(usize, &str)| at == 0 || text[..at].ends_with([' ', '\t']);
    let comment = text.match_indices('#').find(starts);
    text[..comment.map_or(text.len(), |(at, _)| at)].trim_end()
}

/// The part of a line before a backslash that continues it. A backslash at the end of a comment is
/// part of a drawing or a path.
fn continued(line: &str) -> Option<&str> {
    let open = line.trim_end().strip_suffix('\\')?;
    (without_comment(open).len() == open.trim_end().len()).then_some(open)
}

/// A number, including the not-a-numbers that C libraries print.
pub(super) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| {
        let lower = word.to_ascii_lowercase();
        let not_a_number = ["#ind", "#qnan", "#snan", "nan("];
        (not_a_number.iter().any(|n| lower.contains(n))).then_some(f64::NAN)
    })
}

/// Calls `each` with every statement of the text, without blank and comment lines.
///
/// # Errors
/// The first that `each` returns.
pub(super) fn for_each<E>(
    text: &str,
    mut each: impl FnMut(Statement<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut lines = (1..).zip(text.lines());
    while let Some((line, first)) = lines.next() {
        let mut whole = Cow::Borrowed(first);
        let mut last = first;
        while let Some(open) = continued(last) {
            let cut = last.len() - open.len();
            last = lines.next().map_or("", |(_, next)| next);
            let whole = whole.to_mut();
            whole.truncate(whole.len() - cut);
            whole.push(' ');
            whole.push_str(last);
        }
        let whole = whole.trim();
        let (keyword, rest) = whole
            .split_once(|c: char| c.is_ascii_whitespace())
            .unwrap_or((whole, ""));
        if !keyword.is_empty() && !keyword.starts_with('#') {
            let rest = rest.trim();
            each(Statement {
                line,
                keyword,
                rest,
            })?;
        }
    }
    Ok(())
}
