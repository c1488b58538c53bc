//! Compares `replay orders` with plain caches that replay the output of `replay convert`, and tests searched
//! orders in files and refusals.

use parallax_tests::lru::Lru;
use parallax_tests::{program, refuse, root, run_ok};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

const LINE_BYTES: u64 = 16;

/// A trace of one frame.
fn trace() -> PathBuf {
    root().join("traces/atrium.textrace")
}

fn orders(arguments: &[&str]) -> Value {
    orders_of(&trace(), arguments)
}

fn orders_of(trace: &Path, arguments: &[&str]) -> Value {
    let mut command = program("replay");
    command.arg("orders").arg(trace).args(arguments);
    let output = run_ok(command.arg("--json"));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// The row of an order.
fn row<'a>(json: &'a Value, order: &str) -> &'a Value {
    let rows = json["rows"].as_array().expect("rows");
    let found = rows.iter().find(|row| row["order"] == order);
    found.unwrap_or_else(|| panic!("no row of {order}"))
}

/// Uses one core, and orders that differ in every part.
#[test]
fn bytes_equal_those_of_plain_caches_with_din_input() {
    let names = [
        "gilbert+sta",
        "zig-zag+halves+offset",
        "band2+merge+infinity",
        "strip8+lrta",
        "scanline+right-reversed",
        "adaptive16+sta+offset",
        "zig-zag+merge+row-primitives",
        "zig-zag+lrta+row-lines",
        "zig-zag+sta+offset+runs",
    ];
    let all = names.join(",");
    let json = orders(&["--orders", &all, "--cores", "1", "--caches", "4/16"]);
    let mut bytes = Vec::new();
    for name in names {
        let output = run_ok(
            program("replay")
                .args(["convert", "--to", "din", "--order", name, "-o", "-"])
                .arg(trace()),
        );
        let text = String::from_utf8(output.stdout).expect("din is text");
        let (mut l1, mut l2) = (Lru::new(64, 4), Lru::new(256, 4));
        let address = |line: &str| u64::from_str_radix(&line[2..], 16).expect("an address");
        let lines = text.lines().map(|line| address(line) / LINE_BYTES);
        let misses = lines
            .filter(|line| !l1.access(*line) && !l2.access(*line))
            .count() as u64;
        assert_eq!(
            row(&json, name)["external_bytes"],
            misses * LINE_BYTES,
            "{name}"
        );
        bytes.push(misses);
    }
    bytes.sort_unstable();
    bytes.dedup();
    assert_eq!(bytes.len(), names.len(), "orders that differ: {bytes:?}");
}

#[test]
fn rows_describe_their_order_and_its_requirements() {
    let json = orders(&[
        "--orders",
        "zig-zag+sta+offset+boustro",
        "--caches",
        "8/64",
        "--bounds",
    ]);
    assert_eq!(json["schema"], "replay.orders/2");
    let own = row(&json, "zig-zag+sta+offset+boustro");
    assert_eq!(own["buildable"], true);
    assert_eq!(own["information"], "display");
    assert!(own["state_bytes"].as_u64() <= Some(64));
    assert_eq!(own["tile_buffers"], 2);
    assert_eq!(
        (&own["l1_kib"], &own["l2_kib"]),
        (&8.0.into(), &64.0.into())
    );
    assert_eq!(
        (&own["frames"], &own["between_frames"]),
        (&1.into(), &"keep".into())
    );
    // A single frame is traversed forwards.
    let single = row(&json, "z2-sta");
    assert_eq!(single["change_pct"], 0.0);
    let run = run_ok(program("replay").arg("run").arg(trace()).args([
        "--order",
        "zig-zag+sta+offset",
        "--l2",
        "64KiB",
        "--mode",
        "functional",
        "--json",
    ]));
    let run: Value = serde_json::from_slice(&run.stdout).expect("one JSON object");
    assert_eq!(own["external_bytes"], run["result"]["external_bytes"]);
    // No row is below the infinite cache, and OPT is below LRU.
    let bytes = |order: &str| row(&json, order)["external_bytes"].as_u64().expect("bytes");
    let infinite = bytes("bound: infinite cache");
    let opt = bytes("bound: OPT of z2-sta");
    let ways = bytes("bound: OPT by ways of z2-sta");
    assert!(infinite <= opt && opt <= ways && ways < bytes("z2-sta"));
    assert!(bytes("bound: windows") <= bytes("z2-sta"));
    assert_eq!(row(&json, "bound: windows")["buildable"], false);
}

