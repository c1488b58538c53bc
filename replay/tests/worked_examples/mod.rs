//! The worked examples of the documents: each code block of language `example` is a command and its output.
//!
//! The first line names what runs and its settings as `key=value`; the other lines are the expected output.
//! `UPDATE_EXAMPLES=1` rewrites them; review the diff by hand, because the examples state the rules.

mod cache;
mod cores;
mod dram;
mod levels;
mod lookups;
mod order;
mod shaded_vertices;

use replay::stream::MemoryTrace;
use replay::stream::testing::Synthetic;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// The settings of an example.
struct Settings {
    /// The word after the command, for example the name of an order.
    subject: String,
    values: BTreeMap<String, String>,
}

impl Settings {
    /// Splits the words after the command.
    fn parse<'a>(mut words: impl Iterator<Item = &'a str>) -> Self {
        let subject = words.next().unwrap_or_default().to_owned();
        let values = words.map(|word| {
            let (key, value) = word
                .split_once('=')
                .unwrap_or_else(|| panic!("{word}: expected key=value"));
            (key.to_owned(), value.to_owned())
        });
        Self {
            subject,
            values: values.collect(),
        }
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.values.get(key).map(String::as_str)
    }

    /// A number, or its default.
    fn number(&self, key: &str, default: u64) -> u64 {
        self.get(key).map_or(default, |text| parsed(key, text))
    }

    /// Numbers between commas.
    fn numbers(&self, key: &str) -> Vec<u64> {
        self.list(key)
            .iter()
            .map(|text| parsed(key, text))
            .collect()
    }

    /// Words between commas.
    fn list(&self, key: &str) -> Vec<String> {
        let text = self.get(key).unwrap_or_default();
        text.split(',')
            .filter(|word| !word.is_empty())
            .map(str::to_owned)
            .collect()
    }

    /// Columns and rows, as `7x2`.
    fn pair(&self, key: &str) -> [u32; 2] {
        let text = self
            .get(key)
            .unwrap_or_else(|| panic!("expected {key}=AxB"));
        let (a, b) = text
            .split_once('x')
            .unwrap_or_else(|| panic!("{key}={text}: expected AxB"));
        [a, b].map(|side| parsed(key, side) as u32)
    }
}

fn parsed(key: &str, text: &str) -> u64 {
    text.parse()
        .unwrap_or_else(|_| panic!("{key}={text}: expected a number"))
}

/// A trace of one picture that is no eye's, with one texture.
fn one_picture(size_px: [u32; 2]) -> MemoryTrace {
    let generator = Synthetic {
        textures: 1,
        materials: 1,
        ..Synthetic::one_layer(size_px, 120)
    };
    let mut trace = generator.generate();
    trace.tables.passes.truncate(1);
    trace.tables.passes[0].eye = None;
    trace
}

/// The output of a command.
fn output(command: &str) -> Vec<String> {
    let mut words = command.split_whitespace();
    let name = words.next().unwrap_or_default();
    let settings = Settings::parse(words);
    match name {
        "order" => order::output(&settings),
        "cache" => cache::output(&settings),
        "levels" => levels::output(&settings),
        "cores" => cores::output(&settings),
        "look-ups" => lookups::output(&settings),
        "dram" => dram::output(&settings),
        "shaded-vertices" => shaded_vertices::output(&settings),
        _ => panic!("`{command}`: no such command"),
    }
}

/// The page with the outputs that the commands give now, and the number of its examples.
fn rendered(page: &str) -> (String, usize) {
    let (mut text, mut examples) = (String::new(), 0);
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        text += &format!("{line}\n");
        if line != "```example" {
            continue;
        }
        examples += 1;
        let command = lines.next().unwrap_or_default();
        text += &format!("{command}\n");
        for line in output(command) {
            text += &format!("{}\n", line.trim_end());
        }
        text += "```\n";
        let end = lines.find(|line| *line == "```");
        assert!(end.is_some(), "`{command}`: the block does not end");
    }
    (text, examples)
}

fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            pages(&path, found);
        } else if path.extension().is_some_and(|of| of == "md") {
            found.push(path);
        }
    }
}

#[test]
fn the_examples_of_the_documents_are_what_the_models_do() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let mut found = Vec::new();
    pages(&docs, &mut found);
    found.sort();
    let mut all = 0;
    for path in found {
        let page = fs::read_to_string(&path).unwrap();
        let (text, examples) = rendered(&page);
        all += examples;
        if env::var_os("UPDATE_EXAMPLES").is_some() {
            if text != page {
                fs::write(&path, text).unwrap();
            }
        } else if text != page {
            for (number, (is, should)) in (1..).zip(page.lines().zip(text.lines())) {
                assert_eq!(is, should, "{}:{number}", path.display());
            }
            panic!(
                "{}: an output has too many or too few lines",
                path.display()
            );
        }
    }
    assert!(all >= 29, "{all} examples: the documents lost some");
}
