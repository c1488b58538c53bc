//! The capture through lavapipe against the reference.

use super::agreement::Agreement;
use super::classes::Class;
use super::compare::{Comparison, lanes, pixel_of};
use super::geometry::Geometry;
use super::reference::AlphaTest;
use formats::footprint::LodFormula;
use formats::textrace::{SUBTEXELS, Tables, Textrace, TextraceWriter, Tile, TraceMeta};
use formats::texture::{ColorSpace, Filter, MipFilter, Sampler};
use formats::view::{Eye, FrameViews, Hmd, Lens, TILE_SIZE_PX};
use glam::{Affine3A, DVec2, Vec2, Vec3, Vec4};
use raster::backend::{CaptureBackend, Fragments, View, Work};
use raster::capture::{CaptureJob, CapturedFrame};
use raster::draws::{DrawCall, DrawList, SHADOW_SIZE};
use raster::error::RasterError;
use raster::lavapipe::{Lavapipe, device};
use raster::lighting::Lighting;
use raster::skips::Skipped;
use record::CaptureCounts;
use scene::{AlphaMode, Camera, Image, Instance, Material, Mesh, Scene, TextureRef, cameras, hmd};
use std::collections::BTreeSet;
use techniques::layer::Predicted;
use techniques::{Layer, Planner, Settings, Skips};
use textures::TextureSet;

mod culling;
mod every_fragment;
mod far_field;
mod layers;
mod motion;
mod skips;

const SIZE_PX: [u32; 2] = [200, 136];
const BUDGET: u64 = 128 << 20;

struct Captured {
    trace: Vec<u8>,
    tables: Tables,
    /// Tiles by pass.
    tiles: Vec<Vec<Tile>>,
    pictures_match: bool,
    /// RGBA8 by pass.
    pictures: Vec<Vec<u8>>,
    counts: CaptureCounts,
    predicted: Predicted,
    work: Work,
}

const BOTH: &[Eye] = &[Eye::Left, Eye::Right];

fn display(size_px: [u32; 2]) -> Hmd {
    let mut hmd = hmd::preset("symmetric-100").unwrap();
    hmd.eye_size_px = size_px;
    hmd.fov = [hmd::symmetric(100.0, size_px); 2];
    hmd
}

fn views(scene: &Scene, size_px: [u32; 2]) -> FrameViews {
    cameras::still_frame(&scene.cameras[0], &display(size_px))
        .unwrap()
        .remove(0)
}

/// The baseline of `eyes`.
fn baseline(size_px: [u32; 2], eyes: &[Eye]) -> Planner {
    planner(&Settings::default(), size_px, eyes)
}

fn planner(settings: &Settings, size_px: [u32; 2], eyes: &[Eye]) -> Planner {
    let hmd = display(size_px);
    let lenses = hmd.fov.map(|fov| Lens::of(&fov));
    Planner::new(settings, &hmd, lenses, eyes, 72.0).unwrap()
}

fn job<'a>(scene: &'a Scene, draws: &'a DrawList, planner: &'a Planner) -> CaptureJob<'a> {
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

/// Captures one stereo frame; fails, naming the packages, where there is no lavapipe.
fn capture(scene: &Scene, size_px: [u32; 2], cascades: u32, budget: u64) -> Captured {
    try_capture(scene, size_px, cascades, budget, BOTH, true).unwrap_or_else(|e| panic!("{e}"))
}

/// Captures one frame of `eyes`, after a plain picture of it where one is wanted.
fn try_capture(
    scene: &Scene,
    size_px: [u32; 2],
    cascades: u32,
    budget: u64,
    eyes: &[Eye],
    plain: bool,
) -> Result<Captured, RasterError> {
    capture_as(&baseline(size_px, eyes), scene, cascades, budget, plain)
}

