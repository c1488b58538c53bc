//! A scene made ready for [`crate::study`]: its world, and the device with the scene on it.

use super::cache_args::CacheArgs;
use super::raster;
use super::scene_args::SceneSetup;
use crate::study::world::World;
use ::raster::backend::Fragments;
use ::raster::draws::DrawList;
use ::raster::lavapipe::{Lavapipe, device::Gpu};
use ::raster::lighting::Lighting;
use formats::view::Lens;
use textures::TextureSet;

/// A world and the device that renders it.
pub struct Prepared {
    /// Scene, path and display.
    pub world: World,
    /// The device with the scene on it.
    pub backend: Lavapipe,
}

/// Compresses the scene's textures, all of them (techniques and frames may sample what others do
/// not), and uploads it to `gpu`. `spec` is the scene as given.
///
/// # Errors
/// Unreadable textures, driver errors.
pub fn prepare(
    setup: SceneSetup,
    lens: [Lens; 2],
    fps: f32,
    spec: &str,
    gpu: Gpu,
    [cascades, record_budget]: [u64; 2],
    cache: CacheArgs,
) -> anyhow::Result<Prepared> {
    let scene = &setup.scene;
    let draws = DrawList::new(scene, cascades as u32)?;
    let uploads = TextureSet::prepare(scene, |_| Some(0), cache.open()?.as_ref())?;
    for note in &uploads.notes {
        shell::warn(note);
    }
    let size_px = setup.hmd.eye_size_px;
    let backend = Lavapipe::on(gpu, scene, &draws, &uploads, size_px, record_budget)?;
    let tables = raster::tables(
        &setup,
        spec,
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
        shadow_range_m: raster::shadow_range_m(&setup, bounds),
        lens,
        tables,
        fps,
        hmd: setup.hmd,
        views: setup.frames,
        scene: setup.scene,
        texture_bytes: uploads.bytes() as u64,
        shown: None,
    };
    Ok(Prepared { world, backend })
}
