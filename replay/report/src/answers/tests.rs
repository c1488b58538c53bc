//! Tests of the sentences.

use super::*;

fn orders(saved: &[f64]) -> Vec<(String, f64)> {
    let names = ["Z2 LRTA", "Z2 STA", "Hilbert"];
    names
        .into_iter()
        .map(str::to_owned)
        .zip(saved.iter().copied())
        .collect()
}

#[test]
fn the_answer_covers_orders_that_save_or_cost_and_a_single_order() {
    let text = |saved: &[f64]| tile_orders("Morton", "mean of atrium", &orders(saved)).join(" ");
    assert_eq!(
        text(&[]),
        "Only Morton was replayed, so no order is compared with another."
    );
    assert_eq!(
        text(&[12.0]),
        "Z2 LRTA fetches 12.0 % less texture data from memory than Morton (mean of atrium)."
    );
    assert_eq!(
        text(&[0.01]),
        "Z2 LRTA fetches as much texture data from memory as Morton (mean of atrium)."
    );
    assert_eq!(
        text(&[5.0, 12.0, -3.0]),
        "Of 4 tile orders, Z2 STA fetches the least texture data from memory: 12.0 % less than Morton (mean of atrium). \
         Hilbert fetches the most: 3.0 % more than Morton."
    );
    assert!(!text(&[5.0, 12.0]).contains("the most"));
    assert_eq!(
        text(&[-5.0, -0.01]),
        "None of the 2 other orders fetches less texture data from memory than Morton; Z2 STA comes closest with as much (mean of atrium). \
         Z2 LRTA fetches the most: 5.0 % more than Morton."
    );
}

#[test]
fn the_answer_covers_sweeps_of_zero_one_equal_and_several_points() {
    let point = |name: &str, mb| (name.to_owned(), mb);
    assert_eq!(sweep(&[], &[]), ["No point was replayed."]);
    assert_eq!(
        sweep(&[point("base", 2.0)], &[]),
        ["One point was replayed: it fetches 2.00 MB per frame from memory."]
    );
    assert_eq!(
        sweep(&[point("a", 2.0), point("b", 2.001)], &[]),
        ["All 2 points fetch 2.00 MB per frame from memory: none of the settings changes it."]
    );
    let axis = |key: &str, low, high| (key.to_owned(), vec![point("1", low), point("2", high)]);
    let text = sweep(
        &[point("a", 0.0), point("b", 4.0)],
        &[axis("l1", 1.9, 2.0), axis("l2", 1.0, 3.0)],
    );
    assert_eq!(
        text.join(" "),
        "Over 2 points, external texture traffic ranges from 0.00 MB per frame (a) to 4.00 MB per frame (b). \
         Of 2 axes, l2 changes the mean most: from 1.00 MB per frame at 1 to 3.00 MB per frame at 2."
    );
}

#[test]
fn the_answer_covers_misses_of_one_order_equal_orders_and_different_orders() {
    let row = |order: &str, miss_pct| Misses {
        order: order.to_owned(),
        miss_pct,
        opt_pct: 1.0,
    };
    assert_eq!(misses("L1", &[]), None);
    assert_eq!(
        misses("L1", &[row("Morton", 3.0)]).unwrap(),
        "L1: 3.00 % of line accesses miss; it would be 1.00 % under optimal replacement."
    );
    let same = misses("L1", &[row("Morton", 3.0), row("Z2 STA", 3.001)]).unwrap();
    assert!(same.contains("in each of the 2 orders"), "{same}");
    let text = misses("L1", &[row("Morton", 3.0), row("Z2 STA", 2.0)]).unwrap();
    assert!(
        text.contains("Z2 STA has the fewest misses of 2 orders, 2.00 %"),
        "{text}"
    );
    assert!(text.ends_with("and Morton the most, 3.00 %."), "{text}");
}

#[test]
fn the_answer_covers_studies_without_buildable_orders_or_savings() {
    let order = |name: &str, change_pct, is_buildable| Studied {
        name: name.to_owned(),
        change_pct,
        is_buildable,
        range_pct: Some([change_pct - 1.0, change_pct + 1.0]),
        over_morton_pct: Some(change_pct - 40.0),
        state_bytes: name.len() as u64,
    };
    let over = "mean over 4 pairs of trace and caches";
    let of = |orders: &[Studied]| studied("z2-sta", orders, over);
    let alone = of(&[order("z2-sta", 0.0, true)]);
    assert_eq!(
        alone,
        [
            "Only z2-sta is an order that hardware can follow (mean over 4 pairs of trace and caches)."
        ]
    );
    let same = Studied {
        range_pct: None,
        ..order("zig", 0.01, true)
    };
    let equal = of(&[order("z2-sta", 0.0, true), same]);
    assert!(
        equal[0].contains("the other order reads as much"),
        "{equal:?}"
    );
    let worse = of(&[order("zig", 2.0, true), order("bound", -9.0, false)]);
    assert_eq!(
        worse[0],
        "No other buildable order reads less. The closest: zig reads 2.0 % more from memory than z2-sta \
         (+1.0 to +3.0 %, mean over 4 pairs of trace and caches)."
    );
    assert!(
        worse[1].contains("bound reads 9.0 % less from memory than z2-sta"),
        "{worse:?}"
    );
    let open = of(&[order("z2-sta", 0.0, true), order("zig", 0.0, true)]);
    assert_eq!(
        open[0],
        "All orders read as much from memory as z2-sta here; zig reads up to 1.0 % less in the best case \
         (mean over 4 pairs of trace and caches)."
    );
    let near = [order("zig-zag", -2.04, true), order("zig", -2.0, true)];
    assert_eq!(
        of(&near)[1],
        "One other is within 0.1 points of it; zig has the least state of them, 3 instead of 7 bytes."
    );
    let morton = Studied {
        over_morton_pct: Some(0.0),
        ..order("morton", 66.7, true)
    };
    let beside_morton = of(&[morton, order("z2-sta", 0.0, true), order("zig", -2.0, true)]);
    assert_eq!(
        beside_morton[0],
        "Best buildable order: zig reads 42.0 % less from memory than morton \
         (-3.0 to -1.0 %, mean over 4 pairs of trace and caches), and 2.0 % less than z2-sta."
    );
}