#[test]
fn searched_orders_from_files_replay_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("a name");
    let usual = ["--orders", "z2-sta", "--caches", "8/32"];
    let search = [
        "--search",
        "greedy,anneal",
        "--moves",
        "3000",
        "--save-orders",
        path,
    ];
    let searched = orders(&[&usual[..], &search[..]].concat());
    let anneal = folder.path().join("atrium.anneal.32k.order");
    let greedy = folder.path().join("atrium.greedy.32k.order");
    let files = [
        "--order-file",
        anneal.to_str().unwrap(),
        "--order-file",
        greedy.to_str().unwrap(),
    ];
    let read = orders(&[&usual[..], &files[..]].concat());
    for name in ["greedy", "anneal"] {
        assert_eq!(row(&searched, name), row(&read, name));
        assert_eq!(row(&read, name)["information"], "future");
        assert_eq!(row(&read, name)["buildable"], false);
    }
    assert_eq!(row(&read, "greedy")["closed_pct"], 100.0);

    let refused = |text: &str, expected: &[&str]| {
        fs::write(&greedy, text).expect("a file");
        let mut command = program("replay");
        command
            .arg("orders")
            .arg(trace())
            .args(["--order-file"])
            .arg(&greedy);
        refuse(&mut command, expected);
    };
    let text = fs::read_to_string(&anneal).expect("a file");
    refused(
        "",
        &[
            "greedy.32k.order",
            "line 1: expected `parallax order 1`, found nothing",
        ],
    );
    let line = text.lines().nth(5).expect("an item");
    refused(
        &text.replacen(line, "0:0", 1),
        &["greedy.32k.order", "expected "],
    );
    refused(
        &text.replacen("name anneal", "name z2-sta", 1),
        &[
            "greedy.32k.order",
            "line 3: expected a name of no other order or bound, found `z2-sta`",
        ],
    );
    let checksum = text.lines().nth(1).expect("the trace");
    refused(
        &text.replacen(checksum, "trace 00000000", 1),
        &["expected an order of one of the traces", "00000000"],
    );
}

#[test]
fn an_order_file_for_another_l2_is_named_and_not_replayed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("a name");
    let usual = ["--orders", "z2-sta", "--caches"];
    let search = ["8/32", "--search", "greedy", "--save-orders", path];
    orders(&[&usual[..], &search].concat());
    let file = folder.path().join("atrium.greedy.32k.order");
    let mut command = program("replay");
    command
        .arg("orders")
        .arg(trace())
        .args(usual)
        .arg("8/64,8/128");
    let output = run_ok(command.arg("--json").arg("--order-file").arg(&file));
    let message = String::from_utf8(output.stderr).expect("text");
    let expected = "atrium.greedy.32k.order: not replayed: expected l2_bytes of one of the L2 caches of --caches \
         (64 KiB, 128 KiB), found 32768 (32 KiB)";
    assert!(message.contains(expected), "{message}");
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let rows = json["rows"].as_array().expect("rows");
    assert!(rows.iter().all(|row| row["order"] == "z2-sta") && rows.len() == 2);
}

/// With an L2 that holds everything, orders are equal, and the result says so.
#[test]
fn equal_orders_have_results_and_a_warning() {
    let mut command = program("replay");
    command.arg("orders").arg(trace());
    let output = run_ok(command.args(["--orders", "z2-sta,morton", "--caches", "16/65536"]));
    let (table, message) = (output.stdout, output.stderr);
    let table = String::from_utf8(table).expect("text");
    assert!(
        table.contains("against Z2 STA") && table.contains("0.00"),
        "{table}"
    );
    let message = String::from_utf8(message).expect("text");
    assert!(
        message.contains("atrium: the caches fetch each distinct line once"),
        "{message}"
    );
    let small = run_ok(program("replay").arg("orders").arg(trace()).args([
        "--orders",
        "z2-sta,morton",
        "--caches",
        "4/16",
    ]));
    let message = String::from_utf8(small.stderr).expect("text");
    assert!(!message.contains("distinct line once"), "{message}");
}

#[test]
fn all_orders_are_those_that_are_compared_by_default() {
    let names = |arguments: &[&str]| -> Vec<String> {
        let json = orders(&[&["--caches", "4/16"][..], arguments].concat());
        let rows = json["rows"].as_array().expect("rows");
        let names = rows
            .iter()
            .map(|row| row["order"].as_str().expect("a name").to_owned());
        names.collect()
    };
    let all = names(&["--orders", "all"]);
    assert!(all.len() > 40);
    assert_eq!(all, names(&[]));
}

