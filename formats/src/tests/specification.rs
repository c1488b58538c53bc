//! Compares FORMAT.md with the code: sizes, offsets, and the order of the chunks. `tests/independent/`
//! shows that the text is sufficient to write a reader.

use crate::container::{CHUNK_ALIGNMENT_BYTES, DIRECTORY_ENTRY_BYTES, HEADER_BYTES};
use crate::raytrace::{GEOMETRY_INDEX_ENTRY_BYTES, RAY_INDEX_ENTRY_BYTES, RayTriangle};
use crate::records::least_bytes;
use crate::textrace::{
    self, Draw, INDEX_ENTRY_BYTES, Pass, Sample, Textrace, UvGroup, VertexSite, geometry,
};
use crate::texture::{Sampler, Texture};
use std::collections::HashMap;

const FORMAT: &str = include_str!("../../../FORMAT.md");

/// Rows of the first table below a heading, cells trimmed.
fn table(heading: &str) -> Vec<Vec<&'static str>> {
    let (_, after) = FORMAT
        .split_once(&format!("\n{heading}\n"))
        .expect("the heading is there");
    after
        .lines()
        .skip_while(|line| !line.starts_with('|'))
        .take_while(|line| line.starts_with('|'))
        .skip(2)
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect()
}

/// Size of a structure from its table of offset, type and field; checks that offsets have no gaps.
fn size(heading: &str) -> usize {
    let mut end = 0;
    for row in table(heading) {
        assert_eq!(row[0], end.to_string(), "{heading}: {row:?}");
        end += match row[1] {
            "u8" | "i8" => 1,
            "u16" | "i16" => 2,
            "u32" | "u8[4]" => 4,
            "u64" | "u8[8]" => 8,
            other => panic!("{heading}: type {other}"),
        };
    }
    end
}

#[test]
fn documented_sizes_equal_those_of_the_code() {
    let code = HashMap::from([
        ("header", HEADER_BYTES),
        ("directory entry", DIRECTORY_ENTRY_BYTES),
        ("chunk alignment", CHUNK_ALIGNMENT_BYTES as usize),
        ("texture without name", least_bytes::<Texture>(1)),
        ("sampler", least_bytes::<Sampler>(1)),
        ("draw without name and groups", least_bytes::<Draw>(1)),
        ("uv group without samples", least_bytes::<UvGroup>(1)),
        ("sample", least_bytes::<Sample>(1)),
        ("sampler of version 2", least_bytes::<Sampler>(2)),
        ("sample of version 2", least_bytes::<Sample>(2)),
        (
            "texture of version 3 without name",
            least_bytes::<Texture>(3),
        ),
        ("sampler of version 3", least_bytes::<Sampler>(3)),
        ("pass", least_bytes::<Pass>(1)),
        ("tile index entry", INDEX_ENTRY_BYTES),
        (
            "draw of vertex reads, without sites and reads",
            textrace::VERTEX_LEAST_BYTES[0],
        ),
        ("site of vertex reads", least_bytes::<VertexSite>(2)),
        ("vertex read, at least", textrace::VERTEX_LEAST_BYTES[1]),
        ("mesh without indices", geometry::MESH_BYTES),
        ("list index entry", geometry::LIST_INDEX_ENTRY_BYTES),
        ("raw run", textrace::RAW_RUN_BYTES),
        ("raw record", textrace::RAW_RECORD_BYTES),
        ("padding of bits", textrace::BITS_PADDING_BYTES),
        ("ray tile index entry", RAY_INDEX_ENTRY_BYTES),
        ("geometry index entry", GEOMETRY_INDEX_ENTRY_BYTES),
        ("ray triangle", least_bytes::<RayTriangle>(1)),
    ]);
    let rows = table("## Sizes");
    assert_eq!(rows.len(), code.len());
    for row in rows {
        assert_eq!(row[1], code[row[0]].to_string(), "{}", row[0]);
    }
}

#[test]
fn documented_fields_add_up() {
    assert_eq!(size("### Header"), HEADER_BYTES);
    assert_eq!(size("### Directory entry"), DIRECTORY_ENTRY_BYTES);
    assert_eq!(size("### Texture"), least_bytes::<Texture>(1));
    assert_eq!(size("### Sampler"), least_bytes::<Sampler>(1));
    assert_eq!(size("### Draw"), least_bytes::<Draw>(1));
    assert_eq!(size("### Sampler of version 2"), least_bytes::<Sampler>(2));
    assert_eq!(size("### Sample of version 2"), least_bytes::<Sample>(2));
    assert_eq!(size("### Texture of version 3"), least_bytes::<Texture>(3));
    assert_eq!(size("### Sampler of version 3"), least_bytes::<Sampler>(3));
    assert_eq!(
        size("### Site of vertex reads"),
        least_bytes::<VertexSite>(2)
    );
    assert_eq!(size("### Pass"), least_bytes::<Pass>(1));
    assert_eq!(size("### Tile index entry"), INDEX_ENTRY_BYTES);
    assert_eq!(
        size("### List index entry"),
        geometry::LIST_INDEX_ENTRY_BYTES
    );
}

#[test]
fn chunks_come_in_the_documented_order() {
    let trace = Textrace::from_bytes(geometry::tests::trace()).unwrap();
    let tags = trace
        .container()
        .directory()
        .iter()
        .map(|entry| format!("`{}`", entry.tag));
    let documented = table("## .textrace")
        .into_iter()
        .map(|row| row[0].to_owned());
    assert_eq!(tags.collect::<Vec<_>>(), documented.collect::<Vec<_>>());
}

#[test]
fn numbers_are_spelled_as_documented() {
    let numbers = [
        0.0,
        -0.0,
        1.0,
        0.064,
        1e-5,
        1e-6,
        12.5e-8,
        1e15,
        1e16,
        1.234_567_890_123_456_8e20,
    ];
    let rows = table("## Content checksum");
    assert_eq!(rows.len(), numbers.len());
    for (row, number) in rows.iter().zip(numbers) {
        let spelled = serde_json::to_string(&number).expect("a finite number");
        assert_eq!(row[1], format!("`{spelled}`"), "{}", row[0]);
    }
}
