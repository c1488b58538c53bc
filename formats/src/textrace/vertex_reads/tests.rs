use super::*;
use crate::container::Kind;
use crate::textrace::tests::tables;
use crate::textrace::{ProgramCapture, Textrace, TextraceWriter};
use crate::texture::{Filter, MipFilter};
use proptest::prelude::*;

/// A fetch and a sample, in two draws.
fn draws() -> Vec<VertexDraw> {
    let site = |texture, fetches, offset| VertexSite {
        texture,
        sampler: 1,
        fetches,
        offset,
    };
    let read = |instance, vertex, site, at, layer, level| VertexRead {
        instance,
        vertex,
        site,
        at,
        layer,
        level,
    };
    let at = [0.25_f32, -3.5].map(f32::to_bits);
    vec![
        VertexDraw {
            frame: 0,
            eye: Some(Eye::Right),
            draw: 3,
            sites: vec![site(1, true, [-1, 2]), site(0, false, [0, 0])],
            reads: vec![
                read(0, 7, 0, [5, u32::MAX], 1, 0),
                read(0, 7, 1, at, 0, 1.5_f32.to_bits()),
                read(1, 2, 1, at, u32::MAX, f32::NAN.to_bits()),
            ],
        },
        VertexDraw {
            draw: 3,
            sites: vec![site(0, true, [0, 0])],
            reads: vec![read(2, 0, 0, [0, 0], 0, 0)],
            ..VertexDraw::default()
        },
    ]
}

fn program_tables() -> Tables {
    let mut tables = tables();
    tables.meta.program = Some(ProgramCapture::default());
    tables
}

fn written(draws: &[VertexDraw]) -> Result<Vec<u8>> {
    let mut writer = TextraceWriter::in_memory(&program_tables())?;
    writer.set_vertex_reads(draws.to_vec())?;
    writer.into_bytes()
}

/// A trace with other bytes in a chunk of vertex reads, and correct checksums.
fn with_chunk(version: (u16, u16), chunk: &[u8]) -> Result<Textrace> {
    let tables = tables();
    let plain = match version.0 {
        1 => TextraceWriter::in_memory(&tables),
        _ => TextraceWriter::in_memory(&program_tables()),
    };
    let plain = Textrace::from_bytes(plain?.into_bytes()?)?;
    let mut writer = ContainerWriter::in_memory(Kind::Textrace)?;
    writer.require_major(version.0);
    writer.require_minor(version.1);
    for entry in plain.container().directory() {
        writer.chunk(entry.tag, plain.container().chunk(entry.tag)?)?;
    }
    writer.chunk(VERTEX_READS, chunk)?;
    Textrace::from_bytes(writer.into_bytes()?)
}

/// The bytes of the chunk.
fn chunk() -> Vec<u8> {
    let trace = Textrace::from_bytes(written(&draws()).unwrap()).unwrap();
    trace.container().chunk(VERTEX_READS).unwrap().to_vec()
}

#[test]
fn reads_are_read_as_written_and_a_trace_without_them_is_as_before() {
    let trace = Textrace::from_bytes(written(&draws()).unwrap()).unwrap();
    assert_eq!(trace.vertex_reads(), draws());
    assert_eq!(trace.container().version(), (2, 1));
    let counts: Vec<u64> = draws().iter().map(VertexDraw::vertices).collect();
    assert_eq!(counts, [2, 1]);
    let without = Textrace::from_bytes(written(&[]).unwrap()).unwrap();
    assert_eq!(without.container().version(), (2, 0));
    assert!(without.container().entry(VERTEX_READS).is_err());
    assert_ne!(trace.content_checksum(), without.content_checksum());
    // The least bytes that the specification names.
    let empty = written(&[VertexDraw::default()]).unwrap();
    let empty = Textrace::from_bytes(empty).unwrap();
    let bytes = empty.container().chunk(VERTEX_READS).unwrap().len();
    assert_eq!(bytes, 4 + LEAST_BYTES[0]);
}

