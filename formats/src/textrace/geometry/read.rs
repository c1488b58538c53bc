//! Reads geometry.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{
    GEOMETRY, GEOMETRY_MINOR, Geometry, GeometryView, LIST_CHUNK, LIST_INDEX, MESH_BYTES,
    MeshGeometry, PRIMITIVE_LISTS, TileLists, ViewTarget,
};
use crate::container::{Container, MAJOR_1};
use crate::error::{Broken, Result};
use crate::parse::{Cursor, Parsed};
use crate::records;
use crate::textrace::{TILE_INDEX, Tables};
use crate::tiles::TileSpan;
use crate::varint::unzigzag;

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
    if container.version().0 == MAJOR_1 {
        container.expect_minor(GEOMETRY_MINOR, GEOMETRY, "a trace with geometry")?;
    }
    let broken = |tag| move |broken: Broken| container.broken(tag, 0, broken);
    let mut geometry = container.parse_chunk(GEOMETRY, read_meshes)?;
    geometry.check_meshes(tables).map_err(broken(GEOMETRY))?;
    let views = container.parse_chunk(LIST_INDEX, read_views)?;
    for (view, span) in views {
        let sound = view
            .check(tables)
            .and_then(|()| geometry.check_order(&view));
        sound.map_err(broken(LIST_INDEX))?;
        geometry.views.push(view);
        geometry.spans.push(span);
    }
    geometry.check_passes(tables).map_err(broken(LIST_INDEX))?;
    LIST_CHUNK.check(container, geometry.spans.iter().copied().map(Some))?;
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
    let lists = LIST_CHUNK.parse(container, span, |input| TileLists::decode(tiles, input))?;
    (lists.check(&tables.draws, tiles))
        .map_err(|broken| container.broken(PRIMITIVE_LISTS, span.offset, broken))?;
    Ok(lists)
}

fn read_meshes(input: &[u8]) -> Parsed<'_, Geometry> {
    let mut input = Cursor::new(input);
    let meshes = input.count("mesh count", MESH_BYTES)?;
    let mut geometry = Geometry::default();
    for _ in 0..meshes {
        let vertices = input.fixed("a mesh")?;
        let [vertex_bytes, index_bytes] = input.fixed("a mesh")?;
        let indices = input.count("index count", 1)?;
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
    for _ in 0..input.count("draw count", 4)? {
        geometry.draw_meshes.push(input.fixed("a mesh of a draw")?);
    }
    Ok((input.rest(), geometry))
}

fn read_views(input: &[u8]) -> Parsed<'_, Vec<(GeometryView, TileSpan)>> {
    let mut input = Cursor::new(input);
    let mut views = Vec::new();
    while !input.rest().is_empty() {
        let at = input;
        let what = "an entry of 36 bytes of the list index";
        let [frame, kind, number, width, height] = input.fixed(what)?;
        let target = match kind {
            0 => ViewTarget::Pass(number),
            1 => ViewTarget::ShadowMap(number),
            _ => return Err(at.fault("a view of kind 0 or 1", kind)),
        };
        let size_px = [width, height];
        let view = GeometryView {
            frame,
            target,
            size_px,
        };
        views.push((view, input.parse(|input| records::parse(MAJOR_1, input))?));
    }
    Ok((input.rest(), views))
}
