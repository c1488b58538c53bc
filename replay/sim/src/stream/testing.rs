//! Traces for tests: small ones with known lines, and generated ones whose access pattern resembles a scene's.

use super::counts::TileBins;
use super::lines::{QuadEnd, TileLines};
use super::tag::Tag;
use super::{MemoryTrace, StreamError, TileSource};
use formats::random::Random;
use formats::textrace::geometry::{Geometry, TileLists};
use formats::textrace::{
    Draw, Pass, PassKind, PrimitiveRun, QuadRecord, SUBTEXELS, Sample, Tables, TextraceWriter,
    Tile, TraceMeta, UvGroup,
};
use formats::texture::{ColorSpace, Sampler, TexelFormat, Texture};
use formats::view::{Eye, EyeView, FovTangents, FrameViews, Hmd, TILE_SIZE_PX};
use std::io::Write;
use tempfile::NamedTempFile;

/// The picture of an eye.
pub fn pass(eye: Eye, size_px: [u32; 2]) -> Pass {
    Pass {
        frame: 0,
        kind: PassKind::Main,
        eye: Some(eye),
        layer: 0,
        size_px,
        tiles: size_px.map(|px| px.div_ceil(TILE_SIZE_PX)),
    }
}

/// What a trace says of itself.
pub fn meta(eye_size_px: [u32; 2], fov: FovTangents) -> TraceMeta {
    TraceMeta {
        tool: "test".into(),
        command_line: Vec::new(),
        scene: "test".into(),
        scene_triangles: 1,
        camera: "default".into(),
        backend: "none".into(),
        driver: "none".into(),
        seed: 0,
        hmd: Hmd {
            name: "custom".into(),
            source: "unverified".into(),
            eye_size_px,
            fov: [fov; 2],
            ipd_m: 0.064,
            cant_deg: 0.0,
        },
        frames: vec![FrameViews::default()],
        surfaces: None,
        origin_m: [0.0; 3],
        techniques: None,
        program: None,
        ..TraceMeta::default()
    }
}

/// An eye that is turned by an angle with this sine and cosine. The tangents are those of its left, right, top and
/// bottom edges.
pub fn turned_eye([sine, cosine]: [f32; 2], [left, right, up, down]: [f32; 4]) -> EyeView {
    let mut view = EyeView::default();
    // Stored by column. The rows are the eye's axes.
    view.world_to_eye[0] = [cosine, 0.0, sine, 0.0];
    view.world_to_eye[2] = [-sine, 0.0, cosine, 0.0];
    view.eye_to_clip = [
        [2.0 / (left + right), 0.0, 0.0, 0.0],
        [0.0, 2.0 / (up + down), 0.0, 0.0],
        [
            (right - left) / (left + right),
            (up - down) / (up + down),
            -1.0,
            -1.0,
        ],
        [0.0; 4],
    ];
    view
}

/// Tables with one draw that samples all textures (of these sizes, BC1, all levels) trilinearly, and a
/// stereo pair of one-tile passes.
pub fn tables(sizes: &[[u32; 2]]) -> Tables {
    let fov = FovTangents::new(1.0, 1.0, 1.0, 1.0);
    Tables {
        meta: meta([16, 16], fov),
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
                        ..Sample::default()
                    })
                    .collect(),
            }],
        }],
        passes: [Eye::Left, Eye::Right]
            .map(|eye| pass(eye, [16, 16]))
            .into(),
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
        let passes = passes.map(|pass| Pass { frame, ..pass });
        long.tables.passes.extend(passes);
    }
    long
}

