//! The tables of a ray trace as chunks: META, RBVH, RMAT and RLIT (JSON), RTRI (binary).
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{BvhSummary, EyeCamera, RayLighting, RayTriangle, RaytraceMeta, RaytraceTables};
use crate::container::{ChunkTag, Container, ContainerWriter, MAJOR_1};
use crate::error::{Broken, Result, ensure};
use crate::json;
use crate::parse::Taken;
use crate::records::{Codec, Record, parse_table, write_table};
use crate::view::check_eye_size;
use glam::Vec3;
use std::io::{Seek, Write};

/// JSON of [`super::RaytraceMeta`].
pub const META: ChunkTag = ChunkTag(*b"META");
/// JSON of [`super::BvhSummary`].
pub const BVH: ChunkTag = ChunkTag(*b"RBVH");
/// JSON array of [`super::RayMaterial`].
pub const MATERIALS: ChunkTag = ChunkTag(*b"RMAT");
/// JSON array of [`super::RayLight`].
pub const LIGHTS: ChunkTag = ChunkTag(*b"RLIT");
/// Triangle table.
pub const TRIANGLES: ChunkTag = ChunkTag(*b"RTRI");

/// Bytes of a triangle: primitive, object, material, nine coordinates.
pub const TRIANGLE_ENTRY_BYTES: usize = 48;
/// Minor version of files with four-wide or compressed trees, or with lighting.
pub const TREES_AND_LIGHTING_MINOR: u16 = 4;
/// Minor version of files whose tree has instances.
pub const INSTANCES_MINOR: u16 = 5;
/// Minor version of files that state the update of their tree.
pub const UPDATE_MINOR: u16 = 6;
/// Maximum number of samples per pixel.
pub const MAX_SAMPLES_PER_PX: u32 = 1024;
/// Maximum depth of reflections.
pub const MAX_DEPTH: u32 = 64;
/// Largest absolute coordinate of a vertex or an eye in metres.
pub const MAX_COORDINATE_M: f32 = 1e18;
/// Largest angular radius of a parallel light.
pub const MAX_SUN_RADIUS_DEG: f32 = 45.0;
/// Most ambient-occlusion rays of a primary hit.
pub const MAX_OCCLUSION_RAYS: u32 = 1024;
/// Largest size of a node or a triangle in memory.
pub const MAX_ENTRY_BYTES: u32 = 4096;

/// Writes the table chunks.
pub(super) fn write<W: Write + Seek>(
    tables: &RaytraceTables,
    container: &mut ContainerWriter<W>,
) -> Result<()> {
    check(tables).map_err(|(_, broken)| broken.unwritable())?;
    container.chunk(META, &json::write("trace description", &tables.meta)?)?;
    container.chunk(BVH, &json::write("hierarchy", &tables.bvh)?)?;
    container.chunk(
        MATERIALS,
        &json::write("material table", &tables.materials)?,
    )?;
    container.chunk(LIGHTS, &json::write("light table", &tables.lights)?)?;
    container.chunk(TRIANGLES, &write_table(MAJOR_1, &tables.triangles)?)
}

/// Reads and checks the table chunks.
pub(super) fn read(container: &Container) -> Result<RaytraceTables> {
    let tables = RaytraceTables {
        meta: json::read(container, META, "a trace's description")?,
        bvh: json::read(container, BVH, "a hierarchy")?,
        materials: json::read(container, MATERIALS, "a material table")?,
        lights: json::read(container, LIGHTS, "a light table")?,
        triangles: container.parse_chunk(TRIANGLES, |input| {
            parse_table(MAJOR_1, "triangle count", input)
        })?,
    };
    if tables.bvh.traversal.is_new_in_minor_4() {
        container.expect_minor(TREES_AND_LIGHTING_MINOR, BVH, "this kind of tree")?;
    }
    if tables.bvh.instances.is_some() {
        container.expect_minor(INSTANCES_MINOR, BVH, "instances")?;
    }
    if tables.bvh.update.is_some() {
        container.expect_minor(UPDATE_MINOR, BVH, "an update")?;
    }
    if tables.meta.lighting.is_some() {
        container.expect_minor(TREES_AND_LIGHTING_MINOR, META, "this lighting")?;
    }
    check(&tables).map_err(|((chunk, offset), broken)| container.broken(chunk, offset, broken))?;
    Ok(tables)
}

impl Record for RayTriangle {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "a triangle of 48 bytes";
        codec.number(&mut self.primitive)?;
        codec.number(&mut self.object)?;
        codec.number(&mut self.material)?;
        codec.number(&mut self.vertices)
    }
}

/// Chunk and byte of a violated rule.
type At = (ChunkTag, u64);

/// Checks each table and the references between them.
fn check(tables: &RaytraceTables) -> Result<(), (At, Broken)> {
    check_meta(&tables.meta).map_err(|broken| ((META, 0), broken))?;
    check_bvh(&tables.bvh).map_err(|broken| ((BVH, 0), broken))?;
    let mut previous = None;
    for (index, triangle) in tables.triangles.iter().enumerate() {
        let at = (TRIANGLES, (4 + index * TRIANGLE_ENTRY_BYTES) as u64);
        check_triangle(index, triangle, previous, tables.materials.len())
            .map_err(|broken| (at, broken))?;
        previous = Some(triangle.primitive);
    }
    Ok(())
}

