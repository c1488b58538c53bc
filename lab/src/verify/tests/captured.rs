//! One captured frame of a scene, and its agreement with the reference.

use super::*;
use std::io::Write;
use std::path::{Path, PathBuf};

pub(super) const SIZE_PX: [u32; 2] = [200, 136];
pub(super) const BUDGET: u64 = 128 << 20;

pub(super) struct Captured {
    pub(super) trace: Vec<u8>,
    pub(super) tables: Tables,
    /// Tiles by pass.
    pub(super) tiles: Vec<Vec<Tile>>,
    pub(super) pictures_match: bool,
    /// RGBA8 by pass.
    pub(super) pictures: Vec<Vec<u8>>,
    pub(super) counts: CaptureCounts,
    pub(super) predicted: Predicted,
    pub(super) work: Work,
}

pub(super) const BOTH: &[Eye] = &[Eye::Left, Eye::Right];

pub(super) fn display(size_px: [u32; 2]) -> Hmd {
    let mut hmd = hmd::preset("symmetric-100").unwrap();
    hmd.eye_size_px = size_px;
    hmd.fov = [hmd::symmetric(100.0, size_px); 2];
    hmd
}

pub(super) fn views(scene: &Scene, size_px: [u32; 2]) -> FrameViews {
    cameras::still_frame(&scene.cameras[0], &display(size_px))
        .unwrap()
        .remove(0)
}

/// A planner of `eyes` without techniques.
pub(super) fn baseline(size_px: [u32; 2], eyes: &[Eye]) -> Planner {
    planner(&Settings::default(), size_px, eyes)
}

pub(super) fn planner(settings: &Settings, size_px: [u32; 2], eyes: &[Eye]) -> Planner {
    let hmd = display(size_px);
    let lenses = hmd.fov.map(|fov| Lens::of(&fov));
    Planner::new(settings, &hmd, lenses, eyes, 72.0).unwrap()
}

pub(super) fn job<'a>(
    scene: &'a Scene,
    draws: &'a DrawList,
    planner: &'a Planner,
) -> CaptureJob<'a> {
    CaptureJob {
        scene,
        draws,
        lighting: Lighting::new(scene),
        bounds: scene.bounds().unwrap_or_default(),
        shadow_range_m: [0.1, 40.0],
        planner,
        skips: Skips::default(),
        fragments: Fragments::DepthTested,
        shaded: true,
    }
}

/// The driver for a scene and its draws.
pub(super) fn driver(scene: &Scene, draws: &DrawList, size_px: [u32; 2]) -> Lavapipe {
    let set = TextureSet::compress(scene).unwrap();
    let gpu = device::open(None).unwrap_or_else(|e| panic!("{e}"));
    Lavapipe::new(gpu, scene, draws, &set, size_px, BUDGET).unwrap_or_else(|e| panic!("{e}"))
}

/// The path of a downloaded scene, or nothing and a message if it is absent.
pub(super) fn real_scene(file: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("PARALLAX_SCENES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes"),
        Into::into,
    );
    let path = folder.join(file);
    if path.exists() {
        return Some(path);
    }
    // Not `eprintln`, because libtest captures its lines: `scripts/test.sh` lists this one.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: {} is absent (set PARALLAX_SCENES)",
        path.display()
    );
    None
}

/// Captures one stereo frame; fails with the names of the packages if there is no lavapipe.
pub(super) fn capture(scene: &Scene, size_px: [u32; 2], cascades: u32, budget: u64) -> Captured {
    try_capture(scene, size_px, cascades, budget, BOTH, true).unwrap_or_else(|e| panic!("{e}"))
}

/// Captures one frame of `eyes`, after a plain picture of it if `plain` is set.
pub(super) fn try_capture(
    scene: &Scene,
    size_px: [u32; 2],
    cascades: u32,
    budget: u64,
    eyes: &[Eye],
    plain: bool,
) -> Result<Captured, RasterError> {
    capture_as(&baseline(size_px, eyes), scene, cascades, budget, plain)
}

/// Captures one planned frame, after a plain picture of it if `plain` is set.
pub(super) fn capture_as(
    planner: &Planner,
    scene: &Scene,
    cascades: u32,
    budget: u64,
    plain: bool,
) -> Result<Captured, RasterError> {
    let skips = Skips::default();
    let tested = Fragments::DepthTested;
    Ok(capture_skipping(planner, scene, cascades, budget, plain, skips, tested)?.0)
}

/// The tables of a trace of one frame.
fn tables(
    job: &CaptureJob<'_>,
    (views, frame): (&FrameViews, &Frame),
    set: &TextureSet,
    backend: &Lavapipe,
) -> Tables {
    let textures = job.draws.textures(set);
    let (samplers, draw_table) = job.draws.tables(job.scene, set, &textures);
    Tables {
        meta: TraceMeta {
            tool: "test".into(),
            command_line: Vec::new(),
            scene: "test".into(),
            scene_triangles: job.scene.triangle_count(),
            camera: "test".into(),
            backend: "lavapipe".into(),
            driver: backend.driver().into(),
            seed: 0,
            hmd: display(job.planner.hmd().eye_size_px),
            frames: vec![views.clone()],
            surfaces: Some(job.draws.surfaces(job.fragments)),
            origin_m: [0.0; 3],
            techniques: None,
            program: None,
            ..TraceMeta::default()
        },
        textures,
        samplers,
        draws: draw_table,
        passes: frame.plan.passes(frame.number),
    }
}

