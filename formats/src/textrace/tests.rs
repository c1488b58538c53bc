use super::*;
use crate::texture::{ColorSpace, TexelFormat};
use crate::view::{EyeView, FovTangents};
use proptest::prelude::*;

/// Tables with two textured draws and an untextured one, and a stereo pass of 3x2 tiles.
pub(crate) fn tables() -> Tables {
    let eye = EyeView {
        world_to_eye: [[0.1, 1.0, -2.5, 1e-7]; 4],
        eye_to_clip: [[0.3; 4]; 4],
        position: [0.032, 1.6, 0.0],
    };
    let tangents = FovTangents {
        left: 1.19,
        right: 1.19,
        up: 1.3,
        down: 1.3,
    };
    let texture = |name: &str, size| Texture {
        name: name.to_owned(),
        size: [size, size / 2],
        levels: 3,
        layers: 2,
        format: TexelFormat::Bc1,
        color_space: ColorSpace::Srgb,
    };
    let sample = |texture| Sample {
        texture,
        sampler: 1,
        layer: 1,
        offset: [-1, 1],
    };
    let group = |textures: &[u32]| UvGroup {
        extent: [1024, 512],
        samples: textures.iter().map(|texture| sample(*texture)).collect(),
    };
    let draw = |material: &str, first_primitive, groups| Draw {
        material: material.to_owned(),
        first_primitive,
        primitives: 1000,
        groups,
    };
    let pass = |eye| Pass {
        frame: 0,
        kind: PassKind::Main,
        eye,
        layer: 0,
        size_px: [40, 32],
        tiles: [3, 2],
    };
    Tables {
        meta: TraceMeta {
            tool: "test 1".to_owned(),
            command_line: vec!["raster".to_owned()],
            scene: "made up".to_owned(),
            scene_triangles: 3000,
            camera: "default".to_owned(),
            backend: "none".to_owned(),
            driver: "none".to_owned(),
            seed: 7,
            hmd: Hmd {
                name: "custom".to_owned(),
                source: "unverified".to_owned(),
                eye_size_px: [40, 32],
                fov: [tangents; 2],
                ipd_m: 0.064,
                cant_deg: 0.0,
            },
            frames: vec![FrameViews {
                frame: 0,
                eyes: [eye; 2],
            }],
            origin_m: [0.0; 3],
            techniques: None,
            surfaces: Some(Surfaces {
                depth_tested: true,
                not_opaque: vec![[2, 1]],
            }),
        },
        textures: vec![texture("a.png", 1024), texture("b.png", 64)],
        samplers: vec![Sampler::TRILINEAR_REPEAT, Sampler::SHADOW],
        draws: vec![
            draw("brick", 0, vec![group(&[0, 1]), group(&[1])]),
            draw("plain", 1000, vec![]),
            draw("leaf", 2000, vec![group(&[1])]),
        ],
        passes: vec![pass(Some(Eye::Left)), pass(Some(Eye::Right))],
    }
}

fn record() -> impl Strategy<Value = QuadRecord> {
    let number = prop_oneof![-20000..20000i32, any::<i32>()];
    let pair = [number.clone(), number.clone()];
    (
        0..8u8,
        0..8u8,
        1..16u8,
        any::<u8>(),
        pair.clone(),
        pair.clone(),
        pair.clone(),
        pair,
    )
        .prop_map(|(x, y, mask, group, uv, dx, dy, cross)| QuadRecord {
            x,
            y,
            mask,
            group,
            uv,
            dx,
            dy,
            cross,
        })
}

/// Tiles that obey every invariant with otherwise random content.
pub(crate) fn tile() -> impl Strategy<Value = Tile> {
    let run = (0..3000u32, prop::collection::vec(record(), 1..12));
    prop::collection::vec(run, 0..20).prop_map(|runs| {
        let tables = tables();
        let mut tile = Tile::default();
        let by_primitive: std::collections::BTreeMap<_, _> = runs.into_iter().collect();
        for (primitive, mut records) in by_primitive {
            let draw = primitive / 1000;
            let groups = tables.draws[draw as usize].groups.len() as u8;
            for record in &mut records {
                record.group = match record.group % (groups + 1) {
                    last if last == groups => NO_GROUP,
                    group => group,
                };
            }
            records.sort_by_key(|record| (quad_morton(record.x, record.y), record.group));
            tile.runs.push(PrimitiveRun {
                primitive,
                draw,
                first: tile.records.len() as u32,
                count: records.len() as u32,
            });
            tile.records.extend(records);
        }
        tile
    })
}

