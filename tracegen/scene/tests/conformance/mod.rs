//! Supported features of scene files, one by one: each row writes its file, loads it and checks the
//! scene that renderers get. The table in docs/results/scene-files.md is generated from these rows.
//!
//! `UPDATE_FIGURES=1` rewrites results/scene-features.csv.

pub(crate) mod files;
mod geometry;
mod images;
mod materials;
mod motion;
mod rows;

use rows::{Row, Status};
use std::path::Path;

/// All rows, each with the file of its test.
fn all() -> Vec<Row> {
    let files = [
        (geometry::ROWS, "scene/tests/conformance/geometry.rs"),
        (motion::ROWS, "scene/tests/poses/mod.rs"),
        (images::ROWS, "scene/tests/conformance/images.rs"),
        (materials::ROWS, "scene/tests/conformance/materials.rs"),
    ];
    let tested = |(rows, file): (&'static [Row], &'static str)| {
        rows.iter().map(move |row| match row.test {
            "" => Row { test: file, ..*row },
            _ => *row,
        })
    };
    files.into_iter().flat_map(tested).collect()
}

#[test]
fn every_feature_is_read_as_its_row_says() {
    let mut csv = String::from("feature,read as,how,test\n");
    for row in all() {
        let folder = tempfile::tempdir().unwrap();
        let loaded = (row.load)(folder.path());
        match (row.status, loaded) {
            (Status::Refused, Err(error)) => {
                let text = error.to_string();
                assert!(text.contains(row.how), "{}: {text}", row.feature);
            }
            (Status::Refused, Ok(_)) => panic!("{} is read", row.feature),
            (_, loaded) => {
                let loaded = loaded.unwrap_or_else(|e| panic!("{}: {e}", row.feature));
                (row.check)(&loaded, row.feature);
            }
        }
        let fields = [row.feature, row.status.name(), row.how, row.test];
        csv += &fields.map(quoted).join(",");
        csv.push('\n');
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results/scene-features.csv");
    if std::env::var_os("UPDATE_FIGURES").is_some() {
        let command = "UPDATE_FIGURES=1 cargo test --release -p scene --test files";
        std::fs::write(&path, format!("# command: {command}\n{csv}")).unwrap();
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    let lines = |text: &str| -> Vec<String> {
        let kept = text.lines().filter(|line| !line.starts_with('#'));
        kept.map(str::to_owned).collect()
    };
    assert_eq!(lines(&stored), lines(&csv), "UPDATE_FIGURES=1 rewrites it");
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}