fn tiles(trace: &Textrace) -> Vec<Vec<Tile>> {
    let passes = &trace.tables().passes;
    (0..passes.len())
        .map(|pass| {
            (0..passes[pass].tile_count() as usize)
                .map(|index| {
                    let mut tile = Tile::default();
                    trace.decode_tile(pass, index, &mut tile).unwrap();
                    tile
                })
                .collect()
        })
        .collect()
}

/// Like [`capture_as`], with the given skips and fragments; also returns what was skipped of textures and
/// frame.
pub(super) fn capture_skipping(
    planner: &Planner,
    scene: &Scene,
    cascades: u32,
    budget: u64,
    plain: bool,
    skips: Skips,
    fragments: Fragments,
) -> Result<(Captured, TextureSet, Skipped), RasterError> {
    let size_px = planner.hmd().eye_size_px;
    let draws = DrawList::new(scene, cascades).unwrap();
    let views = views(scene, size_px);
    let job = CaptureJob {
        skips,
        fragments,
        ..job(scene, &draws, planner)
    };
    let mut finest = Vec::new();
    let frame = job.frame_and_levels(&views, &mut finest)?;
    let set = TextureSet::prepare(scene, |image| finest[image], None).unwrap();
    let mut backend = Lavapipe::new(device::open(None)?, scene, &draws, &set, size_px, budget)?;
    let tables = tables(&job, (&views, &frame), &set, &backend);
    job.light(&mut backend, &frame)?;
    let plain = plain.then(|| job.plain_frame(&mut backend, &frame));
    // Multiview leaves no depth per view.
    let compares = matches!(plain, Some(Ok(_))) && !planner.settings().multiview;
    let depths = compares.then(|| job.depths(&mut backend, &frame).unwrap());
    let recorder = || {
        let writer = TextraceWriter::in_memory(&tables).unwrap();
        Recorder::new(writer, draws.replays(fragments))
    };
    let mut shaded = recorder();
    let before = backend.work();
    let CapturedFrame {
        pictures, counts, ..
    } = job.capture_frame(&mut backend, &frame, &mut shaded)?;
    let after = backend.work();
    let trace = shaded.into_writer().unwrap().into_bytes().unwrap();
    if let Some(depths) = &depths {
        assert!(job.depths(&mut backend, &frame)? == *depths, "shaded");
    }
    // Neither records nor depth depend on whether a picture is drawn.
    let unshaded = CaptureJob {
        shaded: false,
        ..job
    };
    let mut without = recorder();
    unshaded.capture_frame(&mut backend, &frame, &mut without)?;
    assert!(
        without.into_writer().unwrap().into_bytes().unwrap() == trace,
        "a trace without shading"
    );
    if let Some(depths) = &depths
        && fragments == Fragments::DepthTested
    {
        assert!(
            unshaded.depths(&mut backend, &frame)? == *depths,
            "unshaded"
        );
    }
    let reader = Textrace::from_bytes(trace.clone()).unwrap();
    let captured = Captured {
        trace,
        tables,
        tiles: tiles(&reader),
        pictures_match: match plain {
            Some(plain) => Some(plain?.0) == pictures,
            None => true,
        },
        pictures: pictures.unwrap_or_default(),
        counts,
        predicted: frame.plan.predicted,
        work: Work {
            draws: after.draws - before.draws,
            calls: after.calls - before.calls,
            regions: after.regions - before.regions,
            ..after
        },
    };
    Ok((captured, set, frame.skipped))
}

/// Agreement of one eye's pass with the reference.
pub(super) fn agreement(
    scene: &Scene,
    captured: &Captured,
    pass: usize,
    alpha: &dyn AlphaTest,
) -> Agreement {
    let draws = DrawList::new(scene, 0).unwrap();
    let size_px = captured.tables.passes[pass].size_px;
    let view = views(scene, size_px).eyes[pass];
    let recorded = match &captured.tables.meta.surfaces {
        Some(surfaces) if !surfaces.depth_tested => Fragments::All,
        _ => Fragments::DepthTested,
    };
    let geometry = Geometry::new(scene, &draws, &view, size_px, |_| true);
    let comparison = Comparison {
        tables: &captured.tables,
        alpha,
        recorded,
        formula: LodFormula::Llvmpipe,
        shadows: None,
    };
    let mut sum = Agreement::default();
    for (number, tile) in captured.tiles[pass].iter().enumerate() {
        sum.merge(&comparison.tile(&geometry, number, tile).0);
    }
    assert_eq!(sum.recorded_twice, 0);
    sum
}

/// Pixel and primitive of every recorded lane of a pass.
pub(super) fn recorded(captured: &Captured, pass: usize) -> BTreeSet<([u32; 2], u32)> {
    let columns = captured.tables.passes[pass].tiles[0];
    let of_tile = |(number, tile): (u32, &Tile)| {
        let origin = [number % columns, number / columns].map(|t| t * TILE_SIZE_PX);
        let pixel = move |key| (pixel_of(key, origin), (key >> 8) as u32);
        lanes(tile).into_iter().map(move |lane| pixel(lane.key))
    };
    (0..).zip(&captured.tiles[pass]).flat_map(of_tile).collect()
}
