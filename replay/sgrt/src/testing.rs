//! Ray traces of scenes with known results, for tests.

use super::config::SgrtConfig;
use super::detect::intersect;
use super::frame::{Frame, RaySource, TileError};
use super::presets::SGRT_PAPER;
use formats::raytrace::camera::sample_position_px;
use formats::raytrace::half::round3;
use formats::raytrace::{
    BvhSummary, EyeCamera, Hit, NO_PARENT, Outcome, PixelRecord, RayKind, RayMaterial, RayRecord,
    RayTile, RayTriangle, RaytraceMeta, RaytraceTables, RaytraceWriter, TraversalKind, Visit,
    encode_ray_tile,
};
use formats::textrace::TraceMeta;
use formats::view::{Eye, FovTangents, Hmd};
use glam::Vec3;
use sim::stream::testing::meta;

/// Index of the diffuse material.
pub const DIFFUSE: u32 = 0;
/// Index of the mirror material.
pub const MIRROR: u32 = 1;
/// Index of a diffuse material with holes.
pub const LEAF: u32 = 2;

/// The geometry of an object.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A triangle, part of the trace's table.
    Triangle([[f32; 3]; 3]),
    /// An exact sphere, not part of any table.
    Sphere {
        /// In metres.
        center: [f32; 3],
        /// In metres.
        radius: f32,
    },
}

/// A shape with object and material. Its index is its primitive number.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Its geometry.
    pub shape: Shape,
    /// Index of its object.
    pub object: u32,
    /// Index of its material.
    pub material: u32,
}

/// The defaults with the paper's storage: rows in DRAM.
pub fn rows_in_dram() -> SgrtConfig {
    SgrtConfig::from_overrides(SGRT_PAPER.parameters).expect("a preset's parameters")
}

/// A hierarchy summary with 64-byte nodes.
pub fn bvh() -> BvhSummary {
    BvhSummary {
        builder: "none".into(),
        settings: Vec::new(),
        traversal: TraversalKind::Bvh2,
        triangles: 1000,
        nodes: 999,
        leaves: 1000,
        depth: 12,
        sah_cost: 1.0,
        bytes_per_node: 64,
        bytes_per_triangle: 48,
        instances: None,
        update: None,
    }
}

/// A traced scene.
pub struct Synthetic {
    tables: RaytraceTables,
    tiles: [Vec<RayTile>; 2],
}

impl RaySource for Synthetic {
    fn tables(&self) -> &RaytraceTables {
        &self.tables
    }

    fn tile(&self, eye: Eye, index: u32, tile: &mut RayTile) -> Result<(), TileError> {
        *tile = self.tiles[eye as usize][index as usize].clone();
        Ok(())
    }
}

impl Synthetic {
    /// The bytes of a file with the trace.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut writer = RaytraceWriter::in_memory().expect("a writer");
        for tile in self.tiles.iter().flatten() {
            let encoded = encode_ray_tile(tile, false).expect("a valid tile");
            writer.tile(&encoded).expect("written");
        }
        writer.into_bytes(&self.tables).expect("finished")
    }
}

/// View of a scene.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Width and height of each image in pixels.
    pub size_px: [u32; 2],
    /// Distance of the eyes in metres.
    pub ipd_m: f32,
    /// Samples of each pixel.
    pub samples_per_px: u32,
    /// Outward rotation of each eye.
    pub cant_deg: f32,
    /// By how much the right frustum is shifted upwards, as a tangent.
    pub right_tilt: f32,
    /// Midpoint between the eyes.
    pub center: [f32; 3],
    /// Kind of tree that the steps belong to.
    pub tree: TraversalKind,
}

impl Default for View {
    fn default() -> Self {
        Self {
            size_px: [72, 40],
            ipd_m: 0.064,
            samples_per_px: 1,
            cant_deg: 0.0,
            right_tilt: 0.0,
            center: [0.0; 3],
            tree: TraversalKind::Bvh2,
        }
    }
}

