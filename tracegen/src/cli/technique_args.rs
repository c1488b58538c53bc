//! Flags for techniques, which leave out work or do it more coarsely.

use super::choice::choice;
use super::lens_args::LensArgs;
use super::values::numbers;
use crate::hidden_mesh;
use anyhow::ensure;
use clap::Args;
use clap::builder::TypedValueParser;
use formats::view::Hmd;
use scene::paths::read_gazes;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use techniques::Gaze;
use techniques::Settings;
use techniques::distance::DistanceCull;
use techniques::foveation::MODES;
use techniques::gaze::GazeSample;
use techniques::settings::{FarField, Foveation, FoveationKind, Rates, Split, Variant};
use techniques::shading_reuse::ShadingReuse;
use visibility::Culling;

/// Techniques of a capture.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Techniques")]
pub struct TechniqueArgs {
    /// How the visible draws of a frame are found.
    #[arg(long, value_name = "NAME", default_value = Culling::default().name(),
          value_parser = culling_parser())]
    cull: Culling,
    /// Leave out draws that are hidden behind others: the draws visible in the last frame are drawn first,
    /// for their depth.
    #[arg(long)]
    occlusion: bool,
    #[command(flatten)]
    pub lens: LensArgs,
    /// Draw nothing outside the visible part of the lens.
    #[arg(long)]
    hidden_area_mask: bool,
    /// Draw nothing inside the headset's hidden-area mesh: a JSON file of triangles
    /// (docs/models/foveation.md) or a recording of hmdq.
    #[arg(long, value_name = "FILE", conflicts_with = "hidden_area_mask")]
    hidden_area_mesh: Option<PathBuf>,
    /// Leave out draws whose every point is farther than this from the head.
    #[arg(
        long,
        value_name = "METRES",
        conflicts_with = "cull_px",
        allow_hyphen_values = true
    )]
    cull_distance: Option<f32>,
    /// Leave out draws whose bounding sphere spans fewer pixels.
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    cull_px: Option<f32>,
    /// Submit both eyes at once if the driver does so correctly (the capture still records one eye after the
    /// other).
    #[arg(long)]
    multiview: bool,
    /// Let the right eye take the colour of surfaces that the left eye has shaded, where the left eye's pixels around the
    /// place differ by at most this much (of the square root of linear light, 0 to 1) [default with the flag alone: 0.02].
    #[arg(long, value_name = "CONTRAST", num_args = 0..=1, require_equals = true, default_missing_value = "0.02",
          conflicts_with_all = ["multiview", "far_field", "foveate"])]
    reuse_shading: Option<f32>,
    /// Disparity of highlights and mirrored light, as a share of that of the eyes' positions: 0 shows both eyes what the
    /// point between them sees.
    #[arg(long, value_name = "SHARE", allow_hyphen_values = true)]
    highlight_disparity: Option<f32>,
    /// Draw everything beyond a distance once for both eyes. The distance is given in metres (7.5), as the
    /// largest error in pixels (1px), or as the distance of least cost within an error (least-work:2px;
    /// least-work alone means 1px).
    #[arg(long, value_name = "METRES|Npx|least-work", conflicts_with = "foveate")]
    far_field: Option<SplitFlag>,
    /// How the far field's picture is used for both eyes.
    #[arg(long, value_parser = variant_parser(), value_name = "HOW", requires = "far_field", default_value = "plain")]
    far_field_variant: Variant,
    /// Shade more coarsely away from the gaze.
    #[arg(long, value_parser = foveate_parser(), value_name = "HOW")]
    foveate: Option<FoveationKind>,
    /// Gaze: degrees right and up from straight ahead, or a CSV file with the header time_s,x_deg,y_deg
    /// [default: 0,0].
    #[arg(
        long,
        value_name = "X,Y|FILE.csv",
        requires = "foveate",
        allow_hyphen_values = true
    )]
    gaze: Option<String>,
    /// Degrees from the gaze at which rates 1/2, 1/4, 1/8 and 1/16 start (radial-density: every other quad
    /// from the first on), or `acuity`, from the eye's resolution [default: 15,25,35,45].
    #[arg(long, value_name = "A,B,C,D|acuity", requires = "foveate")]
    rates: Option<RatesFlag>,
}

