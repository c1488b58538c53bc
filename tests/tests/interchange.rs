//! `replay convert --to din` feeds other simulators: an independent reading of that text must
//! agree with what `replay run` counts on the same trace.

use parallax_tests::{program, root, run_ok};
use serde_json::Value;
use std::collections::{HashSet, VecDeque};

const LINE_BYTES: u64 = 16;

/// Addresses of a din text: `LABEL HEXADDR` a line, label 0 = read.
fn parse_din(text: &str) -> Vec<u64> {
    text.lines()
        .map(|line| {
            let (label, address) = line.split_once(' ').expect("two fields");
            assert_eq!(label, "0", "every access is a read");
            u64::from_str_radix(address, 16).expect("a hexadecimal address")
        })
        .collect()
}

fn convert(granularity: &str) -> Vec<u64> {
    let trace = root().join("traces/atrium-shadows.textrace");
    let output = run_ok(
        program("replay")
            .args([
                "convert",
                "--to",
                "din",
                "--granularity",
                granularity,
                "--order",
                "morton",
                "-o",
                "-",
            ])
            .arg(trace),
    );
    parse_din(&String::from_utf8(output.stdout).expect("din is text"))
}

fn run(options: &[&str]) -> Value {
    let trace = root().join("traces/atrium-shadows.textrace");
    let output = run_ok(
        program("replay")
            .arg("run")
            .arg(trace)
            .args(["--order", "morton", "--json"])
            .args(options),
    );
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// Misses of a set-associative LRU cache, the plainest way.
fn lru_misses(addresses: &[u64], size_bytes: u64, ways: usize) -> u64 {
    let sets = size_bytes / LINE_BYTES / ways as u64;
    let mut cache: Vec<VecDeque<u64>> = vec![VecDeque::new(); sets as usize];
    let mut misses = 0;
    for line in addresses.iter().map(|a| a / LINE_BYTES) {
        let set = &mut cache[(line % sets) as usize];
        if let Some(at) = set.iter().position(|&tag| tag == line) {
            set.remove(at);
        } else {
            misses += 1;
            set.truncate(ways - 1);
        }
        set.push_front(line);
    }
    misses
}

#[test]
fn din_accesses_and_distinct_lines_agree_with_run() {
    let addresses = convert("line");
    let result = &run(&["--mode", "functional"])["result"];
    assert_eq!(result["l1"]["line_lookups"], addresses.len() as u64);
    let distinct: HashSet<u64> = addresses.iter().map(|a| a / LINE_BYTES).collect();
    assert_eq!(result["unique_lines"], distinct.len() as u64);
}

#[test]
fn texel_addresses_touch_the_same_lines() {
    let by_line: HashSet<u64> = convert("line").iter().map(|a| a / LINE_BYTES).collect();
    let by_texel: HashSet<u64> = convert("texel").iter().map(|a| a / LINE_BYTES).collect();
    assert!(by_line == by_texel);
}

#[test]
fn a_plain_lru_cache_fed_with_din_misses_as_often_as_run() {
    let addresses = convert("line");
    for (l1_kib, ways) in [(8, 4_usize), (16, 4), (8, 1), (4, 8)] {
        let result = &run(&[
            "--mode",
            "functional",
            "--cores",
            "1",
            "--l1",
            &format!("{l1_kib}KiB"),
            "--l1-ways",
            &ways.to_string(),
        ])["result"];
        assert_eq!(
            result["l1"]["line_misses"],
            lru_misses(&addresses, l1_kib * 1024, ways),
            "{l1_kib} KiB, {ways} ways"
        );
    }
}