/// Replays two frames with caches kept or emptied between them, and with the learner.
#[test]
fn rows_cover_kept_and_emptied_caches_and_compare_the_learner_with_fixed_orders() {
    let trace = root().join("traces/jungle.textrace");
    let json = orders_of(
        &trace,
        &[
            "--orders",
            "morton+sta+boustro",
            "--caches",
            "8/64",
            "--between",
            "keep,lose-50,flush",
            "--learn",
            "z2-sta,morton+sta+boustro",
        ],
    );
    let bytes = |between: &str, order: &str| {
        let rows = json["rows"].as_array().expect("rows");
        let found = rows
            .iter()
            .find(|row| row["order"] == order && row["between_frames"] == between);
        found.expect("a row")["external_bytes"]
            .as_u64()
            .expect("bytes")
    };
    let of = |order| ["keep", "lose-50", "flush"].map(|between| bytes(between, order));
    let (plain, boustro) = (of("z2-sta"), of("morton+sta+boustro"));
    assert!(
        boustro[0] < boustro[1] && boustro[1] < boustro[2],
        "{boustro:?}"
    );
    // Reversing every other frame saves bytes if the L2 keeps its lines. If the L2 is emptied, it is just
    // another order.
    assert!(boustro[0] < plain[0], "{boustro:?} {plain:?}");
    let learned = json["learned"].as_array().expect("what was learned");
    let kept: Vec<&Value> = learned
        .iter()
        .filter(|row| row["between_frames"] == "keep")
        .collect();
    assert_eq!(kept.len(), 3);
    for (row, order) in kept.iter().zip(["z2-sta", "morton+sta+boustro"]) {
        assert_eq!(row["order"], order);
        assert_eq!(row["external_bytes"], bytes("keep", order), "{order}");
    }
    assert_eq!(kept[2]["order"], "learned");
    assert!(kept[2]["regret_pct"].as_f64() >= Some(0.0));
}

#[test]
fn output_does_not_depend_on_the_number_of_threads() {
    let run = |threads: &str, html: &Path| {
        let mut command = program("replay");
        command.arg("orders").arg(trace()).args([
            "--caches", "8/32", "--search", "anneal", "--moves", "2000", "--bounds",
        ]);
        let output = run_ok(
            command
                .args(["--json", "--threads", threads, "--html"])
                .arg(html),
        );
        (output.stdout, fs::read(html).expect("a page"))
    };
    let folder = tempfile::tempdir().expect("a folder");
    let pages = ["one.html", "two.html"].map(|name| folder.path().join(name));
    let (one, two) = (run("1", &pages[0]), run("3", &pages[1]));
    assert!(one.0 == two.0 && one.1 == two.1);
    let page = String::from_utf8(one.1).expect("a page is text");
    assert!(page.contains("zig-zag+sta+offset") && page.contains("<svg"));
}

#[test]
fn contradicting_options_are_refused() {
    let refused = |arguments: &[&str], expected: &[&str]| {
        let mut command = program("replay");
        refuse(command.arg("orders").arg(trace()).args(arguments), expected);
    };
    refused(
        &["--orders", "zig-zag+sta+offset+spin"],
        &["--orders: `spin`: expected a part, one of sv, lrta, sta, merge, halves, index, offset"],
    );
    refused(
        &["--orders", "zig-zag4"],
        &["`zig-zag4`: expected no number behind zig-zag"],
    );
    refused(
        &["--orders", "strip0"],
        &["`strip0`: expected 1 to 1048576 columns"],
    );
    refused(
        &["--orders", "morton+offset"],
        &["`offset` pairs tiles: expected lrta, sta, merge or halves with it"],
    );
    refused(
        &["--order", "z2-sta"],
        &["--order is varied here; use --orders"],
    );
    refused(
        &["--between", "lose-0"],
        &[
            "--between: expected keep, flush, or lose-N",
            "found `lose-0`",
        ],
    );
    refused(
        &["--search", "best"],
        &[
            "--search: expected greedy, greedy-N with a look-ahead of N items, or anneal, found `best`",
        ],
    );
    let mut run = program("replay");
    refuse(
        run.arg("run").arg(trace()).args(["--order", "spiral+sta"]),
        &[
            "invalid value 'spiral+sta' for '--order <ORDER>'",
            "`spiral`: expected a curve, one of scanline, zig-zag",
        ],
    );
}
