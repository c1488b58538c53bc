//! `--auto`: the budget of a combination of techniques.

use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// A limit that a combination of techniques must keep in every frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Budget {
    /// Mean FLIP inside the lens of the worse eye, compared with the baseline's picture, 0 (lossless) to 1.
    Flip(f64),
    /// Distance in pixels between a point's place in the picture and its true place. Only techniques whose
    /// error is such a shift are allowed.
    Pixels(f64),
    /// Median frame time on this device in milliseconds. The error is minimised within it.
    #[serde(rename = "budget-ms")]
    FrameMs(f64),
}

impl Budget {
    /// The largest error of a frame, if the budget limits errors.
    pub fn error_limit(self) -> Option<f64> {
        match self {
            Self::Flip(limit) | Self::Pixels(limit) => Some(limit),
            Self::FrameMs(_) => None,
        }
    }
}

impl FromStr for Budget {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || {
            format!(
                "expected flip=ERROR from 0 (lossless) to 1, pixels=PX or budget-ms=MS above 0, found '{text}'"
            )
        };
        let (name, value) = text.split_once('=').ok_or_else(known)?;
        let value: f64 = value.parse().map_err(|_| known())?;
        let is_positive = value.is_finite() && value > 0.0;
        match name {
            "flip" if (0.0..=1.0).contains(&value) => Ok(Self::Flip(value)),
            "pixels" if is_positive => Ok(Self::Pixels(value)),
            "budget-ms" if is_positive => Ok(Self::FrameMs(value)),
            _ => Err(known()),
        }
    }
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flip(limit) => write!(f, "flip={limit}"),
            Self::Pixels(limit) => write!(f, "pixels={limit}"),
            Self::FrameMs(limit) => write!(f, "budget-ms={limit}"),
        }
    }
}
