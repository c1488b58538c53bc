//! The techniques by name, and the rows of a study: each technique alone, and combinations.

use anyhow::bail;
use formats::UnknownName;
use formats::view::Hmd;
use techniques::distance::DistanceCull;
use techniques::foveation::{MODES, Mode};
use techniques::settings::{FarField, Foveation, Rates, Reprojection, Split, Variant};
use techniques::shading_reuse::ShadingReuse;
use techniques::{Gaze, Settings};
use visibility::Culling;

/// One technique: a change of the baseline's settings.
#[derive(Clone, Debug)]
pub struct Part {
    /// Name as in `--only`, manifests and results.
    pub name: String,
    /// Title for readers.
    pub title: String,
    /// Whether no visible pixel may change.
    pub lossless: bool,
    change: Change,
}

#[derive(Clone, Debug)]
enum Change {
    Culling(Culling),
    Switch(Setting, fn(&mut Settings)),
    Foveation(Foveation),
}

/// The setting that a part changes. Two parts that change the same setting exclude each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// How visible draws are found.
    Culling,
    /// Whether hidden draws are left out.
    Occlusion,
    /// Whether pixels outside the lens are drawn.
    Mask,
    /// Whether both eyes are drawn at once.
    Multiview,
    /// Which draws are too far or too small to be drawn.
    Distance,
    /// How often a frame is rendered.
    Rate,
    /// What the right eye takes of the left eye's colours.
    ShadingReuse,
    /// Where highlights are seen from.
    Highlights,
    /// Where and how both eyes share a picture of the far field.
    FarField,
    /// How the periphery is shaded more coarsely.
    Foveation,
}