/// Captures one frame as planned, after a plain picture of it where one is wanted.
fn capture_as(
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

/// As [`capture_as`], with the given skips and fragments; also what they left out of the textures and of the frame.
fn capture_skipping(
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
    let finest = job.finest_levels(std::slice::from_ref(&views))?;
    let set = TextureSet::prepare(scene, |image| finest[image], None).unwrap();
    let mut backend = Lavapipe::new(scene, &draws, &set, size_px, budget)?;
    let textures = draws.textures(&set);
    let (samplers, draw_table) = draws.tables(scene, &set, &textures);
    let tables = Tables {
        meta: TraceMeta {
            tool: "test".into(),
            command_line: Vec::new(),
            scene: "test".into(),
            scene_triangles: scene.triangle_count(),
            camera: "test".into(),
            backend: "lavapipe".into(),
            driver: backend.driver().into(),
            seed: 0,
            hmd: display(size_px),
            frames: vec![views.clone()],
            surfaces: Some(draws.surfaces(fragments)),
            origin_m: [0.0; 3],
        },
        textures,
        samplers,
        draws: draw_table,
        passes: job.passes(std::slice::from_ref(&views)),
    };
    let frame = job.frame(&views)?;
    job.light(&mut backend, &frame)?;
    let plain = plain.then(|| job.plain_frame(&mut backend, &frame));
    // Both views at once leave no depth of their own.
    let compares = matches!(plain, Some(Ok(_))) && !planner.settings().multiview;
    let depths = compares.then(|| job.depths(&mut backend, &frame).unwrap());
    let mut writer = TextraceWriter::in_memory(&tables).unwrap();
    let mut recorder = job.recorder(&tables);
    let before = backend.work();
    let CapturedFrame {
        pictures, counts, ..
    } = job.capture_frame(&mut backend, &frame, 0, &mut recorder, &mut writer)?;
    let after = backend.work();
    let trace = writer.into_bytes().unwrap();
    if let Some(depths) = &depths {
        assert!(job.depths(&mut backend, &frame)? == *depths, "shaded");
    }
    // Records do not depend on whether a picture is drawn as well, and depth neither.
    let unshaded = CaptureJob {
        shaded: false,
        ..job
    };
    let mut writer = TextraceWriter::in_memory(&tables).unwrap();
    let mut recorder = unshaded.recorder(&tables);
    unshaded.capture_frame(&mut backend, &frame, 0, &mut recorder, &mut writer)?;
    assert!(
        writer.into_bytes().unwrap() == trace,
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
    let tiles = (0..tables.passes.len())
        .map(|pass| {
            (0..tables.passes[pass].tile_count() as usize)
                .map(|index| {
                    let mut tile = Tile::default();
                    reader.decode_tile(pass, index, &mut tile).unwrap();
                    tile
                })
                .collect()
        })
        .collect();
    let captured = Captured {
        trace,
        tables,
        tiles,
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
fn agreement(scene: &Scene, captured: &Captured, pass: usize, alpha: &dyn AlphaTest) -> Agreement {
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
    };
    let mut sum = Agreement::default();
    for (number, tile) in captured.tiles[pass].iter().enumerate() {
        sum.merge(&comparison.tile(&geometry, number, tile).0);
    }
    assert_eq!(sum.recorded_twice, 0);
    sum
}

/// Pixel and primitive of every recorded lane of a pass.
fn recorded(captured: &Captured, pass: usize) -> BTreeSet<([u32; 2], u32)> {
    let columns = captured.tables.passes[pass].tiles[0];
    let of_tile = |(number, tile): (u32, &Tile)| {
        let origin = [number % columns, number / columns].map(|t| t * TILE_SIZE_PX);
        let pixel = move |key| (pixel_of(key, origin), (key >> 8) as u32);
        lanes(tile).into_iter().map(move |lane| pixel(lane.key))
    };
    (0..).zip(&captured.tiles[pass]).flat_map(of_tile).collect()
}

/// Deterministic numbers in 0..1.
fn random(seed: u32) -> impl FnMut() -> f32 {
    let mut state = u64::from(seed) * 2 + 1;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    }
}

/// An image of 4x4-texel cells, which BC1 holds exactly; `opaque` decides each cell's alpha.
fn cells(cells: u32, opaque: impl Fn(u32, u32) -> bool) -> Image {
    let edge = cells * 4;
    let rgba: Vec<u8> = (0..edge * edge)
        .flat_map(|i| {
            let (x, y) = (i % edge / 4, i / edge / 4);
            if opaque(x, y) {
                [200, 160, 80, 255]
            } else {
                [0, 0, 0, 0]
            }
        })
        .collect();
    Image::from_texels("cells", [edge; 2], ColorSpace::Srgb, rgba)
}

/// Triangles of random size, place and slant in front of the camera, some across the near plane.
fn triangles(count: usize, seed: u32, material: usize) -> Mesh {
    let mut next = random(seed);
    let mut mesh = Mesh {
        name: "random".into(),
        material,
        ..Mesh::default()
    };
    for _ in 0..count {
        let center = Vec3::new(next() * 8.0 - 4.0, next() * 6.0 - 3.0, -0.5 - next() * 8.0);
        let size = 0.3 + next() * next() * 6.0;
        for _ in 0..3 {
            mesh.indices.push(mesh.positions.len() as u32);
            mesh.positions
                .push(center + size * (Vec3::new(next(), next(), next()) - 0.5));
            mesh.normals.push(Vec3::Z);
            mesh.tangents.push(Vec4::new(1.0, 0.0, 0.0, 1.0));
            mesh.uv0
                .push(Vec2::new(next() * 4.0 - 2.0, next() * 4.0 - 2.0));
        }
    }
    mesh
}

fn scene(meshes: Vec<Mesh>, materials: Vec<Material>, images: Vec<Image>) -> Scene {
    Scene {
        name: "test".into(),
        instances: (0..meshes.len())
            .map(|mesh| Instance {
                mesh,
                transform: Affine3A::IDENTITY,
            })
            .collect(),
        meshes,
        materials,
        images,
        cameras: vec![Camera {
            name: "test".into(),
            eye: Vec3::ZERO,
            target: Vec3::NEG_Z,
            up: Vec3::Y,
            vfov_deg: 60.0,
            near: 0.1,
            far: 50.0,
        }],
        ..Scene::default()
    }
}

fn textured(alpha: AlphaMode, double_sided: bool) -> Material {
    let sampler = Sampler {
        mag: Filter::Nearest,
        min: Filter::Nearest,
        mip: MipFilter::None,
        ..Sampler::TRILINEAR_REPEAT
    };
    Material {
        name: format!("{alpha:?}"),
        base_color_texture: Some(TextureRef {
            sampler,
            ..TextureRef::new(0)
        }),
        alpha,
        double_sided,
        ..Material::default()
    }
}

fn checker() -> Image {
    cells(8, |x, y| (x * 5 + y * 3) % 7 < 4)
}

/// For scenes without alpha test.
fn passes(_: &DrawCall, _: DVec2) -> bool {
    true
}

/// The alpha test on [`checker`] with nearest filtering.
fn checker_passes(_: &DrawCall, uv: DVec2) -> bool {
    let cell = uv.rem_euclid(DVec2::ONE) * 8.0;
    (cell.x as u32 * 5 + cell.y as u32 * 3) % 7 < 4
}

#[test]
fn coverage_depth_order_coordinates_and_levels_of_random_triangles_agree_with_the_reference() {
    let meshes = vec![
        triangles(150, 1, 0),
        triangles(80, 2, 1),
        triangles(60, 3, 2),
    ];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Opaque, false),
        textured(AlphaMode::Blend, true),
    ];
    let mut scene = scene(meshes, materials, vec![checker()]);
    // A mirrored instance turns the winding of the single-sided mesh round.
    scene.instances.push(Instance {
        mesh: 1,
        transform: Affine3A::from_scale_rotation_translation(
            Vec3::new(-1.0, 1.2, 0.8),
            glam::Quat::from_rotation_z(0.4),
            Vec3::new(0.3, -0.2, -0.5),
        ),
    });
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    for pass in 0..2 {
        let a = agreement(&scene, &captured, pass, &passes);
        println!("pass {pass}: {a:?}, IoU {:.6}", a.coverage_iou());
        assert!(a.both > 20_000, "{a:?}");
        assert!(a.coverage_iou() >= 0.999, "{a:?}");
        let [mean, _, max] = a.uv_errors_texels.summary();
        assert!(max < 0.05 && mean < 0.002, "{a:?}");
        let same_levels = a.capture.levels_differ as f64 / a.capture.samples as f64;
        assert!(same_levels < 0.001, "{a:?}");
        assert_eq!(a.of_class(Class::Unexplained), 0, "{a:?}");
    }
    assert!(captured.pictures_match);
}

