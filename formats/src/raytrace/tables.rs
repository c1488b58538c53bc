//! The tables of a ray trace as chunks: META, RBVH, RMAT and RLIT (JSON), RTRI (binary).
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{BvhSummary, EyeCamera, RayLighting, RayTriangle, RaytraceMeta, RaytraceTables};
use crate::container::{ChunkTag, Container, ContainerWriter};
use crate::error::{Broken, FormatError, Result, ensure};
use crate::json;
use crate::parse::{self, Parsed};
use crate::view::check_eye_size;
use glam::Vec3;
use nom::Parser;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::{le_f32, le_u32};
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
    let number = |what: &str, n: usize| {
        u32::try_from(n).map_err(|_| FormatError::Unwritable {
            what: what.to_owned(),
            expected: "less than 2^32 entries".to_owned(),
            found: n.to_string(),
        })
    };
    let triangles = &tables.triangles;
    let mut bytes = Vec::with_capacity(4 + triangles.len() * TRIANGLE_ENTRY_BYTES);
    bytes.extend(number("triangle table", triangles.len())?.to_le_bytes());
    for t in triangles {
        for n in [t.primitive, t.object, t.material] {
            bytes.extend(n.to_le_bytes());
        }
        for x in t.vertices.as_flattened() {
            bytes.extend(x.to_le_bytes());
        }
    }
    container.chunk(TRIANGLES, &bytes)
}

/// Reads and checks the table chunks.
pub(super) fn read(container: &Container) -> Result<RaytraceTables> {
    let tables = RaytraceTables {
        meta: json::read(container, META, "a trace's description")?,
        bvh: json::read(container, BVH, "a hierarchy")?,
        materials: json::read(container, MATERIALS, "a material table")?,
        lights: json::read(container, LIGHTS, "a light table")?,
        triangles: container.parse_chunk(TRIANGLES, read_triangles)?,
    };
    let (major, minor) = container.version();
    if minor < TREES_AND_LIGHTING_MINOR {
        let later = [
            (
                BVH,
                "kind of tree",
                tables.bvh.traversal.is_new_in_minor_4(),
            ),
            (META, "lighting", tables.meta.lighting.is_some()),
        ];
        if let Some((chunk, what, _)) = later.into_iter().find(|(.., has)| *has) {
            let expected = format!("version {major}.{TREES_AND_LIGHTING_MINOR} for this {what}");
            return Err(container.malformed(chunk, 0, expected, format!("{major}.{minor}")));
        }
    }
    check(&tables).map_err(|((chunk, offset), broken)| {
        let expected = format!("{}: {}", broken.what, broken.expected);
        container.malformed(chunk, offset, expected, broken.found)
    })?;
    Ok(tables)
}

fn read_triangles(input: &[u8]) -> Parsed<'_, Vec<RayTriangle>> {
    let (rest, number) = parse::count("triangle count", TRIANGLE_ENTRY_BYTES).parse(input)?;
    count(read_triangle, number).parse(rest)
}

fn read_triangle(input: &[u8]) -> Parsed<'_, RayTriangle> {
    let vertex = || (le_f32, le_f32, le_f32).map(<[f32; 3]>::from);
    let (rest, ((primitive, object, material), (a, b, c))) = context(
        "a triangle of 48 bytes",
        ((le_u32, le_u32, le_u32), (vertex(), vertex(), vertex())),
    )
    .parse(input)?;
    let triangle = RayTriangle {
        primitive,
        object,
        material,
        vertices: [a, b, c],
    };
    Ok((rest, triangle))
}

/// Chunk and byte of a violated rule.
type At = (ChunkTag, u64);

