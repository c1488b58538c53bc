//! Parsers of values that several commands take.

use super::choice::choice;
use clap::builder::TypedValueParser;
use formats::textrace::Encoding;
use std::ops::RangeInclusive;
use std::time::Duration;

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

/// Parser of a number within a range, which has a unit. What is not a number is outside every range.
#[cfg_attr(not(feature = "programs"), allow(dead_code))]
pub(super) fn number_in(
    range: RangeInclusive<f64>,
    unit: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let number = text.trim().parse().ok();
        let found = number.filter(|number| range.contains(number));
        found.ok_or_else(|| {
            let (least, most) = range.clone().into_inner();
            format!("expected {least} to {most} {unit}, found '{text}'")
        })
    }
}

/// A time limit in seconds.
#[cfg_attr(not(feature = "programs"), allow(dead_code))]
pub(super) fn parse_timeout(text: &str) -> Result<Duration, String> {
    let seconds = text.trim().parse().ok();
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.filter(|time| !time.is_zero())
        .ok_or_else(|| format!("expected seconds, more than 0 and less than 1e19, found '{text}'"))
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
    fn numbers_are_within_their_range_and_time_limits_are_times() {
        let millimetres = number_in(0.0..=1000.0, "mm");
        assert_eq!(millimetres("64"), Ok(64.0));
        assert_eq!(millimetres(" 1e3 "), Ok(1000.0));
        for bad in [
            "nan", "inf", "-inf", "-5", "1000.1", "1e400", "", "x", "0x10",
        ] {
            let error = millimetres(bad).unwrap_err();
            assert!(error.contains("0 to 1000 mm"), "{bad}: {error}");
        }
        assert_eq!(parse_timeout("0.5"), Ok(Duration::from_millis(500)));
        assert!(parse_timeout("1e18").is_ok());
        for bad in ["0", "-1", "nan", "inf", "18446744073709551615", "1e400", ""] {
            assert!(parse_timeout(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_take_binary_suffixes() {
        assert_eq!(parse_bytes("64MiB"), Ok(64 << 20));
        assert_eq!(parse_bytes("65536"), Ok(65536));
        for bad in ["", "MiB", "1", "64MB", "-4MiB", "99999999999999999999GiB"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }
}
