//! The commands of `docs/use/tutorial.md` print what the page shows.
//!
//! `UPDATE_FIGURES=1` replaces each line shown by the line of the output that is most like it; review the diff.

use formats::textrace::Textrace;
use parallax_tests::{program, root, run_ok};
use std::fs;
use std::path::Path;

/// Lines left out.
const GAP: &str = "...";

/// A fenced block: its language and its text.
type Block<'a> = (&'a str, &'a str);

fn blocks(page: &str) -> Vec<Block<'_>> {
    let fences = page.split("```").skip(1).step_by(2);
    fences.filter_map(|fence| fence.split_once('\n')).collect()
}

/// Standard error and output of a command line, in a folder.
fn output(folder: &Path, line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    let output = run_ok(
        program(words[0])
            .args(&words[1..])
            .current_dir(folder)
            .env("COLUMNS", "200"),
    );
    [output.stderr, output.stdout]
        .map(|text| String::from_utf8(text).expect("text"))
        .concat()
}

/// The first line of a block that is not in the output where it should be.
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

/// The block with each line replaced by the line of the output, from the last one on, that shares most words.
fn rewritten(shown: &str, output: &str) -> String {
    let lines: Vec<&str> = output.lines().collect();
    let mut from = 0;
    let mut text = String::new();
    for line in shown.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let shared = |at: &usize| {
            let other = lines[*at].split_whitespace();
            other.filter(|word| words.contains(word)).count()
        };
        // Of lines that share as many words, the first one.
        match (from..lines.len()).rev().max_by_key(shared) {
            Some(at) if line != GAP => {
                text += lines[at].trim_end();
                from = at + 1;
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

#[test]
fn the_tutorial_shows_what_its_commands_print() {
    let page = root().join("docs/use/tutorial.md");
    let text = fs::read_to_string(&page).expect("the page");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let is_command = |line: &&str| line.starts_with("tracegen ") || line.starts_with("replay ");
    let (mut printed, mut compared, mut new) = (String::new(), 0, text.clone());
    for (language, block) in blocks(&text) {
        match language {
            "toml" => fs::write(folder.path().join("caches.toml"), block).expect("a file"),
            "sh" => {
                for line in block.lines().filter(is_command) {
                    printed = output(folder.path(), line);
                    let trace = folder.path().join("atrium.textrace");
                    if line.starts_with("tracegen raster")
                        && driver(&trace) != driver(&root().join("traces/atrium.textrace"))
                    {
                        parallax_tests::skipped!("this driver's captures are not the tutorial's");
                        return;
                    }
                }
            }
            "text" => {
                compared += 1;
                if std::env::var_os("UPDATE_FIGURES").is_some() {
                    new = new.replace(block, &rewritten(block, &printed));
                } else if let Some(line) = missing(block, &printed) {
                    panic!("docs/use/tutorial.md: expected '{line}' in the output:\n{printed}");
                }
            }
            other => panic!("docs/use/tutorial.md: a block of '{other}'"),
        }
    }
    assert!(compared > 6, "compared {compared} blocks");
    if new != text {
        fs::write(&page, new).expect("the page");
    }
}

#[test]
fn a_changed_digit_is_missed_and_a_rewritten_block_has_it() {
    let printed = "a 1\nb 2 x\nc 3 y\n";
    assert_eq!(missing("a 1\n...\nc 3 y\n", printed), None);
    assert_eq!(missing("a 1\nc 3 y\n", printed), Some("c 3 y"));
    assert_eq!(missing("...\nc 4 y\n", printed), Some("c 4 y"));
    assert_eq!(rewritten("...\nc 4 y\n", printed), "...\nc 3 y\n");
}