/// `--far-field`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SplitFlag(Split);

impl FromStr for SplitFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let px = |text: &str| text.strip_suffix("px")?.parse().ok();
        let split = match text.strip_prefix("least-work") {
            Some("") => Some(Split::LeastWork { within_px: 1.0 }),
            Some(rest) => (rest.strip_prefix(':').and_then(px))
                .map(|within_px| Split::LeastWork { within_px }),
            None => px(text)
                .map(Split::Pixels)
                .or_else(|| text.parse().ok().map(Split::Metres)),
        };
        split.map(Self).ok_or_else(|| {
            format!("expected metres as in 7.5, pixels as in 1px, least-work or least-work:2px, found '{text}'")
        })
    }
}

fn variant_parser() -> impl TypedValueParser<Value = Variant> {
    choice([
        (
            "plain",
            Variant::Plain,
            "As a camera between the eyes sees it",
        ),
        (
            "depth-shift",
            Variant::DepthShift,
            "Shifted for each eye by the disparity at the split",
        ),
        (
            "alternate-eye",
            Variant::AlternateEye,
            "From the left eye in even frames, from the right eye in odd ones",
        ),
    ])
}

fn foveate_parser() -> impl TypedValueParser<Value = FoveationKind> {
    choice(MODES.iter().map(|mode| (mode.name, mode.kind, mode.help)))
}

fn culling_parser() -> impl TypedValueParser<Value = Culling> {
    choice(Culling::all().map(|culling| (culling.name(), culling, culling.help())))
}

/// `--rates`.
#[derive(Clone, Copy, Debug)]
enum RatesFlag {
    Edges([f32; 4]),
    Acuity,
}

impl FromStr for RatesFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "acuity" {
            return Ok(Self::Acuity);
        }
        numbers(text).map(Self::Edges).ok_or_else(|| {
            format!("expected four angles as in 15,25,35,45 or acuity, found '{text}'")
        })
    }
}

impl TechniqueArgs {
    /// The first flag whose layers hold only what the depth of others leaves open.
    pub fn layers_by_depth(&self) -> Option<&'static str> {
        let far_field = self.far_field.map(|_| "--far-field");
        far_field.or(self.reuse_shading.map(|_| "--reuse-shading"))
    }

    /// Files that the flags refer to.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let gaze = self.gaze.as_ref().map(PathBuf::from);
        let gaze = gaze.filter(|path| path.extension().is_some());
        gaze.into_iter()
            .chain(self.hidden_area_mesh.clone())
            .collect()
    }

    /// The first flag that needs more than one picture per eye, drawn once from the eye's draw list.
    pub fn beyond_plain_frames(&self) -> Option<&'static str> {
        let flags = [
            (self.occlusion, "--occlusion"),
            (self.hidden_area_mask, "--hidden-area-mask"),
            (self.hidden_area_mesh.is_some(), "--hidden-area-mesh"),
            (self.multiview, "--multiview"),
            (self.reuse_shading.is_some(), "--reuse-shading"),
            (self.highlight_disparity.is_some(), "--highlight-disparity"),
            (self.far_field.is_some(), "--far-field"),
            (self.foveate.is_some(), "--foveate"),
        ];
        flags.iter().find(|flag| flag.0).map(|flag| flag.1)
    }

    /// Whether occlusion culling uses what the frame before saw.
    pub(super) fn occludes(&self) -> bool {
        self.occlusion
    }

    /// The settings of the techniques.
    ///
    /// # Errors
    /// A gaze that cannot be read, rates that are not used, and what [`Settings::check`] refuses.
    pub fn settings(&self, hmd: &Hmd) -> anyhow::Result<Settings> {
        let settings = Settings {
            culling: self.cull,
            occlusion: self.occlusion,
            multiview: self.multiview,
            hidden_area_mask: self.hidden_area_mask,
            hidden_area_mesh: (self.hidden_area_mesh.as_deref().map(hidden_mesh::read))
                .transpose()?,
            distance_cull: (self.cull_distance.map(DistanceCull::Metres))
                .or(self.cull_px.map(DistanceCull::Pixels)),
            half_rate: None,
            highlight_disparity: self.highlight_disparity,
            shading_reuse: (self.reuse_shading).map(|contrast| ShadingReuse { contrast }),
            far_field: self.far_field.map(|SplitFlag(split)| FarField {
                split,
                variant: self.far_field_variant,
            }),
            foveation: self.foveation(hmd)?,
        };
        settings.check(hmd)?;
        Ok(settings)
    }

    fn foveation(&self, hmd: &Hmd) -> anyhow::Result<Option<Foveation>> {
        let Some(kind) = self.foveate else {
            return Ok(None);
        };
        let mode = kind.mode();
        if let Some(of) = mode.rates_of {
            let found = format!("found with {}, whose rates are those of {of}", mode.name);
            ensure!(
                mode.follows_gaze || self.rates.is_none() && self.gaze.is_none(),
                "--rates, --gaze: expected with another --foveate, {found}"
            );
            let by_angle = MODES.iter().filter(|mode| mode.rates_of.is_none());
            let names: Vec<&str> = by_angle.map(|mode| mode.name).collect();
            ensure!(
                self.rates.is_none(),
                "--rates: expected with --foveate {}, {found}",
                names.join(" or ")
            );
        }
        Ok(Some(Foveation {
            kind,
            gaze: self
                .gaze
                .as_deref()
                .map(gaze)
                .transpose()?
                .unwrap_or_default(),
            rates: match self.rates {
                None => Rates::default(),
                Some(RatesFlag::Edges(edges_deg)) => Rates { edges_deg },
                Some(RatesFlag::Acuity) => Rates::of_acuity(hmd),
            },
        }))
    }
}

