//! Extreme captures: each sweep drives one parameter of `tracegen raster` to the limits of arithmetic, and
//! compares the capture with a reference or with a capture of the same scene without extremes.
//!
//! A point passes if the error stays within its bound, or if the program reports the problem by refusing
//! (exit code 2) or by a warning. All other results are failures.

mod lanes;
mod probe;
pub mod report;
mod shapes;
mod sweeps;

pub use report::Report;
pub use sweeps::SWEEPS;

use probe::{Capture, Probe, Ran};
use serde::Serialize;
use std::path::Path;

/// A sweep: a file in [`sweeps`] and a row of [`SWEEPS`].
pub struct Sweep {
    /// Name on the command line and in the table.
    pub name: &'static str,
    /// The parameter, and what the error is measured against.
    pub about: &'static str,
    /// Bounds of its points.
    bounds: Bounds,
    /// Part of the warning that points beyond the bounds must print; none if no point may exceed them.
    warning: Option<&'static str>,
    run: fn(&mut Points<'_>) -> anyhow::Result<()>,
}

/// Largest errors that a sweep's points may have without a warning.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Bounds {
    /// Fragments that only the capture or only the reference has, in percent of all.
    pub fragments_pct: f64,
    /// Distance of texture coordinates, texels.
    pub uv_texels: f64,
}

/// Differences of a capture from its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Error {
    /// Fragments (pixel and primitive) in either of them.
    pub fragments: u64,
    /// Fragments that only one of them has, in percent.
    pub fragments_pct: f64,
    /// Largest distance of texture coordinates in texels; whole repeats are ignored.
    pub uv_texels: f64,
}

/// Result of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Captured within the bounds.
    Within,
    /// Captured beyond the bounds, with the expected warning.
    Warned,
    /// Refused with exit code 2.
    Refused,
    /// Captured beyond the bounds without the expected warning, or neither captured nor refused.
    Broken,
}

impl Outcome {
    /// Result of a run, with the error of its capture if there is one.
    fn of(ran: &Ran, error: Option<&Error>, bounds: &Bounds, warning: Option<&str>) -> Self {
        match (ran.exit_code, error) {
            (Some(0), Some(error)) => {
                let within = error.fragments_pct <= bounds.fragments_pct
                    && error.uv_texels <= bounds.uv_texels;
                let warned = warning.is_some_and(|part| ran.said(part).is_some());
                match (within, warned) {
                    (true, _) => Self::Within,
                    (false, true) => Self::Warned,
                    (false, false) => Self::Broken,
                }
            }
            (Some(2), None) if ran.said("error:").is_some() => Self::Refused,
            _ => Self::Broken,
        }
    }
}

/// A point of a sweep.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Point {
    /// Value of the parameter.
    pub at: String,
    /// Result of the point.
    pub outcome: Outcome,
    /// Its error, if there is a capture.
    pub error: Option<Error>,
    /// Output of the program: its error, the expected warning, or its first warning.
    pub said: Option<String>,
}

/// The points of a sweep, in the order of their runs.
pub struct Points<'a> {
    probe: &'a Probe<'a>,
    /// Whether points that take minutes are included.
    full: bool,
    bounds: Bounds,
    warning: Option<&'static str>,
    points: Vec<Point>,
}

impl Points<'_> {
    /// Captures a scene of the sweep's folder and adds the point.
    fn add(
        &mut self,
        at: impl Into<String>,
        capture: &Capture,
        measure: impl FnOnce(&Probe<'_>) -> anyhow::Result<Error>,
    ) -> anyhow::Result<()> {
        let ran = self.probe.capture(capture)?;
        let captured = ran.exit_code == Some(0);
        let error = captured.then(|| measure(self.probe)).transpose()?;
        let outcome = Outcome::of(&ran, error.as_ref(), &self.bounds, self.warning);
        let belongs = self.warning.and_then(|part| ran.said(part));
        let said = ran.said("error:").or(belongs).or(ran.said(""));
        self.points.push(Point {
            at: at.into(),
            outcome,
            error,
            said: said.map(str::to_owned),
        });
        Ok(())
    }

    /// Like [`Self::add`], compared with the reference in double precision.
    fn add_against_reference(
        &mut self,
        at: impl Into<String>,
        capture: &Capture,
    ) -> anyhow::Result<()> {
        self.add(at, capture, |probe| probe.against_reference(capture))
    }
}

