//! `--auto`: what a combination of techniques must keep.

use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// What a combination of techniques must keep in every frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Budget {
    /// Mean FLIP inside the lens of the worse eye, against the baseline's picture, 0 to 1.
    Flip(f64),
    /// Pixels between a point's place in the picture and its true place. Only techniques whose
    /// error is such a shift may be used.
    Pixels(f64),
    /// Median time of a frame on the device as it is, milliseconds. The error is as small as that
    /// allows.
    BudgetMs(f64),
}

/// The search keeps this share of an error budget: other frames may be worse than those it sees.
const SEARCH_SHARE: f64 = 0.8;

impl Budget {
    /// The largest error of a frame, if errors are bounded.
    #[must_use]
    pub fn error_limit(self) -> Option<f64> {
        match self {
            Self::Flip(limit) | Self::Pixels(limit) => Some(limit),
            Self::BudgetMs(_) => None,
        }
    }

    /// The largest error of a frame that the search takes.
    #[must_use]
    pub fn search_limit(self) -> Option<f64> {
        match self {
            Self::Flip(limit) => Some(SEARCH_SHARE * limit),
            // The shift is a bound that holds for every frame alike.
            Self::Pixels(limit) => Some(limit),
            Self::BudgetMs(_) => None,
        }
    }
}

impl FromStr for Budget {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || {
            format!("expected flip=ERROR, pixels=PX or budget-ms=MS, each above 0, found '{text}'")
        };
        let (name, value) = text.split_once('=').ok_or_else(known)?;
        let value: f64 = value.parse().map_err(|_| known())?;
        if !(value.is_finite() && value > 0.0) {
            return Err(known());
        }
        match name {
            "flip" => Ok(Self::Flip(value)),
            "pixels" => Ok(Self::Pixels(value)),
            "budget-ms" => Ok(Self::BudgetMs(value)),
            _ => Err(known()),
        }
    }
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flip(limit) => write!(f, "flip={limit}"),
            Self::Pixels(limit) => write!(f, "pixels={limit}"),
            Self::BudgetMs(limit) => write!(f, "budget-ms={limit}"),
        }
    }
}
