use super::*;
use crate::container::ChunkTag;
use crate::textrace::tests::tables;
use crate::textrace::{Textrace, TextraceWriter};

/// A mesh of random triangles for each draw of the tables.
fn geometry(tables: &Tables) -> Geometry {
    let mut state = 1_u32;
    let mut random = move |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % below
    };
    let meshes = tables.draws.iter().map(|draw| MeshGeometry {
        vertices: 700,
        vertex_bytes: 56,
        index_bytes: 4,
        indices: (0..3 * draw.primitives).map(|_| random(700)).collect(),
    });
    Geometry {
        meshes: meshes.collect(),
        draw_meshes: (0..tables.draws.len() as u32).collect(),
        ..Geometry::default()
    }
}

fn view() -> GeometryView {
    GeometryView {
        frame: 0,
        target: ViewTarget::Pass(0),
        size_px: [40, 32],
    }
}

/// The right eye's view, with empty lists.
fn right() -> (GeometryView, TileLists) {
    let view = GeometryView {
        target: ViewTarget::Pass(1),
        ..view()
    };
    let lists = TileLists {
        starts: vec![0; 7],
        ..TileLists::default()
    };
    (view, lists)
}

fn lists() -> TileLists {
    TileLists {
        draws: vec![0, 2],
        starts: vec![0, 3, 3, 5, 5, 5, 6],
        primitives: vec![0, 1, 2999, 4, 999, 2000],
    }
}

fn written(views: &[(GeometryView, TileLists)]) -> Vec<u8> {
    let tables = tables();
    let writer = TextraceWriter::in_memory(&tables).unwrap();
    let mut writer = writer.with_geometry(geometry(&tables)).unwrap();
    for (view, lists) in views {
        writer.append_view(*view, lists).unwrap();
    }
    writer.into_bytes().unwrap()
}

/// A trace with lists for each of its passes.
pub(crate) fn trace() -> Vec<u8> {
    written(&[(view(), lists()), right()])
}

#[test]
fn geometry_is_read_as_written() {
    let shadow_map = GeometryView {
        target: ViewTarget::ShadowMap(1),
        size_px: [16, 1],
        ..view()
    };
    let (right, nothing) = right();
    let empty = TileLists {
        starts: vec![0, 0],
        ..TileLists::default()
    };
    let views = [
        (shadow_map, empty.clone()),
        (view(), lists()),
        (right, nothing),
    ];
    let trace = Textrace::from_bytes(written(&views)).unwrap();
    let found = trace.geometry().unwrap();
    let expected = geometry(&tables());
    assert_eq!(
        (&found.meshes, &found.draw_meshes),
        (&expected.meshes, &expected.draw_meshes)
    );
    assert_eq!(found.views, [shadow_map, view(), right]);
    assert_eq!(trace.tile_lists(0).unwrap(), empty);
    assert_eq!(trace.tile_lists(1).unwrap(), lists());
    assert_eq!(found.view_of_pass(1), Some(2));
    assert_eq!(lists().tile(2), [4, 999]);
    assert!(
        trace
            .tile_lists(3)
            .unwrap_err()
            .to_string()
            .contains("view 3")
    );
    assert_eq!(trace.container().version(), (1, GEOMETRY_MINOR));
}

#[test]
fn a_trace_without_geometry_has_none_and_an_older_version() {
    let bytes = TextraceWriter::in_memory(&tables())
        .unwrap()
        .into_bytes()
        .unwrap();
    let trace = Textrace::from_bytes(bytes).unwrap();
    assert!(trace.geometry().is_none() && trace.tile_lists(0).is_err());
    assert!(trace.container().version().1 < GEOMETRY_MINOR);
}

#[test]
fn lists_that_violate_a_rule_are_not_written() {
    let changed = |change: &dyn Fn(&mut TileLists)| {
        let mut changed = lists();
        change(&mut changed);
        changed
    };
    let broken = [
        (changed(&|l| l.primitives.swap(0, 1)), view()),
        (changed(&|l| l.primitives[1] = 0), view()),
        // Draw 1 is not submitted.
        (changed(&|l| l.primitives[5] = 1500), view()),
        (changed(&|l| l.primitives[5] = 3000), view()),
        (changed(&|l| l.draws = vec![2, 0]), view()),
        (changed(&|l| l.draws = vec![0, 3]), view()),
        (changed(&|l| l.starts[6] = 5), view()),
        (changed(&|l| l.starts.truncate(6)), view()),
        (
            lists(),
            GeometryView {
                size_px: [40, 16],
                ..view()
            },
        ),
        (lists(), GeometryView { frame: 1, ..view() }),
        (
            lists(),
            GeometryView {
                target: ViewTarget::Pass(9),
                ..view()
            },
        ),
    ];
    let tables = tables();
    for (lists, view) in broken {
        let writer = TextraceWriter::in_memory(&tables).unwrap();
        let mut writer = writer.with_geometry(geometry(&tables)).unwrap();
        assert!(
            writer.append_view(view, &lists).is_err(),
            "{view:?} {lists:?}"
        );
    }
    for change in [
        |g: &mut Geometry| g.meshes[0].indices[0] = 700,
        |g: &mut Geometry| g.meshes[0].index_bytes = 3,
        |g: &mut Geometry| g.meshes[0].vertex_bytes = 0,
        |g: &mut Geometry| g.meshes[0].indices.truncate(4),
        |g: &mut Geometry| g.draw_meshes[0] = 9,
        |g: &mut Geometry| g.draw_meshes.truncate(1),
    ] {
        let mut changed = geometry(&tables);
        change(&mut changed);
        assert!(
            TextraceWriter::in_memory(&tables)
                .unwrap()
                .with_geometry(changed)
                .is_err()
        );
    }
}

