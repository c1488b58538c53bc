mod mutations;

use super::*;
use sim::config::{Mode, Order, RunConfig};
use sim::engine::Work;
use sim::result::TraceId;
use sim::stream::MemoryTrace;
use sim::stream::testing::tables;

/// A trace without passes. Its replay is empty, which suffices to count replays.
fn empty(scene: &str) -> MemoryTrace {
    let mut tables = tables(&[]);
    tables.meta.scene = scene.to_owned();
    tables.passes.clear();
    MemoryTrace {
        tables,
        tiles: Vec::new(),
    }
}

fn id(checksum: &str) -> TraceId {
    TraceId {
        scene: "empty".into(),
        checksum: checksum.into(),
        ..TraceId::default()
    }
}

fn plan(file: &str) -> Plan {
    ExperimentFile::parse(file).unwrap().plan().unwrap()
}

fn refusal(file: &str) -> String {
    let parsed = ExperimentFile::parse(file);
    parsed.and_then(|f| f.plan()).unwrap_err().to_string()
}

const FILE: &str = "traces = [\"a.textrace\"]\n\n[base]\nmode = \"functional\"\n\n[axes]\norder = [\"morton\", \"z2-sta\"]\nl1.size_bytes = [\"8KiB\", \"16KiB\"]\n\n[one-at-a-time]\nlayout.block_order = [\"morton\"]\n";

#[test]
fn axes_are_crossed_and_changes_are_made_one_at_a_time() {
    let points = plan(FILE).points;
    let titles: Vec<String> = points.iter().map(Point::title).collect();
    assert_eq!(titles.len(), 8);
    assert_eq!(titles[1], "order=morton l1.size_bytes=16KiB");
    assert_eq!(
        titles[7],
        "order=z2-sta l1.size_bytes=16KiB layout.block_order=morton"
    );
    assert!(points.iter().all(|p| p.config.mode == Mode::Functional));
    assert_eq!(points[3].config.order, Order::Z2_STA);
    assert_eq!(points[3].config.level.l1.size_bytes, 16 << 10);
    assert_eq!(points[3].config.level.l1.ways, 4);
}

#[test]
fn levels_below_the_l2_can_be_axes() {
    let sizes = |file: &str| -> Vec<Vec<u64>> {
        let points = plan(file).points.into_iter();
        let sizes = points.map(|p| p.config.level.lower().map(|l| l.size_bytes).collect());
        sizes.collect()
    };
    let added = "[axes]\nl3.size_bytes = [\"1MiB\", \"4MiB\"]\n";
    assert_eq!(sizes(added), [vec![1 << 20], vec![4 << 20]]);
    let base = "[base.l3]\nsize_bytes = \"1MiB\"\nways = 8\n";
    assert_eq!(sizes(base), [vec![1 << 20]]);
    let second = "[axes]\nl4.size_bytes = [\"4MiB\"]\n[one-at-a-time]\nl3.ways = [4]\n";
    let both = format!("{base}{second}");
    assert_eq!(
        sizes(&both),
        [vec![1 << 20, 4 << 20], vec![1 << 20, 4 << 20]]
    );
    let points = plan(&both).points;
    let ways = |point: &Point| point.config.level.lower().next().unwrap().ways;
    assert_eq!(points.iter().map(ways).collect::<Vec<_>>(), [8, 4]);
    let three = "[{ size_bytes = 1024 }, { size_bytes = 4096 }, { size_bytes = \"1MiB\" }]";
    let whole = format!("[one-at-a-time]\nlevel = [{three}]\n");
    assert_eq!(sizes(&whole).last().unwrap(), &[1 << 20]);
    for (file, text) in [
        (
            "[axes]\nl4.size_bytes = [\"1MiB\"]\n",
            "`l4.size_bytes`: unknown field `l4`",
        ),
        (
            "[axes]\nlevel.size_bytes = [\"1MiB\"]\n",
            "expected a sequence",
        ),
        ("[axes]\nl3.ways = [4]\n", "missing field `size_bytes`"),
        ("[axes]\nl1.0.ways = [4]\n", "line 2: `l1.0.ways`"),
    ] {
        let found = refusal(file);
        assert!(found.contains(text), "{file}: {found}");
    }
}

#[test]
fn invalid_files_are_refused_with_the_line() {
    for (file, text) in [
        (
            "[axes]\norder = [\"morton\"]\nl7.size_bytes = [\"1MiB\"]\n",
            "line 3: `l7.size_bytes`: unknown field `l7`, expected one of `mode`, `order`",
        ),
        (
            "[base]\nseed = 2\n[axis]\n",
            "line 3: `axis`: unknown key, expected one of traces, base, axes, one-at-a-time",
        ),
        ("[axes]\n\norder = [\"spiral\"]\n", "line 3: `order`: "),
        (
            "[axes]\norder = \"morton\"\n",
            "line 2: `order`: expected a list of values, found \"morton\"",
        ),
        ("[base]\nseed = = 1\n", "line 2: "),
        (
            "[axes]\nl1.ways = [2]\n\"l1.ways\" = [4]\n",
            "line 3: `l1.ways`: duplicate key",
        ),
        (
            "[base]\n\"l1.ways\" = 2\nl1 = { ways = 4 }\n",
            "line 3: `l1.ways`: duplicate key",
        ),
        (
            "[axes]\nl1.size_bytes = [-1]\n",
            "line 2: `l1.size_bytes`: invalid value: integer `-1`, expected a number of bytes or a text",
        ),
        (
            "axes = 1\n",
            "line 1: `axes`: expected a table, found integer",
        ),
    ] {
        let found = refusal(file);
        assert!(found.starts_with(text), "{found}");
    }
}

