//! The data model of the ray trace (`.raytrace`).
//!
//! A trace holds one stereo frame. For each eye and each 16x16 tile it has the pixels row by row. Each
//! pixel has its primary hit, its colour and the tree of its rays, with the cost of each ray in the
//! bounding volume hierarchy. Lengths are metres. Positions are `f32` relative to [`RaytraceMeta::origin`],
//! so that a scene far from the world's origin loses no precision.

pub mod camera;
mod codec;
mod file;
mod geometry;
mod geometry_codec;
pub mod half;
mod hierarchy;
mod hierarchy_codec;
pub mod normal;
mod predict;
mod relations;
pub mod tables;
mod write;

#[cfg(test)]
mod tests;

use crate::text::name_of;
use crate::textrace::TraceMeta;
use crate::view::{Eye, TILE_SIZE_PX};
pub use camera::EyeCamera;
pub use file::{
    GEOMETRY_INDEX, GEOMETRY_INDEX_ENTRY_BYTES, GEOMETRY_TILES, NODES, RAY_INDEX,
    RAY_INDEX_ENTRY_BYTES, RAY_TILES, Raytrace, SLOTS,
};
pub use geometry::{RayGeometry, SlotHit};
use glam::Vec3;
pub use hierarchy::{ChildKind, Hierarchy, HierarchyChild, HierarchyTriangle, Parents};
pub use relations::check_relations;
use serde::{Deserialize, Serialize};
pub use write::{EncodedRayTile, RaytraceWriter, encode_ray_tile, encode_ray_tile_with_geometry};

/// Description of the whole trace.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RaytraceMeta {
    /// Scene, camera, HMD, eye matrices, tool and command line; `backend` is `rays` and `driver`
    /// names the traversal.
    pub trace: TraceMeta,
    /// World position that every position of the trace is relative to, metres.
    pub origin: [f64; 3],
    /// Cameras of the left and right eye, relative to `origin`; rays are computed from them.
    pub eyes: [EyeCamera; 2],
    /// Levels of secondary rays: a primary ray has depth 0, the deepest reflection `max_depth`.
    pub max_depth: u32,
    /// Samples per pixel; a tile holds this many records per pixel.
    pub samples_per_px: u32,
    /// Whether every ray lists the nodes and triangles that it visited.
    pub has_visits: bool,
    /// Radiance of the sky and of the ground below the horizon, linear RGB. Misses see it, and it is the
    /// ambient light.
    pub sky: [[f32; 3]; 2],
    /// Light beyond Whitted's model, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lighting: Option<RayLighting>,
}

/// Light beyond Whitted's model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RayLighting {
    /// Radius of point lights in metres; 0 for points.
    pub light_radius_m: f32,
    /// Angular radius of parallel lights in degrees; 0 for parallel light.
    pub sun_radius_deg: f32,
    /// Ambient-occlusion rays per primary hit.
    pub occlusion_rays: u32,
    /// Their largest distance in metres.
    pub occlusion_m: f32,
    /// Diffuse rays of a path in a row, at most.
    pub bounces: u32,
    /// Whether glass and blended surfaces colour the light of shadow rays.
    pub coloured_shadows: bool,
    /// Whether normal maps bend shading normals.
    pub normal_maps: bool,
}

/// Effects of a material on a ray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RayMaterial {
    /// Name for reports.
    pub name: String,
    /// Whether it scatters light, that is, has a view-independent part.
    pub diffuse: bool,
    /// Whether it spawns reflection rays.
    pub mirror: bool,
    /// Whether it spawns refraction rays (glass, or a blended surface that rays pass straight through).
    pub glass: bool,
    /// Whether it has a specular highlight.
    pub glossy: bool,
    /// Whether rays pass through some of its texels: below the cutoff of an alpha mask, or below 1/255 of a
    /// blended surface.
    pub alpha_masked: bool,
}

