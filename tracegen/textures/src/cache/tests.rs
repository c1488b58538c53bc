//! Tests of hits, damage, sharing and limits.

use super::*;
use formats::bounded_folder::ABANDONED;
use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::{Duration, SystemTime};

fn key(n: u8) -> Key {
    let mut hasher = KeyHasher::new("test");
    hasher.add(&[n]);
    hasher.finish()
}

fn blocks(n: u8, bytes: usize) -> Vec<u8> {
    (0..bytes).map(|i| n.wrapping_add(i as u8)).collect()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .map(|entries| entries.flatten().map(|e| e.path()).collect())
        .unwrap_or_default();
    files.sort();
    files
}

#[test]
fn stored_textures_are_loaded_by_another_cache_of_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a/b");
    for (n, format) in [(1, TexelFormat::Bc1), (2, TexelFormat::Bc3)] {
        Cache::new(path.clone(), 1 << 20).store(key(n), format, &blocks(n, 1000));
        let found = Cache::new(path.clone(), 1 << 20).load(key(n));
        assert_eq!(found, Some((format, blocks(n, 1000))));
    }
    assert_eq!(Cache::new(path, 1 << 20).load(key(3)), None);
}

#[test]
fn keys_differ_with_the_version_and_with_every_byte() {
    let key = |version: &str, bytes: &[u8]| {
        let mut hasher = KeyHasher::new(version);
        hasher.add(bytes);
        hasher.finish()
    };
    let first = key("1", b"abc");
    assert_ne!(first, key("2", b"abc"));
    assert_ne!(first, key("1", b"abd"));
    assert_eq!(first, key("1", b"abc"));
}

#[test]
fn a_damaged_or_truncated_file_counts_as_missing_and_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path().to_owned(), 1 << 20);
    let stored = blocks(7, 300);
    cache.store(key(1), TexelFormat::Bc1, &stored);
    let path = cache.path(key(1));
    let whole = fs::read(&path).unwrap();
    assert_eq!(whole.len(), HEADER_BYTES + 300);
    let mut bad: Vec<Vec<u8>> = (0..whole.len())
        .map(|at| {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            bytes
        })
        .collect();
    bad.extend((0..whole.len()).map(|length| whole[..length].to_vec()));
    bad.push([&whole[..], &[0]].concat());
    bad.push(vec![0; whole.len()]);
    // A length that exceeds any memory.
    let mut endless = whole.clone();
    endless[40..48].fill(0xff);
    bad.push(endless);
    for (number, bytes) in bad.into_iter().enumerate() {
        fs::write(&path, bytes).unwrap();
        assert_eq!(cache.load(key(1)), None, "damage {number}");
    }
    cache.store(key(1), TexelFormat::Bc1, &stored);
    assert_eq!(cache.load(key(1)), Some((TexelFormat::Bc1, stored)));
}

#[test]
fn a_valid_file_with_another_key_counts_as_missing() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path().to_owned(), 1 << 20);
    cache.store(key(1), TexelFormat::Bc1, &blocks(1, 64));
    fs::rename(cache.path(key(1)), cache.path(key(2))).unwrap();
    assert_eq!(cache.load(key(2)), None);
}

#[test]
fn concurrent_writers_and_readers_see_only_complete_textures() {
    let folder = tempfile::tempdir().unwrap();
    // The limit holds about six of the ten textures, so some are evicted.
    let limit = 6 * (HEADER_BYTES as u64 + 5000);
    std::thread::scope(|scope| {
        for thread in 0..8u8 {
            let cache = Cache::new(folder.path().to_owned(), limit);
            scope.spawn(move || {
                for round in 0..100u8 {
                    let n = round.wrapping_mul(3).wrapping_add(thread) % 10;
                    match cache.load(key(n)) {
                        Some((_, found)) => assert_eq!(found, blocks(n, 5000)),
                        None => cache.store(key(n), TexelFormat::Bc1, &blocks(n, 5000)),
                    }
                }
            });
        }
    });
    let left = files(folder.path());
    assert!(!left.is_empty());
    assert!(
        left.iter()
            .all(|f| f.extension().is_some_and(|e| e == EXTENSION)),
        "{left:?}"
    );
}

#[test]
fn the_least_recently_used_textures_are_evicted_at_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let file_bytes = HEADER_BYTES as u64 + 1000;
    let cache = Cache::new(folder.path().to_owned(), 8 * file_bytes);
    let long_ago = SystemTime::now() - Duration::from_secs(1_000_000);
    for n in 0..8 {
        cache.store(key(n), TexelFormat::Bc1, &blocks(n, 1000));
        let file = File::open(cache.path(key(n))).unwrap();
        file.set_modified(long_ago + Duration::from_secs(n.into()))
            .unwrap();
    }
    // Using the oldest texture makes the second oldest the next one to be evicted.
    assert!(cache.load(key(0)).is_some());
    cache.store(key(8), TexelFormat::Bc1, &blocks(8, 1000));
    let there: Vec<u8> = (0..9).filter(|&n| cache.path(key(n)).exists()).collect();
    // One is evicted for the new file and one more for the free eighth.
    assert_eq!(there, [0, 3, 4, 5, 6, 7, 8]);
    let too_large = blocks(9, 9000);
    cache.store(key(9), TexelFormat::Bc1, &too_large);
    assert_eq!(files(folder.path()).len(), 7);
}

#[test]
fn unfinished_files_of_killed_runs_are_removed_after_a_day() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (folder.path().join(".a.part"), folder.path().join(".b.part"));
    for path in [&old, &new] {
        fs::write(path, [0; 10]).unwrap();
    }
    let file = File::options().write(true).open(&old).unwrap();
    file.set_modified(SystemTime::now() - 2 * ABANDONED)
        .unwrap();
    Cache::new(folder.path().to_owned(), 1 << 20).store(key(1), TexelFormat::Bc1, &[0; 8]);
    assert!(!old.exists() && new.exists());
}

#[test]
fn a_folder_that_cannot_be_used_is_an_empty_cache() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"in the way").unwrap();
    let cache = Cache::new(file.join("textures"), 1 << 20);
    cache.store(key(1), TexelFormat::Bc1, &[1; 8]);
    assert_eq!(cache.load(key(1)), None);

    // Existing files of a read-only folder can still be used. (Root can also write to it.)
    let closed = folder.path().join("closed");
    let cache = Cache::new(closed.clone(), 1 << 20);
    cache.store(key(1), TexelFormat::Bc1, &[1; 8]);
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    cache.store(key(2), TexelFormat::Bc1, &[2; 8]);
    assert_eq!(cache.load(key(1)), Some((TexelFormat::Bc1, vec![1; 8])));
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o755)).unwrap();

    // A folder with the name of the file.
    fs::create_dir(cache.path(key(5))).unwrap();
    cache.store(key(5), TexelFormat::Bc1, &[5; 8]);
    assert_eq!(cache.load(key(5)), None);
}
