//! Tests of the file: round trip, damage, and data that must not be written.

mod columns;

use super::*;
use crate::error::FormatError;
use crate::textrace::TraceMeta;
use crate::view::{EyeView, FovTangents, FrameViews, Hmd};
use proptest::prelude::*;

const SIZE_PX: [u32; 2] = [20, 18];

/// A point or a directional light.
fn light(is_point: bool) -> RayLight {
    match is_point {
        true => RayLight::Point {
            position: [0.1, 0.2, 0.3],
            color: [1.0; 3],
        },
        false => RayLight::Directional {
            direction: [0.0, -1.0, 0.0],
            color: [3.0; 3],
        },
    }
}

fn meta(has_visits: bool) -> RaytraceMeta {
    let fov = FovTangents::new(1.2, 1.0, 1.1, 0.9);
    let eye = |x: f32| EyeCamera {
        position: [x, 0.1, 0.0],
        right: [1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
        forward: [0.0, 0.0, -1.0],
        fov,
        size_px: SIZE_PX,
    };
    let view = EyeView {
        world_to_eye: [[0.1, 1.0, -2.5, 1e-7]; 4],
        eye_to_clip: [[0.3; 4]; 4],
        position: [0.032, 1.6, 0.0],
    };
    let views = FrameViews {
        frame: 0,
        eyes: [view; 2],
    };
    RaytraceMeta {
        trace: TraceMeta {
            tool: "test 1".to_owned(),
            command_line: vec!["rays".to_owned()],
            scene: "made up".to_owned(),
            scene_triangles: 40,
            hmd: Hmd {
                eye_size_px: SIZE_PX,
                fov: [fov; 2],
                ..Hmd::default()
            },
            frames: vec![views],
            ..TraceMeta::default()
        },
        origin: [0.1, 1e6 + 1.0 / 3.0, -7.0],
        eyes: [eye(-0.032), eye(0.032)],
        max_depth: 3,
        samples_per_px: 1,
        has_visits,
        sky: [[0.3, 0.4, 0.5], [0.1; 3]],
        // Kinds of rays beyond Whitted's.
        lighting: has_visits.then(|| RayLighting {
            bounces: 2,
            ..RayLighting::default()
        }),
    }
}

pub(super) fn tables(has_visits: bool) -> RaytraceTables {
    let material = |name: &str, mirror| RayMaterial {
        name: name.to_owned(),
        diffuse: true,
        mirror,
        glass: false,
        glossy: false,
        alpha_masked: false,
    };
    RaytraceTables {
        meta: meta(has_visits),
        bvh: BvhSummary {
            settings: vec![("leaf".to_owned(), "4".to_owned())],
            triangles: 40,
            nodes: 17,
            leaves: 18,
            depth: 6,
            sah_cost: 61.623_411_2,
            bytes_per_node: 64,
            bytes_per_triangle: 40,
            ..BvhSummary::default()
        },
        materials: vec![material("clay", false), material("chrome", true)],
        lights: vec![light(false), light(true)],
        triangles: (0..20)
            .map(|i| RayTriangle {
                primitive: 2 * i,
                object: i / 7,
                material: i % 2,
                vertices: [
                    [i as f32, 0.0, -5.0],
                    [i as f32 + 0.7, 0.1, -5.5],
                    [i as f32, 0.9, -5.25],
                ],
            })
            .collect(),
    }
}

/// A generated tile that obeys the format and depends only on the arguments.
pub(super) fn tile(tables: &RaytraceTables, eye: Eye, number: u32, seed: u64) -> RayTile {
    let mut state = seed | 1;
    let mut next = |below: u32| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) % u64::from(below)) as u32
    };
    let mut tile = RayTile::default();
    (tile.origin_px, tile.size_px) = tables.tile_rect(number);
    let camera = tables.camera(eye);
    for i in 0..tile.size_px[0] * tile.size_px[1] {
        let x = tile.origin_px[0] + i % tile.size_px[0];
        let y = tile.origin_px[1] + i / tile.size_px[0];
        let direction = camera.direction(camera::sample_position_px(x, y, 0, 1));
        let hit = (next(4) > 0).then(|| {
            let triangle = &tables.triangles[next(20) as usize];
            let code = [next(60000) as i16, next(60000) as i16];
            let uv = [next(1000) as f32 / 7.0, -1.5];
            Hit::new(
                camera,
                direction,
                next(9000) as f32 / 900.0,
                triangle,
                code,
                uv,
            )
        });
        let color = [next(900) as f32 / 300.0, next(50) as f32, 1e-3];
        let mut pixel = PixelRecord {
            hit,
            view_independent: half::round3(if hit.is_some() { color } else { [0.0; 3] }),
            view_dependent: half::round3([color[2], color[0], color[1]]),
            first_ray: tile.rays.len() as u32,
            ray_count: 1 + next(5),
        };
        for own in 0..pixel.ray_count {
            let parent = if own == 0 { NO_PARENT } else { next(own) };
            let above = tile.rays.get((pixel.first_ray + parent.min(own)) as usize);
            let ray = RayRecord {
                kind: match own {
                    0 => RayKind::Primary,
                    _ if tables.meta.lighting.is_some() => RayKind::ALL[1 + next(5) as usize],
                    _ => RayKind::ALL[1 + next(3) as usize],
                },
                outcome: [Outcome::Miss, Outcome::Hit, Outcome::Occluded][next(3) as usize],
                depth: if own == 0 {
                    0
                } else {
                    above.map_or(0, |r| r.depth) + 1
                },
                parent,
                steps: next(200),
                triangle_tests: next(9),
                alpha_tests: next(3),
            };
            tile.rays.push(ray);
        }
        pixel.ray_count = tile.rays.len() as u32 - pixel.first_ray;
        tile.pixels.push(pixel);
    }
    if tables.meta.has_visits {
        let visits: u64 = tile.rays.iter().map(RayRecord::visit_count).sum();
        tile.visits = (0..visits)
            .map(|_| match next(2) {
                0 => Visit::Node(next(17)),
                _ => Visit::Triangle(next(40)),
            })
            .collect();
    }
    tile
}

