//! Settings of techniques.

use crate::distance::DistanceCull;
use crate::error::SettingsError;
use crate::gaze::{self, Gaze};
use crate::hidden_mesh::HiddenMesh;
use crate::shading_reuse::ShadingReuse;
use formats::view::Hmd;
use serde::{Deserialize, Serialize};
use visibility::Culling;

/// Settings of techniques; the default is the baseline.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct Settings {
    /// Culling technique for the visible draws of each view.
    pub culling: Culling,
    /// Whether draws hidden behind the visible draws of the last frame are not drawn.
    pub occlusion: bool,
    /// Whether both eyes are rendered in one submission.
    pub multiview: bool,
    /// Whether pixels outside the lens are not drawn.
    pub hidden_area_mask: bool,
    /// The headset's hidden-area mesh; pixels inside are not drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hidden_area_mesh: Option<HiddenMesh>,
    /// Condition for draws that are too far away or too small.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance_cull: Option<DistanceCull>,
    /// Whether every other frame is reprojected from the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_rate: Option<Reprojection>,
    /// Colours of the left eye that the right eye takes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shading_reuse: Option<ShadingReuse>,
    /// Disparity of highlights and mirrored light, as a share of that of the eyes' positions: with 0, both eyes see them as
    /// from the point between the eyes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub highlight_disparity: Option<f32>,
    /// One picture of far geometry for both eyes.
    pub far_field: Option<FarField>,
    /// Coarser shading in the periphery.
    pub foveation: Option<Foveation>,
}

/// One picture of the far field for both eyes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct FarField {
    /// Distance at which the far field starts.
    pub split: Split,
    /// How the picture is used for both eyes.
    #[serde(default)]
    pub variant: Variant,
}

/// Distance at which the far field starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", rename_all_fields = "kebab-case")]
pub enum Split {
    /// This distance.
    Metres(f32),
    /// The distance at which a point is shifted by at most this number of pixels.
    Pixels(f32),
    /// The distance with the least cost, with points shifted by at most this number of pixels.
    LeastWork {
        /// Maximum shift in pixels.
        within_px: f32,
    },
}

/// How the picture of the far field is used for both eyes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Variant {
    /// From a camera between the eyes.
    #[default]
    Plain,
    /// From a camera between the eyes, shifted for each eye by the disparity at the split.
    DepthShift,
    /// From the left eye in even frames, from the right eye in odd ones.
    AlternateEye,
}

/// Motion that a reprojection compensates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reprojection {
    /// The rotation of the head.
    Rotation,
    /// The rotation and translation of the head, using the last frame's depth.
    Depth,
}

/// Coarser shading away from the gaze.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Foveation {
    /// Foveation technique.
    pub kind: FoveationKind,
    /// Direction of the gaze.
    #[serde(default)]
    pub gaze: Gaze,
    /// Shading rates by angle.
    #[serde(default)]
    pub rates: Rates,
}

/// Foveation techniques.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FoveationKind {
    /// One rate per tile, by its angle from the gaze.
    Rings,
    /// 3x3 viewports, the outer ones at half the resolution.
    MultiResolution,
    /// Every other 2x2 quad beyond the first angle of the rates.
    RadialDensity,
    /// 2x2 viewports, coarser towards the edges by a projective map.
    LensMatched,
}

/// Shading rates by angle from the gaze.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Rates {
    /// Degrees from the gaze at which rates 1/2, 1/4, 1/8 and 1/16 begin, ascending.
    pub edges_deg: [f32; 4],
}

impl Default for Rates {
    fn default() -> Self {
        Self {
            edges_deg: [15.0, 25.0, 35.0, 45.0],
        }
    }
}

impl Settings {
    /// Whether invisible pixels are masked, by the lens's circle or by a mesh.
    pub fn masks_hidden_area(&self) -> bool {
        self.hidden_area_mask || self.hidden_area_mesh.is_some()
    }

    /// Whether a frame is reprojected from the previous one instead of rendered.
    pub fn reprojects(&self, frame: u32) -> bool {
        self.half_rate.is_some() && frame % 2 == 1
    }

    /// Whether a frame depends on how the one before it was rendered.
    pub fn remembers(&self) -> bool {
        self.occlusion || self.half_rate.is_some()
    }

    /// Checks every value, and that the techniques are compatible.
    ///
    /// # Errors
    /// The first invalid setting, and its valid values.
    pub fn check(&self, hmd: &Hmd) -> Result<(), SettingsError> {
        if let Some(mesh) = &self.hidden_area_mesh {
            mesh.check(hmd.eye_size_px)?;
        }
        if let Some(distance) = &self.distance_cull {
            distance.check()?;
        }
        if self.half_rate == Some(Reprojection::Depth)
            && (self.foveation.is_some()
                || self.far_field.is_some()
                || self.shading_reuse.is_some()
                || self.multiview)
        {
            return Err(SettingsError {
                what: "half rate by depth",
                expected: "pictures that are one layer each, which has their depth".into(),
                found: "foveation, a far field, shading reuse or multiview".into(),
            });
        }
        if let Some(foveation) = &self.foveation {
            foveation.check(hmd)?;
        }
        if let Some(reuse) = self.shading_reuse {
            reuse.check()?;
            let others = [
                ("foveation", self.foveation.is_some()),
                ("a far field", self.far_field.is_some()),
                ("multiview", self.multiview),
            ];
            if let Some((other, _)) = others.into_iter().find(|(_, asked)| *asked) {
                return Err(SettingsError {
                    what: "shading reuse",
                    expected: "eyes that are drawn one after the other, each as one picture".into(),
                    found: other.into(),
                });
            }
        }
        if let Some(share) = self.highlight_disparity
            && !(0.0..=4.0).contains(&share)
        {
            return Err(SettingsError {
                what: "disparity of highlights",
                expected: "0 to 4 times that of the eyes".into(),
                found: share.to_string(),
            });
        }
        if let Some(far_field) = &self.far_field {
            far_field.check()?;
            if self.foveation.is_some() {
                return Err(SettingsError {
                    what: "foveation with a far field",
                    expected: "one of both".into(),
                    found: "both".into(),
                });
            }
        }
        Ok(())
    }
}

