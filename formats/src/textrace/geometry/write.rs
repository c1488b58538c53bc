//! Writes geometry. Lists are spooled while views are captured, because only one chunk can be written at a
//! time.

use super::{
    GEOMETRY, GEOMETRY_MINOR, Geometry, GeometryView, LIST_INDEX, LIST_INDEX_ENTRY_BYTES,
    PRIMITIVE_LISTS, TileLists, ViewTarget,
};
use crate::container::{ContainerWriter, MAJOR_1};
use crate::error::{Broken, Result};
use crate::parse::Number;
use crate::records::{self, put_count};
use crate::textrace::Tables;
use crate::tiles::TileSpool;
use crate::varint::{put, zigzag};
use std::io::{Seek, Write};
use tempfile::SpooledTempFile;

/// Geometry that will be written after the tiles.
#[derive(Debug)]
pub(in crate::textrace) struct Spool {
    geometry: Geometry,
    lists: TileSpool,
    encoded: Vec<u8>,
}

impl Spool {
    /// Starts with the meshes and draws of `geometry`; its views are ignored.
    pub fn new(geometry: Geometry, tables: &Tables) -> Result<Self> {
        geometry.check_meshes(tables).map_err(Broken::unwritable)?;
        Ok(Self {
            geometry: Geometry {
                views: Vec::new(),
                spans: Vec::new(),
                ..geometry
            },
            lists: TileSpool::new(SpooledTempFile::new(TileSpool::IN_MEMORY_BYTES)),
            encoded: Vec::new(),
        })
    }

    /// Appends a view.
    pub fn append(&mut self, tables: &Tables, view: GeometryView, lists: &TileLists) -> Result<()> {
        view.check(tables).map_err(Broken::unwritable)?;
        (self.geometry.check_order(&view)).map_err(Broken::unwritable)?;
        lists
            .check(&tables.draws, view.tile_count())
            .map_err(Broken::unwritable)?;
        self.encoded.clear();
        lists.encode(&mut self.encoded);
        let span = (self.lists).append("primitive lists of a view", &self.encoded)?;
        self.geometry.views.push(view);
        self.geometry.spans.push(span);
        Ok(())
    }

    /// Writes the chunks.
    pub fn write<W: Write + Seek>(
        mut self,
        tables: &Tables,
        container: &mut ContainerWriter<W>,
    ) -> Result<()> {
        (self.geometry.check_passes(tables)).map_err(Broken::unwritable)?;
        if container.major() == MAJOR_1 {
            container.require_minor(GEOMETRY_MINOR);
        }
        container.chunk(GEOMETRY, &meshes(&self.geometry)?)?;
        self.lists.write(PRIMITIVE_LISTS, container)?;
        let views = self.geometry.views.iter().zip(&self.geometry.spans);
        let mut index = Vec::with_capacity(self.geometry.views.len() * LIST_INDEX_ENTRY_BYTES);
        for (view, span) in views {
            let (kind, number) = match view.target {
                ViewTarget::Pass(pass) => (0_u32, pass),
                ViewTarget::ShadowMap(cascade) => (1, cascade),
            };
            let [width, height] = view.size_px;
            [view.frame, kind, number, width, height].put(&mut index);
            records::write(MAJOR_1, span, &mut index)?;
        }
        container.chunk(LIST_INDEX, &index)
    }
}

fn meshes(geometry: &Geometry) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    put_count("meshes", geometry.meshes.len(), &mut bytes)?;
    for mesh in &geometry.meshes {
        mesh.vertices.put(&mut bytes);
        [mesh.vertex_bytes, mesh.index_bytes].put(&mut bytes);
        put_count("indices of a mesh", mesh.indices.len(), &mut bytes)?;
        let mut next = 0;
        for &index in &mesh.indices {
            put(zigzag(next - i64::from(index)), &mut bytes);
            next = next.max(i64::from(index) + 1);
        }
    }
    put_count("draws", geometry.draw_meshes.len(), &mut bytes)?;
    geometry
        .draw_meshes
        .iter()
        .for_each(|mesh| mesh.put(&mut bytes));
    Ok(bytes)
}