#[test]
fn masked_draws_keep_exactly_the_lanes_that_an_in_order_gpu_keeps() {
    // Masked draws among opaque ones, with heavy overlap inside each draw.
    let meshes = vec![
        triangles(40, 11, 0),
        triangles(500, 12, 1),
        triangles(20, 13, 0),
        triangles(500, 14, 1),
    ];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Mask(0.5), true),
    ];
    let scene = scene(meshes, materials, vec![checker()]);
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    assert!(
        captured.counts.masked_lanes_killed > 10_000,
        "the scene must exercise the replay, killed {}",
        captured.counts.masked_lanes_killed
    );
    for pass in 0..2 {
        let a = agreement(&scene, &captured, pass, &checker_passes);
        println!("pass {pass}: {a:?}, IoU {:.6}", a.coverage_iou());
        assert!(a.coverage_iou() >= 0.999, "{a:?}");
    }
    assert!(captured.pictures_match);
}

#[test]
fn a_small_record_budget_gives_the_same_trace() {
    let meshes = vec![triangles(150, 21, 0), triangles(150, 22, 1)];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Mask(0.5), true),
    ];
    let scene = scene(meshes, materials, vec![checker()]);
    let whole = capture(&scene, SIZE_PX, 2, BUDGET);
    for budget in [300 << 10, 64 << 10] {
        let parts = capture(&scene, SIZE_PX, 2, budget);
        assert!(
            parts.trace == whole.trace,
            "budget {budget} changed the trace"
        );
        assert!(parts.pictures_match);
    }
}

