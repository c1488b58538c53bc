//! A cache of prepared textures between runs: a folder with one file per texture.
//!
//! The name of a file is its key: an XXH3-128 hash of everything that determines its bytes. A fast hash is
//! sufficient, because the folder belongs to the user and accidental collisions of 128 bits do not occur.
//! Each file contains its key and a checksum of its content. A damaged or misplaced file counts as missing
//! and is replaced.
//!
//! Files are written under a temporary name, renamed, and never changed, so any number of processes can share
//! the folder without a lock. Reading a file sets its modification time. When a new file exceeds the size
//! limit, the least recently used files are removed until an eighth of the limit is free.
//!
//! The cache has no errors: a folder that cannot be read or written is treated as empty.

use formats::container::{AtomicFile, open_regular};
use formats::texture::TexelFormat;
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime};
use xxhash_rust::xxh3::Xxh3;

const MAGIC: [u8; 8] = *b"PLXTEX\x00\x01";
/// Magic number, key, checksum, length of the blocks, format.
const HEADER_BYTES: usize = 8 + 16 + 16 + 8 + 4;
const EXTENSION: &str = "texture";
/// Age after which an unfinished file counts as left behind by a killed run.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

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
pub struct Cache {
    folder: PathBuf,
    limit_bytes: u64,
    /// Size of the folder's files in bytes as far as this process knows; `None` before the first check.
    used_bytes: Mutex<Option<u64>>,
}

impl Cache {
    /// A cache of at most `limit_bytes` bytes in `folder`, which is created with the first file.
    pub fn new(folder: PathBuf, limit_bytes: u64) -> Self {
        Self {
            folder,
            limit_bytes,
            used_bytes: Mutex::new(None),
        }
    }

    fn path(&self, key: Key) -> PathBuf {
        self.folder.join(format!("{:032x}.{EXTENSION}", key.0))
    }

    /// Format and blocks of a texture, if the cache has a valid file with this key.
    pub(crate) fn load(&self, key: Key) -> Option<(TexelFormat, Vec<u8>)> {
        let mut file = open_regular(&self.path(key)).ok()?;
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
        // Only eviction uses this time, so a failure has no effect here.
        let _ = file.set_modified(SystemTime::now());
        Some((format, blocks))
    }

    /// Stores a texture. A failure is ignored.
    pub(crate) fn store(&self, key: Key, format: TexelFormat, blocks: &[u8]) {
        let Some(header) = header(key, format, blocks) else {
            return;
        };
        let bytes = (HEADER_BYTES + blocks.len()) as u64;
        if bytes > self.limit_bytes || fs::create_dir_all(&self.folder).is_err() {
            return;
        }
        let mut used = self
            .used_bytes
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if used.is_none_or(|used| used + bytes > self.limit_bytes) {
            *used = Some(self.make_room(bytes));
        }
        if write(&self.path(key), &header, blocks).is_ok() {
            *used = used.map(|used| used + bytes);
        }
    }

    /// If `needed_bytes` more would exceed the limit, removes the least recently used files until an eighth
    /// of the limit is also free. Returns the size of the remaining files.
    fn make_room(&self, needed_bytes: u64) -> u64 {
        let now = SystemTime::now();
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let Ok(metadata) = entry.metadata() else {
                continue;
            };
            let modified = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let path = entry.path();
            if path.extension().is_some_and(|e| e == EXTENSION) && metadata.is_file() {
                files.push((modified, path, metadata.len()));
            } else if path.extension().is_some_and(|e| e == "part")
                && now
                    .duration_since(modified)
                    .is_ok_and(|age| age > ABANDONED)
            {
                let _ = fs::remove_file(path);
            }
        }
        let mut used: u64 = files.iter().map(|(.., bytes)| bytes).sum();
        if used + needed_bytes <= self.limit_bytes {
            return used;
        }
        files.sort();
        let allowed = (self.limit_bytes - self.limit_bytes / 8).saturating_sub(needed_bytes);
        for (_, path, bytes) in files {
            if used <= allowed {
                break;
            }
            if fs::remove_file(path).is_ok() {
                used -= bytes;
            }
        }
        used
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

fn write(path: &Path, header: &[u8], blocks: &[u8]) -> std::io::Result<()> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(header)?;
    file.write_all(blocks)?;
    file.persist()
}

#[cfg(test)]
mod tests;
