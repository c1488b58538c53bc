//! Rows of a points file: one line each, with a checksum that detects every changed byte.
//!
//! The form is `CRC-32 MODEL-VERSION KEY JSON\n`. The checksum has 8 hex digits and covers everything after
//! the following space.

/// Content of a line after the checksum.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct StoredRow<'a> {
    /// Version of the models that produced the counts.
    pub model_version: u32,
    /// Key of the point.
    pub key: &'a str,
    /// The point as JSON.
    pub json: &'a str,
}

impl<'a> StoredRow<'a> {
    /// The line, including its line feed.
    pub fn encode(&self) -> Vec<u8> {
        let Self {
            model_version,
            key,
            json,
        } = self;
        let content = format!("{model_version} {key} {json}");
        format!("{:08x} {content}\n", crc32fast::hash(content.as_bytes())).into_bytes()
    }

    /// Reads a line, including its line feed.
    ///
    /// # Errors
    /// What was expected and found.
    pub fn decode(line: &'a [u8]) -> Result<Self, String> {
        let Some(line) = line.strip_suffix(b"\n") else {
            return Err("expected a line feed at its end, found the end of the file".to_owned());
        };
        let (checksum, content) = match line.split_at_checked(9) {
            Some(([checksum @ .., b' '], content)) => (checksum, content),
            _ => return Err("expected a checksum of 8 digits and a space".to_owned()),
        };
        let expected = format!("{:08x}", crc32fast::hash(content));
        if checksum != expected.as_bytes() {
            let found = String::from_utf8_lossy(checksum);
            return Err(format!(
                "expected checksum {expected} of its content, found {found:?}"
            ));
        }
        let row = || {
            let mut words = std::str::from_utf8(content).ok()?.splitn(3, ' ');
            Some(Self {
                model_version: words.next()?.parse().ok()?,
                key: words.next()?,
                json: words.next()?,
            })
        };
        row().ok_or_else(|| "expected a model version, a key and JSON".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_changed_and_every_missing_byte_of_a_row_is_refused() {
        let row = StoredRow {
            model_version: 3,
            key: "0badcafe",
            json: r#"{"misses":12}"#,
        };
        let line = row.encode();
        assert_eq!(StoredRow::decode(&line), Ok(row));
        for at in 0..line.len() {
            for bits in 1..=255u8 {
                let mut changed = line.clone();
                changed[at] ^= bits;
                assert!(
                    StoredRow::decode(&changed).is_err(),
                    "byte {at}, bits {bits:#x}"
                );
            }
            assert!(StoredRow::decode(&line[..at]).is_err(), "cut at {at}");
        }
        let mut changed = line.clone();
        changed[line.len() - 3] = b'3';
        let error = StoredRow::decode(&changed).unwrap_err();
        assert!(error.starts_with("expected checksum ") && error.contains("found \""));
    }
}
