use super::*;
use crate::FormatError;
use proptest::prelude::*;
use std::io::{self, Read, Write};

fn written(form: PlainForm, accesses: &[PlainAccess]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = PlainWriter::new(form, &mut bytes).unwrap();
    for access in accesses {
        writer.access(access).unwrap();
    }
    bytes
}

fn compressed(compression: Compression, bytes: &[u8]) -> Vec<u8> {
    let mut writer = CompressedWriter::new(Some(compression), Vec::new());
    writer.write_all(bytes).unwrap();
    writer.finish().unwrap()
}

/// Returns one more byte at every read, so that reads end at many different positions.
struct Trickle<'a>(&'a [u8], usize);

impl Read for Trickle<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        self.1 += 1;
        let count = self.1.min(out.len()).min(self.0.len());
        let (now, rest) = self.0.split_at(count);
        out[..count].copy_from_slice(now);
        self.0 = rest;
        Ok(count)
    }
}

fn read(bytes: &[u8], form: Option<AddressForm>) -> Result<(Vec<PlainAccess>, Found), FormatError> {
    let mut all = Vec::new();
    let file = AddressFile::of_stream("x".to_owned(), form, Trickle(bytes, 0))?;
    let found = file.for_blocks::<FormatError>(|block| {
        match block {
            Block::U32(words) => all.extend(
                words
                    .iter()
                    .map(|w| PlainAccess::read(u32::from_le_bytes(*w).into(), 1)),
            ),
            Block::U64(words) => {
                all.extend(
                    words
                        .iter()
                        .map(|w| PlainAccess::read(u64::from_le_bytes(*w), 1)),
                );
            }
            Block::Accesses(accesses) => all.extend_from_slice(accesses),
        }
        Ok(())
    })?;
    Ok((all, found))
}

fn refused(bytes: &[u8], form: Option<AddressForm>) -> String {
    let error = read(bytes, form).unwrap_err();
    let cause = std::error::Error::source(&error).map_or(String::new(), |c| format!(": {c}"));
    format!("{error}{cause}")
}

fn accesses() -> Vec<PlainAccess> {
    let kinds = [AccessKind::Read, AccessKind::Write, AccessKind::Fetch];
    let access = |i: u64| PlainAccess {
        address: i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (i % 40),
        bytes: 1 + (i % 70) as u32,
        kind: kinds[(i % 3) as usize],
    };
    (0..10_000).map(access).collect()
}

#[test]
fn every_form_is_read_as_written() {
    let all = accesses();
    let fits = |a: &&PlainAccess| a.address < 1 << 32;
    let words32: Vec<_> = all
        .iter()
        .filter(fits)
        .map(|a| PlainAccess::read(a.address, 1))
        .collect();
    let words64: Vec<_> = all
        .iter()
        .map(|a| PlainAccess::read(a.address, 1))
        .collect();
    let without_size: Vec<_> = all.iter().map(|a| PlainAccess { bytes: 1, ..*a }).collect();
    for (written_as, form, held) in [
        (PlainForm::U32, AddressForm::U32, &words32),
        (PlainForm::U64, AddressForm::U64, &words64),
        (PlainForm::Din, AddressForm::Din, &without_size),
        (PlainForm::Gem5, AddressForm::Gem5, &all),
    ] {
        let source: Vec<_> = match form {
            AddressForm::U32 => words32.clone(),
            _ => all.clone(),
        };
        let bytes = written(written_as, &source);
        let (back, found) = read(&bytes, Some(form)).unwrap();
        assert!(back == *held, "{form:?}");
        assert_eq!(found.accesses, held.len() as u64);
        for compression in Compression::ALL {
            let packed = compressed(compression, &bytes);
            assert!(packed != bytes);
            assert!(
                read(&packed, Some(form)).unwrap().0 == *held,
                "{form:?} {compression:?}"
            );
            // Some tools write several consecutive members or frames.
            let (first, second) = (
                written(written_as, &source[..7]),
                written(written_as, &source),
            );
            if form != AddressForm::Gem5 {
                let twice = [
                    compressed(compression, &first),
                    compressed(compression, &second),
                ]
                .concat();
                assert_eq!(read(&twice, Some(form)).unwrap().0.len(), held.len() + 7);
            }
        }
    }
}

#[test]
fn many_frames_are_read_as_written() {
    let bytes: Vec<u8> = (0..3_000_000_u32).flat_map(u32::to_le_bytes).collect();
    let (back, _) = read(
        &compressed(Compression::Zstd, &bytes),
        Some(AddressForm::U32),
    )
    .unwrap();
    assert!(back.iter().map(|a| a.address).eq(0..3_000_000));
}