fn check_meta(meta: &RaytraceMeta) -> Result<(), Broken> {
    meta.trace.check()?;
    for eye in &meta.eyes {
        check_eye(eye, meta.trace.hmd.eye_size_px)?;
    }
    let (samples, depth) = (meta.samples_per_px, meta.max_depth);
    let expected = format_args!("1 to {MAX_SAMPLES_PER_PX}");
    let fits = (1..=MAX_SAMPLES_PER_PX).contains(&samples);
    ensure(fits, "samples per pixel", expected, samples)?;
    ensure(
        depth <= MAX_DEPTH,
        "depth",
        format_args!("at most {MAX_DEPTH}"),
        depth,
    )?;
    meta.lighting.iter().try_for_each(check_lighting)
}

fn check_lighting(lighting: &RayLighting) -> Result<(), Broken> {
    let what = "lighting";
    let RayLighting {
        sun_radius_deg,
        occlusion_rays,
        bounces,
        ..
    } = *lighting;
    let lengths = [lighting.light_radius_m, lighting.occlusion_m];
    ensure(
        lengths.iter().all(|m| (0.0..=MAX_COORDINATE_M).contains(m)),
        what,
        format_args!("lengths of 0 to {MAX_COORDINATE_M:e} m"),
        format_args!("{lengths:?}"),
    )?;
    ensure(
        (0.0..=MAX_SUN_RADIUS_DEG).contains(&sun_radius_deg),
        what,
        format_args!("a sun of 0 to {MAX_SUN_RADIUS_DEG} degrees"),
        sun_radius_deg,
    )?;
    ensure(
        occlusion_rays <= MAX_OCCLUSION_RAYS && bounces <= MAX_DEPTH,
        what,
        format_args!("at most {MAX_OCCLUSION_RAYS} rays and {MAX_DEPTH} bounces"),
        format_args!("{occlusion_rays} and {bounces}"),
    )
}

fn check_eye(eye: &EyeCamera, size_px: [u32; 2]) -> Result<(), Broken> {
    let what = "eyes";
    check_eye_size(eye.size_px)?;
    ensure(
        eye.size_px == size_px,
        what,
        format_args!("the display's eye size, {size_px:?} px"),
        format_args!("{:?} px", eye.size_px),
    )?;
    eye.fov.check()?;
    let axes = [eye.right, eye.up, eye.forward].map(Vec3::from);
    let [right, up, forward] = axes;
    let angles = [right.dot(up), up.dot(forward), forward.dot(right)];
    ensure(
        axes.iter()
            .all(|axis| (0.999..=1.001).contains(&axis.length()))
            && angles.iter().all(|cosine| cosine.abs() <= 0.001),
        what,
        "unit axes at right angles",
        format_args!("{right}, {up}, {forward}"),
    )?;
    ensure(
        in_range(&eye.position),
        what,
        format_args!("positions within {MAX_COORDINATE_M:e} m"),
        format_args!("{:?}", eye.position),
    )
}

/// Whether all coordinates are within [`MAX_COORDINATE_M`].
pub(super) fn in_range(coordinates: &[f32]) -> bool {
    coordinates.iter().all(|x| x.abs() <= MAX_COORDINATE_M)
}

fn check_bvh(bvh: &BvhSummary) -> Result<(), Broken> {
    let what = "hierarchy";
    let counts = [bvh.triangles, bvh.nodes, bvh.leaves];
    ensure(
        counts.iter().all(|count| *count <= u32::MAX.into()),
        what,
        "fewer than 2^32 triangles, nodes and leaves",
        format_args!("{counts:?}"),
    )?;
    let instances = bvh.instances.unwrap_or_default();
    let end = u64::from(instances.first) + u64::from(instances.count);
    let expected = format_args!("instances below node {}", bvh.nodes);
    ensure(end <= bvh.nodes, what, expected, end)?;
    let update = bvh.update.unwrap_or_default();
    let inner = bvh.nodes - u64::from(instances.count);
    ensure(
        update.triangles_written <= update.triangles_read
            && update.triangles_read <= bvh.triangles
            && update.instances <= instances.count.into()
            && update.nodes <= inner,
        what,
        format_args!(
            "an update of at most {} triangles, {} instances and {inner} nodes, and no more triangles written than read",
            bvh.triangles, instances.count
        ),
        format_args!("{update:?}"),
    )?;
    ensure(
        bvh.sah_cost >= 0.0,
        what,
        "a cost of 0 or more",
        bvh.sah_cost,
    )?;
    let sizes = [bvh.bytes_per_node, bvh.bytes_per_triangle];
    ensure(
        sizes
            .iter()
            .all(|size| (1..=MAX_ENTRY_BYTES).contains(size)),
        what,
        format_args!("1 to {MAX_ENTRY_BYTES} bytes a node and a triangle"),
        format_args!("{sizes:?}"),
    )
}

fn check_triangle(
    index: usize,
    triangle: &RayTriangle,
    previous: Option<u32>,
    materials: usize,
) -> Result<(), Broken> {
    let what = format_args!("triangle {index}");
    let RayTriangle {
        primitive,
        material,
        ..
    } = *triangle;
    let ascends = previous.is_none_or(|p| p < primitive);
    ensure(ascends, what, "ascending primitive numbers", primitive)?;
    let expected = format_args!("a material below {materials}");
    ensure((material as usize) < materials, what, expected, material)?;
    ensure(
        in_range(triangle.vertices.as_flattened()),
        what,
        format_args!("vertices within {MAX_COORDINATE_M:e} m"),
        format_args!("{:?}", triangle.vertices),
    )
}
