//! Steps that several commands take to capture a scene.

use super::raster_args::RasterArgs;
use super::scene_args::SceneSetup;
use crate::picture;
use crate::study::world::World;
use anyhow::Context;
use formats::container::AtomicFile;
use formats::textrace::{Tables, TextraceWriter, TraceMeta};
use formats::texture::TexelFormat;
use raster::backend::{CaptureBackend, Fragments};
use raster::capture::Pictures;
use raster::geometry::geometry;
use record::Recorder;
use scene::{LoadOptions, Scene};
use shell::{Output, cannot_write, lasting_arguments};
use std::path::Path;
use textures::{Cache, TextureSet};

/// Cascades that `--shadows` adds (Z2 paper section 4.1).
const CASCADES: u32 = 4;

/// Formats of shadow maps.
pub(super) const SHADOW_FORMATS: [(&str, TexelFormat, &str); 3] = [
    ("r32f", TexelFormat::R32f, "4 bytes a texel"),
    ("d16", TexelFormat::D16, "2 bytes a texel"),
    ("bc4", TexelFormat::Bc4, "8 bytes for 4x4 texels"),
];

/// The refusal of a scene without shadow maps.
pub(super) fn no_maps(scene: &str) -> String {
    format!("{scene}: expected a scene with shadow maps, found one without: add --shadows")
}

/// Loads the scene and the path of `tracegen raster`.
pub fn load(args: &RasterArgs, outputs: &[Output]) -> anyhow::Result<SceneSetup> {
    let setup = args
        .scene
        .setup(None, &args.path, 0..args.frames(), &LoadOptions::ALL)?;
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
    let defect = backend.for_technique("multiview")?.multiview_defect()?;
    if let Some(defect) = &defect {
        shell::warn(&format!(
            "multiview cannot be trusted, so views are drawn one by one: {defect}"
        ));
    }
    Ok(defect)
}

/// The trace of `tracegen raster` and its picture.
pub struct TraceOutput<'a> {
    pub recorder: Recorder<AtomicFile>,
    image: Option<&'a Path>,
}

impl<'a> TraceOutput<'a> {
    /// Creates the trace beside its final place.
    pub fn create(args: &'a RasterArgs, tables: &Tables, world: &World) -> anyhow::Result<Self> {
        let writer = TextraceWriter::create(&args.output, tables)?;
        let mut writer = writer.with_encoding(args.encoding);
        if args.geometry {
            writer = writer.with_geometry(geometry(&world.scene, &world.draws))?;
        }
        Ok(Self {
            recorder: Recorder::new(writer, world.draws.replays(args.hsr)),
            image: args.image.as_deref(),
        })
    }

    /// Writes the picture and the trace; both appear or neither does. Returns the size of the trace in bytes.
    pub fn finish(self, pictures: Option<&Pictures>, size_px: [u32; 2]) -> anyhow::Result<u64> {
        let image = match (self.image, pictures) {
            (Some(path), Some(pictures)) => {
                let prepared = picture::prepare_side_by_side(path, pictures, size_px);
                Some((path, prepared.with_context(|| cannot_write(path))?))
            }
            _ => None,
        };
        let file_bytes = self.recorder.into_writer()?.finish()?;
        if let Some((path, image)) = image {
            image.persist().with_context(|| cannot_write(path))?;
        }
        Ok(file_bytes)
    }
}

/// Shadow cascades of a scene, or the cascades that `--shadows` adds.
pub(super) fn cascades(scene: &Scene, shadows: bool) -> u32 {
    if shadows {
        CASCADES
    } else {
        scene.shadow_cascades.min(CASCADES)
    }
}

/// The tables of a trace of all frames that records `fragments`, without passes.
pub(super) fn tables(
    world: &World,
    spec: &str,
    uploads: &TextureSet,
    backend: &dyn CaptureBackend,
    fragments: Fragments,
) -> Tables {
    let textures = world.draws.textures(uploads);
    let (samplers, draws) = world.draws.tables(&world.scene, uploads, &textures);
    Tables {
        meta: TraceMeta {
            tool: super::tool(),
            command_line: lasting_arguments(std::env::args_os().skip(1)),
            scene: spec.into(),
            scene_triangles: world.scene.triangle_count(),
            camera: world.camera.name.clone(),
            backend: backend.name().into(),
            driver: backend.driver().into(),
            hmd: world.hmd.clone(),
            frames: world.views.clone(),
            surfaces: Some(world.draws.surfaces(fragments)),
            origin_m: world.scene.origin.to_array(),
            ..TraceMeta::default()
        },
        textures,
        samplers,
        draws,
        passes: Vec::new(),
    }
}

/// Sets the environment variables that Mesa reads.
pub(super) fn prepare_environment(threads: Option<u16>) {
    // SAFETY: the only other thread waits for signals; nothing reads the environment meanwhile.
    unsafe {
        // Mesa's device selection tries to connect to a display server, and prints errors if there is none.
        std::env::set_var("NODEVICE_SELECT", "1");
        // At narrow vectors Mesa 22.3 corrupts memory where the processor has AVX2, and on some that have AVX.
        let set = |name: &str| std::env::var_os(name);
        if set("LP_NATIVE_VECTOR_WIDTH").is_some_and(|bits| bits == "128")
            && set("GALLIUM_OVERRIDE_CPU_CAPS").is_none()
        {
            std::env::set_var("GALLIUM_OVERRIDE_CPU_CAPS", "sse4.1");
        }
        // softpipe provides all features of OpenGL 4.5 that the capture needs, as extensions of 3.3.
        if set("GALLIUM_DRIVER").is_some_and(|driver| driver == "softpipe") {
            std::env::set_var("MESA_GL_VERSION_OVERRIDE", "4.5");
            std::env::set_var("MESA_GLSL_VERSION_OVERRIDE", "450");
        }
        if let Some(threads) = threads {
            std::env::set_var("LP_NUM_THREADS", threads.to_string());
        }
    }
}