#[test]
fn forms_are_detected_by_name_and_content() {
    let detect_form = |name: &str, bytes: &[u8]| {
        AddressFile::of_stream(name.to_owned(), None, bytes).map(|file| file.form())
    };
    let gem5 = written(PlainForm::Gem5, &accesses());
    let din = written(PlainForm::Din, &accesses());
    assert_eq!(detect_form("a", &gem5).unwrap(), AddressForm::Gem5);
    assert_eq!(detect_form("a", &din).unwrap(), AddressForm::Din);
    assert_eq!(detect_form("a", b"r 7f00 8").unwrap(), AddressForm::Din);
    assert_eq!(detect_form("a.u64", &din).unwrap(), AddressForm::U64);
    assert_eq!(detect_form("a.u32.zst", &din).unwrap(), AddressForm::U32);
    assert_eq!(
        detect_form("a.gz", &compressed(Compression::Gzip, &gem5)).unwrap(),
        AddressForm::Gem5
    );
    let words = written(PlainForm::U32, &[PlainAccess::read(7, 1)]);
    let error = detect_form("a.bin", &words).unwrap_err().to_string();
    assert!(error.contains("--address-form"), "{error}");
    assert!(
        detect_form("a", b"")
            .unwrap_err()
            .to_string()
            .contains("found nothing")
    );
}

#[test]
fn extended_din_has_sizes_and_comments_are_ignored() {
    let (all, _) = read(b"r 0x10 4\n W 1F 0x20 x\n\t0 20 comment\r\n2\t30\r\n", None).unwrap();
    let access = |address, bytes, kind| PlainAccess {
        address,
        bytes,
        kind,
    };
    assert_eq!(
        all,
        [
            access(0x10, 4, AccessKind::Read),
            access(0x1f, 0x20, AccessKind::Write),
            access(0x20, 1, AccessKind::Read),
            access(0x30, 1, AccessKind::Fetch),
        ]
    );
}

#[test]
fn wrong_din_lines_are_named() {
    for line in [
        "0",
        "0 xyz",
        "3 10",
        "7",
        "r 10",
        "r 10 x",
        "0 10000000000000000",
        "x 10",
        "0 0x",
        "w ffffffffffffffff 2",
        "r 0 100001",
    ] {
        let text = format!("0 1f\n{line}\n0 20\n");
        let error = refused(text.as_bytes(), Some(AddressForm::Din));
        let expected = "x: line 2 at byte 5: expected a label (0 read, 1 write, 2 fetch)";
        assert!(error.starts_with(expected), "{line:?}: {error}");
        assert!(error.contains(&format!("found {line:?}")), "{error}");
    }
    let endless = [b"0 1\n".as_slice(), &vec![b' '; 3 << 20]].concat();
    let error = refused(&endless, Some(AddressForm::Din));
    assert!(error.contains("line 2") && error.len() < 300, "{error}");
}

#[test]
fn din_is_read_with_any_line_ends_blank_lines_and_a_byte_order_mark() {
    let plain = "0 1000\n1 1040\nr 10 4 x\n0 1000\n";
    let expected = read(plain.as_bytes(), None).unwrap();
    assert_eq!(expected.0.len(), 4);
    for text in [
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\r"),
        plain.replace('\n', "\n\r"),
        plain.replace('\n', "\n \t\n\n"),
        format!("\r\n\n{plain}\n \n"),
        format!("\u{feff}{plain}"),
        format!("\u{feff}\n{}", plain.trim_end()),
    ] {
        for form in [None, Some(AddressForm::Din)] {
            assert_eq!(read(text.as_bytes(), form).unwrap(), expected, "{text:?}");
        }
    }
    let error = refused(b"0 1\r\n\r\n\n0 x\r\n", Some(AddressForm::Din));
    assert!(error.starts_with("x: line 4 at byte 8: "), "{error}");
    let error = refused(b"0 1\r\r0 x\r", Some(AddressForm::Din));
    assert!(error.starts_with("x: line 3 at byte 5: "), "{error}");
    let error = refused(b"\n \r\n", Some(AddressForm::Din));
    assert!(error.contains("at least one access"), "{error}");
}

