//! Splits traces into chunks and reassembles them with correct checksums, so that tests can change data
//! behind the checksums.

use formats::Trace;
use formats::container::{ChunkTag, Container, ContainerWriter, Kind};
use formats::raytrace::RayTile;
use formats::textrace::Tile;
use formats::view::Eye;

/// The chunks of a trace, in file order.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Kind of trace.
    pub kind: Kind,
    /// Major version.
    pub major: u16,
    /// Minor version.
    pub minor: u16,
    /// Tag and bytes of each chunk.
    pub chunks: Vec<([u8; 4], Vec<u8>)>,
}

impl Parts {
    /// Splits a valid trace.
    ///
    /// # Panics
    /// The bytes are not a container.
    pub fn of(bytes: &[u8]) -> Self {
        Self::read(bytes).expect("a sound container")
    }

    /// Splits a container.
    ///
    /// # Errors
    /// Its header, directory or a chunk is damaged.
    pub fn read(bytes: &[u8]) -> formats::Result<Self> {
        let container = Container::from_bytes(bytes.to_vec())?;
        let chunk = |tag| Ok(container.chunk(tag)?.to_vec());
        let entries = container.directory().iter();
        Ok(Self {
            kind: container.kind(),
            major: container.version().0,
            minor: container.version().1,
            chunks: entries
                .map(|entry| Ok((entry.tag.0, chunk(entry.tag)?)))
                .collect::<formats::Result<_>>()?,
        })
    }

    /// Bytes of a chunk; empty if there is none.
    pub fn chunk(&mut self, tag: &[u8; 4]) -> &mut Vec<u8> {
        let at = self.chunks.iter().position(|(other, _)| other == tag);
        let at = at.unwrap_or_else(|| {
            self.chunks.push((*tag, Vec::new()));
            self.chunks.len() - 1
        });
        &mut self.chunks[at].1
    }

    /// Writes a number into a chunk.
    ///
    /// # Panics
    /// The chunk is too short.
    pub fn put(&mut self, tag: &[u8; 4], at: usize, bytes: &[u8]) {
        self.chunk(tag)[at..at + bytes.len()].copy_from_slice(bytes);
    }

    /// Changes the value of a JSON chunk.
    ///
    /// # Panics
    /// The chunk is not JSON.
    pub fn edit(&mut self, tag: &[u8; 4], change: impl FnOnce(&mut serde_json::Value)) {
        let chunk = self.chunk(tag);
        let mut value = serde_json::from_slice(chunk).expect("a JSON chunk");
        change(&mut value);
        *chunk = value.to_string().into_bytes();
    }

    /// Replaces text in a JSON chunk, once.
    ///
    /// # Panics
    /// The text is not in the chunk.
    pub fn replace(&mut self, tag: &[u8; 4], from: &str, to: &str) {
        let chunk = self.chunk(tag);
        let text = String::from_utf8(chunk.clone()).expect("JSON is UTF-8");
        assert!(text.contains(from), "{from} is not in {text}");
        *chunk = text.replacen(from, to, 1).into_bytes();
    }

    /// Families of tiles: the records, and the geometry of rays if there is any. Each has the tags of the
    /// chunk of tiles and of its index, and the size of an index entry.
    fn families(&self) -> Vec<([u8; 4], [u8; 4], usize)> {
        let has = |tag: &[u8; 4]| self.chunks.iter().any(|(other, _)| other == tag);
        match self.kind {
            Kind::Textrace => vec![(*b"TILE", *b"TIDX", 32)],
            Kind::Raytrace if has(b"RGEO") && has(b"RGIX") => {
                vec![(*b"RAYS", *b"RTIX", 24), (*b"RGEO", *b"RGIX", 16)]
            }
            Kind::Raytrace => vec![(*b"RAYS", *b"RTIX", 24)],
        }
    }

    /// Number of families of tiles: 2 for a ray trace with geometry, else 1.
    pub fn family_count(&self) -> usize {
        self.families().len()
    }

    /// The bytes of every slot of the index of the records, as far as they exist.
    pub fn tiles(&mut self) -> Vec<Vec<u8>> {
        self.tiles_of(0)
    }

    /// The same of a family of tiles, 0 for the records.
    ///
    /// # Panics
    /// There is no such family.
    pub fn tiles_of(&mut self, family: usize) -> Vec<Vec<u8>> {
        let (tiles, index, entry_bytes) = self.families()[family];
        let all = self.chunk(&tiles).clone();
        let entries = self.chunk(&index).chunks_exact(entry_bytes);
        let of = |entry: &[u8]| {
            let (offset, size) = (number(entry, 0, 8), number(entry, 8, 4));
            let end = offset.saturating_add(size).min(all.len());
            all.get(offset.min(end)..end).unwrap_or_default().to_vec()
        };
        entries.map(of).collect()
    }

    /// Replaces the tiles. Offsets, sizes and checksums in the index are updated; its counts are not.
    pub fn set_tiles(&mut self, tiles: &[Vec<u8>]) {
        self.set_tiles_of(0, tiles);
    }