#[test]
fn the_chunk_is_unknown_to_versions_whose_tables_come_first() {
    let trace = with_chunk((1, 5), b"anything").unwrap();
    assert!(trace.vertex_reads().is_empty());
    assert!(with_chunk((2, 1), b"anything").is_err());
}

#[test]
fn bad_chunks_are_refused_with_place_expectation_and_finding() {
    let whole = chunk();
    assert_eq!(with_chunk((2, 7), &whole).unwrap().vertex_reads(), draws());
    let refused = |version, bytes: &[u8], wanted: &[&str]| {
        let error = with_chunk(version, bytes).expect_err("refused").to_string();
        for part in wanted.iter().chain(&["VTXR"]) {
            assert!(error.contains(part), "{error}: {part}");
        }
    };
    refused((2, 0), &whole, &["version 2.1 for vertex reads", "2.0"]);
    for length in 0..whole.len() {
        refused((2, 1), &whole[..length], &["expected", "found"]);
    }
    refused(
        (2, 1),
        &[&whole[..], &[0]].concat(),
        &["the end", "1 more bytes"],
    );
    refused((2, 1), &whole[..2], &["count of draws", "2 bytes left"]);
    let changed = |at: usize, value: u8| {
        let mut bytes = whole.clone();
        bytes[at] = value;
        bytes
    };
    // The first draw: frame, number, eye, sites.
    let sites = 4 + 4 + 4 + 1 + 4;
    let of_draw = |what: &str| format!("{what} of draw 0 of vertex reads: ");
    for (at, value, wanted, found) in [
        (0, 200, "count of draws of at most".to_owned(), "200"),
        (4, 9, of_draw("frame"), "9"),
        (12, 2, "an eye, 0, 1 or 255".to_owned(), "2"),
        (13, 200, "site count of at most".to_owned(), "200"),
        (sites, 9, of_draw("texture") + "an index below 2", "9"),
        (sites + 4, 9, of_draw("sampler") + "an index below 2", "9"),
        (
            sites + 6,
            2,
            "0 for a sample or 1 for a fetch".to_owned(),
            "2",
        ),
        (sites + 18, 200, "read count of at most".to_owned(), "200"),
        (sites + 24, 4, of_draw("site") + "an index below 2", "2"),
    ] {
        refused(
            (2, 1),
            &changed(at, value),
            &[&wanted, &format!("found {found}")],
        );
    }
}

#[test]
fn reads_that_break_a_rule_are_not_written() {
    let refused = |edit: fn(&mut Vec<VertexDraw>), wanted: &str| {
        let mut draws = draws();
        edit(&mut draws);
        let error = written(&draws).expect_err("refused").to_string();
        assert!(error.contains(wanted), "{error}");
    };
    refused(|draws| draws[1].sites[0].texture = 2, "texture of draw 1");
    refused(|draws| draws[1].sites.clear(), "site of draw 1");
    refused(|draws| draws[1].draw = 2, "frame and number from (0, 3) on");
    refused(
        |draws| draws[0].reads.swap(0, 2),
        "instance and vertex from (1, 2) on",
    );
    let mut first = TextraceWriter::in_memory(&tables()).unwrap();
    let error = first.set_vertex_reads(draws()).expect_err("refused");
    assert!(error.to_string().contains("tables come last"), "{error}");
}