/// Runs the named sweeps (all if there are none), including points that take minutes if `full` is set;
/// temporary files are written to `folder`.
///
/// # Errors
/// A folder that cannot be written, or a program that cannot be started.
pub fn run(
    folder: &Path,
    names: &[String],
    full: bool,
    mut progress: impl FnMut(&Sweep),
) -> anyhow::Result<Report> {
    let probe = Probe::new(folder)?;
    let mut report = Report::default();
    let chosen = |sweep: &&Sweep| names.is_empty() || names.iter().any(|name| name == sweep.name);
    for sweep in SWEEPS.iter().filter(chosen) {
        progress(sweep);
        // Files that a sweep may replace.
        probe.write("stress.png", shapes::checker([64, 64])?)?;
        probe.write("holes.png", shapes::holes([64, 64])?)?;
        probe.write("stress.mtl", shapes::MATERIALS)?;
        let mut points = Points {
            probe: &probe,
            full,
            bounds: sweep.bounds,
            warning: sweep.warning,
            points: Vec::new(),
        };
        (sweep.run)(&mut points)?;
        report.add(sweep, points.points);
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_broken_unless_it_keeps_its_bounds_or_the_program_says_that_it_does_not() {
        let bounds = Bounds {
            fragments_pct: 0.1,
            uv_texels: 0.5,
        };
        let off = |fragments_pct: f64, uv_texels: f64| Error {
            fragments: 1000,
            fragments_pct,
            uv_texels,
        };
        let of = |exit_code: Option<i32>, said: &str, error: Option<Error>| {
            let ran = Ran {
                exit_code,
                said: said.lines().map(str::to_owned).collect(),
            };
            Outcome::of(&ran, error.as_ref(), &bounds, Some("too thin"))
        };
        assert_eq!(of(Some(0), "", Some(off(0.1, 0.5))), Outcome::Within);
        let both = "warning: a texture is missing\nwarning: triangles are too thin";
        assert_eq!(of(Some(0), both, Some(off(0.2, 0.0))), Outcome::Warned);
        assert_eq!(of(Some(2), "error: no", None), Outcome::Refused);
        for broken in [
            of(Some(0), "", Some(off(0.2, 0.0))),
            of(Some(0), "", Some(off(0.0, 0.6))),
            of(Some(0), "", Some(off(0.0, f64::NAN))),
            // Another warning does not count.
            of(
                Some(0),
                "warning: a texture is missing",
                Some(off(0.2, 0.0)),
            ),
            of(Some(2), "", None),
            of(Some(101), "error: no", None),
            of(None, "error: no", None),
        ] {
            assert_eq!(broken, Outcome::Broken);
        }
    }

    #[test]
    fn names_of_sweeps_are_their_own_and_the_report_counts_what_is_broken() {
        let mut names = SWEEPS.each_ref().map(|sweep| sweep.name);
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        let point = |outcome| Point {
            at: "a".into(),
            outcome,
            error: None,
            said: Some("a | b".into()),
        };
        let mut report = Report::default();
        let points = [Outcome::Within, Outcome::Broken, Outcome::Refused];
        report.add(&SWEEPS[0], points.map(point).to_vec());
        assert_eq!(report.broken(), 1);
        let text = report.markdown();
        assert!(
            text.contains("| translation | 3 | 1 | 0 | 1 | 1 |"),
            "{text}"
        );
        assert!(
            text.contains("| a | broken | - | - | - | a \\| b |"),
            "{text}"
        );
    }
}
