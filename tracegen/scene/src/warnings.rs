//! Warnings about a file: one line per kind, however often it occurs.

use crate::files::shown;

/// Collects warnings. Text from the file is made printable in a terminal.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    /// Kind, the first occurrence's sentence, and how many there were.
    kinds: Vec<(&'static str, String, u64)>,
}

impl Warnings {
    /// Counts an occurrence of `kind`; the first one's sentence is kept.
    pub fn count(&mut self, kind: &'static str, sentence: impl FnOnce() -> String) {
        match self.kinds.iter_mut().find(|(known, ..)| *known == kind) {
            Some((.., count)) => *count += 1,
            None => self.kinds.push((kind, shown(&sentence()), 1)),
        }
    }

    /// Adds an uncounted sentence.
    pub fn say(&mut self, sentence: &str) {
        self.kinds.push(("", shown(sentence), 1));
    }

    /// Appends the warnings of another part of the file.
    pub fn append(&mut self, other: Self) {
        self.kinds.extend(other.kinds);
    }

    /// One sentence per kind, in order of first occurrence.
    pub fn into_sentences(self) -> Vec<String> {
        self.kinds
            .into_iter()
            .map(|(_, sentence, count)| match count {
                1 => sentence,
                _ => format!("{sentence} (and {} more like this)", count - 1),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_that_occurs_often_is_one_sentence_with_a_count() {
        let mut warnings = Warnings::default();
        for i in 0..5 {
            warnings.count("lines", || format!("primitive {i} is lines"));
        }
        warnings.say("a\x1bb");
        assert_eq!(
            warnings.into_sentences(),
            ["primitive 0 is lines (and 4 more like this)", "a\\u{1b}b"]
        );
    }
}
