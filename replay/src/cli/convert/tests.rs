use super::*;
use crate::cli::testing::{file_of, lines};
use clap::Parser;
use formats::FormatError;
use formats::interop::plain::{AddressFile, AddressForm, Block};
use locality::{Streams, analyse};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;
use sim::config::{LevelConfig, Levels, Mode, Order};
use sim::engine::replay;
use sim::line_list::line_list;
use sim::memory::AnyCache;
use sim::order::parts::Eyes;
use sim::stream::MemoryTrace;
use sim::stream::testing::Synthetic;
use sim::stream::testing::different_frames;
use std::collections::HashSet;
use studies::orders_study::default_orders;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: ConvertArgs,
}

fn parse(arguments: &[&str]) -> ConvertArgs {
    let fixed = ["convert", "x.textrace"];
    Line::try_parse_from(fixed.iter().chain(arguments))
        .unwrap()
        .args
}

fn small() -> MemoryTrace {
    Synthetic::new([72, 56], 120).generate()
}

fn textures(trace: &Trace) -> &Textrace {
    match trace {
        Trace::Texture(trace) => trace,
        Trace::Ray(_) => panic!("a texture trace"),
    }
}

fn din(trace: &Trace, config: &RunConfig, granularity: &str) -> Vec<u64> {
    let args = parse(&["--to", "din", "--granularity", granularity]);
    let mut text = Vec::new();
    write_accesses(trace, config, &args, &mut text).unwrap();
    let mut addresses = Vec::new();
    AddressFile::of_stream("din".to_owned(), Some(AddressForm::Din), text.as_slice())
        .unwrap()
        .for_blocks::<FormatError>(|block| {
            if let Block::Accesses(accesses) = block {
                addresses.extend(accesses.iter().map(|access| access.address));
            }
            Ok(())
        })
        .unwrap();
    addresses
}

#[test]
fn din_output_has_the_look_ups_that_run_counts() {
    let memory = small();
    let file = file_of(&memory);
    let trace = Trace::open(file.path()).unwrap();
    for order in [Order::MORTON, Order::Z2_STA, Order::Z2_STA_MERGE] {
        for line_bytes in [16, 64] {
            let config = RunConfig {
                mode: Mode::Functional,
                order,
                line_bytes,
                ..RunConfig::default()
            };
            let result = replay(textures(&trace), &config).unwrap();
            let addresses = din(&trace, &config, "line");
            assert_eq!(addresses.len() as u64, result.l1.counters.line_lookups);
            let distinct: HashSet<u64> = addresses.iter().copied().collect();
            assert_eq!(distinct.len() as u64, result.unique_lines);
            let line = |address: u64| address - address % u64::from(line_bytes);
            let of_texels: HashSet<u64> = din(&trace, &config, "texel")
                .into_iter()
                .map(line)
                .collect();
            assert_eq!(of_texels, distinct);
        }
    }
}

#[test]
fn every_order_writes_the_same_accesses() {
    let file = file_of(&small());
    let trace = Trace::open(file.path()).unwrap();
    let sorted = |order| {
        let config = RunConfig {
            order,
            ..RunConfig::default()
        };
        let mut addresses = din(&trace, &config, "line");
        addresses.sort_unstable();
        addresses
    };
    let reference = sorted(Order::SCANLINE);
    assert!(!reference.is_empty());
    for order in Order::all() {
        assert!(sorted(order) == reference, "{}", order.name());
    }
}

/// Every order of the study, and every combination of the parts that need counters.
fn all_orders() -> Vec<Order> {
    let mut orders = default_orders();
    for eyes in Eyes::ALL {
        for pairing in ["index", "offset", "infinity", "row-primitives", "row-lines"] {
            let names = ["adaptive", "zig-zag"]
                .map(|curve| format!("{curve}+{}+{pairing}+boustro", eyes.name()));
            orders.extend(names.iter().filter_map(|name| Order::by_name(name).ok()));
        }
    }
    orders
}

/// Frames with different pictures, and tiles of two sizes.
#[test]
fn every_order_is_the_same_for_convert_run_locality_and_the_line_list() {
    let file = file_of(&different_frames());
    let trace = Trace::open(file.path()).unwrap();
    let source = textures(&trace);
    let mut sequences = HashSet::new();
    let mut sampling = RunConfig::default().sampling;
    // Fewer accesses; the order of quads does not depend on their number.
    sampling.max_anisotropy = Some(1);
    for (order, tile_px) in all_orders().into_iter().zip([16, 8].into_iter().cycle()) {
        let name = order.name();
        let config = RunConfig {
            mode: Mode::Functional,
            order,
            tile_px,
            sampling,
            cores: 1,
            level: Levels::two(LevelConfig::lru(1 << 10), LevelConfig::lru(4 << 10)),
            ..RunConfig::default()
        };
        // Two cores have no effect on what is written.
        let addresses = din(&trace, &RunConfig { cores: 2, ..config }, "line");
        assert!(
            addresses == line_list(source, &config).unwrap().address,
            "{name}"
        );
        let mut caches =
            [1_u32 << 10, 4 << 10].map(|bytes| AnyCache::lru(bytes / 64, 4).into_box());
        let mut misses = [0; 2];
        for address in &addresses {
            for (cache, misses) in caches.iter_mut().zip(&mut misses) {
                if cache.access((address / 16) as u32) {
                    break;
                }
                *misses += 1;
            }
        }
        let result = replay(source, &config).unwrap();
        let counted = [&result.l1, &result.l2].map(|level| level.counters.line_misses);
        assert_eq!(counted, misses, "{name}");
        let figures = analyse(source, &config, &[order], Streams::Levels, &|_| ()).unwrap();
        let streams = figures[0].streams.iter();
        let counted: Vec<u64> = streams.map(|(_, figures)| figures.split.misses()).collect();
        assert_eq!(counted, misses, "{name}");
        sequences.insert(addresses);
    }
    assert!(sequences.len() > 40, "{} sequences", sequences.len());
}