/// Every byte of the three chunks is changed with correct checksums, which must be refused or read without
/// a panic.
#[test]
fn changed_bytes_with_right_checksums_are_read_or_refused() {
    let bytes = trace();
    let whole = Textrace::from_bytes(bytes.clone()).unwrap();
    let mut refused = 0;
    for tag in [PRIMITIVE_LISTS, LIST_INDEX, GEOMETRY] {
        let entry = *whole.container().entry(tag).unwrap();
        let step = if tag == GEOMETRY { 97 } else { 1 };
        for at in (0..entry.length_bytes as usize).step_by(step) {
            for value in [0x00, 0x01, 0x7f, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[entry.offset_bytes as usize + at] = value;
                let read = Textrace::from_bytes(repaired(changed, &whole, tag))
                    .and_then(|trace| trace.tile_lists(0));
                refused += usize::from(read.is_err());
            }
        }
    }
    assert!(refused > 300, "{refused}");
}

/// Corrects the checksums of a file in which bytes of one chunk were changed.
fn repaired(mut bytes: Vec<u8>, whole: &Textrace, changed: ChunkTag) -> Vec<u8> {
    let directory = u64::from_le_bytes(bytes[16..24].try_into().unwrap()) as usize;
    for (number, entry) in whole.container().directory().iter().enumerate() {
        let range = entry.offset_bytes as usize..(entry.offset_bytes + entry.length_bytes) as usize;
        let lists = whole.container().entry(PRIMITIVE_LISTS).unwrap();
        if changed == PRIMITIVE_LISTS && entry.tag == LIST_INDEX {
            for entry in (range.start..range.end).step_by(LIST_INDEX_ENTRY_BYTES) {
                let number = |at: usize| {
                    let bytes = bytes[entry + at..][..4].try_into().unwrap();
                    u32::from_le_bytes(bytes) as usize
                };
                let (start, size) = (number(20), number(28));
                let list = &bytes[lists.offset_bytes as usize + start..][..size];
                let crc = crc32fast::hash(list).to_le_bytes();
                bytes[entry + 32..entry + 36].copy_from_slice(&crc);
            }
        }
        let crc = crc32fast::hash(&bytes[range]).to_le_bytes();
        bytes[directory + 24 * number + 4..][..4].copy_from_slice(&crc);
    }
    let crc = crc32fast::hash(&bytes[directory..]).to_le_bytes();
    bytes[36..40].copy_from_slice(&crc);
    let crc = crc32fast::hash(&bytes[..44]).to_le_bytes();
    bytes[44..48].copy_from_slice(&crc);
    bytes
}

#[test]
fn views_out_of_order_or_missing_are_neither_written_nor_read() {
    let shadow_map = |cascade| {
        let view = GeometryView {
            target: ViewTarget::ShadowMap(cascade),
            ..view()
        };
        (view, right().1)
    };
    let sound = [shadow_map(0), shadow_map(2), (view(), lists()), right()];
    let bytes = written(&sound);
    let tables = tables();
    let write = |views: &[&(GeometryView, TileLists)]| {
        let writer = TextraceWriter::in_memory(&tables)?;
        let mut writer = writer.with_geometry(geometry(&tables))?;
        for (view, lists) in views {
            writer.append_view(*view, lists)?;
        }
        writer.into_bytes()
    };
    let [a, b, c, d] = &sound;
    for broken in [
        &[b, a, c, d][..],
        &[a, a, c, d],
        &[a, c, b, d],
        &[a, b, d, c],
    ] {
        let error = write(broken).unwrap_err().to_string();
        assert!(error.contains("ascending"), "{error}");
    }
    let error = write(&[a, b, c]).unwrap_err().to_string();
    assert!(error.contains("one for each of 2 passes"), "{error}");
    // The number of the second shadow map, and of the second pass.
    let whole = Textrace::from_bytes(bytes.clone()).unwrap();
    let index = whole.container().entry(LIST_INDEX).unwrap().offset_bytes as usize;
    for entry in [1, 3] {
        let mut changed = bytes.clone();
        changed[index + entry * LIST_INDEX_ENTRY_BYTES + 8] = 0;
        let error = Textrace::from_bytes(repaired(changed, &whole, LIST_INDEX)).unwrap_err();
        assert!(error.to_string().contains("ascending"), "{error}");
    }
}

#[test]
fn a_list_without_a_recorded_primitive_is_found() {
    let run = |primitive| crate::textrace::PrimitiveRun {
        primitive,
        draw: 0,
        first: 0,
        count: 1,
    };
    let tile = |primitives: &[u32]| crate::textrace::Tile {
        runs: primitives.iter().copied().map(run).collect(),
        records: Vec::new(),
    };
    assert!(lists().check_records(0, &tile(&[0, 2999])).is_ok());
    assert!(lists().check_records(1, &tile(&[])).is_ok());
    let broken = lists().check_records(2, &tile(&[4, 5])).unwrap_err();
    assert!(broken.found.contains("primitive 5"), "{broken:?}");
}
