//! The rows of the table of culling techniques, from which flags, settings, help and error messages are generated.

use super::{CullInput, NAMES, TABLE, Volumes};
use crate::rig::TooWide;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::str::FromStr;

/// A row of the table.
#[derive(Debug)]
pub struct Technique {
    name: &'static str,
    title: &'static str,
    help: &'static str,
    lossless: bool,
    volumes: fn(&CullInput<'_>) -> Result<Volumes, TooWide>,
}

pub(super) const fn row(
    name: &'static str,
    title: &'static str,
    lossless: bool,
    help: &'static str,
    volumes: fn(&CullInput<'_>) -> Result<Volumes, TooWide>,
) -> Technique {
    Technique {
        name,
        title,
        help,
        lossless,
        volumes,
    }
}

macro_rules! techniques {
    ($($id:ident = $row:expr;)+) => {
        impl Culling {
            $(
                #[doc = concat!("`", stringify!($id), "` of the table.")]
                pub const $id: Self = Self(&$row);
            )+
        }

        const TABLE: &[Culling] = &[$(Culling::$id),+];
        const NAMES: &[&str] = &[$(Culling::$id.name()),+];
    };
}

pub(super) use techniques;

/// A culling technique: a reference to its row. It is serialised as its name.
#[derive(Clone, Copy, Debug)]
pub struct Culling(pub(super) &'static Technique);

impl Culling {
    /// Every technique, in the order of the table.
    pub fn all() -> impl ExactSizeIterator<Item = Self> {
        TABLE.iter().copied()
    }

    /// Every name, in the order of the table.
    pub fn names() -> &'static [&'static str] {
        NAMES
    }

    /// Name in flags, settings and results.
    pub const fn name(self) -> &'static str {
        self.0.name
    }

    /// Name in tables and plots.
    pub fn title(self) -> &'static str {
        self.0.title
    }

    /// One line of help.
    pub fn help(self) -> &'static str {
        self.0.help
    }

    /// The volumes in which draws may be visible.
    pub(super) fn volumes(self, frame: &CullInput<'_>) -> Result<Volumes, TooWide> {
        (self.0.volumes)(frame)
    }

    /// Whether all draws visible inside the lens are kept.
    pub fn is_lossless(self) -> bool {
        self.0.lossless
    }
}

impl Default for Culling {
    /// The baseline.
    fn default() -> Self {
        Self::PER_EYE
    }
}

impl PartialEq for Culling {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Culling {}

impl fmt::Display for Culling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Error for an unknown name of a technique.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown culling '{0}': expected one of {known}", known = NAMES.join(", "))]
pub struct UnknownCulling(String);

impl FromStr for Culling {
    type Err = UnknownCulling;

    fn from_str(name: &str) -> Result<Self, UnknownCulling> {
        Self::all()
            .find(|row| row.name() == name)
            .ok_or_else(|| UnknownCulling(name.to_owned()))
    }
}

impl Serialize for Culling {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Culling {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        (name.parse()).map_err(|_| de::Error::unknown_variant(&name, NAMES))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_is_found_by_its_name_and_no_other() {
        for technique in Culling::all() {
            let name = technique.name();
            assert_eq!(name.parse(), Ok(technique));
            assert_eq!(Culling::all().filter(|t| t.name() == name).count(), 1);
        }
        let error = "octree".parse::<Culling>().unwrap_err().to_string();
        assert!(
            error.contains("'octree'") && error.contains("none, per-eye"),
            "{error}"
        );
    }
}
