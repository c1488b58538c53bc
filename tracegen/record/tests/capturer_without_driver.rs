//! Tests the crate with a capturer without a driver. It computes the quads of an analytic scene and passes
//! them on out of order.
//!
//! The view has 64x96 pixels. Draw 0 is an opaque triangle over the pixels with `x + y < 40`. Draw 1 is
//! alpha-masked and covers the tile in column 1, row 0 twice: primitive 1, whose alpha passes in even
//! columns, is in front of primitive 2. Texture coordinates are the pixel's centre divided by 64, so a pixel
//! is as large as a texel.

use formats::textrace::{
    Draw, LodRule, Pass, PassKind, SUBTEXELS, Sample, SampleLevel, Tables, Textrace,
    TextraceWriter, Tile, TraceMeta, UvGroup,
};
use formats::texture::{ColorSpace, Sampler, TexelFormat, Texture};
use formats::view::{Eye, FovTangents, FrameViews, Hmd};
use record::{
    Captured, Capturer, DepthReplay, RawDepth, RawRecord, RawRecords, RecordError, Recorder,
    Region, Sink,
};
use std::collections::BTreeMap;

const SIZE_PX: [u32; 2] = [64, 96];
/// Size of the texture in texels.
const EDGE: u32 = 64;

fn tables() -> Tables {
    let fov = FovTangents::new(1.0, 1.0, 1.0, 1.0);
    let draw = |first_primitive, primitives| Draw {
        material: "grid".into(),
        first_primitive,
        primitives,
        groups: vec![UvGroup {
            extent: [EDGE; 2],
            samples: vec![Sample::default()],
        }],
    };
    Tables {
        meta: TraceMeta {
            tool: "an analytic capturer".into(),
            scene: "triangle".into(),
            hmd: Hmd {
                eye_size_px: SIZE_PX,
                fov: [fov; 2],
                ..Hmd::default()
            },
            frames: vec![FrameViews::default()],
            ..TraceMeta::default()
        },
        textures: vec![Texture {
            name: "grid".into(),
            size: [EDGE; 2],
            levels: 7,
            layers: 1,
            format: TexelFormat::Rgba8,
            color_space: ColorSpace::Linear,
            part: None,
        }],
        samplers: vec![Sampler::TRILINEAR_REPEAT],
        draws: vec![draw(0, 1), draw(1, 2)],
        passes: vec![Pass {
            frame: 0,
            kind: PassKind::Main,
            eye: Some(Eye::Left),
            layer: 0,
            size_px: SIZE_PX,
            tiles: [4, 6],
        }],
    }
}

/// Primitive, draw and covered lanes of the quad at column `x` and row `y`.
fn covered(x: u32, y: u32) -> Vec<(u32, u32, u8)> {
    let mut found = Vec::new();
    match x + y {
        0..=18 => found.push((0, 0, 0b1111)),
        // Quads on the diagonal lack the bottom right lane.
        19 => found.push((0, 0, 0b0111)),
        _ => {}
    }
    if (8..16).contains(&x) && y < 8 {
        found.extend([(1, 1, 0b1111), (2, 1, 0b1111)]);
    }
    found
}

/// A capturer that computes its records instead of rendering.
struct Analytic {
    capacity: u64,
    /// Whether the last quad is passed on first.
    backwards: bool,
    /// Whether each lane has a record of its own.
    lane_by_lane: bool,
    /// Primitive whose coordinates are NaN.
    not_finite: Option<u32>,
    asked: Vec<Region>,
    empty: usize,
    overflowed: usize,
}

impl Analytic {
    fn new(capacity: u64, backwards: bool) -> Self {
        Self {
            capacity,
            backwards,
            lane_by_lane: false,
            not_finite: None,
            asked: Vec::new(),
            empty: 0,
            overflowed: 0,
        }
    }
}

impl Capturer for Analytic {
    type Error = RecordError;

    fn record_capacity(&self) -> u64 {
        self.capacity
    }

