//! Generates stereo traces for benchmarks and tests: textured rectangles at several depths, seen by two
//! parallel eyes. Their access pattern resembles a scene's.

use super::MemoryTrace;
use formats::random::Random;
use formats::textrace::{
    Draw, Pass, PassKind, PrimitiveRun, QuadRecord, SUBTEXELS, Sample, Tables, Tile, TraceMeta,
    UvGroup,
};
use formats::texture::{ColorSpace, Sampler, TexelFormat, Texture};
use formats::view::{Eye, FovTangents, FrameViews, Hmd, TILE_SIZE_PX};

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
    /// Generates the trace.
    #[must_use]
    pub fn generate(&self) -> MemoryTrace {
        let patches = self.patches();
        let tables = self.tables(patches.len() as u32);
        let tiles = [0, 1].map(|eye| {
            let [columns, rows] = tables.passes[eye].tiles;
            (0..rows)
                .flat_map(|y| (0..columns).map(move |x| [x, y]))
                .map(|at| tile(&patches, at, eye as i32))
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
        let fov = FovTangents {
            left: 1.19,
            right: 1.19,
            up: 1.34,
            down: 1.34,
        };
        let tiles = self.size_px.map(|px| px.div_ceil(TILE_SIZE_PX));
        let pass = |eye| Pass {
            frame: 0,
            kind: PassKind::Main,
            eye: Some(eye),
            layer: 0,
            size_px: self.size_px,
            tiles,
        };
        Tables {
            meta: TraceMeta {
                tool: "replay".into(),
                command_line: Vec::new(),
                scene: "synthetic".into(),
                scene_triangles: primitives.into(),
                camera: "default".into(),
                backend: "none".into(),
                driver: "none".into(),
                seed: self.seed,
                hmd: Hmd {
                    name: "custom".into(),
                    source: "unverified".into(),
                    eye_size_px: self.size_px,
                    fov: [fov; 2],
                    ipd_m: 0.064,
                    cant_deg: 0.0,
                },
                frames: vec![FrameViews::default()],
                surfaces: None,
                origin_m: [0.0; 3],
                techniques: None,
                program: None,
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
                                sampler: 0,
                                layer: 0,
                                offset: [0; 2],
                                level: Default::default(),
                            })
                            .collect(),
                    }],
                })
                .collect(),
            passes: vec![pass(Eye::Left), pass(Eye::Right)],
        }
    }
}

/// The quads of a tile covered by each patch, with patches as primitives.
fn tile(patches: &[Patch], [column, row]: [u32; 2], eye: i32) -> Tile {
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
