//! `order NAME tiles=CxR`: the work items of a frame.

use super::Settings;
use formats::textrace::{Pass, PassKind};
use formats::view::{Eye, EyeView, FrameViews};
use replay::order::{
    Counters, Order, PlanInputs, TileRef, View, ViewCounters, WorkItem, plan_frame,
};
use replay::stream::testing::{Synthetic, turned_eye};

pub fn output(settings: &Settings) -> Vec<String> {
    let order = Order::by_name(&settings.subject).unwrap_or_else(|why| panic!("{why:?}"));
    let tiles = settings.pair("tiles");
    let frame = settings.number("frame", 0) as u32;
    let is_one = settings.get("view") == Some("one");
    let pass = |eye| Pass {
        frame,
        kind: PassKind::Main,
        eye,
        layer: 0,
        size_px: tiles.map(|n| 16 * n),
        tiles,
    };
    let passes = match is_one {
        true => vec![pass(None)],
        false => vec![pass(Some(Eye::Left)), pass(Some(Eye::Right))],
    };
    let mut meta = Synthetic::default().generate().tables.meta;
    let eyes = ["left", "right"].map(|key| eye(settings, key));
    meta.frames = vec![FrameViews {
        eyes,
        ..FrameViews::default()
    }];
    let shifts = || {
        settings
            .list("shifts")
            .iter()
            .map(|n| n.parse().unwrap())
            .collect()
    };
    let counters = Counters {
        views: vec![ViewCounters {
            view: View::of(0, 0, &passes[0]),
            bytes: settings.number("bytes", 0),
            primitive_shift: shifts(),
            line_shift: shifts(),
        }],
    };
    let inputs = PlanInputs {
        seed: settings.number("seed", 1),
        cores: settings.number("cores", 2) as u32,
        tile_px: 16,
        l2_bytes: settings.number("l2_bytes", 128 << 10),
        line_bytes: 16,
        meta: Some(&meta),
        last: (settings.get("bytes").or(settings.get("shifts"))).map(|_| &counters),
    };
    let items = plan_frame(order, &inputs, &passes, frame).concat();
    if is_one {
        return steps(&items, tiles);
    }
    let eye_of = |at: TileRef| format!("{}{}", if at.pass == 0 { 'L' } else { 'R' }, at.tile);
    let items: Vec<String> = (items.iter())
        .map(|item| item.tiles().map(eye_of).collect::<Vec<_>>().join("+"))
        .collect();
    items.chunks(12).map(|line| line.join("  ")).collect()
}

/// The step at which each tile of a view is visited, row by row.
fn steps(items: &[WorkItem], [columns, rows]: [u32; 2]) -> Vec<String> {
    let mut steps = vec![0; (columns * rows) as usize];
    for (step, item) in items.iter().enumerate() {
        for at in item.tiles() {
            steps[at.tile as usize] = step;
        }
    }
    let row = |row: &[usize]| {
        row.iter()
            .map(|step| format!("{step:3}"))
            .collect::<String>()
    };
    steps.chunks(columns as usize).map(row).collect()
}

/// An eye: tangents of its left, right, top and bottom edges, and its outward turn as a sine and cosine in
/// fifths. The default is symmetric and looks straight ahead.
fn eye(settings: &Settings, key: &str) -> EyeView {
    let numbers: Vec<f32> = settings
        .list(key)
        .iter()
        .map(|n| n.parse().unwrap())
        .collect();
    let tangents = numbers.try_into().unwrap_or([1.0; 4]);
    let [sine, cosine] = match settings.get("turned") {
        Some("3-4-5") => [0.6, 0.8],
        _ => [0.0, 1.0],
    };
    let sine = if key == "left" { sine } else { -sine };
    turned_eye([sine, cosine], tangents)
}