    fn capture(&mut self, region: Region, sink: &mut Sink<'_>) -> Result<Captured, RecordError> {
        self.asked.push(region);
        let [columns, rows] = [0, 1].map(|axis| {
            let first = region.origin_px[axis] / 2;
            first..first + region.size_px[axis] / 2
        });
        let mut records: Vec<(RawRecord, RawDepth)> = Vec::new();
        for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
            for (primitive, draw, mask) in covered(x, y) {
                let texel = 1.0 / EDGE as f32;
                // Lanes 0 and 2 lie in even columns.
                let (depth, passing) = match primitive {
                    1 => (0.5, 0b0101),
                    _ => (0.7, 0b1111),
                };
                let is_not_finite = self.not_finite == Some(primitive);
                let record = RawRecord {
                    header: RawRecord::pack(x, y, mask, 0),
                    primitive,
                    draw,
                    passing,
                    uv: match is_not_finite {
                        true => [f32::NAN, 0.5],
                        false => [x, y].map(|q| (2.0 * q as f32 + 0.5) * texel),
                    },
                    dx: [texel, 0.0],
                    dy: [0.0, texel],
                    cross: [0.0; 2],
                };
                let depth = [depth; 4];
                let lanes = (0..4).map(|lane| 1 << lane).filter(|lane| mask & lane != 0);
                let masks: Vec<u8> = match self.lane_by_lane {
                    true => lanes.collect(),
                    false => vec![mask],
                };
                records.extend(masks.into_iter().map(|mask| {
                    let header = RawRecord::pack(x, y, mask, 0);
                    (RawRecord { header, ..record }, RawDepth { depth })
                }));
            }
        }
        let needed = records.len() as u64;
        if needed > self.capacity {
            self.overflowed += 1;
            return Ok(Captured::Overflow { needed });
        }
        if records.is_empty() {
            self.empty += 1;
            return Ok(Captured::Complete);
        }
        if self.backwards {
            records.reverse();
        }
        let (quads, depths): (Vec<_>, Vec<_>) = records.into_iter().unzip();
        sink(RawRecords {
            quads: &quads,
            depths: &depths,
        })?;
        Ok(Captured::Complete)
    }
}

fn trace(capturer: &mut Analytic) -> Result<Vec<u8>, RecordError> {
    let mut recorder = recorder();
    recorder.capture_pass(capturer)?;
    Ok(recorder.into_writer()?.into_bytes()?)
}

/// A recorder for the tables of the analytic scene.
fn recorder() -> InMemory {
    let writer = TextraceWriter::in_memory(&tables()).unwrap();
    Recorder::new(writer, REPLAYS.to_vec())
}

type InMemory = Recorder<std::io::Cursor<Vec<u8>>>;

#[test]
fn a_capturer_without_a_driver_writes_a_trace_with_exactly_its_records() {
    let mut capturer = Analytic::new(200, true);
    let bytes = trace(&mut capturer).unwrap();
    assert!(capturer.overflowed > 0, "no region overflowed");
    assert!(capturer.empty > 0, "no region was empty");

    let mut expected = BTreeMap::new();
    for (x, y) in (0..48).flat_map(|y| (0..32).map(move |x| (x, y))) {
        for (primitive, draw, mask) in covered(x, y) {
            // Primitive 1 hides primitive 2 in even columns, where its alpha passes.
            let mask = if primitive == 2 { 0b1010 } else { mask };
            expected.insert((x, y, primitive), (draw, mask));
        }
    }
    let reader = Textrace::from_bytes(bytes).unwrap();
    let mut tile = Tile::default();
    for index in 0..24_u32 {
        reader.decode_tile(0, index as usize, &mut tile).unwrap();
        for run in &tile.runs {
            for record in &tile.records[run.first as usize..(run.first + run.count) as usize] {
                let x = index % 4 * 8 + u32::from(record.x);
                let y = index / 4 * 8 + u32::from(record.y);
                let found = expected.remove(&(x, y, run.primitive));
                assert_eq!(found, Some((run.draw, record.mask)), "quad ({x}, {y})");
                // The centre of a pixel is half a texel from its edge.
                let texels = [x, y].map(|q| (2 * q as i32) * SUBTEXELS + SUBTEXELS / 2);
                assert_eq!(record.uv, texels);
                assert_eq!((record.dx, record.dy), ([SUBTEXELS, 0], [0, SUBTEXELS]));
                assert_eq!((record.cross, record.group), ([0, 0], 0));
            }
        }
    }
    assert!(expected.is_empty(), "missing: {expected:?}");
}

#[test]
fn fragments_with_nan_coordinates_are_not_counted() {
    let counts = |not_finite: Option<u32>| {
        let mut recorder = recorder();
        let mut capturer = Analytic {
            not_finite,
            ..Analytic::new(1 << 20, false)
        };
        let recorded = recorder.capture_pass(&mut capturer);
        let counts = recorded.unwrap().counts;
        let bytes = recorder.into_writer().unwrap().into_bytes().unwrap();
        let trace = Textrace::from_bytes(bytes).unwrap();
        (counts, trace.records())
    };
    let (all, _) = counts(None);
    // Only the quads and lanes of primitive 0.
    let of_first = (0..48).flat_map(|y| (0..32).flat_map(move |x| covered(x, y)));
    let of_first: Vec<u8> = (of_first.filter(|(primitive, ..)| *primitive == 0))
        .map(|(.., mask)| mask)
        .collect();
    let lanes: u32 = of_first.iter().map(|mask| mask.count_ones()).sum();
    let (rest, records) = counts(Some(0));
    assert_eq!(rest.not_finite, of_first.len() as u64);
    assert_eq!(all.quads - rest.quads, of_first.len() as u64);
    assert_eq!(all.fragments - rest.fragments, u64::from(lanes));
    assert_eq!((rest.records, rest.quads), (records, records));
}

