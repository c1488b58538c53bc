//! Reads geometry.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{
    GEOMETRY, GEOMETRY_MINOR, Geometry, GeometryView, LIST_INDEX, LIST_INDEX_ENTRY_BYTES,
    MESH_BYTES, MeshGeometry, PRIMITIVE_LISTS, TileLists, ViewTarget,
};
use crate::container::{Container, MAJOR_1};
use crate::error::Result;
use crate::parse::{self, Cursor, Fault, Parsed};
use crate::textrace::{TILE_INDEX, Tables};
use crate::tiles::{TileChunk, TileSpan};
use crate::varint::unzigzag;
use nom::Parser;
use nom::error::context;
use nom::multi::count;
use nom::number::complete::{le_u16, le_u32};

/// The geometry of a trace, if it has any.
pub(in crate::textrace) fn read(
    container: &Container,
    tables: &Tables,
) -> Result<Option<Geometry>> {
    let tags = [GEOMETRY, PRIMITIVE_LISTS, LIST_INDEX];
    if tags.iter().all(|tag| container.entry(*tag).is_err()) {
        return Ok(None);
    }
    container.expect_order(&[TILE_INDEX, GEOMETRY, PRIMITIVE_LISTS, LIST_INDEX])?;
    let (major, minor) = container.version();
    if major == MAJOR_1 && minor < GEOMETRY_MINOR {
        let expected = format!("version {major}.{GEOMETRY_MINOR} for a trace with geometry");
        return Err(container.malformed(GEOMETRY, 0, expected, format!("{major}.{minor}")));
    }
    let broken = |tag| {
        move |broken: crate::error::Broken| {
            container.malformed(
                tag,
                0,
                format!("{}: {}", broken.what, broken.expected),
                broken.found,
            )
        }
    };
    let mut geometry = container.parse_chunk(GEOMETRY, read_meshes)?;
    geometry.check_meshes(tables).map_err(broken(GEOMETRY))?;
    let entries = container.chunk(LIST_INDEX)?.len() / LIST_INDEX_ENTRY_BYTES;
    let views =
        container.parse_chunk(LIST_INDEX, |input| count(read_view, entries).parse(input))?;
    for (view, span) in views {
        let sound = view
            .check(tables)
            .and_then(|()| geometry.check_order(&view));
        sound.map_err(broken(LIST_INDEX))?;
        geometry.views.push(view);
        geometry.spans.push(span);
    }
    geometry.check_passes(tables).map_err(broken(LIST_INDEX))?;
    list_chunk(container).check(geometry.spans.iter().copied().map(Some))?;
    Ok(Some(geometry))
}

/// The primitive lists of a view.
pub(in crate::textrace) fn lists_of(
    container: &Container,
    tables: &Tables,
    view: &GeometryView,
    span: &TileSpan,
) -> Result<TileLists> {
    let tiles = view.tile_count();
    let lists = list_chunk(container).parse(span, |input| TileLists::decode(tiles, input))?;
    lists.check(&tables.draws, tiles).map_err(|broken| {
        let expected = format!("{}: {}", broken.what, broken.expected);
        container.malformed(PRIMITIVE_LISTS, span.offset, expected, broken.found)
    })?;
    Ok(lists)
}

fn list_chunk(container: &Container) -> TileChunk<'_> {
    TileChunk {
        container,
        tiles: PRIMITIVE_LISTS,
        index: LIST_INDEX,
        entry_bytes: LIST_INDEX_ENTRY_BYTES,
    }
}

fn read_meshes(input: &[u8]) -> Parsed<'_, Geometry> {
    let mut input = Cursor::new(input);
    let meshes = input.parse(parse::count("mesh count", MESH_BYTES))?;
    let mut geometry = Geometry::default();
    for _ in 0..meshes {
        let (vertices, vertex_bytes, index_bytes) =
            input.parse(context("a mesh", (le_u32, le_u16, le_u16)))?;
        let indices = input.parse(parse::count("index count", 1))?;
        let mut mesh = MeshGeometry {
            vertices,
            vertex_bytes,
            index_bytes,
            indices: Vec::with_capacity(indices),
        };
        let mut next = 0_i64;
        for _ in 0..indices {
            let index = next - unzigzag(input.number("an index", 33)?);
            let vertex = u32::try_from(index).map_err(|_| input.fault("a vertex", index))?;
            next = next.max(index + 1);
            mesh.indices.push(vertex);
        }
        geometry.meshes.push(mesh);
    }
    let draws = input.parse(parse::count("draw count", 4))?;
    geometry.draw_meshes = input.parse(count(le_u32, draws))?;
    Ok((input.rest(), geometry))
}

fn read_view(at: &[u8]) -> Parsed<'_, (GeometryView, TileSpan)> {
    let (rest, (frame, kind, number, width, height, span)) = context(
        "an entry of 36 bytes of the list index",
        (le_u32, le_u32, le_u32, le_u32, le_u32, TileSpan::parse),
    )
    .parse(at)?;
    let target = match kind {
        0 => ViewTarget::Pass(number),
        1 => ViewTarget::ShadowMap(number),
        _ => {
            return Err(nom::Err::Failure(Fault::new(
                at,
                "a view of kind 0 or 1",
                kind,
            )));
        }
    };
    let view = GeometryView {
        frame,
        target,
        size_px: [width, height],
    };
    Ok((rest, (view, span)))
}