#[test]
fn an_impossible_point_is_refused_at_planning() {
    let found = refusal("[axes]\nl1.size_bytes = [\"8KiB\", \"6KiB\"]\n");
    let expected = "point l1.size_bytes=6KiB: L1 cache of 6 KiB";
    assert!(found.starts_with(expected), "{found}");
    assert_eq!(
        refusal(
            "[base.l1]\nsize_bytes = \"6KiB\"\nways = 3\n[axes]\nl1.replacement = [\"lru\", \"tree-plru\"]\n"
        ),
        "point l1.replacement=tree-plru: L1 cache with tree-plru: expected 1, 2, 4 ... 64 ways, found 3"
    );
}

#[test]
fn millions_of_points_are_refused_before_they_are_created() {
    let values: Vec<String> = (1..=400).map(|i| i.to_string()).collect();
    let file = format!(
        "[axes]\nseed = [{0}]\ntmu.threads = [{0}]\n",
        values.join(",")
    );
    assert_eq!(
        refusal(&file),
        "expected at most 100000 points, found 160000"
    );
}

#[test]
fn the_example_experiments_can_be_planned() {
    for (text, points) in [
        (include_str!("../../../experiments/caches.toml"), 48),
        (include_str!("../../../experiments/open-choices.toml"), 39),
        (include_str!("../../../experiments/texel-density.toml"), 36),
        (include_str!("../../../experiments/shadow-maps.toml"), 18),
        (include_str!("../../../experiments/modes.toml"), 24),
    ] {
        assert_eq!(plan(text).points.len(), points);
    }
}

#[test]
fn a_second_run_computes_nothing_and_gives_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), None).unwrap();
    let trace = empty("empty");
    let subjects = [Subject::new(&trace, id("1"), "empty".into())];
    let plan = plan("[axes]\norder = [\"morton\", \"z2-sta\"]\nseed = [1, 2, 3]\n");
    let first = run(&plan, &subjects, Some(&store), &|_| ()).unwrap();
    assert_eq!(first.work.replays, 6);
    let store = Store::open(folder.path(), None).unwrap();
    let second = run(&plan, &subjects, Some(&store), &|_| ()).unwrap();
    assert_eq!(second.work.replays, 0);
    let results = |outcome: &Outcome| -> Vec<_> {
        let rows = outcome.rows();
        rows.iter().map(|row| row.result.clone()).collect()
    };
    assert_eq!(results(&first), results(&second));
}

#[test]
fn equal_configurations_are_replayed_once() {
    let trace = empty("empty");
    let subjects = [Subject::new(&trace, id("1"), "empty".into())];
    let plan = plan("[axes]\nseed = [1, 2]\n[one-at-a-time]\ncores = [2, 4]\n");
    let outcome = run(&plan, &subjects, None, &|_| ()).unwrap();
    assert_eq!((outcome.rows().len(), outcome.work.replays), (6, 4));
}

#[test]
fn rows_refer_to_the_points_they_are_compared_with() {
    let trace = empty("empty");
    let subjects = [Subject::new(&trace, id("1"), "empty".into())];
    let orders = [Order::MORTON, Order::Z2_STA];
    let caches = [(8 << 10, 128 << 10), (16 << 10, 128 << 10)];
    let plan = Plan::paper(RunConfig::default(), &caches, &orders, true).unwrap();
    let results: Vec<_> = (0..plan.points.len() as u64)
        .map(|quads| sim::result::RunResult {
            quads,
            ..Default::default()
        })
        .collect();
    let outcome = Outcome::new(&plan, &subjects, results, Work::default());
    let quads = |result: Option<&sim::result::RunResult>| result.map(|r| r.quads);
    let rows = outcome.rows();
    let of = |i: usize| {
        let row = &rows[i];
        [row.morton, row.unchanged, row.functional].map(quads)
    };
    // Timed: 8/128 in both orders, 16/128 in both orders; then the same in functional mode.
    assert_eq!(of(3), [Some(2), None, Some(7)]);
    assert_eq!(of(7), [Some(6), Some(3), None]);
}

#[test]
fn traces_of_one_scene_are_labelled_with_their_file_names() {
    let (atrium, other) = (empty("atrium"), empty("jungle"));
    let (one, two) = (id("11111111"), id("22222222"));
    let named = |list: &[(&MemoryTrace, &TraceId, &str)]| {
        let list: Vec<_> = list
            .iter()
            .map(|(trace, id, file)| (&trace.tables, *id, (*file).to_owned()))
            .collect();
        labels(&list)
    };
    assert_eq!(
        named(&[
            (&atrium, &one, "a"),
            (&atrium, &two, "b"),
            (&other, &one, "c")
        ]),
        ["a", "b", "jungle"]
    );
    assert_eq!(
        named(&[(&atrium, &one, "a"), (&atrium, &two, "a")]),
        ["a 11111111", "a 22222222"]
    );
}