/// Traces a scene for two 90-degree eyes that look along -z.
pub fn trace(scene: &[Placed], view: View) -> Synthetic {
    let fov = FovTangents {
        left: 1.0,
        right: 1.0,
        up: 0.6,
        down: 0.6,
    };
    let eyes = [-1.0f32, 1.0].map(|side| {
        let (sine, cosine) = (side * view.cant_deg).to_radians().sin_cos();
        let tilt = view.right_tilt * side.max(0.0);
        let [x, y, z] = view.center;
        EyeCamera {
            position: [x + 0.5 * side * view.ipd_m, y, z],
            right: [cosine, 0.0, sine],
            up: [0.0, 1.0, 0.0],
            forward: [sine, 0.0, -cosine],
            fov: FovTangents {
                up: fov.up + tilt,
                down: fov.down - tilt,
                ..fov
            },
            size_px: view.size_px,
        }
    });
    let triangles = scene
        .iter()
        .enumerate()
        .filter_map(|(i, placed)| match placed.shape {
            Shape::Triangle(vertices) => Some(RayTriangle {
                primitive: i as u32,
                object: placed.object,
                material: placed.material,
                vertices,
            }),
            Shape::Sphere { .. } => None,
        })
        .collect();
    let material = |name: &str, mirror: bool| RayMaterial {
        name: name.into(),
        diffuse: !mirror,
        mirror,
        glass: false,
        glossy: false,
        alpha_masked: false,
    };
    let meta = meta(view.size_px, fov);
    let tables = RaytraceTables {
        meta: RaytraceMeta {
            trace: TraceMeta {
                scene: "synthetic".into(),
                scene_triangles: scene.len() as u64,
                backend: "rays".into(),
                hmd: Hmd {
                    ipd_m: view.ipd_m,
                    ..meta.hmd.clone()
                },
                ..meta
            },
            origin: [0.0; 3],
            eyes,
            max_depth: 1,
            samples_per_px: view.samples_per_px,
            has_visits: false,
            sky: [[0.3, 0.5, 0.9]; 2],
            lighting: None,
        },
        bvh: BvhSummary {
            traversal: view.tree,
            ..bvh()
        },
        materials: vec![
            material("diffuse", false),
            material("mirror", true),
            RayMaterial {
                alpha_masked: true,
                ..material("leaf", false)
            },
        ],
        lights: Vec::new(),
        triangles,
    };
    let tiles = eyes.map(|eye| {
        (0..tables.tile_count())
            .map(|tile| trace_tile(scene, &eye, &tables, tile))
            .collect()
    });
    Synthetic { tables, tiles }
}

impl Synthetic {
    /// Adds addresses: the rays of each pixel visit a path that neighbours partly share.
    pub fn with_visits(mut self) -> Self {
        self.tables.meta.has_visits = true;
        for tile in self.tiles.iter_mut().flatten() {
            let mut visits = Vec::new();
            for (number, ray) in (0u32..).zip(&tile.rays) {
                let at = |step: u32, count: u32| (number / 8 * 37 + step * step) % count;
                visits.extend((0..ray.steps).map(|step| Visit::Node(at(step, 999))));
                visits.extend((0..ray.triangle_tests).map(|test| Visit::Triangle(at(test, 1000))));
            }
            tile.visits = visits;
        }
        self
    }
}

/// The scene's frame, loaded like a file's.
pub fn frame(scene: &[Placed], view: View) -> Frame {
    Frame::load(&trace(scene, view)).expect("a synthetic trace loads")
}

fn trace_tile(scene: &[Placed], eye: &EyeCamera, tables: &RaytraceTables, tile: u32) -> RayTile {
    let (origin_px, size_px) = tables.tile_rect(tile);
    let mut out = RayTile {
        origin_px,
        size_px,
        ..RayTile::default()
    };
    let spp = tables.meta.samples_per_px;
    for y in origin_px[1]..origin_px[1] + size_px[1] {
        for x in origin_px[0]..origin_px[0] + size_px[0] {
            for s in 0..spp {
                let direction = eye.direction(sample_position_px(x, y, s, spp));
                let pixel = trace_pixel(scene, eye, direction, &mut out.rays);
                out.pixels.push(pixel);
            }
        }
    }
    out
}