/// Small meshes side by side over the view, each placed eight times in a row.
fn many_instances(alpha: AlphaMode) -> Scene {
    let meshes = (0..12).map(|mesh| triangles(3, 70 + mesh, 0)).collect();
    let mut scene = scene(meshes, vec![textured(alpha, true)], vec![checker()]);
    scene.instances = (0..96)
        .map(|i| {
            let place = Vec3::new((i % 12) as f32 - 5.5, (i / 12) as f32 - 3.5, -5.5) * 1.6;
            let transform =
                Affine3A::from_translation(place) * Affine3A::from_scale(Vec3::splat(0.4));
            Instance {
                mesh: i / 8,
                transform,
            }
        })
        .collect();
    scene
}

#[test]
fn instances_in_one_draw_call_are_recorded_as_if_they_were_drawn_one_by_one() {
    for alpha in [AlphaMode::Opaque, AlphaMode::Blend] {
        let scene = many_instances(alpha);
        let captured = capture(&scene, SIZE_PX, 0, BUDGET);
        assert_eq!([captured.work.draws, captured.work.calls], [2 * 96, 2 * 12]);
        for pass in 0..2 {
            let a = agreement(&scene, &captured, pass, &passes);
            assert!(a.both > 500, "{a:?}");
            assert!(a.coverage_iou() >= 0.999, "{a:?}");
        }
        assert!(captured.pictures_match);
    }
}

#[test]
fn a_region_after_an_overflow_draws_only_what_may_touch_it() {
    let scene = many_instances(AlphaMode::Opaque);
    let whole = capture(&scene, SIZE_PX, 0, BUDGET);
    let parts = capture(&scene, SIZE_PX, 0, 8 << 10);
    assert!(parts.trace == whole.trace);
    let (draws, regions) = (parts.work.draws, parts.work.regions);
    println!(
        "{draws} draws in {regions} regions, {} in one a view",
        whole.work.draws
    );
    assert_eq!(whole.work.regions, 2);
    assert!(regions >= 6, "{regions}");
    // One view's draws in each region would be 96.
    assert!(
        draws < 96 * regions * 3 / 4,
        "{draws} draws in {regions} regions"
    );
}

#[test]
fn a_lone_view_has_the_records_that_it_has_in_a_stereo_pair() {
    let meshes = vec![triangles(60, 81, 0), triangles(60, 82, 1)];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Mask(0.5), true),
    ];
    let scene = scene(meshes, materials, vec![checker()]);
    let both = capture(&scene, SIZE_PX, 2, BUDGET);
    for (pass, eye) in [Eye::Left, Eye::Right].into_iter().enumerate() {
        let alone = try_capture(&scene, SIZE_PX, 2, BUDGET, &[eye], true).unwrap();
        assert_eq!(alone.tables.passes.len(), 1);
        assert_eq!(alone.tiles[0], both.tiles[pass]);
    }
}

#[test]
fn work_that_a_frame_does_not_need_is_not_done() {
    let meshes = vec![triangles(60, 81, 0), triangles(60, 82, 1)];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Mask(0.5), true),
    ];
    let scene = scene(meshes, materials, vec![checker()]);
    let capture = |plain| try_capture(&scene, SIZE_PX, 2, BUDGET, BOTH, plain).unwrap();
    let (with, without) = (capture(true).work, capture(false).work);
    // Rendered once for the plain pictures and the captured ones: one a cascade that is looked up,
    // and nothing that is seen looks up the farther one.
    assert_eq!(with.shadow_maps, 1);
    // The textures' state and that of the slots without a texture.
    assert_eq!(with.samplers, 2);
    // Two casters, the opaque draw, the masked draw's records and its colour; the plain opaque
    // draw is a pipeline of its own.
    assert_eq!([without.pipelines, with.pipelines], [5, 6]);
    let captured = capture(false);
    assert!(captured.trace == capture(true).trace);
}

