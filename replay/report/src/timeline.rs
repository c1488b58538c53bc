//! A replay over time, in the trace event format of Perfetto and Chrome's tracing page. One nanosecond
//! stands for one cycle.

use formats::textrace::{Pass, Tables};
use formats::view::Eye;
use frame::{CoreCycles, FrameTime};
use serde_json::{Map, Value, json};
use sim::result::{TileAt, Timeline, TimelineItem};

/// Process numbers of the two groups of tracks.
const CORES: u32 = 1;
const MEMORY: u32 = 2;

/// The whole file. A core's item ends when its next one starts, although threads of the item may still be
/// in flight.
///
/// # Errors
/// A number that JSON cannot hold.
pub fn json(timeline: &Timeline, tables: &Tables, line_bytes: u32) -> serde_json::Result<String> {
    let mut events = vec![
        name("process_name", CORES, 0, "cores"),
        name("process_name", MEMORY, 0, "memory"),
    ];
    let cores = timeline.items.iter().map(|item| item.core + 1).max();
    for core in 0..cores.unwrap_or(0) {
        events.push(name("thread_name", CORES, core, &format!("core {core}")));
    }
    for item in &timeline.items {
        events.push(slice(
            &titles(item.tiles.iter().copied(), &tables.passes),
            [CORES, item.core],
            [item.start_cycle, item.end_cycle],
            json!({
                "start_cycle": item.start_cycle,
                "end_cycle": item.end_cycle,
                "useful_cycles": item.useful_cycles,
                "wasted_cycles": item.wasted_cycles,
            }),
        ));
        events.push(counter(
            CORES,
            &format!("core {}: texture unit", item.core),
            item.start_cycle,
            json!({"useful %": utilization_pct(item)}),
        ));
    }
    for (interval, &lines) in (0..).zip(&timeline.fetched_lines) {
        let bytes = f64::from(lines) * f64::from(line_bytes);
        events.push(counter(
            MEMORY,
            "texture reads",
            interval * Timeline::INTERVAL_CYCLES,
            json!({"bytes per cycle": bytes / Timeline::INTERVAL_CYCLES as f64}),
        ));
    }
    file(&events)
}

/// The file of frame times, each a process with its name: the frames, the tiles that each slot of a core holds, and the
/// cycles of each core by cause, of which an interval has [`Timeline::INTERVAL_CYCLES`].
///
/// # Errors
/// A number that JSON cannot hold.
pub fn frames_json(times: &[(&str, &FrameTime)], passes: &[Pass]) -> serde_json::Result<String> {
    let mut events = Vec::new();
    for (process, (title, time)) in (1..).zip(times) {
        let Some(timeline) = &time.timeline else {
            continue;
        };
        events.push(name("process_name", process, 0, title));
        events.push(name("thread_name", process, 0, "frames"));
        let (slots, mut start) = (time.machine.tiles, 0);
        for (number, (cycles, _)) in time.frames.iter().enumerate() {
            let (track, span) = ([process, 0], [start, start + cycles]);
            events.push(slice(&format!("frame {number}"), track, span, json!({})));
            start += cycles;
        }
        for core in 0..time.machine.cores {
            for slot in 0..slots {
                let track = format!("core {core}, tile slot {slot}");
                let thread = 1 + core * slots + slot;
                events.push(name("thread_name", process, thread as u32, &track));
            }
        }
        for span in &timeline.spans {
            let tiles = span.tiles.iter().map(|of| TileAt {
                pass: of.pass,
                tile: of.tile,
            });
            let thread = 1 + span.core * slots + span.slot;
            let track = [process, thread as u32];
            events.push(slice(&titles(tiles, passes), track, span.cycles, json!({})));
        }
        for (core, causes) in timeline.causes.iter().enumerate() {
            let title = format!("core {core}: cycles of {}", Timeline::INTERVAL_CYCLES);
            // A cause without cycles has no track.
            let is_used = |at: &usize| causes.iter().any(|of| of[*at] > 0);
            let used: Vec<usize> = (0..CoreCycles::NAMES.len()).filter(is_used).collect();
            for (interval, of) in (0..).zip(causes) {
                let value = |&at: &usize| (CoreCycles::NAMES[at].to_owned(), of[at].into());
                let values: Map<String, Value> = used.iter().map(value).collect();
                let cycle = interval * Timeline::INTERVAL_CYCLES;
                events.push(counter(process, &title, cycle, values.into()));
            }
        }
    }
    file(&events)
}