/// A direction, or a file of directions.
fn gaze(text: &str) -> anyhow::Result<Gaze> {
    if let Some(deg) = numbers(text) {
        return Ok(Gaze::Fixed(deg));
    }
    ensure!(
        text.to_lowercase().ends_with(".csv"),
        "--gaze: expected degrees as in 5,-3 or a file FILE.csv, found '{text}'"
    );
    let sample = |row: scene::paths::GazeRow| GazeSample {
        time_s: row.time_s as f32,
        deg: [row.x_deg as f32, row.y_deg as f32],
    };
    let rows = read_gazes(Path::new(text))?;
    Ok(Gaze::Path(rows.into_iter().map(sample).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gaze_is_two_numbers_or_a_file() {
        assert_eq!(gaze("5,-3.5").unwrap(), Gaze::Fixed([5.0, -3.5]));
        for bad in ["5", "5,6,7", "left", ""] {
            let message = gaze(bad).unwrap_err().to_string();
            assert!(message.contains("5,-3 or a file"), "{message}");
        }
        assert!(gaze("absent.csv").is_err());
    }

    #[test]
    fn a_split_is_metres_pixels_or_least_work() {
        let of = |text: &str| text.parse::<SplitFlag>().map(|flag| flag.0);
        assert_eq!(of("7.5"), Ok(Split::Metres(7.5)));
        assert_eq!(of("1px"), Ok(Split::Pixels(1.0)));
        assert_eq!(of("least-work"), Ok(Split::LeastWork { within_px: 1.0 }));
        assert_eq!(
            of("least-work:2.5px"),
            Ok(Split::LeastWork { within_px: 2.5 })
        );
        for bad in ["", "px", "7.5m", "least-work:2", "least-work2px"] {
            assert!(of(bad).unwrap_err().contains("least-work:2px"), "{bad}");
        }
    }

    #[test]
    fn rates_are_four_numbers_or_acuity() {
        assert!(matches!("acuity".parse(), Ok(RatesFlag::Acuity)));
        assert!(matches!(
            "1,2,3,4.5".parse(),
            Ok(RatesFlag::Edges([1.0, 2.0, 3.0, 4.5]))
        ));
        for bad in ["", "1,2,3", "1,2,3,4,5", "a,b,c,d"] {
            assert!(bad.parse::<RatesFlag>().is_err(), "{bad}");
        }
    }
}
