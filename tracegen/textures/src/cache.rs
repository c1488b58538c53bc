//! A cache of prepared textures between runs: a folder with one file per texture.
//!
//! The name of a file is its key: an XXH3-128 hash of everything that determines its bytes. A fast hash is
//! sufficient, because the folder belongs to the user and accidental collisions of 128 bits do not occur.
//! Each file contains its key and a checksum of its content. A damaged or misplaced file counts as missing
//! and is replaced.
//!
//! [`BoundedFolder`] bounds the folder and lets processes share it.

use formats::bounded_folder::BoundedFolder;
use formats::texture::TexelFormat;
use std::io::{Read, Write};
use std::path::PathBuf;
use xxhash_rust::xxh3::Xxh3;

const MAGIC: [u8; 8] = *b"PLXTEX\x00\x01";
/// Magic number, key, checksum, length of the blocks, format.
const HEADER_BYTES: usize = 8 + 16 + 16 + 8 + 4;
const EXTENSION: &str = "texture";

/// Key of a prepared texture: a hash of everything that determines its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key(u128);

/// Hashes what determines a texture's bytes.
#[derive(Clone)]
pub(crate) struct KeyHasher(Xxh3);

impl KeyHasher {
    /// Starts with the properties that all keys depend on.
    pub fn new(version: &str) -> Self {
        let mut hasher = Self(Xxh3::new());
        hasher.add(&MAGIC);
        hasher.add(version.as_bytes());
        hasher
    }

    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    pub fn finish(&self) -> Key {
        Key(self.0.digest128())
    }
}

/// A cache of prepared textures in a folder.
#[derive(Debug)]
pub struct Cache(BoundedFolder);

impl Cache {
    /// A cache of at most `limit_bytes` bytes in `folder`, which is created with the first file.
    pub fn new(folder: PathBuf, limit_bytes: u64) -> Self {
        Self(BoundedFolder::new(folder, EXTENSION, limit_bytes))
    }

    #[cfg(test)]
    fn path(&self, key: Key) -> PathBuf {
        self.0.path(key.0)
    }

    /// Format and blocks of a texture, if the cache has a valid file with this key.
    pub(crate) fn load(&self, key: Key) -> Option<(TexelFormat, Vec<u8>)> {
        let mut file = self.0.open(key.0)?;
        let metadata = file.metadata().ok()?;
        let mut header = [0; HEADER_BYTES];
        file.read_exact(&mut header).ok()?;
        let length = u64::from_le_bytes(header[40..48].try_into().ok()?);
        // Check before allocation that the length is that of the file.
        if !metadata.is_file() || length.checked_add(HEADER_BYTES as u64)? != metadata.len() {
            return None;
        }
        let mut blocks = vec![0; usize::try_from(length).ok()?];
        file.read_exact(&mut blocks).ok()?;
        let format = match header[48..] {
            [1, 0, 0, 0] => TexelFormat::Bc1,
            [3, 0, 0, 0] => TexelFormat::Bc3,
            _ => return None,
        };
        if header != self::header(key, format, &blocks)? {
            return None;
        }
        BoundedFolder::mark_used(&file);
        Some((format, blocks))
    }

    /// Stores a texture. A failure is ignored.
    pub(crate) fn store(&self, key: Key, format: TexelFormat, blocks: &[u8]) {
        let Some(header) = header(key, format, blocks) else {
            return;
        };
        let bytes = (HEADER_BYTES + blocks.len()) as u64;
        self.0.store(key.0, bytes, |file| {
            file.write_all(&header)?;
            file.write_all(blocks)
        });
    }
}

/// The header of a file with these blocks; `None` for a format that is not cached.
fn header(key: Key, format: TexelFormat, blocks: &[u8]) -> Option<[u8; HEADER_BYTES]> {
    let format: u32 = match format {
        TexelFormat::Bc1 => 1,
        TexelFormat::Bc3 => 3,
        _ => return None,
    };
    let mut header = [0; HEADER_BYTES];
    header[..8].copy_from_slice(&MAGIC);
    header[8..24].copy_from_slice(&key.0.to_le_bytes());
    header[40..48].copy_from_slice(&(blocks.len() as u64).to_le_bytes());
    header[48..].copy_from_slice(&format.to_le_bytes());
    // The checksum covers the header, with zeros in place of the checksum, and the blocks.
    let mut hasher = Xxh3::new();
    hasher.update(&header);
    hasher.update(blocks);
    header[24..40].copy_from_slice(&hasher.digest128().to_le_bytes());
    Some(header)
}

#[cfg(test)]
mod tests;
