//! Errors in a configuration.

use super::{MOST_LINES, MOST_SETS};
use std::borrow::Cow;
use std::fmt::Display;
use std::ops::RangeInclusive;
use thiserror::Error;

/// An invalid configuration.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The number of sets is not a power of two.
    #[error(
        "{level} cache of {size}, {ways} ways, {line_bytes}-byte lines: expected a power-of-two number of sets up to {MOST_SETS}, found {found}; possible: {possible}"
    )]
    Sets {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Size, formatted.
        size: Box<str>,
        /// Ways.
        ways: u32,
        /// Line size in bytes.
        line_bytes: u32,
        /// The number of sets found.
        found: Box<str>,
        /// The nearest possible sizes, and the ways that make this size possible.
        possible: Box<str>,
    },
    /// More lines than the limit.
    #[error(
        "{level} cache of {size}, {line_bytes}-byte lines: expected at most {MOST_LINES} lines in all caches of the level, found {caches} x {found}"
    )]
    Lines {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Size, formatted.
        size: String,
        /// Line size in bytes.
        line_bytes: u32,
        /// Caches of this size.
        caches: u32,
        /// Lines per cache.
        found: u64,
    },
    /// A number of ways that the policy does not support.
    #[error("{level} cache with {policy}: expected {expected} ways, found {found}")]
    Ways {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Replacement policy.
        policy: &'static str,
        /// The supported numbers.
        expected: &'static str,
        /// The number found.
        found: u32,
    },
    /// A value that is not valid for its key.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// Key in the configuration file.
        key: &'static str,
        /// The valid values.
        expected: Cow<'static, str>,
        /// The value found.
        found: String,
    },
}

/// Fails unless `is_accepted`.
pub fn accept(
    is_accepted: bool,
    key: &'static str,
    expected: impl Into<Cow<'static, str>>,
    found: impl Display,
) -> Result<(), ConfigError> {
    match is_accepted {
        true => Ok(()),
        false => Err(ConfigError::Value {
            key,
            expected: expected.into(),
            found: found.to_string(),
        }),
    }
}

/// Fails if the value is outside the range.
pub(crate) fn in_range<T: PartialOrd + Display>(
    key: &'static str,
    value: T,
    range: RangeInclusive<T>,
) -> Result<(), ConfigError> {
    let expected = || format!("{} to {}", range.start(), range.end());
    match range.contains(&value) {
        true => Ok(()),
        false => accept(false, key, expected(), value),
    }
}