/// A trace of three frames with different pictures, so that their counters differ.
pub fn different_frames() -> MemoryTrace {
    let of_seed = |seed| {
        let synthetic = Synthetic {
            seed,
            ..Synthetic::new([128, 64], 17)
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
        let views = FrameViews {
            frame,
            ..Default::default()
        };
        trace.tables.meta.frames.push(views);
    }
    trace
}

/// A trace with geometry, whose tiles may be empty.
pub struct GeometryTrace {
    /// The tiles.
    pub memory: MemoryTrace,
    /// The meshes and views.
    pub geometry: Geometry,
    /// The primitive lists of each view.
    pub lists: Vec<TileLists>,
}

impl TileSource for GeometryTrace {
    fn tables(&self) -> &Tables {
        self.memory.tables()
    }

    fn records(&self) -> u64 {
        self.memory.records()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        self.memory.read_tile(pass, index, tile)
    }

    fn geometry(&self) -> Option<&Geometry> {
        Some(&self.geometry)
    }

    fn tile_lists(&self, view: usize) -> Result<TileLists, StreamError> {
        Ok(self.lists[view].clone())
    }
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

/// Parameters of a generated trace.
#[derive(Clone, Copy, Debug)]
pub struct Synthetic {
    /// Size of one eye's picture in pixels.
    pub size_px: [u32; 2],
    /// Edge of the rectangles in pixels.
    pub patch_px: u32,
    /// Overlapping layers of rectangles.
    pub layers: u32,
    /// Textures per material.
    pub textures: u32,
    /// Materials.
    pub materials: u32,
    /// Seed.
    pub seed: u64,
}

impl Default for Synthetic {
    fn default() -> Self {
        Self {
            size_px: [960, 1080],
            patch_px: 120,
            layers: 1,
            textures: 3,
            materials: 24,
            seed: 1,
        }
    }
}

/// A rectangle on the screen with an affine texture mapping.
struct Patch {
    /// Left, top, right, bottom in pixels of the left eye.
    bounds: [i32; 4],
    draw: u32,
    disparity_px: i32,
    uv: [i32; 2],
    dx: [i32; 2],
    dy: [i32; 2],
}

impl Synthetic {
    /// One layer of rectangles.
    pub fn one_layer(size_px: [u32; 2], patch_px: u32) -> Self {
        Self {
            size_px,
            patch_px,
            ..Self::default()
        }
    }

    /// Two layers of rectangles.
    pub fn new(size_px: [u32; 2], patch_px: u32) -> Self {
        Self {
            layers: 2,
            ..Self::one_layer(size_px, patch_px)
        }
    }

    /// Generates the trace.
    pub fn generate(&self) -> MemoryTrace {
        let patches = self.patches();
        let tables = self.tables(patches.len() as u32);
        let tiles = [0, 1].map(|eye| {
            let [columns, rows] = tables.passes[eye].tiles;
            (0..rows)
                .flat_map(|y| (0..columns).map(move |x| [x, y]))
                .map(|at| tile_of(&patches, at, eye as i32))
                .collect()
        });
        MemoryTrace {
            tables,
            tiles: tiles.into(),
        }
    }

    fn patches(&self) -> Vec<Patch> {
        let mut random = Random(self.seed);
        let mut random = move |below: u32| random.below(below) as i32;
        let edge = self.patch_px as i32;
        let mut patches = Vec::new();
        for layer in 0..self.layers {
            for y in (0..self.size_px[1] as i32).step_by(self.patch_px as usize) {
                for x in (-edge..self.size_px[0] as i32 + edge).step_by(self.patch_px as usize) {
                    if layer > 0 && random(2) == 0 {
                        continue;
                    }
                    // One to four texels per pixel, rotated by a random angle.
                    let angle = f64::from(random(628)) / 100.0;
                    let texels = f64::from(SUBTEXELS) * (1.0 + f64::from(random(300)) / 100.0);
                    let (s, c) = angle.sin_cos();
                    let fixed = |v: f64| (v * texels).round() as i32;
                    patches.push(Patch {
                        bounds: [x, y, x + edge, y + edge],
                        draw: random(self.materials) as u32,
                        disparity_px: 2 * random(24),
                        uv: [random(1024) * SUBTEXELS, random(1024) * SUBTEXELS],
                        dx: [fixed(c), fixed(s)],
                        dy: [fixed(-s), fixed(c)],
                    });
                }
            }
        }
        patches
    }

    fn tables(&self, primitives: u32) -> Tables {
        let size = |texture: u32| 1024 >> (texture % 3 / 2);
        let fov = FovTangents::new(1.19, 1.19, 1.34, 1.34);
        Tables {
            meta: TraceMeta {
                tool: "replay".into(),
                scene: "synthetic".into(),
                scene_triangles: primitives.into(),
                seed: self.seed,
                ..meta(self.size_px, fov)
            },
            textures: (0..self.materials * self.textures)
                .map(|i| {
                    let size = size(i % self.textures);
                    Texture {
                        name: format!("texture {i}"),
                        size: [size; 2],
                        levels: size.ilog2() + 1,
                        layers: 1,
                        format: TexelFormat::Bc1,
                        color_space: ColorSpace::Linear,
                        part: None,
                    }
                })
                .collect(),
            samplers: vec![Sampler::TRILINEAR_REPEAT],
            draws: (0..self.materials)
                .map(|material| Draw {
                    material: format!("material {material}"),
                    first_primitive: 0,
                    primitives,
                    groups: vec![UvGroup {
                        extent: [1024; 2],
                        samples: (0..self.textures)
                            .map(|t| Sample {
                                texture: material * self.textures + t,
                                ..Sample::default()
                            })
                            .collect(),
                    }],
                })
                .collect(),
            passes: [Eye::Left, Eye::Right]
                .map(|eye| pass(eye, self.size_px))
                .into(),
        }
    }
}

/// The quads of a tile covered by each patch, with patches as primitives.
fn tile_of(patches: &[Patch], [column, row]: [u32; 2], eye: i32) -> Tile {
    let mut tile = Tile::default();
    let corner = [column, row].map(|t| (t * TILE_SIZE_PX) as i32);
    for (number, patch) in patches.iter().enumerate() {
        let [left, top, right, bottom] = patch.bounds;
        // Patches are further left for the right eye.
        let [left, right] = [left, right].map(|x| x - eye * patch.disparity_px);
        if right <= corner[0]
            || left >= corner[0] + 16
            || bottom <= corner[1]
            || top >= corner[1] + 16
        {
            continue;
        }
        let first = tile.records.len();
        for morton in 0_u8..64 {
            let even = |m: u8| m & 1 | m >> 1 & 2 | m >> 2 & 4;
            let (x, y) = (even(morton), even(morton >> 1));
            let at = [corner[0] + 2 * i32::from(x), corner[1] + 2 * i32::from(y)];
            let mask = (0..4).fold(0, |mask, lane| {
                let [px, py] = [at[0] + lane % 2, at[1] + lane / 2];
                let inside = px >= left && px < right && py >= top && py < bottom;
                mask | u8::from(inside) << lane
            });
            if mask == 0 {
                continue;
            }
            let (from_left, from_top) = (at[0] - left, at[1] - top);
            tile.records.push(QuadRecord {
                x,
                y,
                mask,
                group: 0,
                uv: [0, 1].map(|a| patch.uv[a] + from_left * patch.dx[a] + from_top * patch.dy[a]),
                dx: patch.dx,
                dy: patch.dy,
                cross: [0; 2],
            });
        }
        if tile.records.len() > first {
            tile.runs.push(PrimitiveRun {
                primitive: number as u32,
                draw: patch.draw,
                first: first as u32,
                count: (tile.records.len() - first) as u32,
            });
        }
    }
    tile
}
