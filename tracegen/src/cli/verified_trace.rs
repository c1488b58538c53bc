//! What a trace tells of its own capture: views, camera and shadow maps, and whether it is a baseline.

use super::scene_args::SceneSetup;
use anyhow::{Context, bail, ensure};
use formats::textrace::Textrace;
use formats::view::FrameViews;
use glam::DVec3;
use scene::{Camera, Scene};
use std::path::Path;

/// Name of the texture of the shadow maps.
const SHADOW_MAPS: &str = "shadow cascades";

/// Largest number of shadow cascades.
const MOST_CASCADES: u32 = 4;

/// Flags of `tracegen raster` that leave out fragments which a plain picture has.
const LEAVE_OUT: [&str; 5] = [
    "--hidden-area-mask",
    "--hidden-area-mesh",
    "--cull-distance",
    "--cull-px",
    "--reuse-shading",
];

/// Takes display and views from a trace. Returns whether the shadow cascades follow from them.
pub(super) fn look_as(
    trace: &Textrace,
    file: &Path,
    setup: &mut SceneSetup,
) -> anyhow::Result<bool> {
    let meta = &trace.tables().meta;
    let first = meta
        .frames
        .first()
        .with_context(|| format!("{}: the trace has no frames", file.display()))?;
    let moves = setup.scene.moves();
    ensure!(
        !moves || first.frame == 0,
        "{}: expected frame 0 of a scene that moves, found frame {}",
        file.display(),
        first.frame
    );
    if setup
        .frames
        .first()
        .is_none_or(|own| own.eyes != first.eyes)
    {
        setup.camera = camera_of(first, &setup.scene, &setup.camera);
    }
    setup.hmd = meta.hmd.clone();
    setup.frames = match moves {
        true => vec![first.clone()],
        false => meta.frames.clone(),
    };
    // The cascades span what is seen from the start of the path.
    Ok(first.frame == 0)
}

/// The camera between the eyes of a trace. Numbers that equal the scene's within rounding are
/// replaced by the scene's, because the shadow cascades depend on the last bits.
fn camera_of(views: &FrameViews, scene: &Scene, own: &Camera) -> Camera {
    let [left, right] = views
        .eyes
        .each_ref()
        .map(|eye| DVec3::from(eye.position.map(f64::from)));
    let eye = (left + right) / 2.0;
    let [scale, offset] = [2, 3].map(|column| f64::from(views.eyes[0].eye_to_clip[column][2]));
    let planes = match offset > 0.0 {
        true => [offset / (1.0 + scale), offset / scale],
        false => [offset / scale, offset / (1.0 + scale)],
    };
    // Infinity has either sign.
    let planes = planes.map(f64::abs);
    let same = |known: f32, found: f64| {
        (f64::from(known) / found - 1.0).abs() < 1e-3 || known.is_infinite() && found.is_infinite()
    };
    let known = || std::iter::once(own).chain(&scene.cameras);
    let of_planes =
        known().find(|camera| same(camera.near, planes[0]) && same(camera.far, planes[1]));
    let near_eye = |camera: &&Camera| {
        let step = 1e-6 * (1.0 + eye.abs().max_element());
        camera.eye.as_dvec3().abs_diff_eq(eye, step)
    };
    let [near, far] = match of_planes {
        Some(camera) => [camera.near, camera.far],
        None => planes.map(|plane| plane as f32),
    };
    Camera {
        eye: known()
            .find(near_eye)
            .map_or(eye.as_vec3(), |camera| camera.eye),
        near,
        far,
        ..own.clone()
    }
}

/// Shadow cascades of a trace.
pub(super) fn trace_cascades(trace: &Textrace) -> u32 {
    let last = trace.tables().textures.last();
    let maps = last.filter(|t| t.name == SHADOW_MAPS);
    maps.map_or(0, |maps| maps.layers.min(MOST_CASCADES))
}

/// Refuses a capture that leaves out fragments on purpose.
pub(super) fn refuse_partial(trace: &Textrace) -> anyhow::Result<()> {
    let meta = &trace.tables().meta;
    let flag = |argument: &String| {
        let flag = argument.split('=').next()?;
        LEAVE_OUT.contains(&flag).then(|| flag.to_owned())
    };
    let chosen = meta
        .techniques
        .as_ref()
        .map(|chosen| chosen.schedule.clone());
    if let Some(found) = meta.command_line.iter().find_map(flag).or(chosen) {
        bail!(
            "expected a capture of whole pictures, found one with {found}: verify compares the baseline"
        );
    }
    Ok(())
}
