//! Computes the code lengths.
//! `TEXTRACES=a.textrace:b.textrace cargo test --release -p formats --lib planes::tests::train -- --ignored --nocapture`
//! counts symbols in traces and prints `lengths.rs` for them, and the bits of a record by purpose. It
//! repeats this `ROUNDS` times and uses every `EVERY`th tile.
#![allow(
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    reason = "a test may panic"
)]

use super::super::codes::{CODES, Code, Codes, MOST_BITS};
use super::super::encode::{self, Sink};
use super::super::lengths::LENGTHS;
use super::super::places::ESCAPE_PLACE;
use super::super::residual::ESCAPE_SIZES;
use super::super::widths::{CORRECTION, DX_AND_UV, DY_AND_CROSS};
use crate::textrace::{Textrace, Tile};
use std::path::Path;

/// Counts the encoder's output.
struct Counts {
    by_code: Vec<Vec<u64>>,
    /// Bits by code: of its symbols and of the numbers after them.
    bits: Vec<[u64; 2]>,
    last: usize,
}

impl Counts {
    /// Starts with codes of these lengths.
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

/// Rows of the table in docs/results/costs.md, and the row of each code.
const ROWS: [&str; 6] = [
    "places",
    "first quads",
    "corrections",
    "classes",
    "wide",
    "runs",
];

fn row(code: usize) -> usize {
    match code {
        0..17 => 0,
        17..41 => 3,
        41..48 => 1,
        48 => 4,
        49..54 => 2,
        _ => 5,
    }
}

/// The code of parents' numbers.
const PARENT: usize = CODES - 2;

/// Number of bits of the numbers that follow a symbol of a first quad.
fn number_bits(code: usize, symbol: u32) -> u32 {
    let both = match code {
        41 => DX_AND_UV.widths(symbol).iter().sum(),
        42..=47 => DY_AND_CROSS.widths(symbol).iter().sum(),
        49 => CORRECTION.widths(symbol).iter().sum(),
        _ => 0,
    };
    2 * both + if code == PARENT { symbol } else { 0 }
}

impl Sink for Counts {
    fn bits(&mut self, _: u32, count: u32) {
        // A first quad's numbers come after all of its symbols, which determine their bits.
        if !matches!(row(self.last), 1 | 2) {
            self.bits[self.last][1] += u64::from(count);
        }
    }

    fn symbol(&mut self, code: &Code, symbol: u32, escape: u32) -> bool {
        self.last = code.number;
        self.by_code[code.number][symbol as usize] += 1;
        let length = code.length(symbol, code.length(escape, 0));
        let [of_symbols, of_numbers] = &mut self.bits[code.number];
        *of_symbols += u64::from(length);
        *of_numbers += u64::from(number_bits(code.number, symbol));
        code.encode(symbol).is_some()
    }
}

/// Code lengths of at most [`MOST_BITS`] for these symbol counts, by the package-merge method.
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
    let rounds = std::env::var("ROUNDS").map_or(4, |rounds| rounds.parse().unwrap());
    for _ in 0..rounds {
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
            let mut rows = [0.0; ROWS.len()];
            for (code, bits) in counts.bits.iter().enumerate() {
                rows[row(code)] += bits.iter().sum::<u64>() as f64 / records as f64;
            }
            let bytes = rows.iter().sum::<f64>() / 8.0;
            let rows = ROWS
                .iter()
                .zip(rows)
                .map(|(row, bits)| format!("{row} {bits:.2}"));
            let rows: Vec<String> = rows.collect();
            println!(
                "{records} records, {bytes:.3} bytes each; bits: {}",
                rows.join(", ")
            );
            sums.push((counts.by_code, records));
        }
        texts = (0..CODES)
            .map(|code| {
                // Every trace has the same weight.
                let mut counts = vec![0u64; texts[code].len()];
                for (by_code, records) in &sums {
                    for (sum, count) in counts.iter_mut().zip(&by_code[code]) {
                        *sum += count * 100_000_000 / *records as u64;
                    }
                }
                // The escape of symbols that are not in the code, and whether it is used. For widths, other
                // symbols serve as escapes.
                let escape = match code {
                    0..17 => Some((ESCAPE_PLACE as usize, true)),
                    17..41 => Some((ESCAPE_SIZES as usize, true)),
                    41..=47 | 49 => Some((counts.len() - 1, false)),
                    _ => None,
                };
                let total: u64 = counts.iter().sum();
                if let Some((escape, instead)) = escape {
                    let rare = total >> MOST_BITS;
                    for symbol in (0..counts.len()).filter(|s| *s != escape) {
                        if counts[symbol] < rare {
                            let count = std::mem::take(&mut counts[symbol]);
                            counts[escape] += if instead { count } else { 0 };
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
