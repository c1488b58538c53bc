//! Small traces for the tests of the engine.

use super::MemoryTrace;
use super::counts::TileBins;
use super::lines::{QuadEnd, TileLines};
use super::synthetic::Synthetic;
use super::tag::Tag;
use formats::textrace::TextraceWriter;
use formats::textrace::{
    Draw, Pass, PassKind, PrimitiveRun, QuadRecord, SUBTEXELS, Sample, Tables, Tile, TraceMeta,
    UvGroup,
};
use formats::texture::{ColorSpace, Sampler, TexelFormat, Texture};
use formats::view::{Eye, FovTangents, Hmd};
use std::io::Write;
use tempfile::NamedTempFile;

/// Tables with one draw that samples all textures (of these sizes, BC1, all levels) trilinearly, and a
/// stereo pair of one-tile passes.
pub fn tables(sizes: &[[u32; 2]]) -> Tables {
    let fov = FovTangents {
        left: 1.0,
        right: 1.0,
        up: 1.0,
        down: 1.0,
    };
    let pass = |eye| Pass {
        frame: 0,
        kind: PassKind::Main,
        eye: Some(eye),
        layer: 0,
        size_px: [16, 16],
        tiles: [1, 1],
    };
    Tables {
        meta: TraceMeta {
            tool: "test".into(),
            command_line: Vec::new(),
            scene: "test".into(),
            scene_triangles: 1,
            camera: "default".into(),
            backend: "memory".into(),
            driver: "none".into(),
            seed: 0,
            hmd: Hmd {
                name: "custom".into(),
                source: "unverified".into(),
                eye_size_px: [16, 16],
                fov: [fov; 2],
                ipd_m: 0.064,
                cant_deg: 0.0,
            },
            frames: vec![formats::view::FrameViews::default()],
            surfaces: None,
            origin_m: [0.0; 3],
            techniques: None,
            program: None,
        },
        textures: sizes
            .iter()
            .enumerate()
            .map(|(i, &size)| Texture {
                name: format!("texture {i}"),
                size,
                levels: size[0].max(size[1]).ilog2() + 1,
                layers: 1,
                format: TexelFormat::Bc1,
                color_space: ColorSpace::Srgb,
                part: None,
            })
            .collect(),
        samplers: vec![Sampler::TRILINEAR_REPEAT],
        draws: vec![Draw {
            material: "all".into(),
            first_primitive: 0,
            primitives: 1 << 20,
            groups: vec![UvGroup {
                extent: [0, 1].map(|axis| sizes.iter().map(|s| s[axis]).max().unwrap_or(1)),
                samples: (0..sizes.len() as u32)
                    .map(|texture| Sample {
                        texture,
                        sampler: 0,
                        layer: 0,
                        offset: [0; 2],
                        level: Default::default(),
                    })
                    .collect(),
            }],
        }],
        passes: vec![pass(Eye::Left), pass(Eye::Right)],
    }
}

/// A fully covered quad at texel (0, 0) with one texel per pixel.
pub fn record(x: u8, y: u8) -> QuadRecord {
    QuadRecord {
        x,
        y,
        mask: 15,
        group: 0,
        uv: [SUBTEXELS / 2; 2],
        dx: [SUBTEXELS, 0],
        dy: [0, SUBTEXELS],
        cross: [0; 2],
    }
}

/// A tile of primitives, each with a number of adjacent quads.
pub fn tile(primitives: &[(u32, u32)]) -> Tile {
    let mut tile = Tile::default();
    for &(primitive, quads) in primitives {
        tile.runs.push(PrimitiveRun {
            primitive,
            draw: 0,
            first: tile.records.len() as u32,
            count: quads,
        });
        tile.records
            .extend((0..quads).map(|i| record((i % 8) as u8, (i / 8) as u8)));
    }
    tile
}

/// Quads with these footprints, all in cell 0 of tile 0.
pub fn tile_lines(quads: &[&[&[u32]]]) -> TileLines {
    let mut tile = TileLines::default();
    tile.begin(TileBins::default());
    let [first, other] = Tag::of_footprint(0, 0);
    for footprints in quads {
        for lines in *footprints {
            for (index, line) in lines.iter().enumerate() {
                tile.lines.push(*line);
                tile.tags.push(if index == 0 { first } else { other });
            }
        }
        tile.quads.push(QuadEnd {
            end: tile.lines.len() as u32,
            distinct_end: 0,
            footprints: footprints.len() as u32,
        });
    }
    tile
}

/// The same frame several times over.
pub fn repeated(trace: &MemoryTrace, frames: u32) -> MemoryTrace {
    let mut long = trace.clone();
    for frame in 1..frames {
        long.tiles.extend_from_slice(&trace.tiles);
        let passes = trace.tables.passes.iter().cloned();
        let passes = passes.map(|pass| formats::textrace::Pass { frame, ..pass });
        long.tables.passes.extend(passes);
    }
    long
}

/// A trace of three frames with different pictures, so that their counters differ.
pub fn different_frames() -> MemoryTrace {
    let of_seed = |seed| {
        let synthetic = Synthetic {
            size_px: [128, 64],
            patch_px: 17,
            layers: 2,
            textures: 3,
            seed,
            ..Synthetic::default()
        };
        synthetic.generate()
    };
    let mut trace = of_seed(1);
    for frame in 1..3 {
        let other = of_seed(u64::from(frame) + 1);
        let passes = other.tables.passes.iter();
        trace
            .tables
            .passes
            .extend(passes.map(|pass| Pass { frame, ..*pass }));
        trace.tiles.extend(other.tiles);
        for (draw, of) in trace.tables.draws.iter_mut().zip(&other.tables.draws) {
            draw.primitives = draw.primitives.max(of.primitives);
        }
        let views = formats::view::FrameViews {
            frame,
            ..Default::default()
        };
        trace.tables.meta.frames.push(views);
    }
    trace
}

/// Writes a trace to a file that is deleted with the handle.
pub fn file_of(trace: &MemoryTrace) -> NamedTempFile {
    let mut writer = TextraceWriter::in_memory(&trace.tables).expect("a file");
    for (pass, tiles) in trace.tiles.iter().enumerate() {
        for (index, tile) in tiles.iter().enumerate() {
            writer.write_tile(pass, index, tile).expect("a file");
        }
    }
    let mut file = NamedTempFile::new().expect("a file");
    file.write_all(&writer.into_bytes().expect("a file"))
        .expect("a file");
    file
}