impl RayMaterial {
    /// Whether the colour depends on the viewpoint.
    pub fn view_dependent(&self) -> bool {
        self.mirror || self.glass || self.glossy
    }
}

/// A light. Every shaded hit that faces it casts one shadow ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum RayLight {
    /// Parallel light.
    Directional {
        /// Unit direction in which the light travels.
        direction: [f32; 3],
        /// Irradiance, linear RGB.
        color: [f32; 3],
    },
    /// A point light.
    Point {
        /// Position relative to the trace's origin.
        position: [f32; 3],
        /// Radiant intensity, linear RGB.
        color: [f32; 3],
    },
}

/// A triangle hit by a primary ray of either eye, with the data to intersect it again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RayTriangle {
    /// Primitive number: triangles of all instances in submission order.
    pub primitive: u32,
    /// Object number: the scene's instance.
    pub object: u32,
    /// Index into the material table.
    pub material: u32,
    /// Vertices relative to the trace's origin, counter-clockwise from the front.
    pub vertices: [[f32; 3]; 3],
}

impl RayTriangle {
    /// Unit normal on the front side; zero for a degenerate triangle.
    pub fn normal(&self) -> [f32; 3] {
        let [a, b, c] = self.vertices.map(Vec3::from);
        let cross = (b - a).as_dvec3().cross((c - a).as_dvec3());
        cross.normalize_or_zero().as_vec3().to_array()
    }
}

/// Traversal of the hierarchy, which defines a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TraversalKind {
    /// Binary tree; a step tests both children's boxes, as in T&I unit 2.0.
    #[default]
    Bvh2,
    /// Four-wide tree; a step tests all children's boxes.
    Bvh4,
    /// Eight-wide tree; a step tests all children's boxes.
    Bvh8,
    /// Eight-wide tree of nodes with quantised boxes.
    Cwbvh8,
}

impl TraversalKind {
    /// Every kind of tree.
    pub const ALL: [Self; 4] = [Self::Bvh2, Self::Bvh4, Self::Bvh8, Self::Cwbvh8];

    /// Whether files with such a tree need minor version [`tables::TREES_AND_LIGHTING_MINOR`].
    pub(crate) const fn is_new_in_minor_4(self) -> bool {
        matches!(self, Self::Bvh4 | Self::Cwbvh8)
    }
}

/// The bounding volume hierarchy that the counts refer to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BvhSummary {
    /// Builder and version, `obvhs 0.4 ploc+reinsertion`.
    pub builder: String,
    /// Pinned build settings, name and value.
    pub settings: Vec<(String, String)>,
    /// The traversed tree.
    pub traversal: TraversalKind,
    /// Triangles in the tree.
    pub triangles: u64,
    /// Inner nodes of the traversed tree; a step reads one.
    pub nodes: u64,
    /// Leaves.
    pub leaves: u64,
    /// Inner nodes on the longest path from the root to a leaf.
    pub depth: u32,
    /// Surface-area cost of the binary tree, traversal and intersection cost 1 each.
    pub sah_cost: f64,
    /// Memory of one inner node in bytes (all children's boxes).
    pub bytes_per_node: u32,
    /// Memory of one triangle in bytes.
    pub bytes_per_triangle: u32,
    /// Which nodes are instances. Trees of meshes follow them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instances: Option<InstanceNodes>,
    /// The work of the update from the frame before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub update: Option<BvhUpdate>,
}

/// How a hierarchy follows a scene that moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum UpdateMethod {
    /// Trees with a moved triangle are built anew.
    #[default]
    Rebuild,
    /// Trees keep their topology; the boxes around moved triangles move.
    Refit,
}

/// What the update from the frame before reads and writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BvhUpdate {
    /// How.
    pub method: UpdateMethod,
    /// Triangles read: all of a rebuilt tree, or all of the leaves with a moved one.
    pub triangles_read: u64,
    /// Triangle slots written: all of a rebuilt tree, or the moved ones.
    pub triangles_written: u64,
    /// Instances read and written.
    pub instances: u64,
    /// Inner nodes written, instances not counted. A refit also reads them.
    pub nodes: u64,
}