#[test]
fn gzip_may_be_padded_with_zeros_and_other_compressions_are_named() {
    let text = b"0 1000\n1 1040\n";
    let expected = read(text, None).unwrap();
    let packed = compressed(Compression::Gzip, text);
    for padding in [1, 7, 512, 70_000] {
        let padded = [packed.as_slice(), &vec![0; padding]].concat();
        assert_eq!(read(&padded, None).unwrap(), expected, "{padding}");
        let followed = [padded.as_slice(), &packed].concat();
        let error = refused(&followed, None);
        assert!(error.contains("other than zero"), "{error}");
    }
    for (head, name) in [
        (&b"\xfd7zXZ\0\0\x04"[..], "xz"),
        (b"BZh91AY&SY", "bzip2"),
        (b"\x04\x22\x4d\x18\x64", "LZ4"),
        (b"PK\x03\x04\x14", "ZIP"),
    ] {
        let error = refused(head, None);
        let unpacking = error.contains("unpack with `") && error.contains("gzip or Zstandard");
        assert!(
            unpacking && error.ends_with(&format!("found {name}")),
            "{error}"
        );
        let words = [head, &[0; 16]].concat();
        assert!(read(&words[..8], Some(AddressForm::U64)).is_ok(), "{name}");
    }
}

#[test]
fn incomplete_words_are_refused_with_their_place() {
    let error = refused(&[0; 11], Some(AddressForm::U32));
    assert_eq!(error, "x: access 3 at byte 8: expected 4 bytes, found 3");
    let error = refused(&[0; 9], Some(AddressForm::U64));
    assert_eq!(error, "x: access 2 at byte 8: expected 8 bytes, found 1");
    let error = refused(&[], Some(AddressForm::U64));
    assert_eq!(
        error,
        "x: contents at byte 0: expected at least one access, found none"
    );
}

/// A gem5 trace with a header and these messages.
fn gem5_of(messages: &[&[u8]]) -> Vec<u8> {
    let mut bytes = b"gem5\x04\x0a\x00\x18\x01".to_vec();
    for message in messages {
        bytes.push(message.len() as u8);
        bytes.extend_from_slice(message);
    }
    bytes
}

#[test]
fn gem5_commands_and_flags_determine_the_kind() {
    let kind = |command: u8, flags: &[u8]| {
        let mut message = vec![0x08, 5, 0x10, command, 0x18, 0x80, 0x01, 0x20, 64];
        message.extend_from_slice(flags);
        // Start with a read, because a file without accesses is an error.
        let read_first = [0x08, 1, 0x10, 1, 0x18, 0, 0x20, 4];
        let (all, found) = read(&gem5_of(&[&read_first, &message]), None).unwrap();
        assert_eq!(found.accesses + found.other_packets, 2);
        all.get(1).map(|access| {
            assert_eq!((access.address, access.bytes), (128, 64));
            access.kind
        })
    };
    for command in [1, 13, 25, 26] {
        assert_eq!(kind(command, &[]), Some(AccessKind::Read));
        assert_eq!(kind(command, &[0x28, 0x80, 0x02]), Some(AccessKind::Fetch));
        assert_eq!(kind(command, &[0x28, 0x80, 0x08]), None, "uncacheable");
    }
    for command in [4, 7, 16, 34] {
        assert_eq!(kind(command, &[]), Some(AccessKind::Write));
    }
    for command in [0, 2, 5, 10, 17, 38] {
        assert_eq!(kind(command, &[]), None, "command {command}");
    }
    // Unknown fields of every wire type are skipped.
    let others = [
        &[0x31, 0, 0, 0, 0, 0, 0, 0, 0][..],
        &[0x3a, 2, 9, 9],
        &[0x3d, 0, 0, 0, 0],
    ]
    .concat();
    assert_eq!(kind(1, &others), Some(AccessKind::Read));
}

#[test]
fn damaged_gem5_traces_are_refused_without_large_buffers() {
    let packet: &[u8] = &[0x08, 1, 0x10, 1, 0x18, 0, 0x20, 4];
    let whole = gem5_of(&[packet, packet]);
    assert_eq!(read(&whole, None).unwrap().0.len(), 2);
    for end in 1..whole.len() {
        let cut = &whole[..end];
        if end == gem5_of(&[packet]).len() {
            continue;
        }
        let error = refused(cut, Some(AddressForm::Gem5));
        assert!(error.contains("expected"), "{end}: {error}");
    }
    let refused_packet = |message: &[u8], expected: &str| {
        let error = refused(&gem5_of(&[packet, message]), None);
        let place = "x: packet 2 at byte 18: ";
        assert!(
            error.starts_with(place) && error.contains(expected),
            "{error}"
        );
    };
    refused_packet(&[0x08, 1, 0x10, 1, 0x20, 4], "no addr");
    refused_packet(&[0x08, 1], "no cmd, no addr, no size");
    refused_packet(&[0x0b, 1], "the fields of a packet");
    refused_packet(
        &[
            0x0a, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1,
        ],
        "the fields",
    );
    refused_packet(
        &[0x08, 1, 0x10, 1, 0x18, 0, 0x20, 0x81, 0x80, 0x40],
        "at most 1 MiB",
    );
    let last = [&[0x18][..], &[0xff; 9], &[1]].concat();
    let over = [&[0x08, 1, 0x10, 1, 0x20, 2], last.as_slice()].concat();
    refused_packet(&over, "below 2^64");
    // A length of 2^63, and one without an end.
    for length in [
        [0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 1],
        [0xff; 10],
    ] {
        let error = refused(&[gem5_of(&[packet]).as_slice(), &length].concat(), None);
        assert!(
            error.starts_with("x: packet 2 at byte 18: expected"),
            "{error}"
        );
    }
    let only_responses = gem5_of(&[&[0x08, 1, 0x10, 2, 0x18, 0, 0x20, 4]]);
    assert!(refused(&only_responses, None).contains("none among 1 packets"));
}