    /// The same for a family of tiles.
    ///
    /// # Panics
    /// There is no such family.
    pub fn set_tiles_of(&mut self, family: usize, tiles: &[Vec<u8>]) {
        let (tag, index, entry_bytes) = self.families()[family];
        let mut offset = 0u64;
        let entries = self.chunk(&index).chunks_exact_mut(entry_bytes);
        for (entry, tile) in entries.zip(tiles) {
            let at = if tile.is_empty() { 0 } else { offset };
            entry[..8].copy_from_slice(&at.to_le_bytes());
            entry[8..12].copy_from_slice(&(tile.len() as u32).to_le_bytes());
            let crc32 = if tile.is_empty() { 0 } else { crc32(tile) };
            entry[12..16].copy_from_slice(&crc32.to_le_bytes());
            offset += tile.len() as u64;
        }
        *self.chunk(&tag) = tiles.concat();
    }

    /// Corrects the checksums of the tiles at the positions in the index.
    pub fn repair_tiles(&mut self) {
        for (family, (_, index, entry_bytes)) in self.families().into_iter().enumerate() {
            let tiles = self.tiles_of(family);
            let crc32s: Vec<u32> = tiles.iter().map(|tile| crc32(tile)).collect();
            let entries = self.chunk(&index).chunks_exact_mut(entry_bytes);
            for (entry, crc32) in entries.zip(crc32s) {
                if number(entry, 8, 4) > 0 {
                    entry[12..16].copy_from_slice(&crc32.to_le_bytes());
                }
            }
        }
        self.repair_lists();
    }

    /// Corrects the sizes and checksums of primitive lists, if any: the last list gets the rest of the
    /// chunk.
    fn repair_lists(&mut self) {
        let has = |tag: &[u8; 4]| self.chunks.iter().any(|(other, _)| other == tag);
        if !has(b"PLST") || !has(b"PLIX") {
            return;
        }
        let lists = self.chunk(b"PLST").clone();
        let entries: Vec<&mut [u8]> = self.chunk(b"PLIX").chunks_exact_mut(36).collect();
        let last = entries.len().wrapping_sub(1);
        for (place, entry) in entries.into_iter().enumerate() {
            let (start, size) = (number(entry, 20, 8), number(entry, 28, 4));
            let start = start.min(lists.len());
            let end = if place == last {
                lists.len()
            } else {
                start.saturating_add(size).min(lists.len())
            };
            let list = &lists[start..end];
            entry[28..32].copy_from_slice(&(list.len() as u32).to_le_bytes());
            entry[32..36].copy_from_slice(&crc32(list).to_le_bytes());
        }
    }

    /// The file with new checksums of chunks, directory and header. Chunks with a duplicate tag are left
    /// out, because no container can have them.
    pub fn sealed(&self) -> Vec<u8> {
        let mut writer = ContainerWriter::in_memory(self.kind).expect("in memory");
        for (tag, bytes) in &self.chunks {
            let _twice = writer.chunk(ChunkTag(*tag), bytes);
        }
        let mut bytes = writer.into_bytes().expect("in memory");
        bytes[8..10].copy_from_slice(&self.major.to_le_bytes());
        bytes[10..12].copy_from_slice(&self.minor.to_le_bytes());
        repair_header(&mut bytes);
        bytes
    }
}

/// Reads a little-endian number.
fn number(bytes: &[u8], at: usize, size: usize) -> usize {
    let of = bytes.get(at..at + size).unwrap_or_default();
    of.iter()
        .rev()
        .fold(0, |n, byte| n << 8 | usize::from(*byte))
}

/// CRC-32 as in zlib and PNG, computed byte by byte, independent of the library used by the traces.
pub fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = crc32_table();
    let step = |crc: u32, byte: &u8| crc >> 8 ^ TABLE[usize::from(crc as u8 ^ byte)];
    !bytes.iter().fold(u32::MAX, step)
}

/// The effect of each byte on the checksum, computed bit by bit.
const fn crc32_table() -> [u32; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = crc >> 1 ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// Corrects the checksums of directory and header, if they are at the positions in the header.
pub fn repair_header(bytes: &mut [u8]) {
    let at = number(bytes, 16, 8);
    if let Some(directory) = bytes.get(at..) {
        let crc = crc32(directory);
        if let Some(field) = bytes.get_mut(36..40) {
            field.copy_from_slice(&crc.to_le_bytes());
        }
    }
    if bytes.len() >= 48 {
        let crc = crc32(&bytes[..44]);
        bytes[44..48].copy_from_slice(&crc.to_le_bytes());
    }
}

/// Reads a complete trace as `replay validate` does.
///
/// # Errors
/// The first violated rule.
pub fn validate(trace: &Trace) -> formats::Result<()> {
    match trace {
        Trace::Texture(trace) => {
            let lists = trace.pass_lists()?;
            let mut tile = Tile::default();
            for (pass, info) in trace.tables().passes.iter().enumerate() {
                for index in 0..info.tile_count() as usize {
                    trace.decode_tile(pass, index, &mut tile)?;
                    if let Some(lists) = &lists {
                        trace.check_listed(pass, index, &tile, &lists[pass])?;
                    }
                }
            }
            let views = trace.geometry().map_or(0, |geometry| geometry.views.len());
            for view in 0..views {
                trace.tile_lists(view)?;
            }
        }
        Trace::Ray(trace) => {
            let mut tile = RayTile::default();
            for eye in [Eye::Left, Eye::Right] {
                for index in 0..trace.tables().tile_count() {
                    trace.decode_tile_with_geometry(eye, index, &mut tile)?;
                }
            }
            trace.read_hierarchy()?;
        }
    }
    Ok(())
}