/// Checks each table and the references between them.
fn check(tables: &RaytraceTables) -> std::result::Result<(), (At, Broken)> {
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

fn check_meta(meta: &RaytraceMeta) -> std::result::Result<(), Broken> {
    meta.trace.check()?;
    for eye in &meta.eyes {
        check_eye(eye, meta.trace.hmd.eye_size_px)?;
    }
    ensure(
        (1..=MAX_SAMPLES_PER_PX).contains(&meta.samples_per_px),
        || {
            let expected = format!("1 to {MAX_SAMPLES_PER_PX}");
            Broken::new("samples per pixel", expected, meta.samples_per_px)
        },
    )?;
    ensure(meta.max_depth <= MAX_DEPTH, || {
        Broken::new("depth", format!("at most {MAX_DEPTH}"), meta.max_depth)
    })?;
    meta.lighting.iter().try_for_each(check_lighting)
}

fn check_lighting(lighting: &RayLighting) -> std::result::Result<(), Broken> {
    let RayLighting {
        light_radius_m,
        sun_radius_deg,
        occlusion_rays,
        occlusion_m,
        bounces,
        ..
    } = *lighting;
    let lengths = [light_radius_m, occlusion_m];
    ensure(
        lengths.iter().all(|m| (0.0..=MAX_COORDINATE_M).contains(m)),
        || {
            let expected = format!("lengths of 0 to {MAX_COORDINATE_M:e} m");
            Broken::new("lighting", expected, format_args!("{lengths:?}"))
        },
    )?;
    ensure((0.0..=MAX_SUN_RADIUS_DEG).contains(&sun_radius_deg), || {
        let expected = format!("a sun of 0 to {MAX_SUN_RADIUS_DEG} degrees");
        Broken::new("lighting", expected, sun_radius_deg)
    })?;
    ensure(
        occlusion_rays <= MAX_OCCLUSION_RAYS && bounces <= MAX_DEPTH,
        || {
            let expected = format!("at most {MAX_OCCLUSION_RAYS} rays and {MAX_DEPTH} bounces");
            Broken::new(
                "lighting",
                expected,
                format_args!("{occlusion_rays} and {bounces}"),
            )
        },
    )
}

fn check_eye(eye: &EyeCamera, size_px: [u32; 2]) -> std::result::Result<(), Broken> {
    check_eye_size(eye.size_px)?;
    ensure(eye.size_px == size_px, || {
        let expected = format!("the display's eye size, {size_px:?} px");
        Broken::new("eyes", expected, format_args!("{:?} px", eye.size_px))
    })?;
    eye.fov.check()?;
    let [right, up, forward] = [eye.right, eye.up, eye.forward].map(Vec3::from);
    let lengths = [right, up, forward].map(|axis| axis.length());
    let angles = [right.dot(up), up.dot(forward), forward.dot(right)];
    let unit = lengths
        .iter()
        .all(|length| (0.999..=1.001).contains(length));
    ensure(
        unit && angles.iter().all(|cosine| cosine.abs() <= 0.001),
        || {
            let found = format!("{right}, {up}, {forward}");
            Broken::new("eyes", "unit axes at right angles", found)
        },
    )?;
    ensure(in_range(&eye.position), || {
        let found = format!("{:?}", eye.position);
        Broken::new(
            "eyes",
            format!("positions within {MAX_COORDINATE_M:e} m"),
            found,
        )
    })
}

fn in_range(coordinates: &[f32]) -> bool {
    coordinates.iter().all(|x| x.abs() <= MAX_COORDINATE_M)
}

fn check_bvh(bvh: &BvhSummary) -> std::result::Result<(), Broken> {
    let counts = [bvh.triangles, bvh.nodes, bvh.leaves];
    ensure(counts.iter().all(|count| *count <= u32::MAX.into()), || {
        let expected = "fewer than 2^32 triangles, nodes and leaves";
        Broken::new("hierarchy", expected, format_args!("{counts:?}"))
    })?;
    ensure(bvh.sah_cost >= 0.0, || {
        Broken::new("hierarchy", "a cost of 0 or more", bvh.sah_cost)
    })?;
    let sizes = [bvh.bytes_per_node, bvh.bytes_per_triangle];
    ensure(
        sizes
            .iter()
            .all(|size| (1..=MAX_ENTRY_BYTES).contains(size)),
        || {
            let expected = format!("1 to {MAX_ENTRY_BYTES} bytes a node and a triangle");
            Broken::new("hierarchy", expected, format_args!("{sizes:?}"))
        },
    )
}

fn check_triangle(
    index: usize,
    triangle: &RayTriangle,
    previous: Option<u32>,
    materials: usize,
) -> std::result::Result<(), Broken> {
    let what = || format!("triangle {index}");
    ensure(previous.is_none_or(|p| p < triangle.primitive), || {
        Broken::new(what(), "ascending primitive numbers", triangle.primitive)
    })?;
    ensure((triangle.material as usize) < materials, || {
        Broken::new(
            what(),
            format!("a material below {materials}"),
            triangle.material,
        )
    })?;
    ensure(in_range(triangle.vertices.as_flattened()), || {
        let expected = format!("vertices within {MAX_COORDINATE_M:e} m");
        Broken::new(what(), expected, format_args!("{:?}", triangle.vertices))
    })
}
