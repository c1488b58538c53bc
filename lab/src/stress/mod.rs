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

use probe::{Capture, Probe, Ran, Views};
use serde::Serialize;
use std::path::Path;

/// A sweep: a row of [`SWEEPS`].
pub struct Sweep {
    /// Name on the command line and in the table.
    pub name: &'static str,
    /// The parameter, and what the error is measured against.
    pub about: &'static str,
    /// Bounds of its points.
    bounds: Bounds,
    /// Part of the warning that points beyond the bounds must print; none if no point may exceed them.
    warning: Option<&'static str>,
    /// Its cases; those that take minutes only if the argument is true.
    cases: fn(bool) -> sweeps::Cases,
}

/// A point before it runs: a scene, how it is captured, and what the capture is compared with.
struct Case {
    /// Value of the parameter.
    at: String,
    /// Name of the scene's file.
    file: &'static str,
    /// Its content.
    scene: String,
    /// Flags after `tracegen raster SCENE`, separated by spaces.
    flags: String,
    /// Size of the texture `stress.png`.
    texture_px: [u32; 2],
    against: Against,
}

impl Case {
    /// An OBJ scene, compared with the reference.
    fn new(at: impl Into<String>, scene: String, flags: impl Into<String>) -> Self {
        Self {
            at: at.into(),
            file: "a.obj",
            scene,
            flags: flags.into(),
            texture_px: [64, 64],
            against: Against::Reference,
        }
    }
}

/// What a capture is compared with.
enum Against {
    /// The reference in double precision.
    Reference,
    /// The reference in double precision; later points are compared with this capture.
    ReferenceAsFirst,
    /// The last capture of [`Self::ReferenceAsFirst`].
    First,
    /// The mirror image of a capture of this OBJ scene with the same flags, and the width of its pictures.
    MirrorImageOf(String, u32),
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

/// Eyes exchanged and columns mirrored, in pictures of a width.
fn mirrored([left, right]: Views, width_px: u32) -> Views {
    [right, left].map(|view| {
        let fragments = view.into_iter();
        let mirrored = fragments.map(|(([x, y], primitive), lane)| {
            let pixel = [width_px - 1 - x, y];
            ((pixel, primitive), lane)
        });
        mirrored.collect()
    })
}

impl Sweep {
    /// Runs a case; `first` keeps the capture that later cases are compared with.
    fn run(&self, case: Case, probe: &Probe<'_>, first: &mut Views) -> anyhow::Result<Point> {
        probe.write("stress.png", shapes::checker(case.texture_px)?)?;
        let mut mirror_image = Views::default();
        if let Against::MirrorImageOf(scene, width_px) = &case.against {
            let scene = probe.write("a.obj", scene)?;
            probe.capture(&Capture::new(scene, &case.flags))?;
            mirror_image = mirrored(probe.views()?, *width_px);
        }
        let scene = probe.write(case.file, case.scene)?;
        let capture = Capture::new(scene, &case.flags);
        let ran = probe.capture(&capture)?;
        let error = match (&case.against, ran.exit_code) {
            (Against::Reference | Against::ReferenceAsFirst, Some(0)) => {
                Some(probe.against_reference(&capture)?)
            }
            (Against::First, Some(0)) => Some(probe.against(first)?),
            (Against::MirrorImageOf(..), Some(0)) => Some(probe.against(&mirror_image)?),
            _ => None,
        };
        if matches!(case.against, Against::ReferenceAsFirst) {
            *first = probe.views()?;
        }
        let outcome = Outcome::of(&ran, error.as_ref(), &self.bounds, self.warning);
        let belongs = self.warning.and_then(|part| ran.said(part));
        let said = ran.said("error:").or(belongs).or(ran.said(""));
        Ok(Point {
            at: case.at,
            outcome,
            error,
            said: said.map(str::to_owned),
        })
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
        probe.write("holes.png", shapes::holes([64, 64])?)?;
        probe.write("stress.mtl", shapes::MATERIALS)?;
        let mut first = Views::default();
        let cases = (sweep.cases)(full);
        let points = cases.map(|case| sweep.run(case, &probe, &mut first));
        report.add(sweep, points.collect::<anyhow::Result<_>>()?);
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
        let mut names: Vec<_> = SWEEPS.iter().map(|sweep| sweep.name).collect();
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
