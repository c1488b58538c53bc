//! The tables of a ray trace as chunks: META, RBVH, RMAT and RLIT (JSON), RTRI (binary).
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{RayTriangle, RaytraceTables};
use crate::container::{ChunkTag, Container, ContainerWriter};
use crate::error::{FormatError, Result};
use crate::parse::{self, Parsed};
use nom::Parser;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::{le_f32, le_u32};
use serde::Serialize;
use serde::de::DeserializeOwned;
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
/// Largest width and height of an eye's image.
pub const MAX_EYE_SIZE_PX: u32 = 16384;
/// Most samples of a pixel.
pub const MAX_SAMPLES_PER_PX: u32 = 1024;
/// Deepest reflection.
pub const MAX_DEPTH: u32 = 64;

/// Writes the table chunks.
pub(super) fn write<W: Write + Seek>(
    tables: &RaytraceTables,
    container: &mut ContainerWriter<W>,
) -> Result<()> {
    check(tables).map_err(|broken| FormatError::Unwritable {
        what: broken.what,
        expected: broken.expected,
        found: broken.found,
    })?;
    container.chunk(META, &to_json("trace description", &tables.meta)?)?;
    container.chunk(BVH, &to_json("hierarchy", &tables.bvh)?)?;
    container.chunk(MATERIALS, &to_json("material table", &tables.materials)?)?;
    container.chunk(LIGHTS, &to_json("light table", &tables.lights)?)?;
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
        meta: from_json(container, META, "the JSON of a trace's description")?,
        bvh: from_json(container, BVH, "the JSON of a hierarchy")?,
        materials: from_json(container, MATERIALS, "the JSON of a material table")?,
        lights: from_json(container, LIGHTS, "the JSON of a light table")?,
        triangles: container.parse_chunk(TRIANGLES, read_triangles)?,
    };
    check(&tables).map_err(|broken| {
        let expected = format!("{}: {}", broken.what, broken.expected);
        container.malformed(broken.chunk, broken.offset, expected, broken.found)
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

fn to_json<T: Serialize + DeserializeOwned + PartialEq>(what: &str, value: &T) -> Result<Vec<u8>> {
    let unwritable = |found: String| FormatError::Unwritable {
        what: what.to_owned(),
        expected: "finite numbers".to_owned(),
        found,
    };
    let json = serde_json::to_vec(value).map_err(|error| unwritable(error.to_string()))?;
    // JSON has no NaN: what does not come back must not be written.
    match serde_json::from_slice::<T>(&json) {
        Ok(back) if back == *value => Ok(json),
        Ok(_) => Err(unwritable("numbers that change in JSON".to_owned())),
        Err(error) => Err(unwritable(error.to_string())),
    }
}

fn from_json<T: DeserializeOwned>(
    container: &Container,
    tag: ChunkTag,
    expected: &str,
) -> Result<T> {
    let json = container.chunk(tag)?;
    serde_json::from_slice(json).map_err(|error| {
        let before: usize = json
            .split_inclusive(|byte| *byte == b'\n')
            .take(error.line().saturating_sub(1))
            .map(<[u8]>::len)
            .sum();
        let offset = before + error.column().saturating_sub(1);
        container.malformed(tag, offset as u64, expected, error)
    })
}

/// A table that breaks a rule of the format.
struct Broken {
    chunk: ChunkTag,
    offset: u64,
    what: String,
    expected: String,
    found: String,
}

/// Checks what ties the tables together.
fn check(tables: &RaytraceTables) -> std::result::Result<(), Broken> {
    let meta = &tables.meta;
    let broken = |what: &str, expected: String, found: String| Broken {
        chunk: META,
        offset: 0,
        what: what.to_owned(),
        expected,
        found,
    };
    let [left, right] = &meta.eyes;
    let fits = left
        .size_px
        .iter()
        .all(|s| (1..=MAX_EYE_SIZE_PX).contains(s));
    if !fits || left.size_px != right.size_px {
        let expected = format!("the same size, 1 to {MAX_EYE_SIZE_PX} pixels, for both");
        let found = format!("{:?} and {:?}", left.size_px, right.size_px);
        return Err(broken("eyes", expected, found));
    }
    if !(1..=MAX_SAMPLES_PER_PX).contains(&meta.samples_per_px) {
        let expected = format!("1 to {MAX_SAMPLES_PER_PX}");
        return Err(broken(
            "samples per pixel",
            expected,
            meta.samples_per_px.to_string(),
        ));
    }
    if meta.max_depth > MAX_DEPTH {
        let expected = format!("at most {MAX_DEPTH}");
        return Err(broken("depth", expected, meta.max_depth.to_string()));
    }
    let mut previous = None;
    for (index, t) in tables.triangles.iter().enumerate() {
        let broken = |expected: &str, found: String| Broken {
            chunk: TRIANGLES,
            offset: (4 + index * TRIANGLE_ENTRY_BYTES) as u64,
            what: format!("triangle {index}"),
            expected: expected.to_owned(),
            found,
        };
        if previous.is_some_and(|p| p >= t.primitive) {
            return Err(broken(
                "ascending primitive numbers",
                t.primitive.to_string(),
            ));
        }
        previous = Some(t.primitive);
        if t.material as usize >= tables.materials.len() {
            let expected = format!("a material below {}", tables.materials.len());
            return Err(broken(&expected, t.material.to_string()));
        }
        if t.vertices.as_flattened().iter().any(|x| !x.is_finite()) {
            return Err(broken("finite vertices", format!("{:?}", t.vertices)));
        }
    }
    Ok(())
}