impl std::fmt::Display for BvhUpdate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}: {} triangles read and {} written, {} instances, {} nodes",
            name_of(&self.method),
            self.triangles_read,
            self.triangles_written,
            self.instances,
            self.nodes
        )
    }
}

/// The nodes that are instances of a tree with two levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InstanceNodes {
    /// Number of the first one.
    pub first: u32,
    /// How many there are.
    pub count: u32,
}

/// The order in which a ray visits the children of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChildOrder {
    /// The nearest first. An entry of the stack behind the nearest triangle is dropped.
    #[default]
    Nearest,
    /// As the node lists them. No entry of the stack is dropped.
    Node,
    /// Inner children as the node lists them, then leaves. Every leaf goes onto the stack, and no entry is dropped.
    InnerFirst,
}

impl ChildOrder {
    /// The name and value that it has among a hierarchy's settings, if it is not the default.
    pub fn setting(self) -> Option<(&'static str, &'static str)> {
        let value = match self {
            Self::Nearest => return None,
            Self::Node => "node",
            Self::InnerFirst => "inner-first",
        };
        Some(("child_order", value))
    }
}

impl BvhSummary {
    /// The order in which rays visit children.
    pub fn child_order(&self) -> ChildOrder {
        let is_set = |order: &ChildOrder| {
            let mut settings = self.settings.iter();
            settings.any(|(name, value)| Some((name.as_str(), value.as_str())) == order.setting())
        };
        let orders = [ChildOrder::Node, ChildOrder::InnerFirst];
        orders.into_iter().find(is_set).unwrap_or_default()
    }

    /// Memory of all nodes and triangles in bytes.
    pub fn bytes(&self) -> u64 {
        self.nodes * u64::from(self.bytes_per_node)
            + self.triangles * u64::from(self.bytes_per_triangle)
    }

    /// Byte address of a visit; nodes start at 0, and triangles follow them in leaf order.
    pub fn address(&self, visit: Visit) -> u64 {
        match visit {
            Visit::Node(index) => u64::from(index) * u64::from(self.bytes_per_node),
            Visit::Triangle(slot) => {
                self.nodes * u64::from(self.bytes_per_node)
                    + u64::from(slot) * u64::from(self.bytes_per_triangle)
            }
        }
    }

    /// Number of bytes that a visit reads.
    pub fn visit_bytes(&self, visit: Visit) -> u32 {
        match visit {
            Visit::Node(_) => self.bytes_per_node,
            Visit::Triangle(_) => self.bytes_per_triangle,
        }
    }
}

/// One memory access of a ray in the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// A step at the inner node of this index.
    Node(u32),
    /// A test of the triangle in this slot (leaf order, not the primitive number).
    Triangle(u32),
}

impl std::fmt::Display for RayKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&name_of(self))
    }
}

/// Kinds of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum RayKind {
    /// From the eye; closest hit.
    #[default]
    Primary = 0,
    /// Towards a light; any hit.
    Shadow = 1,
    /// Mirrored; closest hit.
    Reflection = 2,
    /// Through glass or a blended surface; closest hit.
    Refraction = 3,
    /// Into the hemisphere of a surface, up to a distance; any hit.
    AmbientOcclusion = 4,
    /// Scattered by a diffuse surface; closest hit.
    Diffuse = 5,
}

impl RayKind {
    /// Every kind, in the order of their numbers.
    pub const ALL: [Self; 6] = [
        Self::Primary,
        Self::Shadow,
        Self::Reflection,
        Self::Refraction,
        Self::AmbientOcclusion,
        Self::Diffuse,
    ];

    /// Whether only traces with lighting have the kind.
    pub const fn needs_lighting(self) -> bool {
        matches!(self, Self::AmbientOcclusion | Self::Diffuse)
    }

