//! Prepares a scene for [`crate::study`]: its world, and a device with the uploaded scene.

use super::cache_args::CacheArgs;
use super::capture_steps::{self, prepare_textures};
use super::scene_args::SceneSetup;
use crate::study::world::{World, shadow_range_m};
use ::raster::backend::Fragments;
use ::raster::draws::DrawList;
use ::raster::lavapipe::{Lavapipe, device::Gpu};
use ::raster::lighting::Lighting;
use formats::view::Lens;

/// A world and the device that renders it.
pub struct Prepared {
    /// Scene, path and display.
    pub world: World,
    /// The device with the uploaded scene.
    pub backend: Lavapipe,
}

/// Options of a preparation.
pub struct Preparation<'a> {
    /// The scene as given.
    pub scene: &'a str,
    /// Visible parts of the left and right eye's pictures.
    pub lens: [Lens; 2],
    /// Frames per second along the path.
    pub fps: f32,
    /// Whether shadow cascades are added.
    pub shadows: bool,
    /// Size limit of raw records in bytes.
    pub record_budget: u64,
    /// The cache of textures.
    pub cache: CacheArgs,
}

/// Compresses all textures of the scene, because techniques and frames may sample what others do not, and
/// uploads it to `gpu`.
///
/// # Errors
/// Unreadable textures, driver errors.
pub fn prepare(of: Preparation<'_>, setup: SceneSetup, gpu: Gpu) -> anyhow::Result<Prepared> {
    let scene = &setup.scene;
    let draws = DrawList::new(scene, capture_steps::cascades(scene, of.shadows))?;
    let uploads = prepare_textures(scene, |_| Some(0), of.cache.open()?.as_ref())?;
    let size_px = setup.hmd.eye_size_px;
    let backend = Lavapipe::on(gpu, scene, &draws, &uploads, size_px, of.record_budget)?;
    let tables = capture_steps::tables(
        &setup,
        of.scene,
        &draws,
        &uploads,
        &backend,
        Vec::new(),
        Fragments::DepthTested,
    );
    let bounds = scene.bounds().unwrap_or_default();
    let world = World {
        draws,
        lighting: Lighting::new(scene),
        bounds,
        shadow_range_m: shadow_range_m(&setup.camera, bounds),
        lens: of.lens,
        tables,
        fps: of.fps,
        start_s: setup.moments.scene_start_s,
        camera: setup.camera,
        hmd: setup.hmd,
        views: setup.frames,
        scene: setup.scene,
        texture_bytes: uploads.bytes() as u64,
        shown: None,
    };
    Ok(Prepared { world, backend })
}
