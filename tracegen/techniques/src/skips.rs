//! Skips of invisible work, on by default. They do not change any output.

use std::fmt;
use std::str::FromStr;

/// Enabled skips. Pictures and traces are bit-identical with and without each of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Skips {
    /// Texels of images that no view samples.
    pub images: bool,
    /// Mip levels finer than any that a view can sample.
    pub mip_levels: bool,
    /// Shadow cascades in which no visible surface looks up its shadow.
    pub cascades: bool,
    /// Draws that do not touch the captured region of a view.
    pub regions: bool,
}

/// Name, and access to the flag of [`Skips`].
type Row = (&'static str, fn(&mut Skips) -> &mut bool);
const ROWS: [Row; 4] = [
    ("images", |skips| &mut skips.images),
    ("mip-levels", |skips| &mut skips.mip_levels),
    ("cascades", |skips| &mut skips.cascades),
    ("regions", |skips| &mut skips.regions),
];

impl Default for Skips {
    fn default() -> Self {
        Self {
            images: true,
            mip_levels: true,
            cascades: true,
            regions: true,
        }
    }
}

impl Skips {
    /// No skips: everything is prepared and drawn, visible or not.
    pub const NONE: Self = Self {
        images: false,
        mip_levels: false,
        cascades: false,
        regions: false,
    };

    /// All skips except the named ones.
    pub fn without(kept: &[Skip]) -> Self {
        let mut skips = Self::default();
        for Skip(number) in kept {
            match ROWS.get(*number) {
                Some((_, switch)) => *switch(&mut skips) = false,
                None => skips = Self::NONE,
            }
        }
        skips
    }
}

/// A skip selected by its name, or all of them by `all`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Skip(usize);

impl FromStr for Skip {
    type Err = UnknownSkip;

    fn from_str(name: &str) -> Result<Self, UnknownSkip> {
        if name == "all" {
            return Ok(Self(ROWS.len()));
        }
        let found = ROWS.iter().position(|(known, _)| *known == name);
        found.map(Self).ok_or_else(|| UnknownSkip(name.into()))
    }
}

/// Error for an unknown name of a skip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownSkip(String);

impl fmt::Display for UnknownSkip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = ROWS.map(|(name, _)| name).join(", ");
        write!(f, "expected all or one of {names}, found '{}'", self.0)
    }
}

impl std::error::Error for UnknownSkip {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_skip_is_switched_off_by_its_name_and_all_of_them_by_all() {
        let skip = |name: &str| name.parse::<Skip>().unwrap();
        assert_eq!(Skips::without(&[]), Skips::default());
        assert_eq!(Skips::without(&[skip("all")]), Skips::NONE);
        let each: Vec<Skip> = ROWS.iter().map(|(name, _)| skip(name)).collect();
        assert_eq!(Skips::without(&each), Skips::NONE);
        let some = Skips::without(&[skip("cascades"), skip("mip-levels")]);
        assert!(!some.cascades && !some.mip_levels && some.images && some.regions);
        let error = "mips".parse::<Skip>().unwrap_err().to_string();
        assert!(
            error.contains("mip-levels") && error.contains("'mips'"),
            "{error}"
        );
    }
}
