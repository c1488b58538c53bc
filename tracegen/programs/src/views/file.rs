//! Files of rules, for programs that no built-in rule fits.
//!
//! ```toml
//! # The first rule whose conditions a draw satisfies determines what it shows.
//! [[rule]]
//! size = [1440, 1600]     # of the target
//! viewport = [0, 0, 1440, 1600]
//! shows = "left"
//!
//! [[rule]]
//! pass = 3                # as `tracegen app --list` numbers them
//! shows = "right"
//! ```

use super::{Drawn, Found, LEFT, Other, RIGHT, Role, View, ViewsError, viewport};
use serde::Deserialize;
use std::path::Path;
use thiserror::Error;

/// Reasons why a file of rules cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum FileError {
    /// The file cannot be read.
    #[error("{file}: {reason}")]
    Io {
        /// Name of the file.
        file: String,
        /// Error of the system.
        reason: String,
    },
    /// The content is not a list of rules.
    #[error("{file}: {reason}")]
    Parse {
        /// Name of the file.
        file: String,
        /// Line, and what was expected there.
        reason: String,
    },
    /// No rule assigns a draw to an eye.
    #[error(
        "{0}: expected a rule that shows \"left\", \"right\", \"both\" or \"views\", found none"
    )]
    NoEye(String),
}

/// The rules of a file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RuleFile {
    rule: Vec<FileRule>,
}

/// A rule: conditions on a draw, and its role.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct FileRule {
    /// Number of the render pass in the frame.
    pass: Option<usize>,
    /// Width and height of the render area.
    size: Option<[u32; 2]>,
    /// Left, top, width and height.
    viewport: Option<[i64; 4]>,
    /// `VkFormat` of the target.
    format: Option<i32>,
    /// Whether the draw writes depth and no colour.
    depth_only: Option<bool>,
    /// Colour channels that the draw writes: `"r"`, `"gb"`.
    channels: Option<Channels>,
    /// View mask of the render pass; 0 without multiview.
    view_mask: Option<u32>,
    shows: Shows,
}

/// Colour channels, `VkColorComponentFlags`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
struct Channels(u32);

impl TryFrom<String> for Channels {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let bit = |letter: char| "rgba".find(letter).map(|place| 1 << place);
        let bits: Option<u32> = text
            .chars()
            .try_fold(0, |all, letter| Some(all | bit(letter)?));
        let error = || format!("expected some of the letters rgba, found {text:?}");
        bits.map(Self).ok_or_else(error)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Shows {
    Left,
    Right,
    /// One picture for both eyes.
    Both,
    /// The views of a multiview pass.
    Views,
    Shadow,
    Ignored,
}

impl Shows {
    fn role(self) -> Role {
        match self {
            Self::Left => LEFT,
            Self::Right => RIGHT,
            Self::Both => Role::Seen(None),
            Self::Views => Role::Multiview,
            Self::Shadow => Role::Shadow,
            Self::Ignored => Role::Other(Other::Ignored),
        }
    }

    fn is_eye(self) -> bool {
        matches!(self, Self::Left | Self::Right | Self::Both | Self::Views)
    }
}

impl RuleFile {
    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be read, or its content is not a list of rules.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| FileError::Io {
            file: file.clone(),
            reason: error.to_string(),
        })?;
        Self::parse(&file, &text)
    }

    /// Parses rules.
    ///
    /// # Errors
    /// The text is not a list of rules.
    pub fn parse(file: &str, text: &str) -> Result<Self, FileError> {
        let rules: Self = toml::from_str(text).map_err(|error| FileError::Parse {
            file: file.to_owned(),
            reason: error.to_string().trim_end().to_owned(),
        })?;
        if rules.rule.iter().any(|rule| rule.shows.is_eye()) {
            Ok(rules)
        } else {
            Err(FileError::NoEye(file.to_owned()))
        }
    }

    pub(super) fn find(&self, frame: u32, draws: &[Drawn<'_>]) -> Result<Found, ViewsError> {
        let role = |draw: &Drawn<'_>| {
            let fitting = self.rule.iter().find(|rule| rule.fits(draw));
            fitting.map(|rule| rule.shows.role())
        };
        let roles: Vec<(usize, Role)> = draws
            .iter()
            .filter_map(|draw| Some((draw.place, role(draw)?)))
            .collect();
        let with = |wanted: &dyn Fn(Role) -> bool| {
            let mut of = draws.iter().filter(|draw| role(draw).is_some_and(wanted));
            of.find(|draw| draw.weight > 0)
        };
        let of_both = |role: Role| matches!(role, Role::Seen(None) | Role::Multiview);
        let view = |draw: Option<&Drawn<'_>>| draw.map(|draw| viewport(draw.info));
        let both = with(&of_both);
        let eyes = match view(both) {
            Some(view) => Some([view; 2]),
            None => {
                let [left, right] = [LEFT, RIGHT].map(|eye| view(with(&|role| role == eye)));
                left.zip(right).map(<[View; 2]>::from)
            }
        };
        let eyes = eyes.ok_or(ViewsError::NotBy {
            frame,
            rule: "file",
        })?;
        if eyes[0].size != eyes[1].size {
            return Err(ViewsError::Sizes {
                frame,
                left: eyes[0].size,
                right: eyes[1].size,
            });
        }
        let mask = both
            .and_then(|draw| draw.pass)
            .map_or(0, |pass| pass.view_mask);
        let first = mask.trailing_zeros();
        Ok(Found {
            eyes,
            layers: match mask.count_ones() {
                0 | 1 => [0, 1],
                _ => [first, (mask & (mask - 1)).trailing_zeros()],
            },
            roles,
            weight: 0,
        })
    }
}

impl FileRule {
    fn fits(&self, draw: &Drawn<'_>) -> bool {
        let area = draw
            .pass
            .map(|pass| [pass.area[2], pass.area[3]].map(|s| s.max(0) as u32));
        let View { origin, size } = viewport(draw.info);
        let view: [i64; 4] = [
            origin[0].into(),
            origin[1].into(),
            size[0].into(),
            size[1].into(),
        ];
        let is = |condition: Option<bool>| condition.unwrap_or(true);
        is(self.pass.map(|pass| pass == draw.pass_number))
            && is(self.size.map(|size| area == Some(size)))
            && is(self.viewport.map(|wanted| wanted == view))
            && is(self
                .format
                .map(|format| draw.target().is_some_and(|t| t.format == format)))
            && is(self
                .depth_only
                .map(|depth_only| depth_only == draw.is_depth_alone()))
            && is(self.channels.map(|channels| channels.0 == draw.channels()))
            && is(self
                .view_mask
                .map(|mask| draw.pass.is_some_and(|pass| pass.view_mask == mask)))
    }
}
