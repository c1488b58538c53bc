//! Prepares a scene for [`crate::study`]: its world, and a device with the uploaded scene.

use super::cache_args::CacheArgs;
use super::capture_steps::{self, prepare_textures};
use super::scene_args::SceneSetup;
use crate::study::world::World;
use ::raster::backend::Fragments;
use ::raster::error::RasterError;
use ::raster::lavapipe::{Lavapipe, device::Gpu};
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
    let cascades = capture_steps::cascades(&setup.scene, of.shadows);
    let mut world = world(setup, cascades, of.lens)?;
    let scene = &world.scene;
    let uploads = prepare_textures(scene, |_| Some(0), of.cache.open()?.as_ref())?;
    let size_px = world.hmd.eye_size_px;
    let backend = Lavapipe::new(
        gpu,
        scene,
        &world.draws,
        &uploads,
        size_px,
        of.record_budget,
    )?;
    world.tables =
        capture_steps::tables(&world, of.scene, &uploads, &backend, Fragments::DepthTested);
    world.texture_bytes = uploads.bytes() as u64;
    Ok(Prepared { world, backend })
}

/// The world of a loaded scene with a number of shadow cascades.
///
/// # Errors
/// A scene that cannot be drawn.
pub fn world(setup: SceneSetup, cascades: u32, lens: [Lens; 2]) -> Result<World, RasterError> {
    World::new(
        (setup.scene, cascades),
        (setup.camera, setup.frames, setup.moments),
        (setup.hmd, lens),
    )
}