impl PartialEq for Part {
    /// Names are unique.
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Part {
    /// Every technique, the baseline first.
    pub fn all() -> Vec<Self> {
        let baseline = Culling::default();
        let others = Culling::all().filter(|culling| *culling != baseline);
        let mut parts = vec![Self::culling(baseline)];
        parts.extend(others.map(Self::culling));
        parts.extend(TECHNIQUES.iter().map(Self::switch));
        parts.extend(
            MODES
                .iter()
                .map(|mode| Self::foveation(mode, "", "", Rates::default())),
        );
        parts
    }

    /// Every technique with the settings that a search tries on a display.
    pub fn options(hmd: &Hmd) -> Vec<Self> {
        let mut parts = Self::all();
        // A search renders single frames, and every other frame at half rate has no picture of its own. Highlights cost the
        // same wherever they are seen from.
        parts.retain(|part| ![Setting::Rate, Setting::Highlights].contains(&part.setting()));
        parts.extend(VARIANTS.iter().map(Self::switch));
        let by_angle = || MODES.iter().filter(|mode| mode.rates_of.is_none());
        parts.extend(
            by_angle().map(|mode| Self::foveation(mode, "-wide", ", 1.5 times as wide", wide())),
        );
        let acuity = Rates::of_acuity(hmd);
        parts
            .extend(by_angle().map(|mode| {
                Self::foveation(mode, "-acuity", " where the eye cannot tell", acuity)
            }));
        parts
    }

    fn switch(&Switch(name, title, lossless, setting, change): &Switch) -> Self {
        Self {
            name: name.to_owned(),
            title: title.to_owned(),
            lossless,
            change: Change::Switch(setting, change),
        }
    }

    /// A foveation mode with some rates and the gaze straight ahead.
    fn foveation(mode: &Mode, suffix: &str, title: &str, rates: Rates) -> Self {
        Self {
            name: format!("{}{suffix}", mode.technique),
            title: format!("{}{title}", mode.title),
            lossless: false,
            change: Change::Foveation(Foveation {
                kind: mode.kind,
                gaze: Gaze::default(),
                rates,
            }),
        }
    }

    fn culling(culling: Culling) -> Self {
        Self {
            name: culling.name().to_owned(),
            title: culling.title().to_owned(),
            lossless: culling.is_lossless(),
            change: Change::Culling(culling),
        }
    }

    /// Whether its error is a shift in pixels that is bounded for every frame.
    pub fn is_shift(&self) -> bool {
        self.setting() == Setting::FarField
    }

    /// The setting that it changes.
    pub fn setting(&self) -> Setting {
        match self.change {
            Change::Culling(_) => Setting::Culling,
            Change::Switch(setting, _) => setting,
            Change::Foveation(_) => Setting::Foveation,
        }
    }

    fn apply(&self, settings: &mut Settings) {
        match &self.change {
            Change::Culling(culling) => settings.culling = *culling,
            Change::Switch(_, change) => change(settings),
            Change::Foveation(foveation) => settings.foveation = Some(foveation.clone()),
        }
    }
}

/// Name, title, whether it is lossless, the setting that it changes, and the change.
struct Switch(&'static str, &'static str, bool, Setting, fn(&mut Settings));

/// The techniques besides culling and foveation.
const TECHNIQUES: &[Switch] = &[
    Switch(
        "occlusion",
        "Occlusion culling",
        true,
        Setting::Occlusion,
        |s| s.occlusion = true,
    ),
    Switch(
        "hidden-area-mask",
        "Hidden-area mask",
        true,
        Setting::Mask,
        |s| s.hidden_area_mask = true,
    ),
    Switch("multiview", "Multiview", true, Setting::Multiview, |s| {
        s.multiview = true
    }),
    Switch(
        "distance-culling",
        "Distance culling, 4 px",
        false,
        Setting::Distance,
        |s| s.distance_cull = Some(DistanceCull::Pixels(4.0)),
    ),
    Switch(
        "half-rate",
        "Half rate, turned with the head",
        false,
        Setting::Rate,
        |s| s.half_rate = Some(Reprojection::Rotation),
    ),
    Switch(
        "half-rate-depth",
        "Half rate, moved with the head by depth",
        false,
        Setting::Rate,
        |s| s.half_rate = Some(Reprojection::Depth),
    ),
    Switch(
        "shading-reuse",
        "Shading reuse between the eyes",
        false,
        Setting::ShadingReuse,
        |s| s.shading_reuse = Some(ShadingReuse::default()),
    ),
    Switch(
        "highlights-between-eyes",
        "Highlights as seen between the eyes",
        false,
        Setting::Highlights,
        |s| s.highlight_disparity = Some(0.0),
    ),
    Switch(
        "far-field",
        "Mono far field, 1 px",
        false,
        Setting::FarField,
        |s| s.far_field = far_field(Split::Pixels(1.0), Variant::Plain),
    ),
    Switch(
        "far-field-least-work",
        "Mono far field where it saves most",
        false,
        Setting::FarField,
        |s| s.far_field = far_field(Split::LeastWork { within_px: 1.0 }, Variant::Plain),
    ),
    Switch(
        "far-field-depth-shift",
        "Mono far field with depth shift, 0.5 px",
        false,
        Setting::FarField,
        |s| s.far_field = far_field(Split::Pixels(0.5), Variant::DepthShift),
    ),
    Switch(
        "far-field-alternate-eye",
        "Mono far field from alternate eyes, 1 px",
        false,
        Setting::FarField,
        |s| s.far_field = far_field(Split::Pixels(1.0), Variant::AlternateEye),
    ),
];

/// Other settings of these techniques, for searches.
const VARIANTS: &[Switch] = &[
    Switch(
        "shading-reuse-0.01",
        "Shading reuse between the eyes, least contrast",
        false,
        Setting::ShadingReuse,
        |s| s.shading_reuse = Some(ShadingReuse { contrast: 0.01 }),
    ),
    Switch(
        "shading-reuse-0.05",
        "Shading reuse between the eyes, more contrast",
        false,
        Setting::ShadingReuse,
        |s| s.shading_reuse = Some(ShadingReuse { contrast: 0.05 }),
    ),
    Switch(
        "far-field-0.5px",
        "Mono far field, 0.5 px",
        false,
        Setting::FarField,
        |s| s.far_field = far_field(Split::Pixels(0.5), Variant::Plain),
    ),
    Switch(
        "far-field-2px",
        "Mono far field, 2 px",
        false,
        Setting::FarField,
        |s| s.far_field = far_field(Split::Pixels(2.0), Variant::Plain),
    ),
    Switch(
        "far-field-depth-shift-1px",
        "Mono far field with depth shift, 1 px",
        false,
        Setting::FarField,
        |s| s.far_field = far_field(Split::Pixels(1.0), Variant::DepthShift),
    ),
];

fn far_field(split: Split, variant: Variant) -> Option<FarField> {
    Some(FarField { split, variant })
}

/// The default rates, each starting 1.5 times as far out.
fn wide() -> Rates {
    Rates {
        edges_deg: Rates::default().edges_deg.map(|edge| 1.5 * edge),
    }
}

/// Combinations that a study measures in addition to the single techniques: title and parts.
const COMBINATIONS: &[(&str, &str)] = &[
    ("Culling and occlusion", "superfrustum+occlusion"),
    (
        "Lossless",
        "superfrustum+occlusion+multiview+hidden-area-mask",
    ),
    (
        "Lossless, except for shifts of up to 1 px in the far field",
        "superfrustum+occlusion+multiview+hidden-area-mask+far-field",
    ),
    (
        "Far field once, nothing else lost",
        "superfrustum+hidden-area-mask+far-field",
    ),
    (
        "Everything",
        "superfrustum+occlusion+multiview+hidden-area-mask+foveation-rings",
    ),
];

/// A technique or a combination, measured as one.
#[derive(Clone, Debug)]
pub struct Row {
    /// The parts' names joined by `+`.
    pub name: String,
    /// Title for readers.
    pub title: String,
    /// Its parts.
    pub parts: Vec<Part>,
    /// Whether all of its parts are lossless.
    pub lossless: bool,
    /// Settings of its capture.
    pub settings: Settings,
}

impl Row {
    /// The technique that all others are compared with.
    ///
    /// # Panics
    /// Never, because the baseline is a technique.
    pub fn baseline() -> Self {
        Self::parse(Culling::default().name()).expect("the baseline is a technique")
    }