#[test]
fn the_trace_does_not_depend_on_the_order_of_records_or_the_size_of_the_buffer() {
    let whole = trace(&mut Analytic::new(100_000, false)).unwrap();
    for capacity in [190, 200, 300, 100_000] {
        let mut capturer = Analytic::new(capacity, true);
        assert!(
            trace(&mut capturer).unwrap() == whole,
            "capacity {capacity}"
        );
    }
}

#[test]
fn parts_of_a_primitive_with_the_same_coordinates_are_one_record_of_a_quad() {
    let whole = trace(&mut Analytic::new(100_000, false)).unwrap();
    let mut capturer = Analytic {
        lane_by_lane: true,
        ..Analytic::new(100_000, false)
    };
    assert!(trace(&mut capturer).unwrap() == whole);
}

#[test]
fn regions_after_an_overflow_cover_the_view_once() {
    let mut capturer = Analytic::new(200, false);
    trace(&mut capturer).unwrap();
    let complete = capturer.asked.len() - capturer.overflowed;
    let mut pixels = vec![0; (SIZE_PX[0] * SIZE_PX[1]) as usize];
    for region in &capturer.asked[capturer.asked.len() - complete..] {
        let [left, top] = region.origin_px;
        for (dx, dy) in
            (0..region.size_px[1]).flat_map(|y| (0..region.size_px[0]).map(move |x| (x, y)))
        {
            pixels[((top + dy) * SIZE_PX[0] + left + dx) as usize] += 1;
        }
    }
    assert!(pixels.iter().all(|&times| times == 1));
}

#[test]
fn a_buffer_too_small_for_a_tile_is_refused() {
    let message = trace(&mut Analytic::new(100, false))
        .unwrap_err()
        .to_string();
    assert!(message.contains("tile (1, 0) alone needs 18"), "{message}");
}

