//! Tables in documents, generated from results files.
//!
//! A results file is `results/NAME.csv`: comment lines starting with `# command:` name the commands that
//! made it; a header and rows follow. A table in a document is between `<!-- figures: NAME -->` and
//! `<!-- end -->`. It shows the results file as it is, or as converted by a row of [`VIEWS`]. Figures
//! within sentences have marks of their own ([`with_inline_figures`]).

mod applications;
mod inline;
mod paper_comparison;
mod reprojection;
mod scene_files;
mod shards;
mod view;

pub use inline::with_inline_figures;
pub use view::{Results, Row, markdown};

use std::path::{Path, PathBuf};

/// Generates a table from a results file.
type View = fn(&Results) -> String;

/// Tables whose form differs from their results file.
const VIEWS: &[(&str, &str, View)] = &[
    ("applications-orders", "applications", applications::orders),
    (
        "applications-records",
        "applications",
        applications::records,
    ),
    ("applications-times", "applications", applications::times),
    ("compile-times", "compile-times", applications::compiling),
    (
        "calibration-ipd-bias",
        "calibration-ipd-bias",
        paper_comparison::calibration,
    ),
    (
        "crytek-500mm",
        "crytek-500mm",
        paper_comparison::crytek_500mm,
    ),
    ("reprojection", "reprojection", reprojection::table),
    ("scene-files", "scene-files", scene_files::table),
    (
        "shadow-map-layout",
        "shadow-map-layout",
        paper_comparison::shadow_maps,
    ),
    ("sweep-shards", "sweep-shards", shards::table),
    ("z2-table2", "paper-savings", paper_comparison::table_2),
];

const BEGIN: &str = "<!-- figures: ";
const END: &str = "<!-- end -->\n";

/// The document with every marked table generated again from the results in `folder`, and the names of
/// those tables.
///
/// # Errors
/// A mark without its end, or a results file that is unreadable or lacks something that the table shows.
pub fn with_tables(document: &str, folder: &Path) -> Result<(String, Vec<String>), String> {
    let (mut text, mut names, mut rest) = (String::new(), Vec::new(), document);
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (name, after) = after
            .split_once(" -->\n")
            .ok_or("a mark without its name")?;
        let (_, after) = (after.split_once(END)).ok_or_else(|| format!("{name}: no {END}"))?;
        let (results, view) = match VIEWS.iter().find(|(known, ..)| *known == name) {
            Some((_, results, view)) => (*results, *view),
            None => (name, Results::full_table as View),
        };
        let results = Results::read(&folder.join(results).with_extension("csv"))?;
        text += &format!("{before}{BEGIN}{name} -->\n{}{END}", view(&results));
        names.push(name.to_owned());
        rest = after;
    }
    Ok((text + rest, names))
}

/// All Markdown files of the documentation.
///
/// # Panics
/// A folder is unreadable.
pub fn documents() -> Vec<PathBuf> {
    let root = crate::root();
    let mut files = ["README.md", "ARCHITECTURE.md", "traces/README.md"]
        .map(|name| root.join(name))
        .to_vec();
    let mut folders = vec![root.join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// Tables that may be typed although most of their cells are numbers: file name and start of the heading.
const TYPED: [(&str, &str); 1] = [
    // Published tangents, each with its source.
    ("displays.md", "| `--hmd` |"),
];

/// Headings of tables outside marks with more than 12 numeric cells.
pub fn typed_tables(name: &str, document: &str) -> Vec<String> {
    let (mut found, mut marked) = (Vec::new(), false);
    let mut lines = document.lines().peekable();
    while let Some(line) = lines.next() {
        marked = line.starts_with(BEGIN) || (marked && !line.starts_with(END.trim_end()));
        if !line.starts_with('|') {
            continue;
        }
        let mut numbers = 0;
        while let Some(row) = lines.next_if(|row| row.starts_with('|')) {
            numbers += row.split('|').filter(|cell| is_measured(cell)).count();
        }
        let exempt = |(file, heading): &(&str, &str)| name == *file && line.starts_with(heading);
        if numbers > 12 && !marked && !TYPED.iter().any(exempt) {
            found.push(format!("{line} ({numbers} figures)"));
        }
    }
    found
}

/// Whether a cell starts with a decimal fraction or a count.
fn is_measured(cell: &str) -> bool {
    let number: String = (cell.trim().chars())
        .take_while(|c| c.is_ascii_digit() || matches!(c, '.' | ',' | '+' | '-'))
        .collect();
    number.bytes().filter(u8::is_ascii_digit).count() > 1
}