pub(super) fn eyes_and_tiles(tables: &RaytraceTables) -> Vec<(Eye, u32)> {
    let tiles = tables.tile_count();
    let both = [Eye::Left, Eye::Right];
    both.into_iter()
        .flat_map(|eye| (0..tiles).map(move |tile| (eye, tile)))
        .collect()
}

fn file(tables: &RaytraceTables, seed: u64) -> Vec<u8> {
    let mut writer = RaytraceWriter::in_memory().expect("in memory");
    for (eye, number) in eyes_and_tiles(tables) {
        let tile = tile(tables, eye, number, seed + u64::from(number));
        let encoded = encode_ray_tile(&tile, tables.meta.has_visits).expect("encodes");
        writer.tile(&encoded).expect("appends");
    }
    writer.into_bytes(tables).expect("writes")
}

/// Why tables are not written.
fn unwritable(tables: &RaytraceTables) -> String {
    let mut writer = RaytraceWriter::in_memory().expect("in memory");
    for (eye, number) in eyes_and_tiles(tables) {
        let tile = tile(tables, eye, number, 1);
        let encoded = encode_ray_tile(&tile, false).expect("encodes");
        writer.tile(&encoded).expect("appends");
    }
    writer.into_bytes(tables).expect_err("refused").to_string()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn tables_and_tiles_are_read_as_written(seed in any::<u64>(), has_visits in any::<bool>()) {
        let tables = tables(has_visits);
        let seed = seed >> 8;
        let trace = Raytrace::from_bytes(file(&tables, seed)).expect("opens");
        prop_assert_eq!(trace.tables(), &tables);
        let mut read = RayTile::default();
        for (eye, number) in eyes_and_tiles(&tables) {
            trace.decode_tile(eye, number, &mut read).expect("decodes");
            let written = tile(&tables, eye, number, seed + u64::from(number));
            prop_assert_eq!(trace.tile_rays(eye, number) as usize, written.rays.len());
            prop_assert_eq!(&read, &written);
        }
    }

    #[test]
    fn a_flipped_bit_is_found(at in 0.0f64..1.0, bit in 0u8..8) {
        let tables = tables(false);
        let mut bytes = file(&tables, 3);
        let at = (at * bytes.len() as f64) as usize;
        bytes[at] ^= 1 << bit;
        prop_assert!(read_all(bytes).is_err(), "byte {}", at);
    }

    #[test]
    fn a_cut_file_is_refused(keep in 0.0f64..1.0) {
        let mut bytes = file(&tables(false), 3);
        bytes.truncate((keep * bytes.len() as f64) as usize);
        prop_assert!(read_all(bytes).is_err());
    }

    #[test]
    fn damage_behind_a_valid_checksum_never_panics(
        at in 0.0f64..1.0,
        value in any::<u8>(),
        has_visits in any::<bool>(),
    ) {
        let tables = tables(has_visits);
        let mut whole = RayTile::default();
        (whole.origin_px, whole.size_px) = tables.tile_rect(0);
        let first = tile(&tables, Eye::Left, 0, 5);
        let mut bytes = match codec::encode(&first, has_visits) {
            Ok(bytes) => bytes,
            Err(_) => unreachable!("the tile obeys the format"),
        };
        let at = (at * bytes.len() as f64) as usize;
        bytes[at] = value;
        // Either result is fine, as long as it neither panics nor loops endlessly.
        let _ = codec::decode(&tables, tables.camera(Eye::Left), &bytes, &mut whole);
    }
}

fn read_all(bytes: Vec<u8>) -> crate::Result<()> {
    let trace = Raytrace::from_bytes(bytes)?;
    let mut tile = RayTile::default();
    for (eye, number) in eyes_and_tiles(trace.tables()) {
        trace.decode_tile(eye, number, &mut tile)?;
    }
    Ok(())
}

