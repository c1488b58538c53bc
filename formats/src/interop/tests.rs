use super::*;
use crate::layout::LayoutConfig;
use crate::textrace::{NO_GROUP, SUBTEXELS};
use std::collections::HashSet;

/// One quad over BC1 texels (2..5, 3..6) of a texture, one lane covered.
fn record() -> QuadRecord {
    QuadRecord {
        x: 3,
        y: 4,
        mask: 0b0010,
        uv: [3 * SUBTEXELS, 4 * SUBTEXELS],
        dx: [SUBTEXELS, 0],
        dy: [0, SUBTEXELS],
        ..QuadRecord::default()
    }
}

fn accesses(granularity: Granularity, record: &QuadRecord) -> Vec<Access> {
    let tables = crate::textrace::tests::tables();
    let layout = Layout::new(&tables.textures, &LayoutConfig::default()).unwrap();
    let expander = Expander {
        tables: &tables,
        layout: &layout,
        sampling: SamplingOptions::default(),
        granularity,
        line_bytes: 16,
    };
    let mut found = Vec::new();
    let collect = |access: &Access| {
        found.push(*access);
        Ok(())
    };
    expander
        .expand(Origin::default(), record, None, collect)
        .unwrap();
    found
}

#[test]
fn lines_are_the_distinct_lines_of_the_texels() {
    let texels = accesses(Granularity::Texel, &record());
    let lines = accesses(Granularity::Line, &record());
    assert!(lines.len() < texels.len());
    let of_texels: HashSet<u64> = texels.iter().map(|a| a.address / 16).collect();
    let of_lines: HashSet<u64> = lines.iter().map(|a| a.address / 16).collect();
    assert_eq!(of_texels, of_lines);
    assert!(lines.iter().all(|a| a.address % 16 == 0));
    assert!(texels.iter().all(|a| (a.pixel_x, a.pixel_y) == (7, 8)));
}

#[test]
fn a_quad_without_a_group_reads_nothing() {
    let record = QuadRecord {
        group: NO_GROUP,
        ..record()
    };
    assert_eq!(accesses(Granularity::Texel, &record), []);
}

#[test]
fn csv_and_json_lines_hold_the_same_accesses() {
    let written = accesses(Granularity::Line, &record());
    let (mut csv, mut jsonl) = (Vec::new(), Vec::new());
    let mut csv_sink = CsvWriter::new(&mut csv).unwrap();
    for access in &written {
        csv_sink.write(access).unwrap();
        write_json_line(access, &mut jsonl).unwrap();
    }
    let csv = String::from_utf8(csv).unwrap();
    let mut rows = csv.lines();
    let columns: Vec<&str> = rows.next().unwrap().split(',').collect();
    for (row, line) in rows.zip(String::from_utf8(jsonl).unwrap().lines()) {
        let object: serde_json::Value = serde_json::from_str(line).unwrap();
        for (column, field) in columns.iter().zip(row.split(',')) {
            let number = match field.strip_prefix("0x") {
                Some(hex) => u64::from_str_radix(hex, 16).unwrap(),
                None => field.parse().unwrap(),
            };
            assert_eq!(object[column], number, "{column}");
        }
    }
}
