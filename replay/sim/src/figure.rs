//! A figure and how far it carries: its lowest and highest value, and why the two differ.

use serde::Serialize;
use std::fmt;

/// A figure. Without doubt, `low` and `high` equal `value`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// The figure, or its estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Probability that the ends enclose the true value; `None` for exact figures and for bounds.
    pub confidence: Option<f64>,
    /// Where the doubt is from.
    pub because: Because,
}

/// Where the doubt about a figure is from. Sampling has a probability and bounds have none, so an interval is never
/// from both.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "doubt", rename_all = "kebab-case")]
pub enum Because {
    /// There is none: everything was replayed.
    Exact,
    /// A random sample was replayed.
    Sampling {
        /// Method of the interval.
        method: &'static str,
        /// Size of the sample.
        n: usize,
        /// Size of the population.
        of: usize,
        /// Degrees of freedom of the estimated variance.
        degrees_of_freedom: f64,
    },
    /// The ends are the value and the largest error on scenes whose values are known.
    Residuals {
        /// Number of scenes.
        scenes: usize,
        /// Number of their sources; scenes of one source share content.
        sources: usize,
    },
    /// The ends are the lowest and the highest value over this range.
    Bounds {
        /// The range, in words.
        over: String,
    },
}

impl Figure {
    /// A figure of a replay of everything.
    pub fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
            confidence: None,
            because: Because::Exact,
        }
    }

    /// An estimate, plus or minus `half`.
    pub fn sampled(value: f64, half: f64, confidence: f64, because: Because) -> Self {
        Self {
            value,
            low: value - half,
            high: value + half,
            confidence: Some(confidence),
            because,
        }
    }

    /// A figure with its lowest and highest value over a range, which `values` are from.
    pub fn bounded(value: f64, values: impl IntoIterator<Item = f64>, over: String) -> Self {
        let ends = |(low, high): (f64, f64), v: f64| (low.min(v), high.max(v));
        let (low, high) = values.into_iter().fold((value, value), ends);
        Self {
            value,
            low,
            high,
            confidence: None,
            because: Because::Bounds { over },
        }
    }

    /// The same figure in another unit; `factor` is positive.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            low: self.low * factor,
            high: self.high * factor,
            ..self
        }
    }

    /// Another figure with the same doubt.
    #[must_use]
    pub fn around(self, value: f64) -> Self {
        let half = self.half();
        Self {
            value,
            low: value - half,
            high: value + half,
            ..self
        }
    }

    /// Half the width of the interval.
    pub fn half(&self) -> f64 {
        (self.high - self.low) / 2.0
    }
}

impl fmt::Display for Because {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => f.write_str("exact: everything was replayed"),
            Self::Sampling {
                method,
                n,
                of,
                degrees_of_freedom,
            } => write!(
                f,
                "{n} of {of} replayed: {method}, {degrees_of_freedom} degrees of freedom"
            ),
            Self::Residuals { scenes, sources } => {
                write!(f, "largest error on {scenes} scenes of {sources} sources")
            }
            Self::Bounds { over } => write!(f, "lowest and highest over {over}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_enclose_the_value_and_have_no_confidence() {
        let figure = Figure::bounded(3.0, [4.0, 2.5], "two starts".into()).times(2.0);
        assert_eq!((figure.value, figure.low, figure.high), (6.0, 5.0, 8.0));
        assert_eq!(figure.confidence, None);
        let json = serde_json::to_value(&figure).unwrap();
        assert_eq!(json["because"]["doubt"], "bounds");
        assert_eq!(
            figure.because.to_string(),
            "lowest and highest over two starts"
        );
    }

    #[test]
    fn an_exact_figure_has_no_width() {
        let figure = Figure::exact(7.0);
        assert_eq!((figure.half(), figure.confidence), (0.0, None));
        assert_eq!(figure.because.to_string(), "exact: everything was replayed");
    }
}