fn trace_pixel(
    scene: &[Placed],
    eye: &EyeCamera,
    direction: [f32; 3],
    rays: &mut Vec<RayRecord>,
) -> PixelRecord {
    let first_ray = rays.len() as u32;
    let ray = |kind, outcome, depth, parent, steps, triangle_tests| RayRecord {
        kind,
        outcome,
        depth,
        parent,
        steps,
        triangle_tests,
        alpha_tests: 0,
    };
    let nearest = scene
        .iter()
        .enumerate()
        .filter_map(|(i, placed)| Some((hit(placed, eye.position, direction)?, i)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((t, i)) = nearest else {
        rays.push(ray(RayKind::Primary, Outcome::Miss, 0, NO_PARENT, 4, 0));
        let up = 0.5 + 0.5 * direction[1];
        return PixelRecord {
            first_ray,
            ray_count: 1,
            view_dependent: round3([0.3 * up, 0.5 * up, 0.9]),
            ..PixelRecord::default()
        };
    };
    let placed = &scene[i];
    let position = eye.at(direction, t);
    rays.push(ray(RayKind::Primary, Outcome::Hit, 0, NO_PARENT, 20, 5));
    rays.push(ray(RayKind::Shadow, Outcome::Miss, 1, 0, 12, 2));
    let mut view_dependent = [0.0; 3];
    if placed.material == MIRROR {
        rays.push(ray(RayKind::Reflection, Outcome::Miss, 1, 0, 30, 7));
        view_dependent = direction.map(|d| 0.2 * d.abs());
    }
    let shade = |f: f32| 0.5 + 0.3 * (f * Vec3::from(position).dot(Vec3::ONE)).sin();
    PixelRecord {
        hit: Some(Hit {
            t,
            position,
            primitive: i as u32,
            object: placed.object,
            material: placed.material,
            ..Hit::default()
        }),
        view_independent: round3([shade(1.0), shade(3.0), placed.object as f32 * 0.1]),
        view_dependent: round3(view_dependent),
        first_ray,
        ray_count: rays.len() as u32 - first_ray,
    }
}

fn hit(placed: &Placed, origin: [f32; 3], direction: [f32; 3]) -> Option<f32> {
    match placed.shape {
        Shape::Triangle(vertices) => intersect(origin, direction, &vertices),
        Shape::Sphere { center, radius } => {
            let to = Vec3::from(center).as_dvec3() - Vec3::from(origin).as_dvec3();
            let d = Vec3::from(direction).as_dvec3();
            let along = to.dot(d);
            let inside = f64::from(radius).powi(2) - (to.length_squared() - along * along);
            let t = along - inside.max(0.0).sqrt();
            (inside >= 0.0 && t > 0.0).then_some(t as f32)
        }
    }
}

/// A rectangle perpendicular to the view direction, as two triangles.
pub fn wall(depth: f32, half: [f32; 2], center_x: f32, object: u32) -> Vec<Placed> {
    let corner = |x: f32, y: f32| [center_x + x * half[0], y * half[1], -depth];
    let (a, b) = (corner(-1.0, -1.0), corner(1.0, -1.0));
    let (c, d) = (corner(1.0, 1.0), corner(-1.0, 1.0));
    [[a, b, c], [a, c, d]]
        .map(|vertices| Placed {
            shape: Shape::Triangle(vertices),
            object,
            material: DIFFUSE,
        })
        .to_vec()
}

/// A sphere of triangles.
pub fn globe(center: [f32; 3], radius: f32, object: u32) -> Vec<Placed> {
    let (rings, sectors) = (10, 20);
    let point = |ring: u32, sector: u32| {
        let polar = std::f32::consts::PI * ring as f32 / rings as f32;
        let around = std::f32::consts::TAU * (sector % sectors) as f32 / sectors as f32;
        let direction = [
            polar.sin() * around.cos(),
            polar.cos(),
            polar.sin() * around.sin(),
        ];
        std::array::from_fn(|a| center[a] + radius * direction[a])
    };
    let mut out = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let (a, b) = (point(ring, sector), point(ring, sector + 1));
            let (c, d) = (point(ring + 1, sector + 1), point(ring + 1, sector));
            for vertices in [[a, b, c], [a, c, d]] {
                out.push(Placed {
                    shape: Shape::Triangle(vertices),
                    object,
                    material: DIFFUSE,
                });
            }
        }
    }
    out
}
