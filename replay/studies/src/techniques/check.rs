//! Checks rules of a manifest that the types of its keys do not express.

use super::manifest::{Frame, Manifest, ManifestRow, numbers};
use formats::technique_study::SCHEMA;
use formats::view::MAX_EYE_SIZE_PX;
use std::path::{Component, Path};

/// A key whose value breaks a rule.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{key}`: expected {expected}, found {found}")]
pub struct Fault {
    /// Path of the key, such as `rows[2].frames[0].images`.
    pub key: String,
    /// Values that the key may have.
    pub expected: String,
    /// Value that it has.
    pub found: String,
}

type Checked = Result<(), Fault>;

fn ensure(
    ok: bool,
    key: impl Into<String>,
    expected: impl Into<String>,
    found: impl ToString,
) -> Checked {
    if ok {
        return Ok(());
    }
    Err(Fault {
        key: key.into(),
        expected: expected.into(),
        found: found.to_string(),
    })
}

/// Checks every rule; fails with the first key that breaks one.
pub fn check(manifest: &Manifest) -> Checked {
    ensure(
        manifest.schema == SCHEMA,
        "schema",
        SCHEMA,
        format_args!("`{}`", manifest.schema),
    )?;
    let broken = |key: &str, broken: formats::error::Broken| Fault {
        key: key.to_owned(),
        expected: format!("{}: {}", broken.what, broken.expected),
        found: broken.found.to_string(),
    };
    manifest.hmd.check().map_err(|e| broken("hmd", e))?;
    for (eye, lens) in manifest.lens.iter().enumerate() {
        let key = format!("lens[{eye}]");
        lens.check().map_err(|e| broken(&key, e))?;
    }
    let ppd = manifest.pixels_per_degree;
    ensure(
        image_error::PIXELS_PER_DEGREE.contains(&ppd),
        "pixels_per_degree",
        "0.1 to 1000",
        ppd,
    )?;
    ensure(
        manifest
            .size_px
            .iter()
            .all(|size| (1..=MAX_EYE_SIZE_PX).contains(size)),
        "size_px",
        format!("1 to {MAX_EYE_SIZE_PX} pixels each way"),
        format_args!("{:?}", manifest.size_px),
    )?;
    positive("fps", manifest.fps)?;
    let frames = &manifest.frames;
    ensure(
        !frames.is_empty() && frames.is_sorted_by(|a, b| a < b),
        "frames",
        "at least one, numbers ascending",
        format_args!("{frames:?}"),
    )?;
    ensure(
        manifest.baseline_row().is_some(),
        "baseline",
        "a technique of `rows`",
        format_args!("`{}`", manifest.baseline),
    )?;
    for (index, row) in manifest.rows.iter().enumerate() {
        check_row(manifest, index, row)?;
    }
    Ok(())
}

fn check_row(manifest: &Manifest, index: usize, row: &ManifestRow) -> Checked {
    let name = &row.technique;
    let earlier = manifest.rows.iter().take(index);
    ensure(
        !name.is_empty() && !earlier.clone().any(|other| other.technique == *name),
        format!("rows[{index}].technique"),
        "a unique name",
        format_args!("`{name}`"),
    )?;
    let numbers: Vec<u32> = row.frames.iter().map(|frame| frame.frame).collect();
    ensure(
        numbers == manifest.frames,
        format!("rows[{index}].frames"),
        format!("the frames {:?}", manifest.frames),
        format_args!("{numbers:?}"),
    )?;
    if let Some(trace) = &row.trace {
        inside(format!("rows[{index}].trace"), trace)?;
    }
    for (at, frame) in row.frames.iter().enumerate() {
        let is_baseline = *name == manifest.baseline;
        check_frame(&format!("rows[{index}].frames[{at}]"), frame, is_baseline)?;
    }
    Ok(())
}

fn check_frame(key: &str, frame: &Frame, is_baseline: bool) -> Checked {
    ensure(
        !frame.frame_s.is_empty(),
        format!("{key}.frame_s"),
        "at least one time",
        "none",
    )?;
    let (times, baseline) = (frame.frame_s.len(), frame.baseline_s.len());
    ensure(
        baseline == times || (is_baseline && baseline == 0),
        format!("{key}.baseline_s"),
        format!("{times} times, one for each of `frame_s`"),
        baseline,
    )?;
    let beside = frame.baseline_processor_s.len();
    ensure(
        frame.processor_s.len() == beside,
        format!("{key}.baseline_processor_s"),
        format!(
            "{} times, as many as `processor_s`",
            frame.processor_s.len()
        ),
        beside,
    )?;
    for (name, list) in [
        ("frame_s", &frame.frame_s),
        ("baseline_s", &frame.baseline_s),
        ("processor_s", &frame.processor_s),
        ("baseline_processor_s", &frame.baseline_processor_s),
    ] {
        for (i, time) in list.iter().enumerate() {
            positive(&format!("{key}.{name}[{i}]"), *time)?;
        }
    }
    ensure(
        frame.cull_s.is_finite() && frame.cull_s >= 0.0,
        format!("{key}.cull_s"),
        "at least 0",
        frame.cull_s,
    )?;
    for (name, map) in [
        ("stages_s", &frame.stages_s),
        ("predicted", &frame.predicted),
    ] {
        let unfit = map.iter().find(|(_, value)| {
            !(value.is_null() || value.as_f64().is_some_and(|x| x.is_finite() && x >= 0.0))
        });
        if let Some((stage, value)) = unfit {
            ensure(false, format!("{key}.{name}.{stage}"), "at least 0", value)?;
        }
    }
    debug_assert!(numbers(&frame.stages_s).all(|(_, x)| x >= 0.0));
    for (eye, image) in frame.images.iter().enumerate() {
        inside(format!("{key}.images[{eye}]"), image)?;
    }
    Ok(())
}

fn positive(key: &str, value: f64) -> Checked {
    let ok = value.is_finite() && value > 0.0;
    ensure(ok, key, "a number above 0", value)
}

/// Checks that a path is relative and inside the folder.
fn inside(key: String, path: &str) -> Checked {
    let plain = |part: Component| matches!(part, Component::Normal(_));
    let ok = !path.is_empty() && Path::new(path).components().all(plain) && !path.contains('\\');
    ensure(
        ok,
        key,
        "a path inside the folder",
        format_args!("`{path}`"),
    )
}
