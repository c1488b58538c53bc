//! What happens to cache contents between the frames of a trace.

use super::ConfigError;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// What happens to cache contents between the frames of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BetweenFrames {
    /// Caches keep their lines, so that a frame can hit lines of the frame before.
    #[default]
    Keep,
    /// Caches are emptied, as if other work ran between the frames.
    Flush,
    /// Other work empties the L1 caches and fills this percentage (1 to 100) of each lower level with its own
    /// lines.
    Lose(u8),
}

impl BetweenFrames {
    /// True if all caches are emptied, for callers that do not simulate other work.
    ///
    /// # Errors
    /// Other work fills part of the caches.
    pub fn empties(self) -> Result<bool, ConfigError> {
        match self {
            Self::Keep => Ok(false),
            Self::Flush => Ok(true),
            Self::Lose(_) => Err(ConfigError::Value {
                key: "between_frames",
                expected: "keep or flush, because this command does not simulate other work".into(),
                found: self.to_string(),
            }),
        }
    }

    /// The percentage of each cache that other work fills, if it fills a part.
    pub const fn lost_percent(self) -> Option<u8> {
        match self {
            Self::Lose(percent) => Some(percent),
            Self::Keep | Self::Flush => None,
        }
    }
}

const LOSE: &str = "lose-";

impl fmt::Display for BetweenFrames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Keep => f.write_str("keep"),
            Self::Flush => f.write_str("flush"),
            Self::Lose(percent) => write!(f, "{LOSE}{percent}"),
        }
    }
}

impl FromStr for BetweenFrames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let percent = text.strip_prefix(LOSE).and_then(|rest| rest.parse().ok());
        match (text, percent) {
            ("keep", _) => Ok(Self::Keep),
            ("flush", _) => Ok(Self::Flush),
            (_, Some(percent @ 1..=100)) => Ok(Self::Lose(percent)),
            _ => Err(format!(
                "expected keep, flush, or lose-N with N from 1 to 100 percent of the L2, found `{text}`"
            )),
        }
    }
}

impl Serialize for BetweenFrames {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for BetweenFrames {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parse_to_the_values_that_print_them() {
        for name in ["keep", "flush", "lose-1", "lose-50", "lose-100"] {
            let found: BetweenFrames = name.parse().unwrap();
            assert_eq!(found.to_string(), name);
        }
        for name in ["", "lose", "lose-0", "lose-101", "lose-half", "Keep"] {
            let error = name.parse::<BetweenFrames>().unwrap_err();
            assert!(error.ends_with(&format!("found `{name}`")), "{error}");
        }
    }
}
