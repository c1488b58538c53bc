//! The examples of `docs/use/analysis.md` print what the page says, and Parquet holds what CSV does.

use parallax_tests::{program, root, run_ok};
use std::fs;
use std::path::Path;
use std::process::Command;

/// A fenced block of a page: its language and text.
type Block = (String, String);

fn blocks(page: &str) -> Vec<Block> {
    let mut fences = page.split("```").skip(1).step_by(2);
    fences
        .by_ref()
        .filter_map(|fence| fence.split_once('\n'))
        .map(|(language, text)| (language.to_owned(), text.to_owned()))
        .collect()
}

/// True where Python has all that a program imports; a line on stderr says what is missing.
fn can_run(program: &str) -> bool {
    let imports = program.lines().filter(|line| line.starts_with("import "));
    // pandas reads Parquet through pyarrow.
    let reader = program.contains("pandas").then_some("import pyarrow");
    imports.chain(reader).all(|line| {
        let found = Command::new("python3").args(["-c", line]).output();
        let found = found.is_ok_and(|output| output.status.success());
        if !found {
            parallax_tests::skipped!("python3 with `{line}` is absent");
        }
        found
    })
}

fn python(folder: &Path, text: &str) -> String {
    let output = run_ok(
        Command::new("python3")
            .args(["-c", text])
            .current_dir(folder),
    );
    String::from_utf8(output.stdout).expect("text")
}

/// Runs a sweep in `folder` as the page's `sh` block does.
fn sweep(folder: &Path, experiment: &str, line: &str) {
    fs::write(folder.join("caches.toml"), experiment).expect("temporary file");
    let words: Vec<&str> = line.split_whitespace().collect();
    let arguments = words
        .strip_prefix(&["replay"])
        .expect("a command of replay");
    let mut command = program("replay");
    for word in arguments {
        match word.strip_prefix("traces/") {
            Some(_) => command.arg(root().join(word)),
            None => command.arg(word),
        };
    }
    run_ok(command.current_dir(folder));
}

#[test]
fn the_examples_print_what_the_page_says() {
    let page = fs::read_to_string(root().join("docs/use/analysis.md")).expect("the page");
    let blocks = blocks(&page);
    let first = |language: &str| {
        let block = blocks.iter().find(|(found, _)| found == language);
        block.map_or_else(|| panic!("no {language} block"), |(_, text)| text.as_str())
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    sweep(folder.path(), first("toml"), first("sh"));
    let mut examples = 0;
    for pair in blocks.windows(2) {
        let [(language, program), (next, expected)] = pair else {
            continue;
        };
        if language == "python" {
            assert_eq!(next, "text", "an example without its output:\n{program}");
            examples += 1;
            if can_run(program) {
                assert_eq!(python(folder.path(), program), *expected, "{program}");
            }
        }
    }
    assert_eq!(examples, 4);
}

#[test]
fn parquet_holds_what_csv_does_with_types() {
    const SCRIPT: &str = "\
import csv
import pyarrow.parquet
table = pyarrow.parquet.read_table('rows.parquet')
with open('out/caches/results.csv', newline='') as file:
    heading, *lines = csv.reader(file)
assert table.column_names == heading, heading
kinds = {'string': str, 'int64': int, 'double': float, 'bool': lambda text: {'true': True, 'false': False}[text]}
for name, column in zip(heading, zip(*lines)):
    kind = kinds[str(table.schema.field(name).type)]
    expected = [kind(cell) if cell != '' else None for cell in column]
    assert table[name].to_pylist() == expected, name
print(*[str(table.schema.field(name).type) for name in ('scene', 'l1_size_bytes', 'sampling_helper_lanes', 'sampling_lod_bias', 'external_bytes', 'tmu_util_pct', 'cycles')])
";
    if !can_run(SCRIPT) {
        return;
    }
    let experiment = "[axes]\nl1.size_bytes = [\"4KiB\", 8192]\nsampling.helper_lanes = [true, false]\nsampling.lod_bias = [0, 0.5]\n\
                      [one-at-a-time]\nmode = [\"functional\"]\n";
    let folder = tempfile::tempdir().expect("a temporary folder");
    let line = "replay sweep caches.toml traces/atrium-shadows.textrace --out out/caches --parquet rows.parquet";
    sweep(folder.path(), experiment, line);
    assert_eq!(
        python(folder.path(), SCRIPT),
        "string int64 bool double int64 double int64\n"
    );
    let first = fs::read(folder.path().join("rows.parquet")).expect("rows");
    sweep(folder.path(), experiment, line);
    assert!(first == fs::read(folder.path().join("rows.parquet")).expect("rows"));
}
