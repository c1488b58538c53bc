//! Where the code lengths come from: `TEXTRACES=a.textrace:b.textrace cargo test --release
//! -p formats --lib planes::train -- --ignored --nocapture` counts symbols in traces and prints
//! `lengths.rs` for them.
#![allow(
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    reason = "a test may panic"
)]

use super::codes::{CODES, Code, Codes, MOST_BITS};
use super::encode::{self, Sink};
use super::lengths::LENGTHS;
use super::places::ESCAPE_PLACE;
use super::residual::ESCAPE_SIZES;
use crate::textrace::{Textrace, Tile};
use std::path::Path;

/// Counts what an encoder would write.
struct Counts {
    by_code: Vec<Vec<u64>>,
    /// Bits by code: of its symbols and of the numbers after them.
    bits: Vec<[u64; 2]>,
    last: usize,
}

impl Counts {
    /// For codes of these lengths.
    fn new(texts: &[String]) -> Self {
        Self {
            by_code: texts.iter().map(|l| vec![0; l.len()]).collect(),
            bits: vec![[0; 2]; CODES],
            last: 0,
        }
    }

    fn add(&mut self, other: &Self) {
        let sums = self.by_code.iter_mut().flatten();
        sums.zip(other.by_code.iter().flatten())
            .for_each(|(sum, count)| *sum += count);
        let sums = self.bits.iter_mut().flatten();
        sums.zip(other.bits.iter().flatten())
            .for_each(|(sum, count)| *sum += count);
    }
}

impl Sink for Counts {
    fn bits(&mut self, _: u32, count: u32) {
        self.bits[self.last][1] += u64::from(count);
    }

    fn symbol(&mut self, code: &Code, symbol: u32, escape: u32) -> bool {
        self.last = code.number;
        self.by_code[code.number][symbol as usize] += 1;
        let length = code.length(symbol, code.length(escape, 0));
        self.bits[code.number][0] += u64::from(length);
        code.encode(symbol).is_some()
    }
}

/// Code lengths of at most [`MOST_BITS`] for symbols seen so often, by the package-merge method.
fn lengths(counts: &[u64]) -> Vec<u32> {
    let mut items: Vec<(u64, Vec<usize>)> = (0..counts.len())
        .filter(|symbol| counts[*symbol] > 0)
        .map(|symbol| (counts[symbol], vec![symbol]))
        .collect();
    items.sort();
    let mut lengths = vec![0; counts.len()];
    if let [(_, alone)] = &items[..] {
        lengths[alone[0]] = 1;
        return lengths;
    }
    let mut merged: Vec<(u64, Vec<usize>)> = Vec::new();
    for _ in 0..MOST_BITS {
        let mut all = items.clone();
        all.append(&mut merged);
        all.sort();
        merged = all
            .chunks_exact(2)
            .map(|two| (two[0].0 + two[1].0, [&two[0].1[..], &two[1].1].concat()))
            .collect();
    }
    for symbol in merged.iter().take(items.len() - 1).flat_map(|m| &m.1) {
        lengths[*symbol] += 1;
    }
    lengths
}

#[test]
#[ignore = "a tool: needs traces"]
fn train() {
    let paths = std::env::var("TEXTRACES").expect("TEXTRACES names traces");
    let every: usize = std::env::var("EVERY").map_or(7, |every| every.parse().unwrap());
    let traces: Vec<Textrace> = paths
        .split(':')
        .map(|path| Textrace::open(Path::new(path)).unwrap())
        .collect();
    let mut texts: Vec<String> = LENGTHS.iter().map(|l| (*l).to_owned()).collect();
    for _ in 0..4 {
        let codes = Codes::new(texts.as_slice().try_into().unwrap());
        let mut sums = vec![];
        for trace in &traces {
            let mut counts = Counts::new(&texts);
            let mut tile = Tile::default();
            let mut records = 0;
            for (pass, info) in trace.tables().passes.iter().enumerate() {
                for index in (0..info.tile_count() as usize).step_by(every) {
                    trace.decode_tile(pass, index, &mut tile).unwrap();
                    records += tile.records.len();
                    counts.last = CODES - 1;
                    let mut back = Counts::new(&texts);
                    encode::tile(&tile, &codes, &mut counts, &mut back);
                    counts.add(&back);
                }
            }
            let by_code: Vec<String> = counts
                .bits
                .iter()
                .map(|b| {
                    b.map(|b| format!("{:.2}", b as f64 / records as f64))
                        .join("+")
                })
                .collect();
            let bits: u64 = counts.bits.as_flattened().iter().sum();
            println!(
                "{records} records, {:.3} bytes each; {}",
                bits as f64 / 8.0 / records as f64,
                by_code.join(" ")
            );
            sums.push((counts.by_code, records));
        }
        texts = (0..CODES)
            .map(|code| {
                // Every trace weighs the same.
                let mut counts = vec![0u64; texts[code].len()];
                for (by_code, records) in &sums {
                    for (sum, count) in counts.iter_mut().zip(&by_code[code]) {
                        *sum += count * 100_000_000 / *records as u64;
                    }
                }
                let escape = match code {
                    0..17 => Some(ESCAPE_PLACE as usize),
                    17..41 => Some(ESCAPE_SIZES as usize),
                    _ => None,
                };
                let total: u64 = counts.iter().sum();
                if let Some(escape) = escape {
                    let rare = total >> MOST_BITS;
                    for symbol in (0..counts.len()).filter(|s| *s != escape) {
                        if counts[symbol] < rare {
                            counts[escape] += std::mem::take(&mut counts[symbol]);
                        }
                    }
                    counts[escape] = counts[escape].max(1);
                } else {
                    counts.iter_mut().for_each(|c| *c = (*c).max(1));
                }
                lengths(&counts).iter().map(|l| format!("{l:x}")).collect()
            })
            .collect();
    }
    for text in &texts {
        println!("    \"{text}\",");
    }
}
