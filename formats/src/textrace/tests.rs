use super::*;
use crate::texture::{ColorSpace, Part, TexelFormat};
use crate::view::{EyeView, FovTangents};
use proptest::prelude::*;

/// Tables with two textured draws and an untextured one, and a stereo pass of 3x2 tiles.
pub(crate) fn tables() -> Tables {
    let eye = EyeView {
        world_to_eye: [[0.1, 1.0, -2.5, 1e-7]; 4],
        eye_to_clip: [[0.3; 4]; 4],
        position: [0.032, 1.6, 0.0],
    };
    let tangents = FovTangents::new(1.19, 1.19, 1.3, 1.3);
    let texture = |name: &str, size| Texture {
        name: name.to_owned(),
        size: [size, size / 2],
        levels: 3,
        layers: 2,
        format: TexelFormat::Bc1,
        color_space: ColorSpace::Srgb,
        part: None,
    };
    let sample = |texture| Sample {
        texture,
        sampler: 1,
        layer: 1,
        offset: [-1, 1],
        level: Default::default(),
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
            program: None,
            ..TraceMeta::default()
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
            tile.push_run(primitive, draw, records);
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

/// The same tables with features that version 1 lacks: in draw 0, each fragment has its own layer and level.
fn program_tables() -> Tables {
    let mut tables = tables();
    tables.meta.surfaces = None;
    tables.meta.program = Some(ProgramCapture::default());
    tables.textures[0].format = TexelFormat::Rgba16;
    tables.samplers[1].lod.bias_256ths = -64;
    for (group, level) in [
        (0, SampleLevel::DERIVED),
        (
            1,
            SampleLevel {
                rule: LodRule::Explicit,
                lod_256ths: 300,
                operands: true,
            },
        ),
    ] {
        for sample in &mut tables.draws[0].groups[group].samples {
            sample.level = level;
        }
    }
    let operands = UvGroup {
        extent: [1, 1],
        samples: Vec::new(),
    };
    tables.draws[0].groups.insert(1, operands);
    tables
}

/// A tile of [`program_tables`] with a loop that samples the group with operands twice in one quad.
fn program_tile() -> Tile {
    let record = |group, uv| QuadRecord {
        x: 2,
        y: 5,
        mask: 6,
        group,
        uv: [uv; 2],
        ..QuadRecord::default()
    };
    Tile {
        runs: vec![PrimitiveRun {
            primitive: 3,
            draw: 0,
            first: 0,
            count: 5,
        }],
        records: vec![
            record(0, 7),
            record(1, 500),
            record(2, 8),
            record(1, 600),
            record(2, 9),
        ],
    }
}

fn program_trace(encoding: Encoding) -> Vec<u8> {
    let tables = program_tables();
    let writer = TextraceWriter::in_memory(&tables).unwrap();
    let mut writer = writer.with_encoding(encoding);
    writer.write_tile(1, 4, &program_tile()).unwrap();
    writer.into_bytes().unwrap()
}

#[test]
fn growing_tables_give_the_same_trace_as_complete_tables() {
    let tables = program_tables();
    let mut writer = TextraceWriter::growing_in_memory().unwrap();
    for (index, pass) in tables.passes.iter().enumerate() {
        assert_eq!(writer.add_pass(*pass).unwrap(), index);
        if index == 1 {
            for (number, draw) in tables.draws.iter().enumerate() {
                assert_eq!(writer.add_draw(draw.clone()).unwrap(), number as u32);
            }
            writer.write_tile(1, 4, &program_tile()).unwrap();
        }
    }
    for texture in &tables.textures {
        writer.add_texture(texture.clone()).unwrap();
    }
    for (index, sampler) in tables.samplers.iter().enumerate() {
        assert_eq!(writer.add_sampler(*sampler).unwrap(), index as u16);
    }
    writer.set_meta(tables.meta.clone()).unwrap();
    let bytes = writer.into_bytes().unwrap();
    assert!(bytes == program_trace(Encoding::default()));
    let trace = Textrace::from_bytes(bytes).unwrap();
    assert_eq!(trace.container().version(), (2, 0));
    assert_eq!(trace.tables(), &tables);
    let mut tile = Tile::default();
    trace.decode_tile(1, 4, &mut tile).unwrap();
    assert_eq!(tile, program_tile());
}

/// The tables of a program with an anisotropic sampler, and with a texture that is a part of the first one.
fn tables_of_version_3() -> Tables {
    let mut tables = program_tables();
    tables.samplers[0].max_anisotropy_256ths = 2560;
    let whole = tables.textures[0].clone();
    tables.textures.push(Texture {
        size: whole.level_size(1),
        levels: 1,
        layers: 1,
        part: Some(Part {
            of: 0,
            level: 1,
            layer: 0,
        }),
        ..whole
    });
    tables
}

#[test]
fn anisotropy_and_parts_of_textures_are_version_3() {
    let tables = tables_of_version_3();
    let bytes = TextraceWriter::in_memory(&tables)
        .unwrap()
        .into_bytes()
        .unwrap();
    let trace = Textrace::from_bytes(bytes).unwrap();
    assert_eq!(trace.container().version(), (3, 0));
    assert_eq!(trace.tables(), &tables);
    // A growing trace names the earliest version that has all of its tables.
    for (set, major) in [(false, 2), (true, 3)] {
        let mut writer = TextraceWriter::growing_in_memory().unwrap();
        let textures = &tables.textures;
        for texture in textures {
            writer
                .add_texture(Texture {
                    part: None,
                    ..texture.clone()
                })
                .unwrap();
        }
        if set {
            let last = textures.len() as u32 - 1;
            writer.set_part(last, textures[last as usize].part).unwrap();
            assert!(writer.set_part(last + 1, None).is_err());
        }
        writer.set_meta(tables.meta.clone()).unwrap();
        let trace = Textrace::from_bytes(writer.into_bytes().unwrap()).unwrap();
        assert_eq!(trace.container().version(), (major, 0));
    }
}

#[test]
fn parts_and_anisotropies_that_cannot_be_are_refused() {
    type Change = fn(&mut Tables);
    let changes: [(Change, &str); 7] = [
        (|t| t.samplers[1].max_anisotropy_256ths = 255, "found 255"),
        (|t| t.samplers[1].max_anisotropy_256ths = 4097, "found 4097"),
        (|t| last_part(t).of = 99, "of texture 99"),
        (
            |t| {
                let own = t.textures.len() as u32 - 1;
                last_part(t).of = own;
            },
            "level 1, layer 0 of texture",
        ),
        (|t| last_part(t).level = 2, "level 2"),
        (|t| last_part(t).layer = 9, "layer 9"),
        (
            |t| t.textures.last_mut().unwrap().format = TexelFormat::Rgba8,
            "level 1, layer 0",
        ),
    ];
    for (change, found) in changes {
        let mut tables = tables_of_version_3();
        change(&mut tables);
        let error = TextraceWriter::in_memory(&tables).unwrap_err().to_string();
        assert!(error.contains(found), "{error}");
    }
}

fn last_part(tables: &mut Tables) -> &mut Part {
    let texture = tables.textures.last_mut().unwrap();
    texture.part.as_mut().unwrap()
}

#[test]
fn growing_written_tables_is_an_error() {
    let tables = tables();
    let mut writer = TextraceWriter::in_memory(&tables).unwrap();
    let errors = [
        writer.add_pass(tables.passes[0]).unwrap_err(),
        writer.add_draw(tables.draws[0].clone()).unwrap_err(),
        writer.set_meta(TraceMeta::default()).unwrap_err(),
    ];
    for error in errors {
        let text = error.to_string();
        assert!(
            text.contains("expected a trace whose tables come last"),
            "{text}"
        );
    }
    let trace = Textrace::from_bytes(writer.into_bytes().unwrap()).unwrap();
    assert_eq!(trace.container().version(), (1, 0));
}

#[test]
fn operands_without_their_record_and_records_without_operands_are_refused() {
    let tables = program_tables();
    let refused = |change: fn(&mut Tile)| {
        let mut tile = program_tile();
        change(&mut tile);
        tile.runs[0].count = tile.records.len() as u32;
        encode_tile(&tables, &tile)
            .expect_err("refused")
            .to_string()
    };
    for change in [
        |tile: &mut Tile| tile.records = [&tile.records[..1], &tile.records[2..]].concat(),
        |tile: &mut Tile| tile.records = [&tile.records[..2], &tile.records[3..]].concat(),
        |tile: &mut Tile| tile.records.truncate(4),
        |tile: &mut Tile| tile.records[1].mask = 2,
        |tile: &mut Tile| tile.records[2].group = 0,
    ] {
        let text = refused(change);
        assert!(text.contains("operands right before the record"), "{text}");
    }
    let mut bad = tables.clone();
    bad.draws[0].groups[1].extent = [2, 1];
    let text = TextraceWriter::in_memory(&bad)
        .expect_err("refused")
        .to_string();
    assert!(text.contains("a group of extent 1x1"), "{text}");
    let mut bad = tables;
    bad.draws[0].groups[0].samples[0].level.lod_256ths = 1;
    let text = TextraceWriter::in_memory(&bad)
        .expect_err("refused")
        .to_string();
    assert!(
        text.contains("a level of 0 where the derivatives decide"),
        "{text}"
    );
}

/// A small trace of each encoding and version.
fn small_traces() -> Vec<Vec<u8>> {
    let versions = [small, program_trace];
    (versions.iter())
        .flat_map(|trace| Encoding::ALL.map(trace))
        .collect()
}

#[test]
fn every_truncation_is_refused() {
    for whole in small_traces() {
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
    for whole in small_traces() {
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