#[test]
fn records_that_contradict_the_tables_are_refused() {
    struct Wrong(RawRecord);
    impl Capturer for Wrong {
        type Error = RecordError;
        fn record_capacity(&self) -> u64 {
            1
        }
        fn capture(&mut self, _: Region, sink: &mut Sink<'_>) -> Result<Captured, RecordError> {
            let records = RawRecords {
                quads: &[self.0],
                depths: &[],
            };
            sink(records).map(|()| Captured::Complete)
        }
    }
    let record = |draw, primitive, group| RawRecord {
        header: RawRecord::pack(0, 0, 15, group),
        primitive,
        draw,
        ..RawRecord::default()
    };
    let cases = [
        (record(2, 0, 0), "a draw below 2, found 2"),
        (record(0, 0, 3), "a group below 1 of draw 0, found 3"),
        (record(0, 7, 0), "primitive"),
    ];
    for (record, expected) in cases {
        let mut recorder = recorder();
        let refused = recorder.capture_pass(&mut Wrong(record));
        let message = refused.unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

/// The texture, sampler and draws of the analytic scene as events, followed by the start of a pass.
fn begun() -> InMemory {
    let tables = tables();
    let mut recording = Recorder::new(TextraceWriter::growing_in_memory().unwrap(), Vec::new());
    recording.texture(tables.textures[0].clone()).unwrap();
    let index = |r: &mut Recorder<_>| r.sampler(tables.samplers[0]).unwrap();
    assert_eq!([0, 0], [index(&mut recording), index(&mut recording)]);
    recording.begin_pass(tables.passes[0]).unwrap();
    for (draw, replay) in tables.draws.iter().zip(REPLAYS) {
        recording.draw(draw.clone(), replay).unwrap();
    }
    recording
}

const REPLAYS: [DepthReplay; 2] = [DepthReplay::None, DepthReplay::Less];

/// All records of the analytic scene and their depths.
fn all_records() -> (Vec<RawRecord>, Vec<RawDepth>) {
    let mut all = (Vec::new(), Vec::new());
    let whole = Region {
        origin_px: [0, 0],
        size_px: SIZE_PX,
    };
    let mut take = |records: RawRecords<'_>| {
        all.0.extend(records.quads);
        all.1.extend(records.depths);
        Ok(())
    };
    let mut capturer = Analytic::new(1 << 20, false);
    capturer.capture(whole, &mut take).unwrap();
    all
}

/// The trace of events.
fn finished(recorder: InMemory) -> Textrace {
    let mut writer = recorder.into_writer().unwrap();
    writer.set_meta(tables().meta).unwrap();
    Textrace::from_bytes(writer.into_bytes().unwrap()).unwrap()
}

fn tiles(trace: &Textrace) -> Vec<Tile> {
    let decode = |index| {
        let mut tile = Tile::default();
        trace.decode_tile(0, index, &mut tile).unwrap();
        tile
    };
    (0..24).map(decode).collect()
}

#[test]
fn events_give_the_same_tiles_as_a_capturer_that_is_asked() {
    let asked = trace(&mut Analytic::new(1 << 20, false)).unwrap();
    let asked = Textrace::from_bytes(asked).unwrap();
    let (quads, depths) = all_records();
    for part in [1, 7, quads.len()] {
        let mut recording = begun();
        // The first parts have no masked draw and therefore no depths.
        for (quads, depths) in quads.chunks(part).zip(depths.chunks(part)) {
            let masked = quads.iter().any(|quad| quad.draw == 1);
            let depths = if masked { depths } else { &[] };
            recording.records(RawRecords { quads, depths }).unwrap();
        }
        let recorded = recording.end_pass().unwrap();
        let pushed = finished(recording);
        assert_eq!(pushed.tables(), asked.tables());
        assert_eq!(tiles(&pushed), tiles(&asked), "{part} at a time");
        assert_eq!(recorded.counts.records, asked.records());
    }
}

#[test]
fn operands_stay_with_their_record_in_loops_and_with_values_that_are_not_finite() {
    let mut recording = Recorder::new(TextraceWriter::growing_in_memory().unwrap(), Vec::new());
    let tables = tables();
    recording.texture(tables.textures[0].clone()).unwrap();
    recording.sampler(tables.samplers[0]).unwrap();
    let mut draw = tables.draws[0].clone();
    draw.groups[0].samples[0].level = SampleLevel {
        rule: LodRule::Explicit,
        lod_256ths: 0,
        operands: true,
    };
    let operands = UvGroup {
        extent: [1, 1],
        samples: Vec::new(),
    };
    draw.groups.insert(0, operands);
    recording.draw(draw, DepthReplay::None).unwrap();
    recording.begin_pass(tables.passes[0]).unwrap();
    let pair = |level: f32, u: f32| {
        let record = RawRecord {
            header: RawRecord::pack(3, 2, 0b1111, 1),
            uv: [u, 0.0],
            ..RawRecord::default()
        };
        let operands = RawRecord {
            header: RawRecord::pack(3, 2, 0b1111, 0),
            passing: RawRecord::OPERANDS,
            uv: [level, 0.0],
            ..RawRecord::default()
        };
        [operands, record]
    };
    // Four iterations of a loop. The coordinate of one and the level of another are not finite.
    let quads = [
        pair(3.0, 0.25),
        pair(2.0, f32::NAN),
        pair(f32::NAN, 0.5),
        pair(1.0, 0.75),
    ];
    let quads = quads.as_flattened();
    recording
        .records(RawRecords { quads, depths: &[] })
        .unwrap();
    let recorded = recording.end_pass().unwrap();
    assert_eq!(
        (recorded.counts.records, recorded.counts.not_finite),
        (4, 2)
    );
    let tile = &tiles(&finished(recording))[0];
    let found: Vec<_> = tile.records.iter().map(|r| (r.group, r.uv[0])).collect();
    let texel = |u: f32| (u * EDGE as f32) as i32 * SUBTEXELS;
    assert_eq!(
        found,
        [
            (0, 3 * SUBTEXELS),
            (1, texel(0.25)),
            (0, SUBTEXELS),
            (1, texel(0.75))
        ]
    );
}

#[test]
fn calls_at_the_wrong_time_are_refused() {
    let none = RawRecords {
        quads: &[],
        depths: &[],
    };
    let mut recording = begun();
    let text = recording
        .begin_pass(tables().passes[0])
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("expected no open pass, found pass 0"),
        "{text}"
    );
    recording.end_pass().unwrap();
    for error in [
        recording.end_pass().unwrap_err(),
        recording.records(none).unwrap_err(),
    ] {
        let text = error.to_string();
        assert!(text.contains("expected an open pass, found none"), "{text}");
    }
    let Err(error) = begun().into_writer() else {
        panic!("an open pass was finished");
    };
    assert!(error.to_string().contains("no open pass"), "{error}");
    let depths = [RawDepth::default()];
    let uneven = RawRecords {
        depths: &depths,
        ..none
    };
    let text = begun().records(uneven).unwrap_err().to_string();
    assert!(text.contains("expected no depths or 0, found 1"), "{text}");
}