fn write(encoding: Encoding, tiles: &[(usize, usize, Tile)]) -> Vec<u8> {
    let tables = tables();
    let mut writer = TextraceWriter::in_memory(&tables).unwrap();
    for (pass, index, tile) in tiles {
        let encoded = encode_tile_as(encoding, &tables, tile).unwrap();
        writer.append(*pass, *index, encoded).unwrap();
    }
    writer.into_bytes().unwrap()
}

fn read_everything(bytes: Vec<u8>) -> crate::Result<()> {
    let trace = Textrace::from_bytes(bytes)?;
    let mut tile = Tile::default();
    for (pass, info) in trace.tables().passes.iter().enumerate() {
        for index in 0..info.tile_count() as usize {
            trace.decode_tile(pass, index, &mut tile)?;
        }
    }
    Ok(())
}

fn small(encoding: Encoding) -> Vec<u8> {
    let run = |primitive, draw, first, count| PrimitiveRun {
        primitive,
        draw,
        first,
        count,
    };
    let record = |x, y, group| QuadRecord {
        x,
        y,
        mask: 7,
        group,
        uv: [1000 * i32::from(x), -70_000],
        dx: [2100, 3],
        dy: [-5, 2200],
        cross: [1, 0],
    };
    let tile = Tile {
        runs: vec![run(3, 0, 0, 3), run(1001, 1, 3, 1)],
        records: vec![
            record(0, 0, 0),
            record(0, 0, 1),
            record(1, 0, 0),
            record(7, 7, NO_GROUP),
        ],
    };
    write(encoding, &[(0, 0, tile.clone()), (1, 3, tile)])
}

#[test]
fn every_truncation_is_refused() {
    for whole in Encoding::ALL.map(small) {
        read_everything(whole.clone()).unwrap();
        for length in 0..whole.len() {
            assert!(
                read_everything(whole[..length].to_vec()).is_err(),
                "{length} bytes"
            );
        }
    }
}

#[test]
fn every_flipped_bit_is_detected() {
    for whole in Encoding::ALL.map(small) {
        for bit in 0..whole.len() * 8 {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(read_everything(bytes).is_err(), "bit {bit}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn tiles_are_read_as_written(a in tile(), b in tile()) {
        for encoding in Encoding::ALL {
            let bytes = write(encoding, &[(0, 1, a.clone()), (1, 5, b.clone())]);
            let trace = Textrace::from_bytes(bytes).unwrap();
            prop_assert_eq!(trace.tables(), &tables());
            let mut out = Tile::default();
            trace.decode_tile(0, 1, &mut out).unwrap();
            prop_assert_eq!(&out, &a);
            trace.decode_tile(1, 5, &mut out).unwrap();
            prop_assert_eq!(&out, &b);
            trace.decode_tile(1, 4, &mut out).unwrap();
            prop_assert_eq!(&out, &Tile::default());
        }
    }
}

#[test]
fn draws_that_are_not_opaque_are_ranges_of_the_table() {
    let flags = [true, false, false, true, false];
    assert_eq!(Surfaces::ranges(flags), [[1, 2], [4, 1]]);
    assert_eq!(Surfaces::ranges([true; 3]), [[0; 2]; 0]);
    for not_opaque in [
        vec![[2, 2]],
        vec![[1, 0]],
        vec![[1, 1], [0, 1]],
        vec![[0, 2], [1, 1]],
    ] {
        let mut tables = tables();
        tables.meta.surfaces = Some(Surfaces {
            depth_tested: true,
            not_opaque,
        });
        let error = TextraceWriter::in_memory(&tables).expect_err("refused");
        assert!(error.to_string().contains("surfaces.not_opaque"), "{error}");
    }
}

#[test]
fn the_content_checksum_depends_on_the_captured_content_and_not_on_the_capture() {
    let checksum = |edit: fn(&mut Tables)| {
        let mut tables = tables();
        edit(&mut tables);
        let writer = TextraceWriter::in_memory(&tables).unwrap();
        let trace = Textrace::from_bytes(writer.into_bytes().unwrap()).unwrap();
        trace.content_checksum()
    };
    let original = checksum(|_| ());
    let annotated = checksum(|tables| {
        let meta = &mut tables.meta;
        meta.tool = "test 2".to_owned();
        meta.command_line.push("--threads=2".to_owned());
        meta.scene = "../made up".to_owned();
        meta.backend = "other".to_owned();
        meta.driver = "llvmpipe (LLVM 15.0.6, 256 bits)".to_owned();
    });
    assert_eq!(original, annotated);
    for edit in [
        |tables: &mut Tables| tables.meta.camera.push('2'),
        |tables: &mut Tables| tables.meta.frames[0].eyes[0].position[0] += 0.001,
        |tables: &mut Tables| tables.draws[0].primitives -= 1,
        |tables: &mut Tables| tables.samplers[0] = Sampler::SHADOW,
    ] {
        assert_ne!(original, checksum(edit));
    }
}