#[test]
fn a_damaged_tile_is_named_by_file_chunk_and_byte() {
    let tables = tables(false);
    let mut bytes = file(&tables, 3);
    // The tiles are the first chunk after the header.
    bytes[crate::container::HEADER_BYTES + 5] ^= 1;
    let error = read_all(bytes).expect_err("damaged");
    let text = error.to_string();
    let start = "memory: chunk RAYS at byte 48: expected a tile with CRC-32 ";
    assert!(text.starts_with(start), "{text}");
}

#[test]
fn kinds_beyond_whitteds_need_lighting() {
    let mut tables = tables(true);
    let mut writer = RaytraceWriter::in_memory().expect("in memory");
    for (eye, number) in eyes_and_tiles(&tables) {
        let tile = tile(&tables, eye, number, 1);
        writer
            .tile(&encode_ray_tile(&tile, true).expect("encodes"))
            .expect("writes");
    }
    tables.meta.lighting = None;
    let refused = writer.into_bytes(&tables).expect_err("has diffuse rays");
    assert!(refused.to_string().contains("no lighting"), "{refused}");
}

#[test]
fn a_tile_beyond_the_last_is_refused() {
    let trace = Raytrace::from_bytes(file(&tables(false), 1)).expect("opens");
    let error = trace.decode_tile(Eye::Right, 4, &mut RayTile::default());
    let text = error.expect_err("refused").to_string();
    assert_eq!(text, "memory: no tile 4, the trace has 4");
}

#[test]
fn tiles_that_violate_the_format_are_not_written() {
    let tables = tables(true);
    let good = tile(&tables, Eye::Left, 0, 9);
    let text = |change: &dyn Fn(&mut RayTile)| {
        let mut bad = good.clone();
        change(&mut bad);
        match encode_ray_tile(&bad, true) {
            Err(FormatError::Unwritable { expected, .. }) => expected,
            other => panic!("written: {other:?}"),
        }
    };
    assert_eq!(
        text(&|t| t.pixels[3].view_dependent[0] = 0.1),
        "colours in half floats"
    );
    assert_eq!(
        text(&|t| t.pixels[1].first_ray += 1),
        "its rays behind the previous pixel's"
    );
    assert_eq!(
        text(&|t| t.rays[0].depth = 1),
        "a parent before it and one level above"
    );
    assert_eq!(
        text(&|t| {
            t.visits.pop();
        }),
        "one a step and triangle test"
    );
}

#[test]
fn a_trace_without_all_its_tiles_is_not_written() {
    let writer = RaytraceWriter::in_memory().expect("in memory");
    let error = writer.into_bytes(&tables(false)).expect_err("incomplete");
    let text = error.to_string();
    assert_eq!(
        text,
        "cannot write tiles: expected 8, all of both eyes, found 0"
    );
}

#[test]
fn an_update_is_read_as_written_and_within_its_tree() {
    let mut tables = tables(false);
    let update = BvhUpdate {
        method: UpdateMethod::Refit,
        triangles_read: 7,
        triangles_written: 5,
        instances: 2,
        nodes: 3,
    };
    tables.bvh.instances = Some(InstanceNodes { first: 4, count: 2 });
    let [triangles_read, nodes] = [tables.bvh.triangles + 1, tables.bvh.nodes - 1];
    tables.bvh.update = Some(update);
    let trace = Raytrace::from_bytes(file(&tables, 1)).expect("opens");
    assert_eq!(trace.tables(), &tables);
    assert_eq!(trace.container().version(), (1, 6));
    for bad in [
        BvhUpdate {
            triangles_read,
            ..update
        },
        BvhUpdate {
            triangles_written: 8,
            ..update
        },
        BvhUpdate {
            instances: 3,
            ..update
        },
        BvhUpdate { nodes, ..update },
    ] {
        tables.bvh.update = Some(bad);
        let text = unwritable(&tables);
        assert!(text.contains("an update of at most"), "{text}");
    }
}

#[test]
fn triangles_out_of_order_or_without_a_material_are_refused() {
    let mut swapped = tables(false);
    swapped.triangles.swap(2, 3);
    let mut stray = tables(false);
    stray.triangles[4].material = 2;
    for (tables, expected) in [
        (swapped, "ascending primitive numbers"),
        (stray, "a material below 2"),
    ] {
        let text = unwritable(&tables);
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn triangles_have_addresses_after_the_nodes() {
    let bvh = tables(false).bvh;
    assert_eq!(bvh.address(Visit::Node(3)), 192);
    assert_eq!(bvh.address(Visit::Triangle(2)), 17 * 64 + 80);
    assert_eq!(bvh.visit_bytes(Visit::Triangle(0)), 40);
}

#[test]
fn the_content_checksum_ignores_how_the_rays_were_captured() {
    let checksum = |edit: fn(&mut RaytraceTables), seed| {
        let mut tables = tables(true);
        edit(&mut tables);
        let trace = Raytrace::from_bytes(file(&tables, seed)).expect("reads");
        trace.content_checksum()
    };
    let original = checksum(|_| (), 1);
    let annotated = |tables: &mut RaytraceTables| tables.meta.trace.tool.push('2');
    assert_eq!(original, checksum(annotated, 1));
    assert_ne!(original, checksum(|_| (), 2));
}
