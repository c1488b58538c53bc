//! Steps that several commands take to capture a scene.

use super::raster::RasterArgs;
use super::scene_args::SceneSetup;
use crate::picture;
use crate::study::world::Tracer;
use anyhow::Context;
use formats::container::AtomicFile;
use formats::textrace::{Tables, TextraceWriter};
use raster::backend::CaptureBackend;
use raster::capture::Pictures;
use raster::draws::DrawList;
use raster::geometry::geometry;
use scene::{LoadOptions, Scene};
use shell::Output;
use std::path::Path;
use textures::{Cache, TextureSet};

/// Loads the scene and the path of `tracegen raster`.
pub fn load(args: &RasterArgs, outputs: &[Output]) -> anyhow::Result<SceneSetup> {
    let setup = args
        .scene
        .setup(None, &args.path, 0..args.frames, &LoadOptions::ALL)?;
    setup.check_outputs(outputs)?;
    Ok(setup)
}

/// Compresses the textures of a scene from their finest levels on and prints warnings.
pub fn prepare_textures(
    scene: &Scene,
    finest: impl Fn(usize) -> Option<u32> + Sync,
    cache: Option<&Cache>,
) -> anyhow::Result<TextureSet> {
    let textures = TextureSet::prepare(scene, finest, cache)?;
    for note in &textures.notes {
        shell::warn(note);
    }
    Ok(textures)
}

/// Warns if both views are drawn one by one because multiview has a defect, and returns it.
pub fn warn_of_multiview_defect(
    backend: &mut dyn CaptureBackend,
) -> anyhow::Result<Option<String>> {
    let defect = backend.multiview_defect()?;
    if let Some(defect) = &defect {
        shell::warn(&format!(
            "multiview cannot be trusted, so views are drawn one by one: {defect}"
        ));
    }
    Ok(defect)
}

/// The trace of `tracegen raster` and its picture.
pub struct TraceOutput<'a> {
    pub tracer: Tracer<'a, AtomicFile>,
    image: Option<&'a Path>,
}

impl<'a> TraceOutput<'a> {
    /// Creates the trace beside its final place.
    pub fn create(
        args: &'a RasterArgs,
        tables: &'a Tables,
        scene: &Scene,
        draws: &DrawList,
    ) -> anyhow::Result<Self> {
        let writer = TextraceWriter::create(&args.output, tables)?;
        let mut writer = writer.with_encoding(args.encoding);
        if args.geometry {
            writer = writer.with_geometry(geometry(scene, draws))?;
        }
        Ok(Self {
            tracer: Tracer::new(tables, writer),
            image: args.image.as_deref(),
        })
    }

    /// Writes the picture and the trace; both appear or neither does. Returns the size of the trace in bytes.
    pub fn finish(self, pictures: Option<&Pictures>, size_px: [u32; 2]) -> anyhow::Result<u64> {
        let cannot_write = |path: &Path| format!("cannot write {}", path.display());
        let image = match (self.image, pictures) {
            (Some(path), Some(pictures)) => {
                let prepared = picture::prepare_side_by_side(path, pictures, size_px);
                Some((path, prepared.with_context(|| cannot_write(path))?))
            }
            _ => None,
        };
        let file_bytes = self.tracer.into_writer().finish()?;
        if let Some((path, image)) = image {
            image.persist().with_context(|| cannot_write(path))?;
        }
        Ok(file_bytes)
    }
}
