//! Checks that the commands of the tutorial, and of pages that use its trace, print what the pages show.
//!
//! `UPDATE_FIGURES=1` replaces the lines of a differing block by the most similar lines of the output; review
//! the diff.

use formats::textrace::Textrace;
use parallax_tests::{program, root, run_ok};
use std::fs;
use std::path::Path;

/// Stands for omitted lines.
const GAP: &str = "...";

/// A fenced block: its language and its text.
type Block<'a> = (&'a str, &'a str);

fn blocks(page: &str) -> Vec<Block<'_>> {
    let fences = page.split("```").skip(1).step_by(2);
    fences.filter_map(|fence| fence.split_once('\n')).collect()
}

/// Standard output and error of a command line, in a folder.
fn output(folder: &Path, line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    let output = run_ok(
        program(words[0])
            .args(&words[1..])
            .current_dir(folder)
            .env("COLUMNS", "200"),
    );
    [output.stdout, output.stderr]
        .map(|text| String::from_utf8(text).expect("text"))
        .concat()
}

/// The first line of a block that is missing in the output, in order.
fn missing<'a>(shown: &'a str, output: &str) -> Option<&'a str> {
    let mut lines = output.lines();
    let mut is_gap = false;
    for line in shown.lines() {
        if line == GAP {
            is_gap = true;
            continue;
        }
        let found = if is_gap {
            lines.any(|other| other.trim_end() == line)
        } else {
            lines.next().is_some_and(|other| other.trim_end() == line)
        };
        if !found {
            return Some(line);
        }
        is_gap = false;
    }
    None
}

/// Similarity of two lines, from 0 to 100: words in common over all words.
fn similarity(a: &str, b: &str) -> usize {
    let [a, b] = [a, b].map(|line| line.split_whitespace().collect::<Vec<_>>());
    let common = a.iter().filter(|word| b.contains(word)).count();
    200 * common / (a.len() + b.len()).max(1)
}

/// The block with each line replaced by a line of the output, in order, with the largest sum of similarities.
fn rewritten(shown: &str, output: &str) -> String {
    let shown: Vec<&str> = shown.lines().collect();
    let output: Vec<&str> = output.lines().collect();
    // The largest sum from a line of the block and a line of the output onwards.
    let mut best = vec![vec![0; output.len() + 1]; shown.len() + 1];
    for i in (0..shown.len()).rev() {
        for j in (0..=output.len()).rev() {
            best[i][j] = if shown[i] == GAP || j == output.len() {
                best[i + 1][j]
            } else {
                let taken = best[i + 1][j + 1] + similarity(shown[i], output[j]);
                taken.max(best[i][j + 1])
            };
        }
    }
    let (mut text, mut j) = (String::new(), 0);
    for (i, line) in shown.iter().enumerate() {
        while *line != GAP && j < output.len() && best[i][j] == best[i][j + 1] {
            j += 1;
        }
        match output.get(j) {
            Some(found) if *line != GAP => {
                text += found.trim_end();
                j += 1;
            }
            _ => text += line,
        }
        text.push('\n');
    }
    text
}

fn driver(trace: &Path) -> String {
    let trace = Textrace::open(trace).expect("a trace");
    trace.tables().meta.driver.clone()
}

/// Runs the commands of a page in `folder` and compares the blocks of text. Returns false if the trace was
/// captured with another driver, whose output differs.
fn check_page(page: &str, folder: &Path) -> bool {
    let file = root().join(page);
    let text = fs::read_to_string(&file).expect("the page");
    let is_command = |line: &&str| line.starts_with("tracegen ") || line.starts_with("replay ");
    let (mut printed, mut compared, mut new) = (String::new(), 0, text.clone());
    for (language, block) in blocks(&text) {
        match language {
            "toml" => fs::write(folder.join("caches.toml"), block).expect("a file"),
            "sh" => {
                for line in block.lines().filter(is_command) {
                    printed = output(folder, line);
                    let trace = folder.join("atrium.textrace");
                    if line.starts_with("tracegen raster")
                        && driver(&trace) != driver(&root().join("traces/atrium.textrace"))
                    {
                        return false;
                    }
                }
            }
            "text" => {
                compared += 1;
                let Some(line) = missing(block, &printed) else {
                    continue;
                };
                assert!(
                    std::env::var_os("UPDATE_FIGURES").is_some(),
                    "{page}: expected '{line}' in the output:\n{printed}"
                );
                new = new.replace(block, &rewritten(block, &printed));
            }
            other => panic!("{page}: a block of '{other}'"),
        }
    }
    assert!(compared > 0, "{page}: no block to compare");
    if new != text {
        fs::write(&file, new).expect("the page");
    }
    true
}

#[test]
fn pages_show_what_their_commands_print() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // The first page creates the trace that the others use.
    for page in ["docs/use/tutorial.md", "docs/use/breakdowns.md"] {
        if !check_page(page, folder.path()) {
            parallax_tests::skipped!("this driver's captures are not those of {page}");
            return;
        }
    }
}

#[test]
fn a_changed_digit_is_reported_and_rewriting_corrects_it() {
    let printed = "a 1\nb 2 x\nc 3 y\n";
    assert_eq!(missing("a 1\n...\nc 3 y\n", printed), None);
    assert_eq!(missing("a 1\nc 3 y\n", printed), Some("c 3 y"));
    assert_eq!(missing("...\nc 4 y\n", printed), Some("c 4 y"));
    assert_eq!(rewritten("...\nc 4 y\n", printed), "...\nc 3 y\n");
}
