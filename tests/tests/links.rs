//! Checks that links in the documents resolve, that every page is in the index, and that pages are short.

use parallax_tests::figures::documents;
use parallax_tests::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const MOST_LINES: usize = 400;

/// The text outside fenced code blocks.
fn prose(text: &str) -> String {
    text.split("```").step_by(2).collect()
}

/// Targets of the links and pictures of a page, without web addresses.
fn targets(text: &str) -> Vec<String> {
    let prose = prose(text);
    let links = prose.split("](").skip(1);
    let found = links.filter_map(|rest| Some(rest.split_once(')')?.0.to_owned()));
    found
        .filter(|target| !target.contains("://") && !target.contains(' '))
        .collect()
}

/// Anchors of a page, as GitHub derives them from headings.
fn anchors(text: &str) -> BTreeSet<String> {
    let prose = prose(text);
    let headings = prose.lines().filter_map(|line| {
        let heading = line.strip_prefix('#')?.trim_start_matches('#');
        heading.strip_prefix(' ')
    });
    headings
        .map(|heading| {
            heading
                .to_lowercase()
                .chars()
                .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
                .map(|c| if c == ' ' { '-' } else { c })
                .collect()
        })
        .collect()
}

/// The problem of a link, if any.
fn fault(page: &Path, text: &str, target: &str) -> Option<String> {
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let file = if path.is_empty() {
        page.to_owned()
    } else {
        page.parent().expect("a folder").join(path)
    };
    let wrong = |what: &str| Some(format!("{}: ({target}): {what}", page.display()));
    if !file.exists() {
        return wrong("no such file");
    }
    if anchor.is_empty() {
        return None;
    }
    let found = if file == page {
        text.to_owned()
    } else {
        fs::read_to_string(&file).unwrap_or_default()
    };
    if anchors(&found).contains(anchor) {
        None
    } else {
        wrong("no such heading")
    }
}

#[test]
fn every_link_of_a_document_resolves() {
    let (mut faults, mut links) = (Vec::new(), 0);
    for page in documents().into_iter().chain([root().join("FORMAT.md")]) {
        let text = fs::read_to_string(&page).expect("a document");
        let targets = targets(&text);
        links += targets.len();
        let wrong = targets
            .iter()
            .filter_map(|target| fault(&page, &text, target));
        faults.extend(wrong);
    }
    assert!(links > 100, "found {links} links");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let page = root().join("README.md");
    assert!(fault(&page, "", "docs/no-such-page.md").is_some());
    assert!(fault(&page, "# A, b\n", "#c").is_some());
    assert!(fault(&page, "# A, b\n", "#a-b").is_none());
}

#[test]
fn every_page_is_in_the_index_and_stays_short() {
    let index = root().join("docs/README.md");
    let text = fs::read_to_string(&index).expect("the index");
    let listed: Vec<PathBuf> = (targets(&text).iter())
        .map(|target| root().join("docs").join(target))
        .collect();
    for page in documents() {
        if !page.starts_with(root().join("docs")) || page == index {
            continue;
        }
        let name = page.display();
        assert!(listed.contains(&page), "{name}: not in docs/README.md");
        let text = fs::read_to_string(&page).expect("a document");
        let lines = text.lines().count();
        assert!(
            lines <= MOST_LINES,
            "{name}: expected at most {MOST_LINES} lines, found {lines}"
        );
    }
}

/// Source files below a folder, without files made by git or Cargo.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        if path.is_dir() {
            if !name.starts_with('.') && !name.starts_with("target") && name != "out" {
                sources(&path, found);
            }
        } else if [".rs", ".wgsl", ".sh", ".py", ".toml", ".csv"]
            .iter()
            .any(|end| name.ends_with(end))
        {
            found.push(path);
        }
    }
}

#[test]
fn documents_named_in_the_sources_exist() {
    let mut files = vec![root().join("Makefile")];
    sources(&root(), &mut files);
    let mut names = 0;
    for file in files {
        let Ok(text) = fs::read_to_string(&file) else {
            continue;
        };
        let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || "/-_.".contains(c)));
        for word in words {
            let at = word.find("docs/").filter(|_| word.ends_with(".md"));
            let Some(name) = at.map(|at| &word[at..]) else {
                continue;
            };
            // The name of a missing page in this file.
            if name == "docs/no-such-page.md" {
                continue;
            }
            names += 1;
            assert!(
                root().join(name).exists(),
                "{}: names {name}, which does not exist",
                file.display()
            );
        }
    }
    assert!(names > 20, "found {names} names of documents");
}

#[test]
fn the_glossary_has_each_term_once_in_alphabetical_order() {
    let text = fs::read_to_string(root().join("docs/glossary.md")).expect("the glossary");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| "));
    let terms: Vec<String> = rows
        .filter_map(|row| Some(row.split_once(" | ")?.0.to_lowercase()))
        .skip(1)
        .filter(|term| !term.starts_with("---"))
        .collect();
    assert!(terms.len() > 50, "found {} terms", terms.len());
    let wrong = terms.windows(2).find(|pair| pair[0] >= pair[1]);
    assert!(wrong.is_none(), "expected alphabetical order: {wrong:?}");
}

#[test]
fn source_files_that_the_documents_name_exist() {
    let mut files = Vec::new();
    sources(&root(), &mut files);
    let (mut names, mut faults) = (0, Vec::new());
    for page in documents() {
        let text = prose(&fs::read_to_string(&page).expect("a document"));
        for code in text.split('`').skip(1).step_by(2) {
            let is_path = code
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "/-_.".contains(c));
            let is_source = [".rs", ".wgsl", ".py", ".sh"]
                .iter()
                .any(|end| code.ends_with(end));
            // `order/NAME.rs` is a file that the reader writes.
            if !is_path || !is_source || code.contains("NAME") {
                continue;
            }
            names += 1;
            if !files.iter().any(|file| file.ends_with(code)) {
                faults.push(format!("{}: no file {code}", page.display()));
            }
        }
    }
    assert!(names > 50, "found {names} names of source files");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Text with every run of white space as one space.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn code_that_the_documents_quote_is_in_the_sources() {
    let mut files = Vec::new();
    sources(&root(), &mut files);
    let texts: Vec<String> = (files.iter())
        .filter_map(|file| Some(words(&fs::read_to_string(file).ok()?)))
        .collect();
    let mut quoted = 0;
    for page in documents() {
        let text = fs::read_to_string(&page).expect("a document");
        let fences = text.split("```").skip(1).step_by(2);
        for block in fences.filter_map(|fence| fence.strip_prefix("rust\n")) {
            for part in block.split("\n\n") {
                let part = words(part);
                quoted += 1;
                assert!(
                    texts.iter().any(|text| text.contains(&part)),
                    "{}: no source file has: {part}",
                    page.display()
                );
            }
        }
    }
    assert!(quoted > 4, "found {quoted} quotes");
}