#[test]
fn a_budget_below_one_tile_is_refused() {
    let scene = scene(
        vec![triangles(400, 31, 0)],
        vec![textured(AlphaMode::Blend, true)],
        vec![checker()],
    );
    let captured = try_capture(&scene, SIZE_PX, 0, 4096, BOTH, true);
    let message = captured.err().unwrap().to_string();
    assert!(
        message.contains("alone needs") && message.contains("record budget"),
        "{message}"
    );
}

#[test]
fn the_records_of_each_pixel_are_as_many_as_an_additive_counter_sees() {
    let meshes = vec![triangles(200, 61, 0), triangles(100, 62, 1)];
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Blend, true),
    ];
    let scene = scene(meshes, materials, vec![checker()]);
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    let draws = DrawList::new(&scene, 0).unwrap();
    let set = TextureSet::compress(&scene).unwrap();
    let mut backend =
        Lavapipe::new(&scene, &draws, &set, SIZE_PX, BUDGET).unwrap_or_else(|e| panic!("{e}"));
    let lighting = Lighting::new(&scene);
    for (pass, eye) in BOTH.iter().enumerate() {
        let view = View {
            target: pass,
            layer: &Layer::whole(*eye, views(&scene, SIZE_PX).eyes[pass], SIZE_PX),
            lighting: &lighting,
            visible: &[],
        };
        let counted = backend.count_fragments(&draws, &view).unwrap();
        let mut recorded = vec![0; counted.len()];
        for (pixel, _) in self::recorded(&captured, pass) {
            recorded[(pixel[1] * SIZE_PX[0] + pixel[0]) as usize] += 1;
        }
        assert!(counted.iter().sum::<u32>() > 20_000);
        assert_eq!(counted, recorded);
    }
}

#[test]
fn untextured_draws_record_their_quads_without_a_group() {
    let scene = scene(
        vec![triangles(50, 41, 0)],
        vec![Material::default()],
        Vec::new(),
    );
    let captured = capture(&scene, SIZE_PX, 0, BUDGET);
    let records = || captured.tiles.iter().flatten().flat_map(|t| &t.records);
    assert!(records().count() > 1000);
    assert!(records().all(|r| r.group == formats::textrace::NO_GROUP));
    assert!(agreement(&scene, &captured, 0, &passes).coverage_iou() >= 0.999);
}

#[test]
fn every_lane_of_a_shadowed_draw_takes_at_most_one_cascade() {
    let scene = scene(
        vec![triangles(80, 51, 0)],
        vec![textured(AlphaMode::Opaque, true)],
        vec![checker()],
    );
    let captured = capture(&scene, SIZE_PX, 4, BUDGET);
    let mut shadowed = 0;
    for tile in captured.tiles.iter().flatten() {
        for run in &tile.runs {
            let records = &tile.records[run.first as usize..(run.first + run.count) as usize];
            for quad in records.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y)) {
                for record in quad.iter().filter(|r| r.group > 0) {
                    let edge = SHADOW_SIZE as i32 * SUBTEXELS;
                    let inside = |v: i32| v > SUBTEXELS && v < edge - SUBTEXELS;
                    for lane in (0..4).filter(|lane| record.mask >> lane & 1 == 1) {
                        assert!(record.lane_uv(lane).into_iter().all(inside), "{record:?}");
                    }
                }
                let cascades: Vec<u8> = quad
                    .iter()
                    .filter(|r| r.group > 0)
                    .map(|r| r.mask)
                    .collect();
                let lanes: u32 = cascades.iter().map(|m| m.count_ones()).sum();
                let union = cascades.iter().fold(0, |all, m| all | m);
                assert_eq!(lanes, union.count_ones());
                // A clipped primitive may cover a quad in two parts.
                let covered = quad
                    .iter()
                    .filter(|r| r.group == 0)
                    .fold(0, |all, r| all | r.mask);
                assert_eq!(union & !covered, 0);
                shadowed += u64::from(union != 0);
            }
        }
    }
    assert!(shadowed > 5000, "{shadowed}");
    assert!(captured.pictures_match);
}