#[test]
fn the_answer_reports_reprojection_that_saves_no_energy() {
    let scene = |energy, paper| Reprojected {
        scene: "chess".to_owned(),
        performance: 1.5,
        energy,
        energy_bounds: [0.9 * energy, 1.1 * energy],
        reuse_pct: 90.0,
        flip: 0.01,
        paper,
    };
    assert!(reprojected(&[]).is_empty());
    let one = reprojected(&[scene(1.25, None)]).join(" ");
    assert!(
        one.starts_with("In chess, ")
            && one.contains("both eyes, 25.0 % more energy (1.12 to 1.38 times at 14 nm)."),
        "{one}"
    );
    assert!(!one.contains("paper"), "{one}");
    let two = reprojected(&[scene(1.0, Some([2.0, 0.5])), scene(1.0, None)]).join(" ");
    assert!(
        two.contains("the mean of 2 scenes")
            && two.contains("both eyes, the same energy (1.00 to 1.00 times, by scene; 0.90 to 1.10 times at 14 nm: whether it saves energy is open)."),
        "{two}"
    );
    assert!(
        two.contains("the scene that stands for one of its own"),
        "{two}"
    );
}

#[test]
fn the_answer_covers_slower_single_and_lossless_techniques() {
    let technique = |name: &str, time, flip| Timed {
        name: name.to_owned(),
        time: Spread {
            p1: time - 0.2,
            q1: time - 0.05,
            median: time,
            q3: time + 0.05,
            p99: time + 0.2,
            samples: LEAST_SAMPLES,
        },
        flip,
    };
    assert_eq!(
        timed("plant", &[], ("per-eye", None)),
        ["Only the baseline was measured on plant."]
    );
    assert_eq!(
        timed("plant", &[technique("a", 1.1, 0.02)], ("per-eye", None))[..1],
        [
            "On plant, a takes 10.0 % more frame time than the baseline (quartiles 1.05 to 1.15 times, 8 measurements) with a mean FLIP of 0.0200."
        ]
    );
    let text = timed(
        "plant",
        &[technique("a", 0.5, 0.02), technique("b", 0.8, 0.0)],
        ("per-eye", Some(technique("", 0.76, 0.0).time)),
    )
    .join(" ");
    assert!(text.contains("a is the fastest: 50.0 % less"), "{text}");
    assert!(
        text.contains("b is the fastest without any image error")
            && text.ends_with("against itself takes 0.76 times its time (quartiles 0.71 to 0.81): smaller differences are noise."),
        "{text}"
    );
    let text = timed(
        "plant",
        &[technique("a", 1.0, 0.0), technique("b", 1.2, 0.0)],
        ("per-eye", None),
    );
    assert_eq!(
        text[0],
        "Of 2 techniques on plant, a is the fastest: as much frame time as the baseline (quartiles 0.95 to 1.05 times, 8 measurements) without any image error."
    );
    assert!(
        text[1].contains("do not tell it from the baseline"),
        "{text:?}"
    );
    let mut few = technique("a", 0.5, 0.0);
    few.time.samples = LEAST_SAMPLES - 1;
    assert!(timed("plant", &[few], ("per-eye", None))[1].contains("do not tell"));
}

#[test]
fn recommendations_count_the_references() {
    let study = |name: &str, time, reference| (name.to_owned(), time, reference);
    assert_eq!(recommended(&[]), ["No study had its inputs."]);
    let one = recommended(&[study("mode", Some(0.5), false)]);
    assert!(
        one[1].contains("mode") && one[1].contains("0.50 times"),
        "{one:?}"
    );
    let two = recommended(&[study("a", Some(1.2), false), study("b", None, true)]);
    assert!(
        two[0].starts_with("1 of 2 studies") && two[0].ends_with("stays in b."),
        "{two:?}"
    );
    assert_eq!(two[1], "None of them saves time on this machine.");
}
