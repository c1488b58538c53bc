//! Writes geometry. Lists are spooled while views are captured, because only one chunk can be written at a
//! time.

use super::{
    GEOMETRY, GEOMETRY_MINOR, Geometry, GeometryView, LIST_INDEX, LIST_INDEX_ENTRY_BYTES,
    PRIMITIVE_LISTS, TileLists, ViewTarget,
};
use crate::container::{ContainerWriter, MAJOR_1};
use crate::error::{Broken, FormatError, Result};
use crate::textrace::Tables;
use crate::tiles::TileSpan;
use crate::varint::{put, zigzag};
use std::io::{Read, Seek, SeekFrom, Write};
use tempfile::SpooledTempFile;

/// Size of the lists in memory before they are moved to a temporary file.
const IN_MEMORY_BYTES: usize = 64 << 20;

/// Geometry that will be written after the tiles.
#[derive(Debug)]
pub(in crate::textrace) struct Spool {
    geometry: Geometry,
    lists: SpooledTempFile,
    bytes: u64,
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
            lists: SpooledTempFile::new(IN_MEMORY_BYTES),
            bytes: 0,
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
        let bytes = u32::try_from(self.encoded.len()).map_err(|_| FormatError::Unwritable {
            what: "primitive lists of a view".to_owned(),
            expected: "less than 2^32 bytes".to_owned(),
            found: format!("{} bytes", self.encoded.len()),
        })?;
        self.lists.write_all(&self.encoded).map_err(spool_error)?;
        self.geometry.views.push(view);
        self.geometry.spans.push(TileSpan {
            offset: self.bytes,
            bytes,
            crc32: crc32fast::hash(&self.encoded),
        });
        self.bytes += u64::from(bytes);
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
        container.begin_chunk(PRIMITIVE_LISTS)?;
        self.lists.seek(SeekFrom::Start(0)).map_err(spool_error)?;
        let mut part = vec![0; 1 << 16];
        loop {
            let read = self.lists.read(&mut part).map_err(spool_error)?;
            if read == 0 {
                break;
            }
            container.append(&part[..read])?;
        }
        let views = self.geometry.views.iter().zip(&self.geometry.spans);
        let mut index = Vec::with_capacity(self.geometry.views.len() * LIST_INDEX_ENTRY_BYTES);
        for (view, span) in views {
            let (kind, number) = match view.target {
                ViewTarget::Pass(pass) => (0_u32, pass),
                ViewTarget::ShadowMap(cascade) => (1, cascade),
            };
            for field in [view.frame, kind, number, view.size_px[0], view.size_px[1]] {
                index.extend(field.to_le_bytes());
            }
            span.write(&mut index);
        }
        container.chunk(LIST_INDEX, &index)
    }
}

fn spool_error(source: std::io::Error) -> FormatError {
    FormatError::io("the temporary file of primitive lists", "use", source)
}

fn meshes(geometry: &Geometry) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let count = |what: &str, count: usize| {
        u32::try_from(count).map_err(|_| FormatError::Unwritable {
            what: what.to_owned(),
            expected: "fewer than 2^32".to_owned(),
            found: count.to_string(),
        })
    };
    bytes.extend(count("meshes", geometry.meshes.len())?.to_le_bytes());
    for mesh in &geometry.meshes {
        bytes.extend(mesh.vertices.to_le_bytes());
        bytes.extend(mesh.vertex_bytes.to_le_bytes());
        bytes.extend(mesh.index_bytes.to_le_bytes());
        bytes.extend(count("indices of a mesh", mesh.indices.len())?.to_le_bytes());
        let mut next = 0;
        for &index in &mesh.indices {
            put(zigzag(next - i64::from(index)), &mut bytes);
            next = next.max(i64::from(index) + 1);
        }
    }
    bytes.extend(count("draws", geometry.draw_meshes.len())?.to_le_bytes());
    for mesh in &geometry.draw_meshes {
        bytes.extend(mesh.to_le_bytes());
    }
    Ok(bytes)
}