#[test]
fn cut_or_damaged_compression_is_refused() {
    let bytes = written(PlainForm::U64, &accesses());
    for compression in Compression::ALL {
        let packed = compressed(compression, &bytes);
        for end in [5, 12, packed.len() / 2, packed.len() - 1] {
            let error = refused(&packed[..end], Some(AddressForm::U64));
            let expected = format!("x: cannot decompress ({}): after ", compression.name());
            assert!(error.starts_with(&expected), "{end}: {error}");
            assert!(
                error.ends_with(" bytes of content: expected more, found the end"),
                "{end}: {error}"
            );
        }
        let head = refused(&packed[..5], Some(AddressForm::U64));
        assert!(head.contains("after 0 bytes"), "{head}");
        let mut wrong = packed.clone();
        let last = wrong.len() - 1;
        wrong[last] ^= 1;
        assert!(refused(&wrong, Some(AddressForm::U64)).contains("cannot decompress"));
        let noise = [packed.as_slice(), b"noise"].concat();
        let error = refused(&noise, Some(AddressForm::U64));
        let expected = format!(": after {} bytes of content: ", bytes.len());
        assert!(error.contains(&expected), "{error}");
        assert!(!error.contains("BadMagicNumber"), "{error}");
    }
}

#[test]
fn a_skipped_frame_is_skipped() {
    let frame = compressed(Compression::Zstd, &[7; 4000]);
    let skipped = [&[0x53, 0x2a, 0x4d, 0x18, 3, 0, 0, 0, 1, 2, 3][..], &frame].concat();
    assert_eq!(
        read(&skipped, Some(AddressForm::U32)).unwrap().0.len(),
        1000
    );
    assert!(
        refused(&skipped[..9], Some(AddressForm::U32)).contains("expected more, found the end")
    );
}

#[test]
fn addresses_that_a_form_cannot_hold_are_refused() {
    let mut writer = PlainWriter::new(PlainForm::U32, Vec::new()).unwrap();
    let error = writer.access(&PlainAccess::read(1 << 32, 1)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "u32: expected addresses below 2^32, found 0x100000000; u64 holds it"
    );
    let mut writer = PlainWriter::new(PlainForm::Champsim, Vec::new()).unwrap();
    assert!(writer.access(&PlainAccess::read(u64::MAX, 1)).is_err());
}

#[test]
fn forms_of_other_simulators_match_their_documentation() {
    let access = PlainAccess::read(0x1f40, 16);
    let write = PlainAccess {
        kind: AccessKind::Write,
        ..access
    };
    let text = |form| String::from_utf8(written(form, &[access, write])).unwrap();
    assert_eq!(text(PlainForm::Din), "0 1f40\n1 1f40\n");
    assert_eq!(text(PlainForm::Ramulator), "LD 0x1f40\nST 0x1f40\n");
    assert_eq!(text(PlainForm::RamulatorO3), "0 8000\n0 8000 8000\n");
    let records = written(PlainForm::Champsim, &[access, write]);
    assert_eq!(records.len(), 128);
    let word = |at: usize| u64::from_le_bytes(records[at..at + 8].try_into().unwrap());
    assert_eq!((word(16), word(32)), (0, CHAMPSIM_BASE + 0x1f40));
    assert_eq!((word(64 + 16), word(64 + 32)), (CHAMPSIM_BASE + 0x1f40, 0));
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic_a_reader(bytes in proptest::collection::vec(any::<u8>(), 0..300), form in 0..4_usize) {
        let form = AddressForm::ALL[form];
        let _ = read(&bytes, Some(form));
        let _ = read(&[b"gem5".as_slice(), &bytes].concat(), Some(form));
        for compression in Compression::ALL {
            let _ = read(&compressed(compression, &bytes), Some(form));
        }
        let _ = read(&[&[0x28, 0xb5, 0x2f, 0xfd][..], &bytes].concat(), Some(form));
        let _ = read(&[&[0x1f, 0x8b, 8][..], &bytes].concat(), Some(form));
    }
}
