//! Byte sizes as people write them: `8KiB`, `128 KiB`, `4096`.

use serde::{Deserialize, Deserializer, Serializer, de};

/// Parses a byte count with an optional binary unit (`B`, `KiB`, `MiB`; `K`/`KB` are read as KiB
/// because cache sizes are always binary).
///
/// # Errors
/// Says what was found and what is accepted.
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

/// Writes a byte count with the largest binary unit that divides it.
#[must_use]
pub fn format_bytes(bytes: u64) -> String {
    match bytes {
        b if b >= 1 << 20 && b % (1 << 20) == 0 => format!("{} MiB", b >> 20),
        b if b >= 1 << 10 && b % (1 << 10) == 0 => format!("{} KiB", b >> 10),
        b => format!("{b} B"),
    }
}

/// For `#[serde(with = "crate::size::serde_bytes")]`: a number in outputs, a number or a text with
/// a unit in inputs.
pub mod serde_bytes {
    use super::{Deserialize, Deserializer, Serializer, de, parse_bytes};

    /// Writes the number.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(bytes: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(*bytes)
    }

    /// Reads a number or a text such as `8KiB`.
    ///
    /// # Errors
    /// Names the text that is no size.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Size {
            Number(u64),
            Text(String),
        }
        match Size::deserialize(deserializer)? {
            Size::Number(bytes) => Ok(bytes),
            Size::Text(text) => parse_bytes(&text).map_err(de::Error::custom),
        }
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
    fn nonsense_is_refused_by_name() {
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
    fn formatting_picks_the_largest_exact_unit() {
        assert_eq!(format_bytes(128 << 10), "128 KiB");
        assert_eq!(format_bytes(1 << 20), "1 MiB");
        assert_eq!(format_bytes(1500), "1500 B");
    }
}
