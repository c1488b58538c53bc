//! Commands begin with their answer: a sentence with a number, then a table that fits a terminal.

use parallax_tests::{program, refuse, root, run_ok};
use std::path::{Path, PathBuf};

/// Widest line of the text without `--details`.
const TERMINAL_CHARS: usize = 100;

/// Commands, and where their inputs are.
fn commands() -> Vec<(&'static str, PathBuf)> {
    let [traces, data] = ["traces", "tests/tests/data"].map(|folder| root().join(folder));
    vec![
        ("run atrium.textrace --order z2-sta", traces.clone()),
        ("run geometry.textrace --frame tile-based", data.clone()),
        (
            "paper atrium.textrace --caches 8/128,16/256",
            traces.clone(),
        ),
        ("orders program.textrace --caches 8/64", traces.clone()),
        (
            "orders program.textrace --orders morton,z2-sta,zig-zag+sta+offset+affinity",
            traces.clone(),
        ),
        ("locality program.textrace", traces.clone()),
        (
            "schedule atrium.textrace --schedulers z2-sta",
            traces.clone(),
        ),
        ("reproject chess-rays.raytrace", traces),
        ("temporal frame-0.raytrace frame-1.raytrace", data.clone()),
        ("techniques techniques --orders morton,z2-sta", data.clone()),
        ("sample plan.textrace --values frames.csv", data),
    ]
}

fn text(command: &str, folder: &Path) -> String {
    let output = run_ok(
        program("replay")
            .args(command.split(' '))
            .current_dir(folder),
    );
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn the_answer_comes_first_and_its_lines_fit_a_terminal() {
    for (command, folder) in commands() {
        let text = text(command, &folder);
        let (answer, table) = text.split_once("\n\n").expect("an answer, then a table");
        let first = answer.split(". ").next().expect("a sentence");
        assert!(
            answer.ends_with('.') && first.contains(|c: char| c.is_ascii_digit()),
            "{command}: {answer}"
        );
        for line in text.lines() {
            assert!(
                line.chars().count() <= TERMINAL_CHARS,
                "{command}: {} characters: {line}",
                line.chars().count()
            );
        }
        assert!(!table.contains("largest error of"), "{command}: {table}");
    }
}

#[test]
fn details_add_tables_and_change_no_line() {
    for (command, folder) in commands() {
        let short = text(command, &folder);
        let Some(kept) = short.strip_suffix("\n(more tables: --details)\n") else {
            let has_none = ["sample", "schedule"]
                .iter()
                .any(|of| command.starts_with(of));
            assert!(has_none, "{command}");
            parallax_tests::refuse(
                program("replay")
                    .args(command.split(' '))
                    .arg("--details")
                    .current_dir(folder),
                &["--details", "no other tables"],
            );
            continue;
        };
        let long = text(&format!("{command} --details"), &folder);
        assert!(
            long.starts_with(kept) && long.len() > kept.len(),
            "{command}: {long}"
        );
    }
}

/// Answer and condition stand in the first three lines: the sentence about machine or measurement begins there.
#[test]
fn the_condition_begins_in_the_first_three_lines() {
    for (command, folder) in commands() {
        let text = text(command, &folder);
        let conditions = ["Machine: ", "Measured at ", "frames"];
        let at = text
            .lines()
            .position(|line| conditions.iter().any(|of| line.contains(of)));
        assert!(at.is_some_and(|line| line < 3), "{command}: {text}");
    }
}

#[test]
fn markdown_has_the_cells_of_the_table() {
    for (command, folder) in commands() {
        let markdown = text(&format!("{command} --markdown"), &folder);
        let plain = text(command, &folder);
        let rows: Vec<&str> = markdown.lines().filter(|l| l.starts_with('|')).collect();
        assert!(
            rows.len() > 2 && rows[1].contains("---"),
            "{command}: {markdown}"
        );
        // A heading is followed by a line of dashes.
        let is_cells = |row: &usize| {
            let mut around = rows.iter().skip(*row).take(2);
            around.all(|row| !row.contains("---"))
        };
        for row in (0..rows.len()).filter(is_cells).map(|row| rows[row]) {
            for cell in row.split('|').map(str::trim) {
                assert!(plain.contains(cell), "{command}: {cell}");
            }
        }
    }
}

#[test]
fn a_cache_that_holds_everything_is_named_in_the_answer() {
    let folder = root().join("traces");
    let all = text("run program.textrace --l2 64MiB", &folder);
    assert!(
        all.contains("The L2 holds everything; no order can save."),
        "{all}"
    );
    let equal = text(
        "orders program.textrace --orders morton,z2-sta --caches 64/65536",
        &folder,
    );
    assert!(equal.starts_with("No order can save here"), "{equal}");
}

#[test]
fn a_change_of_a_result_beyond_the_threshold_has_exit_code_1() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = root().join("traces/atrium.textrace");
    for order in ["morton", "z2-sta"] {
        let output = run_ok(
            program("replay")
                .arg("run")
                .arg(&trace)
                .args(["--json", "--order", order]),
        );
        std::fs::write(folder.path().join(order), output.stdout).expect("a file");
    }
    let diff = |files: [&str; 2], threshold: &str| {
        let mut command = program("replay");
        command
            .arg("diff")
            .args(files)
            .args(["--threshold", threshold]);
        command
            .current_dir(folder.path())
            .output()
            .expect("replay starts")
    };
    let changed = diff(["morton", "z2-sta"], "1");
    let text = String::from_utf8_lossy(&changed.stdout);
    assert_eq!(changed.status.code(), Some(1));
    assert!(
        text.starts_with("z2-sta reads 42.8 % less texture data from DRAM than morton"),
        "{text}"
    );
    assert!(
        text.contains("config.order: \"morton\" and \"z2-sta\""),
        "{text}"
    );
    assert_eq!(diff(["morton", "z2-sta"], "99").status.code(), Some(0));
    assert_eq!(diff(["morton", "morton"], "0").status.code(), Some(0));
    std::fs::write(folder.path().join("other"), "{}").expect("a file");
    assert_eq!(diff(["other", "morton"], "0").status.code(), Some(2));
}

#[test]
fn a_capture_on_the_command_line_is_replayed_and_removed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let tracegen = program("tracegen").get_program().to_owned();
    let flags = [
        "raster",
        "atrium",
        "--size",
        "64x72",
        "--no-plain",
        "--no-cache",
    ];
    let mut command = program("replay");
    command
        .args(["run", "--json", "--"])
        .arg(&tracegen)
        .args(flags);
    let direct = run_ok(command.env("TMPDIR", folder.path())).stdout;
    assert_eq!(folder.path().read_dir().expect("a folder").count(), 0);
    let trace = folder.path().join("atrium.textrace");
    run_ok(program("tracegen").args(flags).arg("-o").arg(&trace));
    let captured = run_ok(program("replay").args(["run", "--json"]).arg(&trace)).stdout;
    assert_eq!(String::from_utf8(direct), String::from_utf8(captured));
    for (words, expected) in [
        (
            &["scenes"][..],
            "expected raster, rays, techniques, app, page or xr, found",
        ),
        (&["raster", "none.glb"], "none.glb"),
    ] {
        let mut command = program("replay");
        command.args(["run", "--"]).arg(&tracegen).args(words);
        refuse(command.env("TMPDIR", folder.path()), &[expected]);
    }
    assert_eq!(folder.path().read_dir().expect("a folder").count(), 1);
}
