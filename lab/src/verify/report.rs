//! The report of `tracegen verify`.

use super::agreement::{Agreement, SampleErrors, Side};
use super::causes::{SampleCause, UvCause};
use super::classes::Class;
use super::colour::ColourErrors;
use super::frame::Verified;
use super::lookups::LookupAgreement;
use super::means::Bias;
use formats::textrace::Tables;
use serde::Serialize;

/// Schema of the report.
const SCHEMA: &str = "tracegen.verify/1";

/// JSON of a verified frame.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Report {
    schema: &'static str,
    scene: String,
    backend: String,
    driver: String,
    size_px: [u32; 2],
    passes: usize,
    tiles: Tiles,
    /// Contradictions between the capture and the scene; empty if all differences have a cause.
    failures: Vec<String>,
    coverage: Coverage,
    uv_error_texels: UvError,
    /// Compared with the same formula of the level of detail.
    capture_precision: Samples,
    /// Compared with the exact logarithm of each fragment's own derivatives.
    specification: Samples,
    /// Look-ups of shadow maps.
    shadow_lookups: Lookups,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    colour: Vec<Colour>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Tiles {
    verified: usize,
    of: usize,
    seed: Option<u64>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Coverage {
    both: u64,
    only_reference: u64,
    only_capture: u64,
    iou: f64,
    recorded_twice: u64,
    differences: Vec<Difference>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Difference {
    class: Class,
    only_reference: u64,
    only_capture: u64,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct UvError {
    coordinates: u64,
    mean: f64,
    p99: f64,
    max: f64,
    not_finite: u64,
    shadow_lookups_not_compared: u64,
    causes: Vec<Count<UvCause>>,
    differences_unexplained: u64,
    groups_missing: u64,
    groups_unexpected: u64,
    /// Number of signed means that were compared with their bounds.
    means: usize,
    /// The largest of them, relative to their bounds.
    largest_means: Vec<Bias>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Lookups {
    compared: u64,
    mean_error_texels: f64,
    p99_error_texels: f64,
    max_error_texels: f64,
    causes: Vec<Count<UvCause>>,
    /// Fragments that are looked up in another cascade than expected, in several, or not at all.
    other_cascades: u64,
}

impl Lookups {
    fn new(agreement: &LookupAgreement) -> Self {
        let [mean, p99, max] = agreement.errors_texels.summary();
        Self {
            compared: agreement.errors_texels.0.len() as u64,
            mean_error_texels: mean,
            p99_error_texels: p99,
            max_error_texels: max,
            causes: counts(&UvCause::ALL, &agreement.causes),
            other_cascades: agreement.other_cascades,
        }
    }
}

/// Number of reported means.
const LARGEST_MEANS: usize = 4;

/// Means in descending order relative to their bounds.
fn by_share(mut means: Vec<Bias>) -> Vec<Bias> {
    means.sort_by(|a, b| b.share().total_cmp(&a.share()));
    means
}

/// All failures, with their place.
fn failures(verified: &Verified, means: &[Bias]) -> Vec<String> {
    let agreement = &verified.agreement;
    let mut failures = verified.faults.clone();
    let sample_causes = |errors: &SampleErrors| errors.causes[SampleCause::Unexplained as usize];
    let colours = (verified.colours.iter()).map(|(slot, errors)| (errors, slot.name()));
    let counts = [
        (
            agreement.of_class(Class::Unexplained),
            "fragments on one side alone",
        ),
        (agreement.recorded_twice, "lanes recorded twice"),
        (
            agreement.groups_missing,
            "uv groups of fragments without a record",
        ),
        (
            agreement.groups_unexpected,
            "records without a uv group of fragments that sample textures",
        ),
        (
            agreement.uv_causes[UvCause::Unexplained as usize],
            "coordinates",
        ),
        (
            agreement.differences_unexplained,
            "differences of coordinates over a quad",
        ),
        (
            agreement.lookups.other_cascades,
            "shadow look-ups of fragments in another cascade",
        ),
        (
            agreement.lookups.causes[UvCause::Unexplained as usize],
            "coordinates of shadow look-ups",
        ),
        (sample_causes(&agreement.capture), "levels or texels"),
        (
            sample_causes(&agreement.specification),
            "levels or texels against the specification",
        ),
    ];
    let unexplained = |(count, what): &(u64, &str)| format!("{what}: {count} unexplained");
    failures.extend(
        counts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(unexplained),
    );
    for (errors, slot) in colours {
        let unexplained = Colour::new(slot, errors).beyond_unexplained;
        if unexplained > 0 {
            failures.push(format!("colours of {slot}: {unexplained} unexplained"));
        }
    }
    failures.extend(
        means
            .iter()
            .filter(|mean| mean.is_systematic())
            .map(|mean| {
                format!(
                    "{}: mean error of {} over {} lanes: expected within {:.6} texels, found {:.6}",
                    mean.of, mean.column, mean.count, mean.bound_texels, mean.mean_texels
                )
            }),
    );
    failures
}

/// Number of differences by cause.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Count<C> {
    cause: C,
    count: u64,
}

fn counts<C: Copy>(causes: &[C], counts: &[u64]) -> Vec<Count<C>> {
    let count = |(&cause, &count): (&C, &u64)| Count { cause, count };
    causes.iter().zip(counts).map(count).collect()
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Samples {
    samples: u64,
    lod_error_mean: f64,
    lod_error_max: f64,
    levels_differ_share: f64,
    footprints_differ_share: f64,
    other_levels: u64,
    other_texels: u64,
    /// Causes of different levels or texels.
    causes: Vec<Count<SampleCause>>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Colour {
    texture: &'static str,
    fragments: u64,
    unrecorded: u64,
    within_1_255_share: f64,
    within_1_255_as_light_share: f64,
    beyond_by_decoding: u64,
    beyond_by_srgb: u64,
    beyond_by_coordinates: u64,
    beyond_unexplained: u64,
    mean: f64,
    max: f64,
    /// With blocks and sRGB decoded like in the driver.
    max_as_driver: f64,
}

/// The schema of the JSON object.
#[cfg(feature = "testing")]
pub fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<Report>(SCHEMA)
}

fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}

impl Report {
    /// The report of a verified frame of a scene; `seed` is that of a sample of tiles.
    pub fn new(scene: &str, tables: &Tables, verified: &Verified, seed: Option<u64>) -> Self {
        let Agreement {
            both,
            recorded_twice,
            not_finite,
            shadow_lookups,
            ..
        } = verified.agreement;
        let agreement = &verified.agreement;
        let [mean, p99, max] = agreement.uv_errors_texels.summary();
        let meta = &tables.meta;
        let means = by_share(agreement.means.biases(tables));
        let difference = |class: Class| Difference {
            class,
            only_reference: agreement.only[Side::Reference as usize][class as usize],
            only_capture: agreement.only[Side::Capture as usize][class as usize],
        };
        Self {
            schema: SCHEMA,
            scene: scene.to_owned(),
            backend: meta.backend.clone(),
            driver: meta.driver.clone(),
            size_px: meta.hmd.eye_size_px,
            passes: verified.passes,
            tiles: Tiles {
                verified: verified.tiles,
                of: verified.all_tiles,
                seed,
            },
            failures: failures(verified, &means),
            coverage: Coverage {
                both,
                only_reference: agreement.only(Side::Reference),
                only_capture: agreement.only(Side::Capture),
                iou: agreement.coverage_iou(),
                recorded_twice,
                differences: Class::ALL.map(difference).into(),
            },
            uv_error_texels: UvError {
                coordinates: agreement.uv_errors_texels.0.len() as u64,
                mean,
                p99,
                max,
                not_finite,
                shadow_lookups_not_compared: shadow_lookups,
                causes: counts(&UvCause::ALL, &agreement.uv_causes),
                differences_unexplained: agreement.differences_unexplained,
                groups_missing: agreement.groups_missing,
                groups_unexpected: agreement.groups_unexpected,
                means: means.len(),
                largest_means: means.into_iter().take(LARGEST_MEANS).collect(),
            },
            capture_precision: Samples::new(&agreement.capture),
            specification: Samples::new(&agreement.specification),
            shadow_lookups: Lookups::new(&agreement.lookups),
            colour: (verified.colours.iter())
                .filter(|(_, errors)| errors.fragments > 0)
                .map(|(slot, errors)| Colour::new(slot.name(), errors))
                .collect(),
        }
    }

    /// All differences that a correct capture does not have.
    pub fn failures(&self) -> &[String] {
        &self.failures
    }

    /// Lines for a terminal.
    pub fn table(&self) -> String {
        let Coverage {
            both,
            only_reference,
            only_capture,
            iou,
            recorded_twice,
            ..
        } = self.coverage;
        let mut text = format!(
            "{}: {} through {}\n{} of {} tiles of {} views of {}x{}\n\n",
            self.scene,
            self.backend,
            self.driver,
            self.tiles.verified,
            self.tiles.of,
            self.passes,
            self.size_px[0],
            self.size_px[1],
        );
        let mut line = |name: &str, value: String| text += &format!("{name:<44} {value}\n");
        line("fragments in both", both.to_string());
        line(
            "fragments only in the reference",
            only_reference.to_string(),
        );
        line("fragments only in the capture", only_capture.to_string());
        line("IoU of fragments", format!("{:.5} %", 100.0 * iou));
        for difference in &self.coverage.differences {
            let Difference {
                class,
                only_reference,
                only_capture,
            } = *difference;
            if only_reference + only_capture > 0 {
                line(
                    &format!("  {}", class.cause()),
                    format!("{} + {}", only_reference, only_capture),
                );
            }
        }
        if recorded_twice > 0 {
            line("lanes recorded twice", recorded_twice.to_string());
        }
        let UvError { mean, p99, max, .. } = self.uv_error_texels;
        line(
            "error of coordinates, texels: mean, 99 %, max",
            format!("{mean:.5}, {p99:.5}, {max:.4}"),
        );
        for Count { cause, count } in &self.uv_error_texels.causes {
            if *count > 0 {
                line(&format!("  {}", cause.text()), count.to_string());
            }
        }
        for mean in self.uv_error_texels.largest_means.iter().take(1) {
            line(
                "largest signed mean, as part of its bound",
                format!(
                    "{:.1} % of {:.6} texels ({}, {})",
                    100.0 * mean.share(),
                    mean.bound_texels,
                    mean.of,
                    mean.column
                ),
            );
        }
        let lookups = &self.shadow_lookups;
        if lookups.compared > 0 {
            line(
                "error of shadow look-ups, texels: mean, 99 %, max",
                format!(
                    "{:.5}, {:.5}, {:.4} of {}",
                    lookups.mean_error_texels,
                    lookups.p99_error_texels,
                    lookups.max_error_texels,
                    lookups.compared
                ),
            );
        }
        let left = self.uv_error_texels.shadow_lookups_not_compared;
        if left > 0 {
            line("shadow look-ups not compared", left.to_string());
        }
        self.capture_precision.lines("same LOD formula", &mut line);
        self.specification.lines("specification", &mut line);
        for colour in &self.colour {
            line(
                &format!("{}: texels within 1/255", colour.texture),
                colour.text(),
            );
        }
        text
    }
}

fn percent(share: f64) -> String {
    format!("{:.4} %", 100.0 * share)
}

impl Samples {
    /// Lines of the table: names and values.
    fn lines(&self, name: &str, mut line: impl FnMut(&str, String)) {
        line(
            &format!("{name}: LOD error, mean and max"),
            format!("{:.6}, {:.4}", self.lod_error_mean, self.lod_error_max),
        );
        line(
            &format!("{name}: levels that differ"),
            percent(self.levels_differ_share),
        );
        line(
            &format!("{name}: footprints that differ"),
            percent(self.footprints_differ_share),
        );
        for Count { cause, count } in &self.causes {
            if *count > 0 {
                line(&format!("  {}", cause.text()), count.to_string());
            }
        }
    }

    fn new(errors: &SampleErrors) -> Self {
        Self {
            samples: errors.samples,
            lod_error_mean: errors.lod_sum / errors.samples.max(1) as f64,
            lod_error_max: errors.lod_max,
            levels_differ_share: share(errors.levels_differ, errors.samples),
            footprints_differ_share: share(
                errors.other_levels + errors.other_texels,
                errors.samples,
            ),
            other_levels: errors.other_levels,
            other_texels: errors.other_texels,
            causes: counts(&SampleCause::ALL, &errors.causes),
        }
    }
}

impl Colour {
    fn text(&self) -> String {
        format!(
            "{} of {} ({} as light; mean {:.5}, max {:.4}, {:.5} as the driver decodes; beyond: {} by blocks decoded in 8 bits, {} by a polynomial for sRGB, {} by 1/64 texel, {} unexplained, {} without a record)",
            percent(self.within_1_255_share),
            self.fragments,
            percent(self.within_1_255_as_light_share),
            self.mean,
            self.max,
            self.max_as_driver,
            self.beyond_by_decoding,
            self.beyond_by_srgb,
            self.beyond_by_coordinates,
            self.beyond_unexplained,
            self.unrecorded
        )
    }

    fn new(texture: &'static str, errors: &ColourErrors) -> Self {
        let compared = errors.fragments - errors.unrecorded;
        Self {
            texture,
            fragments: errors.fragments,
            unrecorded: errors.unrecorded,
            within_1_255_share: share(errors.within_as_encoded, errors.fragments),
            within_1_255_as_light_share: share(errors.within_as_light, errors.fragments),
            beyond_by_decoding: errors.by_decoding,
            beyond_by_srgb: errors.by_srgb,
            beyond_by_coordinates: errors.by_coordinates,
            beyond_unexplained: compared
                - errors.within_as_encoded
                - errors.by_decoding
                - errors.by_srgb
                - errors.by_coordinates,
            mean: errors.sum / compared.max(1) as f64,
            max: errors.max,
            max_as_driver: errors.max_as_driver,
        }
    }
}
