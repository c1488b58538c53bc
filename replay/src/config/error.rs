//! What is wrong with a configuration.

use super::{MOST_LINES, MOST_SETS};
use std::borrow::Cow;
use std::fmt::Display;
use std::ops::RangeInclusive;
use thiserror::Error;

/// A configuration that no machine can have.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConfigError {
    /// Sets are not a power of two.
    #[error(
        "{level} cache of {size}, {ways} ways, {line_bytes}-byte lines: expected a power-of-two number of sets up to {MOST_SETS}, found {found}"
    )]
    Sets {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Size as text.
        size: String,
        /// Ways.
        ways: u32,
        /// Line size.
        line_bytes: u32,
        /// Size over ways and line size.
        found: String,
    },
    /// More lines than this machine can keep.
    #[error(
        "{level} cache of {size}, {line_bytes}-byte lines: expected at most {MOST_LINES} lines in all caches of the level, found {caches} x {found}"
    )]
    Lines {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Size as text.
        size: String,
        /// Line size.
        line_bytes: u32,
        /// Caches of this size.
        caches: u32,
        /// Lines of each.
        found: u64,
    },
    /// Ways that the policy cannot have.
    #[error("{level} cache with {policy}: expected {expected} ways, found {found}")]
    Ways {
        /// `L1`, `L2`, ...
        level: &'static str,
        /// Replacement policy.
        policy: &'static str,
        /// What the policy can have.
        expected: &'static str,
        /// Ways.
        found: u32,
    },
    /// A value that its key does not take.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// Key as in the configuration file.
        key: &'static str,
        /// What is accepted.
        expected: Cow<'static, str>,
        /// What was given.
        found: String,
    },
}

/// Refuses a value unless `is_accepted`.
pub(crate) fn accept(
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

/// Refuses a value outside a range.
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