    /// Whether the ray ends at any triangle, not only at the nearest.
    pub const fn ends_at_any_hit(self) -> bool {
        matches!(self, Self::Shadow | Self::AmbientOcclusion)
    }
}

/// Results of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Outcome {
    /// Left the scene; for a shadow ray: reached the light; for an ambient-occlusion ray: met nothing.
    #[default]
    Miss = 0,
    /// Found its closest hit.
    Hit = 1,
    /// A shadow or ambient-occlusion ray that is blocked.
    Occluded = 2,
}

/// Parent of a primary ray.
pub const NO_PARENT: u32 = u32::MAX;

/// One ray and its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayRecord {
    /// Kind of the ray.
    pub kind: RayKind,
    /// Result of the ray.
    pub outcome: Outcome,
    /// 0 for a primary ray; a secondary ray has its parent's depth plus 1.
    pub depth: u8,
    /// Index, among the same pixel's rays, of the ray whose hit spawned it; less than its own index.
    /// [`NO_PARENT`] for a primary ray.
    #[serde(serialize_with = "parent_or_null")]
    pub parent: u32,
    /// Inner nodes visited ([`TraversalKind`] defines a step).
    pub steps: u32,
    /// Triangles tested.
    pub triangle_tests: u32,
    /// Alpha look-ups at masked triangles.
    pub alpha_tests: u32,
}

fn parent_or_null<S: serde::Serializer>(parent: &u32, out: S) -> Result<S::Ok, S::Error> {
    Some(*parent)
        .filter(|parent| *parent != NO_PARENT)
        .serialize(out)
}

impl RayRecord {
    /// Number of entries of the ray in [`RayTile::visits`], if the trace has visits.
    pub fn visit_count(&self) -> u64 {
        u64::from(self.steps) + u64::from(self.triangle_tests)
    }
}

/// A primary hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Hit {
    /// Distance from the eye in metres (primary directions have unit length).
    pub t: f32,
    /// Position relative to the trace's origin: eye + t * direction.
    pub position: [f32; 3],
    /// Unit normal of the triangle, towards the eye.
    pub geometric_normal: [f32; 3],
    /// Unit interpolated normal, towards the eye; quantised to 2 x 16 bits (octahedral).
    pub shading_normal: [f32; 3],
    /// Texture coordinates, set 0, before any texture transform.
    pub uv: [f32; 2],
    /// Primitive number; the triangle table has its vertices.
    pub primitive: u32,
    /// Object (instance) number.
    pub object: u32,
    /// Index into the material table.
    pub material: u32,
}

impl Hit {
    /// The hit of a primary ray at `t` metres along a unit direction from an eye. Values that the trace
    /// does not store are computed from the triangle.
    pub fn new(
        eye: &EyeCamera,
        direction: [f32; 3],
        t: f32,
        triangle: &RayTriangle,
        shading_normal_code: [i16; 2],
        uv: [f32; 2],
    ) -> Self {
        let normal = Vec3::from(triangle.normal());
        let faces_away = normal.dot(Vec3::from(direction)) > 0.0;
        Self {
            t,
            position: eye.at(direction, t),
            geometric_normal: if faces_away { -normal } else { normal }.to_array(),
            shading_normal: normal::decode(shading_normal_code),
            uv,
            primitive: triangle.primitive,
            object: triangle.object,
            material: triangle.material,
        }
    }
}

/// One pixel, or one sample of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelRecord {
    /// Primary hit, or `None` if the ray misses.
    pub hit: Option<Hit>,
    /// Radiance that does not depend on the viewpoint: diffuse light with shadows, ambient light, emission;
    /// zero for a miss. Linear RGB, rounded to half floats.
    pub view_independent: [f32; 3],
    /// Radiance that depends on the viewpoint: highlights, reflection, refraction, sky. Linear RGB, rounded
    /// to half floats.
    pub view_dependent: [f32; 3],
    /// Index of its first ray, the primary ray, in [`RayTile::rays`].
    pub first_ray: u32,
    /// Number of its rays, at least 1; parents come before children.
    pub ray_count: u32,
}

