use super::*;
use crate::inject::RawSample;
use std::io::Write as _;

fn record(draw: u32) -> RawSample {
    RawSample {
        draw,
        ..RawSample::default()
    }
}

#[test]
fn events_and_records_come_back_and_descriptions_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::create(folder.path()).unwrap();
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
    writer.event(&Event::Frame { frame: 3 }).unwrap();
    let [process] = &Process::all(folder.path()).unwrap()[..] else {
        panic!("one process");
    };
    let events = process.events().unwrap();
    let process_event =
        matches!(&events[0], Event::Process { pid, .. } if *pid == std::process::id());
    assert!(process_event && events.len() == 3, "{events:?}");
    assert_eq!(events[2], Event::Frame { frame: 3 });
    let mut reader = process.records().unwrap();
    let mut read = Vec::new();
    reader.read(spans[1], &mut read).unwrap();
    reader.read(spans[0], &mut read).unwrap();
    let draws: Vec<u32> = read.iter().map(|r| r.draw).collect();
    assert_eq!(draws, [3, 1, 2]);
    let beyond = Span { first: 2, count: 2 };
    let text = reader.read(beyond, &mut read).unwrap_err().to_string();
    assert!(text.contains("expected records 2 to 4"), "{text}");
}

#[test]
fn a_line_that_was_not_finished_is_left_out_and_one_that_is_no_event_refused() {
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
fn settings_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings {
        records: true,
        frames: [10, 13],
        frames_by: FramesBy::Present,
        occlusion: true,
        capacity: 1 << 20,
    };
    settings.save(folder.path()).unwrap();
    assert_eq!(Settings::load(folder.path()).unwrap(), settings);
    let text = Settings::load(&folder.path().join("none")).unwrap_err();
    assert_eq!(text.kind(), std::io::ErrorKind::NotFound);
}