fn file(events: &[Value]) -> serde_json::Result<String> {
    let events: Vec<String> = (events.iter())
        .map(serde_json::to_string)
        .collect::<Result<_, _>>()?;
    Ok(format!(
        "{{\"displayTimeUnit\":\"ns\",\"traceEvents\":[\n{}\n]}}\n",
        events.join(",\n")
    ))
}

/// Timestamps are microseconds.
fn microseconds(cycles: u64) -> f64 {
    cycles as f64 / 1000.0
}

fn name(kind: &str, process: u32, thread: u32, name: &str) -> Value {
    json!({"ph": "M", "name": kind, "pid": process, "tid": thread, "args": {"name": name}})
}

fn counter(process: u32, name: &str, cycle: u64, series: Value) -> Value {
    json!({"ph": "C", "name": name, "pid": process, "ts": microseconds(cycle), "args": series})
}

fn utilization_pct(item: &TimelineItem) -> f64 {
    let cycles = item.end_cycle - item.start_cycle;
    if cycles == 0 {
        return 0.0;
    }
    100.0 * item.useful_cycles as f64 / cycles as f64
}

fn slice(name: &str, [process, thread]: [u32; 2], [start, end]: [u64; 2], args: Value) -> Value {
    json!({
        "ph": "X",
        "name": name,
        "pid": process,
        "tid": thread,
        "ts": microseconds(start),
        "dur": microseconds(end - start),
        "args": args,
    })
}

fn titles(tiles: impl Iterator<Item = TileAt>, passes: &[Pass]) -> String {
    let titles: Vec<String> = tiles.map(|at| title(at, passes)).collect();
    titles.join(" + ")
}

/// `frame 0 left 3,4`: frame, eye, column and row.
fn title(at: TileAt, passes: &[Pass]) -> String {
    let Some(pass) = passes.get(at.pass as usize) else {
        return format!("pass {} tile {}", at.pass, at.tile);
    };
    let eye = match pass.eye {
        Some(Eye::Left) => "left",
        Some(Eye::Right) => "right",
        None => "both",
    };
    let columns = pass.tiles[0].max(1);
    format!(
        "frame {} {eye} {},{}",
        pass.frame,
        at.tile % columns,
        at.tile / columns
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::stream::testing;

    #[test]
    fn items_become_slices_and_lines_become_bytes_per_cycle() {
        let mut tables = testing::tables(&[[4, 4]]);
        tables.passes[0].tiles = [4, 2];
        let item = |core, start_cycle, end_cycle, tile| TimelineItem {
            core,
            start_cycle,
            end_cycle,
            useful_cycles: (end_cycle - start_cycle) / 2,
            wasted_cycles: 3,
            tiles: vec![TileAt { pass: 0, tile }],
        };
        let timeline = Timeline {
            items: vec![item(0, 0, 1000, 5), item(1, 10, 10, 6)],
            fetched_lines: vec![64, 0, 128],
            l2_changes: Vec::new(),
        };
        let text = json(&timeline, &tables, 16).unwrap();
        let found: Value = serde_json::from_str(&text).unwrap();
        let events = found["traceEvents"].as_array().unwrap();
        let of = |kind: &str| {
            events
                .iter()
                .filter(|e| e["ph"] == kind)
                .collect::<Vec<_>>()
        };
        assert_eq!(of("M").len(), 4);
        let slices = of("X");
        assert_eq!(slices.len(), 2);
        assert_eq!(
            (&slices[0]["ts"], &slices[0]["dur"]),
            (&json!(0.0), &json!(1.0))
        );
        assert_eq!(slices[0]["name"], "frame 0 left 1,1");
        let counters = of("C");
        assert_eq!(counters.len(), 5);
        assert_eq!(counters[0]["args"]["useful %"], 50.0);
        let rates: Vec<f64> = (counters.iter())
            .filter_map(|c| c["args"]["bytes per cycle"].as_f64())
            .collect();
        assert_eq!(rates, [1.0, 0.0, 2.0]);
    }
}