/// Every byte is changed with correct checksums, which must be refused or read without a panic.
#[test]
fn changed_bytes_are_read_or_refused() {
    let whole = chunk();
    let mut refused = 0;
    for at in 0..whole.len() {
        for value in [0x00, 0x01, 0x7f, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[at] = value;
            match with_chunk((2, 1), &bytes) {
                Ok(trace) => trace
                    .vertex_reads()
                    .iter()
                    .for_each(|draw| draw.footprints(trace.tables(), |_, _| ())),
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > 100, "{refused}");
}

proptest! {
    #[test]
    fn any_reads_are_read_as_written(values in prop::collection::vec(any::<[u32; 6]>(), 0..40)) {
        let mut reads: Vec<VertexRead> = (values.into_iter())
            .map(|[instance, vertex, u, v, layer, level]| VertexRead {
                instance, vertex, site: u % 2, at: [u, v], layer, level,
            })
            .collect();
        reads.sort_by_key(|read| (read.instance, read.vertex));
        let mut draws = draws();
        draws[0].reads = reads;
        let trace = Textrace::from_bytes(written(&draws).unwrap()).unwrap();
        prop_assert_eq!(trace.vertex_reads(), &draws[..]);
        draws[0].footprints(trace.tables(), |_, _| ());
    }
}

/// Level, layer and texels of each footprint of reads by one site. Texture 0 has 3 levels and 2 layers.
fn footprints_of(site: VertexSite, reads: &[VertexRead]) -> Vec<(u8, u16, Vec<[u32; 2]>)> {
    let mut tables = program_tables();
    tables.textures[0].size = [16, 8];
    tables.samplers[1].wrap = [Wrap::Repeat, Wrap::ClampToEdge];
    (tables.samplers[1].mag, tables.samplers[1].min) = (Filter::Linear, Filter::Linear);
    tables.samplers[1].mip = MipFilter::Linear;
    let draw = VertexDraw {
        sites: vec![site],
        reads: reads.to_vec(),
        ..VertexDraw::default()
    };
    let mut found = Vec::new();
    draw.footprints(&tables, |_, of| {
        found.push((of.level, of.layer, of.texels().collect()))
    });
    found
}

#[test]
fn fetches_outside_a_texture_read_nothing() {
    let site = VertexSite {
        sampler: 1,
        fetches: true,
        offset: [1, -1],
        ..VertexSite::default()
    };
    let fetch = |at: [i32; 2], layer, level: i32| VertexRead {
        at: at.map(i32::cast_unsigned),
        layer,
        level: level.cast_unsigned(),
        ..VertexRead::default()
    };
    let inside = [
        fetch([14, 1], 0, 0),
        fetch([-1, 8], 1, 0),
        fetch([2, 2], 1, 2),
    ];
    let found = footprints_of(site, &inside);
    let texel = |level, layer, at| (level, layer, vec![at]);
    let expected = [
        texel(0, 0, [15, 0]),
        texel(0, 1, [0, 7]),
        texel(2, 1, [3, 1]),
    ];
    assert_eq!(found, expected);
    let outside = [
        fetch([15, 1], 0, 0),
        fetch([-2, 1], 0, 0),
        fetch([0, 0], 0, 0),
        fetch([0, 9], 0, 0),
        fetch([i32::MAX, i32::MIN], 0, 0),
        fetch([0, 1], 2, 0),
        fetch([0, 1], u32::MAX, 0),
        fetch([0, 1], 0, 3),
        fetch([0, 1], 0, -1),
        fetch([3, 1], 0, 2),
    ];
    assert_eq!(footprints_of(site, &outside), []);
}

#[test]
fn samples_are_filtered_and_brought_into_levels_and_layers() {
    let site = VertexSite {
        sampler: 1,
        ..VertexSite::default()
    };
    let sample = |at: [f32; 2], layer, level: f32| VertexRead {
        at: at.map(f32::to_bits),
        layer,
        level: level.to_bits(),
        ..VertexRead::default()
    };
    // Columns repeat, rows end at the edge.
    let corner = vec![[15, 0], [0, 0]];
    let found = footprints_of(site, &[sample([1.0, 0.0], 7, -2.5)]);
    assert_eq!(found, [(0, 1, corner)]);
    let inside = |x, y| vec![[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
    let found = footprints_of(site, &[sample([0.5, 0.5], 0, 0.5)]);
    assert_eq!(found, [(0, 0, inside(7, 3)), (1, 0, inside(3, 1))]);
    let found = footprints_of(site, &[sample([0.5, 0.5], 1, 1e9)]);
    assert_eq!(found, [(2, 1, inside(1, 0))]);
    let not_finite = [sample([f32::NAN, f32::INFINITY], 0, f32::NAN)];
    assert_eq!(footprints_of(site, &not_finite).len(), 1);
}