    /// Every row of a study by default, the baseline first.
    ///
    /// # Panics
    /// Never, because the tests parse every row.
    pub fn all() -> Vec<Self> {
        let alone = Part::all().into_iter();
        let alone = alone.map(|part| Self::parse(&part.name).expect("a technique is a row"));
        alone.chain(Self::combinations()).collect()
    }

    /// The combinations that a study measures in addition to the single techniques.
    ///
    /// # Panics
    /// Never, because the tests parse every row.
    pub fn combinations() -> Vec<Self> {
        let parse = |name: &str| Self::parse(name).expect("rows of the table are techniques");
        COMBINATIONS.iter().map(|(_, name)| parse(name)).collect()
    }

    /// The row of some parts; the baseline if there are none.
    ///
    /// # Errors
    /// Two of the parts exclude each other.
    pub fn of(parts: Vec<Part>) -> anyhow::Result<Self> {
        if parts.is_empty() {
            return Ok(Self::baseline());
        }
        let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
        let name = names.join("+");
        let mut settings = Settings::default();
        for (number, part) in parts.iter().enumerate() {
            let same = |other: &&Part| other.setting() == part.setting();
            if let Some(other) = parts[..number].iter().find(same) {
                bail!(
                    "'{name}': {} and {} exclude each other",
                    other.name,
                    part.name
                );
            }
            part.apply(&mut settings);
        }
        let titles: Vec<&str> = parts.iter().map(|part| part.title.as_str()).collect();
        let listed = COMBINATIONS.iter().find(|(_, known)| *known == name);
        Ok(Self {
            title: listed.map_or_else(|| titles.join(", "), |(title, _)| (*title).to_owned()),
            name,
            lossless: parts.iter().all(|part| part.lossless),
            parts,
            settings,
        })
    }

    /// A row by its name: techniques joined by `+`.
    ///
    /// # Errors
    /// An unknown technique, or two that exclude each other.
    pub fn parse(name: &str) -> anyhow::Result<Self> {
        let all = Part::all();
        let part = |word: &str| {
            let found = all.iter().find(|part| part.name == word);
            found.cloned().ok_or_else(|| UnknownName {
                what: "unknown technique",
                name: word.to_owned(),
                known: known(),
            })
        };
        Self::of(name.split('+').map(part).collect::<Result<_, _>>()?)
    }

    /// The rows of a list of names separated by commas, preceded by the baseline.
    ///
    /// # Errors
    /// See [`Self::parse`].
    pub fn parse_list(list: &str) -> anyhow::Result<Vec<Self>> {
        let mut rows = vec![Self::baseline()];
        for name in list.split(',').map(str::trim) {
            let row = Self::parse(name)?;
            if rows.iter().all(|known| known.name != row.name) {
                rows.push(row);
            }
        }
        Ok(rows)
    }
}

fn known() -> String {
    let names: Vec<String> = Part::all().into_iter().map(|part| part.name).collect();
    format!("some of {}, alone or joined by '+'", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_a_name_of_its_own_and_is_found_by_it() {
        let rows = Row::all();
        assert_eq!(rows[0].name, "per-eye");
        assert_eq!(rows[0].settings, Settings::default());
        for (number, row) in rows.iter().enumerate() {
            let found = Row::parse(&row.name).unwrap();
            assert_eq!((&found.settings, &found.title), (&row.settings, &row.title));
            assert!(rows[..number].iter().all(|other| other.name != row.name));
            assert!(
                rows[..number].iter().all(|r| r.settings != row.settings),
                "{}",
                row.name
            );
        }
    }

    #[test]
    fn a_list_names_rows_once_and_always_has_the_baseline() {
        let rows = Row::parse_list("conical, superfrustum,conical").unwrap();
        let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!(names, ["per-eye", "conical", "superfrustum"]);
    }

    #[test]
    fn unknown_and_contradictory_techniques_are_refused() {
        let error = |list: &str| Row::parse_list(list).unwrap_err().to_string();
        let text = error("conical,octree");
        assert!(
            text.contains("'octree'") && text.contains("superfrustum"),
            "{text}"
        );
        assert!(error("").contains("unknown technique ''"));
        let text = error("conical+superfrustum");
        assert!(
            text.contains("conical and superfrustum exclude each other"),
            "{text}"
        );
    }
}
