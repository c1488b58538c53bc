//! The table of culling techniques, from which flags, settings, help and error messages are generated.

use super::{CullInput, Volumes};
use super::{
    conical, conical_round_robin, conical_superfrustum, none, per_eye, round_robin, superfrustum,
};
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

const fn row(
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
        const NAMES: &[&str] = &[$(Culling::$id.0.name),+];
    };
}

techniques! {
    // constant                  name                    title                              inside the lens, nothing visible is lost   help
    NONE                 = row("none",                 "No culling",                      true,  "Every draw, in both eyes", none::volumes);
    PER_EYE              = row("per-eye",              "Per-eye frustum culling",         true,  "What enters either eye's frustum: two frusta, their lists merged", per_eye::volumes);
    SUPERFRUSTUM         = row("superfrustum",         "Superfrustum culling",            true,  "What enters one frustum around both eyes'", superfrustum::volumes);
    ROUND_ROBIN          = row("round-robin",          "Round-robin culling",             false, "What enters the left eye's frustum in even frames, the right eye's in odd ones", round_robin::volumes);
    CONICAL              = row("conical",              "Conical culling",                 true,  "What enters the part of either eye's frustum that its lens shows", conical::volumes);
    CONICAL_ROUND_ROBIN  = row("conical-round-robin",  "Conical round-robin culling",     false, "What the left eye's lens shows in even frames, the right eye's in odd ones", conical_round_robin::volumes);
    CONICAL_SUPERFRUSTUM = row("conical-superfrustum", "Conical superfrustum culling",    true,  "What enters one cone around what both lenses show", conical_superfrustum::volumes);
}

/// A culling technique: a reference to its row. It is serialised as its name.
#[derive(Clone, Copy, Debug)]
pub struct Culling(&'static Technique);

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
    pub fn name(self) -> &'static str {
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
