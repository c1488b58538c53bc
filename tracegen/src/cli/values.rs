//! Parsers of values that several commands take.

use super::choice::choice;
use clap::builder::TypedValueParser;
use formats::textrace::Encoding;

pub(super) fn encoding_parser() -> impl TypedValueParser<Value = Encoding> {
    choice([
        ("delta", Encoding::Delta, "Bit-packed differences"),
        (
            "planes",
            Encoding::Planes,
            "A plane for each primitive: about 0.5 of the size, slower to read and to write",
        ),
    ])
}

/// Bytes with an optional binary suffix: `64MiB`, `512KiB`, `1GiB`, `4096`.
pub(super) fn parse_bytes(text: &str) -> Result<u64, String> {
    let digits = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    let (number, suffix) = text.split_at(digits);
    let shift = match suffix {
        "" | "B" => Some(0),
        "KiB" => Some(10),
        "MiB" => Some(20),
        "GiB" => Some(30),
        _ => None,
    };
    shift
        .and_then(|shift| number.parse::<u64>().ok()?.checked_mul(1 << shift))
        .filter(|bytes| *bytes >= 4096)
        .ok_or_else(|| format!("expected at least 4KiB as in 64MiB or 1048576, found '{text}'"))
}

/// Exactly N numbers separated by commas.
pub(super) fn numbers<const N: usize>(text: &str) -> Option<[f32; N]> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_take_binary_suffixes() {
        assert_eq!(parse_bytes("64MiB"), Ok(64 << 20));
        assert_eq!(parse_bytes("65536"), Ok(65536));
        for bad in ["", "MiB", "1", "64MB", "-4MiB", "99999999999999999999GiB"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }
}
