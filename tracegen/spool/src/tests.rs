use super::*;
use crate::Unit;
use std::io::Write as _;

/// A record without coordinates.
fn record(draw: u32) -> Unit {
    [1 << 16, draw, 0, 0]
}

#[test]
fn events_and_records_are_read_as_written_and_descriptions_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::create(folder.path()).unwrap();
    writer.reserve_records(100).unwrap();
    let spans = [&[record(1), record(2)][..], &[record(3)]].map(|r| writer.records(r).unwrap());
    for _ in 0..2 {
        let pass = || {
            Event::Pass(PassInfo {
                pass: 7,
                ..PassInfo::default()
            })
        };
        writer.describe("pass", 7, pass).unwrap();
    }
    writer
        .event(&Event::Frame {
            frame: 3,
            took_us: 9,
        })
        .unwrap();
    let [process] = &Process::all(folder.path()).unwrap()[..] else {
        panic!("one process");
    };
    let events = process.events().unwrap();
    let process_event =
        matches!(&events[0], Event::Process { pid, .. } if *pid == std::process::id());
    assert!(process_event && events.len() == 3, "{events:?}");
    assert_eq!(
        events[2],
        Event::Frame {
            frame: 3,
            took_us: 9,
        }
    );
    let mut reader = process.records().unwrap();
    let mut draws = Vec::new();
    for span in [spans[1], spans[0]] {
        reader.read(span, |record| draws.push(record.draw)).unwrap();
    }
    assert_eq!(draws, [3, 1, 2]);
    // Reserving again would overwrite records.
    writer.reserve_records(100).unwrap();
    reader
        .read(spans[0], |record| draws.push(record.draw))
        .unwrap();
    assert_eq!(draws, [3, 1, 2, 1, 2]);
    let beyond = Span {
        first: 1 << 12,
        count: 2,
    };
    let text = reader.read(beyond, drop).unwrap_err().to_string();
    assert!(text.contains("up to byte 65568, found 65536"), "{text}");
    // The header announces coordinates that do not follow.
    let span = writer.records(&[[1 << 20, 0, 0, 0]]).unwrap();
    let text = reader.read(span, drop).unwrap_err().to_string();
    assert!(text.contains("the middle of one"), "{text}");
}

#[test]
fn an_incomplete_last_line_is_ignored_and_an_invalid_line_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::create(folder.path()).unwrap();
    writer.event(&Event::Closed).unwrap();
    let [process] = &Process::all(folder.path()).unwrap()[..] else {
        panic!("one process");
    };
    let append = |bytes: &[u8]| {
        let mut file = std::fs::OpenOptions::new()
            .append(true)
            .open(&process.events)
            .unwrap();
        file.write_all(bytes).unwrap();
    };
    append(b"{\"event\":\"fra");
    assert_eq!(process.events().unwrap().last(), Some(&Event::Closed));
    append(b"\n");
    let text = process.events().unwrap_err().to_string();
    assert!(text.contains("line 3: expected an event"), "{text}");
}

#[test]
fn settings_are_read_as_written() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings {
        records: true,
        frames: [10, 13],
        frames_by: FramesBy::Present,
        occlusion: true,
        record_bytes: 1 << 20,
        pictures: false,
        modules: None,
    };
    settings.save(folder.path()).unwrap();
    assert_eq!(Settings::load(folder.path()).unwrap(), settings);
    let text = Settings::load(&folder.path().join("none")).unwrap_err();
    assert_eq!(text.kind(), std::io::ErrorKind::NotFound);
}