impl PixelRecord {
    /// Final colour: the sum of both parts, linear RGB.
    pub fn color(&self) -> [f32; 3] {
        std::array::from_fn(|c| self.view_independent[c] + self.view_dependent[c])
    }
}

/// One decoded tile of one eye.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayTile {
    /// Left and top pixel.
    pub origin_px: [u32; 2],
    /// Width and height in pixels; less than 16 at the right and bottom edge of some images.
    pub size_px: [u32; 2],
    /// Records row by row, `samples_per_px` per pixel.
    pub pixels: Vec<PixelRecord>,
    /// Rays of all pixels, in pixel order.
    pub rays: Vec<RayRecord>,
    /// Visits of all rays in ray order, [`RayRecord::visit_count`] each, in execution order; empty if the
    /// trace has none.
    pub visits: Vec<Visit>,
    /// Geometry of all rays in ray order; empty if the trace has none, or if it was not read.
    pub geometry: Vec<RayGeometry>,
}

impl RayTile {
    /// Empties the tile and keeps its memory for the next one.
    pub fn clear(&mut self) {
        self.origin_px = [0; 2];
        self.size_px = [0; 2];
        self.pixels.clear();
        self.rays.clear();
        self.visits.clear();
        self.geometry.clear();
    }

    /// Rays of a pixel, its primary ray first; empty for a pixel of another tile.
    pub fn rays_of(&self, pixel: &PixelRecord) -> &[RayRecord] {
        let first = pixel.first_ray as usize;
        self.rays
            .get(first..first.saturating_add(pixel.ray_count as usize))
            .unwrap_or(&[])
    }
}

/// Everything in a trace except its tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct RaytraceTables {
    /// Description and eyes.
    pub meta: RaytraceMeta,
    /// The traversed hierarchy.
    pub bvh: BvhSummary,
    /// Materials.
    pub materials: Vec<RayMaterial>,
    /// Lights.
    pub lights: Vec<RayLight>,
    /// Triangles hit by primary rays of either eye, by ascending primitive number.
    pub triangles: Vec<RayTriangle>,
}

impl RaytraceTables {
    /// The triangle of a primitive, if a primary ray hit it.
    pub fn triangle(&self, primitive: u32) -> Option<&RayTriangle> {
        let at = self
            .triangles
            .binary_search_by_key(&primitive, |t| t.primitive)
            .ok()?;
        self.triangles.get(at)
    }

    /// Camera of an eye.
    pub fn camera(&self, eye: Eye) -> &EyeCamera {
        let [left, right] = &self.meta.eyes;
        match eye {
            Eye::Left => left,
            Eye::Right => right,
        }
    }

    /// Tile columns and rows of an eye's image; tiles are numbered row by row from the top left.
    pub fn tiles(&self) -> [u32; 2] {
        self.meta.eyes[0].size_px.map(|s| s.div_ceil(TILE_SIZE_PX))
    }

    /// Number of tiles of an eye's image.
    pub fn tile_count(&self) -> u32 {
        let [columns, rows] = self.tiles();
        columns * rows
    }

    /// Left and top pixel, width and height of a tile.
    pub fn tile_rect(&self, tile: u32) -> ([u32; 2], [u32; 2]) {
        let [columns, _] = self.tiles();
        let [width, height] = self.meta.eyes[0].size_px;
        let columns = columns.max(1);
        let x = (tile % columns) * TILE_SIZE_PX;
        let y = (tile / columns) * TILE_SIZE_PX;
        let clip = |at: u32, size: u32| size.saturating_sub(at).min(TILE_SIZE_PX);
        ([x, y], [clip(x, width), clip(y, height)])
    }
}
