//! Byte sizes in text: `8KiB`, `128 KiB`, `4096`.

use serde::{Deserializer, de};

/// Parses a byte count with an optional unit (`B`, `KiB`, `MiB`). `K` and `KB` mean KiB, because
/// cache sizes are always binary.
///
/// # Errors
/// The text is not a size; names the text and the accepted forms.
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    let (number, unit) = text.split_at(digits);
    let scale: u64 = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "k" | "kb" | "kib" => 1 << 10,
        "m" | "mb" | "mib" => 1 << 20,
        _ => {
            return Err(format!(
                "size `{text}`: expected a number and B, KiB or MiB"
            ));
        }
    };
    number
        .parse::<u64>()
        .ok()
        .and_then(|n| n.checked_mul(scale))
        .ok_or_else(|| format!("size `{text}`: expected a number and B, KiB or MiB"))
}

/// Formats a byte count with the largest binary unit that divides it.
pub fn format_bytes(bytes: u64) -> String {
    match bytes {
        b if b >= 1 << 20 && b % (1 << 20) == 0 => format!("{} MiB", b >> 20),
        b if b >= 1 << 10 && b % (1 << 10) == 0 => format!("{} KiB", b >> 10),
        b => format!("{b} B"),
    }
}

/// For `#[serde(deserialize_with = "crate::size::serde_bytes::deserialize")]`.
pub mod serde_bytes {
    use super::{Deserializer, de, parse_bytes};
    use std::fmt;

    /// Reads a number or a text such as `8KiB`.
    ///
    /// # Errors
    /// The value is not a size.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        struct Size;

        impl de::Visitor<'_> for Size {
            type Value = u64;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str("a number of bytes or a text such as \"8KiB\"")
            }

            fn visit_u64<E: de::Error>(self, bytes: u64) -> Result<u64, E> {
                Ok(bytes)
            }

            fn visit_i64<E: de::Error>(self, bytes: i64) -> Result<u64, E> {
                let negative = |_| E::invalid_value(de::Unexpected::Signed(bytes), &self);
                bytes.try_into().map_err(negative)
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<u64, E> {
                parse_bytes(text).map_err(E::custom)
            }
        }

        deserializer.deserialize_any(Size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_binary_and_optional() {
        assert_eq!(parse_bytes("8KiB"), Ok(8192));
        assert_eq!(parse_bytes(" 128 kb "), Ok(128 << 10));
        assert_eq!(parse_bytes("1M"), Ok(1 << 20));
        assert_eq!(parse_bytes("4096"), Ok(4096));
    }

    #[test]
    fn invalid_sizes_are_refused_with_their_text() {
        for text in [
            "",
            "KiB",
            "8 potatoes",
            "-1",
            "99999999999999999999",
            "18446744073709551615MiB",
        ] {
            assert!(
                parse_bytes(text).unwrap_err().contains("expected a number"),
                "{text}"
            );
        }
    }

    #[test]
    fn an_invalid_size_in_a_file_is_refused_with_the_accepted_forms() {
        #[derive(Debug, serde::Deserialize)]
        struct File {
            #[serde(deserialize_with = "serde_bytes::deserialize")]
            size: u64,
        }
        let read = |value: &str| toml::from_str::<File>(&format!("size = {value}"));
        assert_eq!(read("4096").unwrap().size, 4096);
        assert_eq!(read("\"4KiB\"").unwrap().size, 4096);
        for (value, found) in [
            ("nan", "floating point"),
            ("-1", "integer `-1`"),
            ("[1]", "sequence"),
        ] {
            let error = read(value).unwrap_err().to_string();
            assert!(error.contains(found), "{error}");
            assert!(
                error.contains("a number of bytes or a text such as"),
                "{error}"
            );
        }
    }

    #[test]
    fn formatting_picks_the_largest_exact_unit() {
        assert_eq!(format_bytes(128 << 10), "128 KiB");
        assert_eq!(format_bytes(1 << 20), "1 MiB");
        assert_eq!(format_bytes(1500), "1500 B");
    }
}