impl FarField {
    fn check(&self) -> Result<(), SettingsError> {
        let ok = match self.split {
            Split::Metres(m) => m.is_finite() && m > 0.0,
            Split::Pixels(px) | Split::LeastWork { within_px: px } => px.is_finite() && px > 0.0,
        };
        if ok {
            return Ok(());
        }
        Err(SettingsError {
            what: "split of the far field",
            expected: "a number above 0".into(),
            found: match self.split {
                Split::Metres(value)
                | Split::Pixels(value)
                | Split::LeastWork { within_px: value } => value.to_string(),
            },
        })
    }
}

impl Foveation {
    fn check(&self, hmd: &Hmd) -> Result<(), SettingsError> {
        let edges = self.rates.edges_deg;
        if !(edges.iter().all(|edge| (0.0..=180.0).contains(edge)) && edges.is_sorted()) {
            return Err(SettingsError {
                what: "angles of the shading rates",
                expected: "0 to 180 degrees, ascending".into(),
                found: format!("{edges:?}"),
            });
        }
        for deg in self.gaze.directions() {
            if !in_view(hmd, deg) {
                return Err(SettingsError {
                    what: "gaze",
                    expected: format!("a direction inside an eye's view, {}", spans(hmd)),
                    found: format!("{},{} degrees", deg[0], deg[1]),
                });
            }
        }
        Ok(())
    }
}

/// Whether a direction is in an eye's frustum.
fn in_view(hmd: &Hmd, deg: [f32; 2]) -> bool {
    let sees = |eye: usize| {
        let fov = &hmd.fov[eye];
        let seen = gaze::direction(hmd, eye, deg);
        let [x, y] = [seen.x / -seen.z, seen.y / -seen.z];
        seen.z < 0.0 && (-fov.left..=fov.right).contains(&x) && (-fov.down..=fov.up).contains(&y)
    };
    gaze::is_ahead(deg) && (sees(0) || sees(1))
}

/// The widest angles of both eyes, for messages.
fn spans(hmd: &Hmd) -> String {
    let degrees = |tangent: f32| tangent.atan().to_degrees();
    let [left, right] = &hmd.fov;
    format!(
        "at most {:.1} degrees left, {:.1} right, {:.1} up and {:.1} down",
        degrees(left.left) + hmd.cant_deg,
        degrees(right.right) + hmd.cant_deg,
        degrees(left.up.max(right.up)),
        degrees(left.down.max(right.down))
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::view::FovTangents;

    fn hmd() -> Hmd {
        let fov = |left, right| FovTangents::new(left, right, 1.0, 1.0);
        Hmd {
            eye_size_px: [64, 64],
            fov: [fov(1.2, 0.8), fov(0.8, 1.2)],
            ..Hmd::default()
        }
    }

    fn looking(deg: [f32; 2]) -> Settings {
        Settings {
            foveation: Some(Foveation {
                kind: FoveationKind::Rings,
                gaze: Gaze::Fixed(deg),
                rates: Rates::default(),
            }),
            ..Settings::default()
        }
    }

    #[test]
    fn settings_are_read_from_json_as_written() {
        for settings in [Settings::default(), looking([3.0, -4.0])] {
            let text = serde_json::to_string(&settings).unwrap();
            assert_eq!(
                serde_json::from_str::<Settings>(&text).unwrap(),
                settings,
                "{text}"
            );
        }
        assert!(serde_json::from_str::<Settings>(r#"{"cullng":"none"}"#).is_err());
    }

    #[test]
    fn a_gaze_must_be_in_the_view_of_at_least_one_eye() {
        // The left eye's view ends at 38.7 degrees to the right, the right eye's at 50.2.
        for deg in [[0.0, 0.0], [45.0, 0.0], [-45.0, 44.0]] {
            assert_eq!(looking(deg).check(&hmd()), Ok(()));
        }
        for deg in [[51.0, 0.0], [0.0, -46.0], [f32::NAN, 0.0], [0.0, 179.0]] {
            let error = looking(deg).check(&hmd()).unwrap_err().to_string();
            assert!(error.contains("50.2 degrees left"), "{error}");
        }
    }

    #[test]
    fn rates_must_get_coarser_outwards() {
        let mut settings = looking([0.0, 0.0]);
        if let Some(foveation) = &mut settings.foveation {
            foveation.rates.edges_deg = [20.0, 10.0, 30.0, 40.0];
        }
        let error = settings.check(&hmd()).unwrap_err().to_string();
        assert!(error.contains("ascending"), "{error}");
    }
}