#[test]
fn every_form_has_the_same_addresses_in_an_order_that_needs_counters() {
    let file = file_of(&different_frames());
    let trace = Trace::open(file.path()).unwrap();
    let config = RunConfig {
        order: Order::by_name("adaptive+sta+row-lines").unwrap(),
        ..RunConfig::default()
    };
    let addresses = din(&trace, &config, "line");
    let write = |to: &str| {
        let mut bytes = Vec::new();
        write_accesses(&trace, &config, &parse(&["--to", to]), &mut bytes).unwrap();
        bytes
    };
    let number = |text: &str| u64::from_str_radix(text.trim_start_matches("0x"), 16).unwrap();
    let u32s = write("u32");
    let u32s = u32s
        .chunks(4)
        .map(|word| u32::from_le_bytes(word.try_into().unwrap()));
    assert!(u32s.map(u64::from).eq(addresses.iter().copied()));
    let u64s = write("u64");
    let u64s = u64s
        .chunks(8)
        .map(|word| u64::from_le_bytes(word.try_into().unwrap()));
    assert!(u64s.eq(addresses.iter().copied()));
    let csv = lines(&write("csv"));
    let csv = csv
        .iter()
        .skip(1)
        .map(|line| number(line.split(',').next().unwrap()));
    assert!(csv.eq(addresses.iter().copied()));
    let text = lines(&write("ramulator"));
    let text = text
        .iter()
        .map(|line| number(line.trim_start_matches("LD ")));
    assert!(text.eq(addresses.iter().copied()));
}

#[test]
fn csv_and_json_lines_have_one_line_per_access() {
    let file = file_of(&small());
    let trace = Trace::open(file.path()).unwrap();
    let config = RunConfig::default();
    let accesses = din(&trace, &config, "line").len();
    for (target, header) in [("csv", 1), ("jsonl", 0)] {
        let mut text = Vec::new();
        write_accesses(&trace, &config, &parse(&["--to", target]), &mut text).unwrap();
        assert_eq!(lines(&text).len(), accesses + header, "{target}");
    }
}

/// The rows of an NPY file without its header, and the number of rows that the header has.
fn npy(bytes: &[u8]) -> (&[u8], usize) {
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
    let (_, shape) = header.split_once("'shape': (").unwrap();
    let (rows, _) = shape.split_once(',').unwrap();
    (&bytes[10 + length..], rows.parse().unwrap())
}

#[test]
fn npy_and_parquet_have_the_accesses_of_csv() {
    let file = file_of(&small());
    let trace = Trace::open(file.path()).unwrap();
    let config = RunConfig::default();
    let addresses = din(&trace, &config, "line");
    let write = |arguments: &[&str]| {
        let mut bytes = Vec::new();
        write_accesses(&trace, &config, &parse(arguments), &mut bytes).unwrap();
        bytes
    };
    let bytes = write(&["--to", "npy"]);
    let (rows, count) = npy(&bytes);
    let row_bytes = 8 + 6 * 4 + 2 + 3 + 4;
    assert_eq!((count, rows.len()), (addresses.len(), count * row_bytes));
    let found = rows
        .chunks(row_bytes)
        .map(|row| u64::from_le_bytes(row[..8].try_into().unwrap()));
    assert!(found.eq(addresses.iter().copied()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    std::fs::write(&path, write(&["--to", "parquet"])).unwrap();
    let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
    let found = reader.get_row_iter(None).unwrap();
    let found = found.map(|row| row.unwrap().get_ulong(0).unwrap());
    assert!(found.eq(addresses));
}

#[test]
fn records_equal_those_of_dump_and_refuse_flags_for_accesses() {
    let memory = small();
    let file = file_of(&memory);
    let trace = Trace::open(file.path()).unwrap();
    let mut bytes = Vec::new();
    let args = parse(&["--to", "npy", "--granularity", "record"]);
    write_accesses(&trace, &RunConfig::default(), &args, &mut bytes).unwrap();
    let (rows, count) = npy(&bytes);
    let records = memory.tiles.iter().flatten().map(|tile| tile.records.len());
    assert_eq!(count, records.sum::<usize>());
    assert_eq!(rows.len(), count * 52);
    for (arguments, expected) in [
        (
            ["--to", "din", "--granularity", "record", "--seed", "1"],
            "--granularity record: only with --to csv, jsonl, npy and parquet",
        ),
        (
            [
                "--to",
                "npy",
                "--granularity",
                "record",
                "--order",
                "morton",
            ],
            "--order: it has no effect on records, only on accesses",
        ),
    ] {
        assert_eq!(parse(&arguments).check().unwrap_err().to_string(), expected);
    }
}

#[test]
fn encoding_and_decoding_restores_the_file() {
    let file = file_of(&small());
    let folder = tempfile::tempdir().unwrap();
    let convert = |from: &std::path::Path, name: &str, encoding: &str| {
        let to = folder.path().join(name);
        let output = to.display().to_string();
        let mut args = parse(&["--to", "textrace", "--encoding", encoding, "-o", &output]);
        args.trace = from.to_owned();
        run(&args).unwrap();
        to
    };
    let raw = convert(file.path(), "raw", "raw");
    let delta = convert(&raw, "delta", "delta");
    let bytes = |path: &std::path::Path| std::fs::read(path).unwrap();
    assert!(bytes(&raw).len() > bytes(&delta).len());
    assert_eq!(bytes(&delta), bytes(file.path()));
}