#[test]
fn a_built_in_scene_agrees_with_the_reference() {
    let scene = scenes::load("atrium-plain").unwrap();
    let captured = capture(&scene, [240, 272], 0, BUDGET);
    let a = agreement(&scene, &captured, 1, &passes);
    println!("atrium-plain: {a:?}, IoU {:.6}", a.coverage_iou());
    assert!(a.both > 40_000, "{a:?}");
    assert!(a.coverage_iou() >= 0.999, "{a:?}");
    assert!(a.uv_errors_texels.summary()[0] < 0.01, "{a:?}");
    assert!(
        (a.capture.levels_differ as f64) < 0.002 * a.capture.samples as f64,
        "{a:?}"
    );
    assert_eq!(a.of_class(Class::Unexplained), 0, "{a:?}");
}

#[test]
fn vertex_colours_show_and_mask_as_the_same_base_colour_does() {
    let quad = |color: Option<Vec4>| Mesh {
        positions: [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
            .map(|[x, y]| Vec3::new(x, y, -6.0))
            .to_vec(),
        normals: vec![Vec3::Z; 4],
        uv0: [[0.0, 4.0], [4.0, 4.0], [4.0, 0.0], [0.0, 0.0]]
            .map(Vec2::from)
            .to_vec(),
        colors: color.map_or_else(Vec::new, |color| vec![color; 4]),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    };
    let color = Vec4::new(0.75, 0.25, 0.5, 0.5);
    // A cutoff that an opaque texel passes with alpha 1 and not with alpha 0.5.
    for alpha in [AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask(0.75)] {
        let material = |base_color| Material {
            base_color,
            ..textured(alpha, false)
        };
        let shot = |vertex: Option<Vec4>, base_color| {
            let (meshes, materials) = (vec![quad(vertex)], vec![material(base_color)]);
            let scene = Scene {
                sky: Vec3::ONE,
                ..scene(meshes, materials, vec![checker()])
            };
            capture(&scene, SIZE_PX, 0, BUDGET)
        };
        let (vertex, base) = (shot(Some(color), Vec4::ONE), shot(None, color));
        let (white, plain) = (shot(Some(Vec4::ONE), Vec4::ONE), shot(None, Vec4::ONE));
        for (a, b) in [(&vertex, &base), (&white, &plain)] {
            assert!(a.pictures_match && b.pictures_match);
            let differences = a.pictures.concat().into_iter().zip(b.pictures.concat());
            let largest = differences.map(|(a, b)| a.abs_diff(b)).max();
            assert!(largest <= Some(1), "{alpha:?}: {largest:?}");
            assert_eq!(a.tiles, b.tiles, "{alpha:?}");
        }
        assert!(vertex.pictures != plain.pictures, "{alpha:?}");
    }
}

#[test]
fn a_device_that_cannot_capture_renders_the_same_pictures_and_refuses_to_capture() {
    let materials = vec![
        textured(AlphaMode::Opaque, true),
        textured(AlphaMode::Mask(0.5), true),
        textured(AlphaMode::Blend, true),
    ];
    let meshes = (0..3).map(|m| triangles(60, 71 + m as u32, m)).collect();
    let scene = scene(meshes, materials, vec![checker()]);
    let captured = capture(&scene, SIZE_PX, 1, BUDGET);
    let draws = DrawList::new(&scene, 1).unwrap();
    let set = TextureSet::compress(&scene).unwrap();
    let mut gpu = device::open(None).unwrap_or_else(|e| panic!("{e}"));
    gpu.no_capture = Some("what the test took away".into());
    let mut backend = Lavapipe::on(gpu, &scene, &draws, &set, SIZE_PX, BUDGET).unwrap();
    let planner = baseline(SIZE_PX, BOTH);
    let job = job(&scene, &draws, &planner);
    let frame = job.frame(&views(&scene, SIZE_PX)).unwrap();
    job.light(&mut backend, &frame).unwrap();
    let (pictures, _) = job.plain_frame(&mut backend, &frame).unwrap();
    assert!(pictures == captured.pictures);
    let work = backend.work();
    assert!(work.state_changes > 0 && work.triangles >= 2 * 180 && work.vertices >= 2 * 180);
    let refused = job.warm_up(&mut backend, &frame).unwrap_err().to_string();
    assert!(refused.contains("what the test took away"), "{refused}");
}
