use super::*;
use crate::error::FormatError;

const META: ChunkTag = ChunkTag(*b"META");
const DATA: ChunkTag = ChunkTag(*b"DATA");

fn sample() -> Vec<u8> {
    let mut writer = ContainerWriter::in_memory(Kind::Textrace).unwrap();
    writer.chunk(META, b"hello").unwrap();
    writer.begin_chunk(DATA).unwrap();
    writer.append(&[1, 2, 3]).unwrap();
    writer.append(&[4; 20]).unwrap();
    writer.into_bytes().unwrap()
}

fn read_all(bytes: Vec<u8>) -> Result<(), FormatError> {
    let container = Container::from_bytes(bytes)?;
    container.expect_kind(Kind::Textrace)?;
    container.chunk(META)?;
    container.chunk(DATA)?;
    Ok(())
}

/// Recomputes the header's CRC, as a malicious writer could.
fn resealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc32 = crc32fast::hash(&bytes[..44]);
    bytes[44..48].copy_from_slice(&crc32.to_le_bytes());
    bytes
}

/// Changes the directory and recomputes both CRCs.
fn with_directory(mut bytes: Vec<u8>, change: impl FnOnce(&mut [u8])) -> Vec<u8> {
    let start = bytes.len() - 2 * DIRECTORY_ENTRY_BYTES;
    change(&mut bytes[start..]);
    let crc32 = crc32fast::hash(&bytes[start..]);
    bytes[36..40].copy_from_slice(&crc32.to_le_bytes());
    resealed(bytes)
}

#[test]
fn chunks_are_read_as_written() {
    let container = Container::from_bytes(sample()).unwrap();
    assert_eq!(container.kind(), Kind::Textrace);
    assert_eq!(container.chunk(META).unwrap(), b"hello");
    assert_eq!(container.chunk(DATA).unwrap().len(), 23);
    assert_eq!(
        container.directory()[1].offset_bytes % CHUNK_ALIGNMENT_BYTES,
        0
    );
}

#[test]
fn every_truncation_is_refused() {
    let whole = sample();
    for length in 0..whole.len() {
        assert!(
            read_all(whole[..length].to_vec()).is_err(),
            "{length} bytes"
        );
    }
}

#[test]
fn every_flipped_bit_is_detected() {
    let whole = sample();
    for bit in 0..whole.len() * 8 {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(read_all(bytes).is_err(), "bit {bit}");
    }
}

#[test]
fn trailing_bytes_are_refused() {
    let mut bytes = sample();
    bytes.push(0);
    assert!(read_all(bytes).is_err());
}

#[test]
fn a_directory_count_beyond_the_file_is_refused_before_allocation() {
    let mut bytes = sample();
    bytes[32..36].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = Container::from_bytes(resealed(bytes)).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("header at byte 16"), "{text}");
    assert!(text.contains("4294967295 entries"), "{text}");
}

#[test]
fn a_directory_offset_past_the_end_is_refused() {
    let mut bytes = sample();
    bytes[16..24].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(Container::from_bytes(resealed(bytes)).is_err());
}

#[test]
fn overlapping_chunks_are_refused() {
    let bytes = with_directory(sample(), |directory| {
        let first = directory[8..16].to_vec();
        directory[32..40].copy_from_slice(&first);
    });
    let text = Container::from_bytes(bytes).unwrap_err().to_string();
    assert!(
        text.contains("expected chunk DATA at byte 56, found offset 48"),
        "{text}"
    );
}

#[test]
fn a_chunk_past_the_end_is_refused() {
    let bytes = with_directory(sample(), |directory| {
        directory[40..48].copy_from_slice(&u64::MAX.to_le_bytes());
    });
    let text = Container::from_bytes(bytes).unwrap_err().to_string();
    assert!(text.contains("chunk DATA of at most 24 bytes"), "{text}");
}

#[test]
fn a_duplicate_tag_is_refused() {
    let bytes = with_directory(sample(), |directory| {
        directory[24..28].copy_from_slice(b"META");
    });
    let text = Container::from_bytes(bytes).unwrap_err().to_string();
    assert!(text.contains("META twice"), "{text}");
    let mut writer = ContainerWriter::in_memory(Kind::Raytrace).unwrap();
    writer.chunk(META, b"").unwrap();
    assert!(writer.chunk(META, b"").is_err());
}

#[test]
fn a_later_major_version_is_named() {
    let mut bytes = sample();
    bytes[8] = 6;
    let text = Container::from_bytes(resealed(bytes))
        .unwrap_err()
        .to_string();
    assert_eq!(
        text,
        "memory: header at byte 8: expected a major version from 1 to 5, found 6"
    );
}

#[test]
fn a_later_minor_version_is_accepted() {
    let mut bytes = sample();
    bytes[10] = 7;
    let container = Container::from_bytes(resealed(bytes)).unwrap();
    assert_eq!(container.version(), (1, 7));
}

#[test]
fn the_error_for_another_file_type_shows_its_first_bytes() {
    let text = Container::from_bytes(b"\x89PNG\r\n\x1a\n0000".to_vec())
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("expected the magic PLXTRACE, found \"\\x89PNG"),
        "{text}"
    );
}

#[test]
fn an_unfinished_file_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.textrace");
    let mut writer = ContainerWriter::create(&path, Kind::Textrace).unwrap();
    writer.chunk(META, b"x").unwrap();
    drop(writer);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_file_has_the_same_bytes_as_a_trace_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.textrace");
    let mut writer = ContainerWriter::create(&path, Kind::Textrace).unwrap();
    writer.chunk(META, b"hello").unwrap();
    writer.begin_chunk(DATA).unwrap();
    writer.append(&[1, 2, 3]).unwrap();
    writer.append(&[4; 20]).unwrap();
    writer.finish().unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), sample());
    let container = Container::open(&path).unwrap();
    assert_eq!(container.file_checksum(), crc32fast::hash(&sample()));
}
