//! Checks that the figures in documents are those of the results files in `results/`. `make figures`
//! rewrites the tables.

use parallax_tests::figures::{Results, documents, typed_tables, with_inline_figures, with_tables};
use parallax_tests::root;
use std::collections::BTreeSet;
use std::fs;

#[test]
fn every_marked_table_equals_its_results_file() {
    let writes = std::env::var_os("UPDATE_FIGURES").is_some();
    let (mut shown, mut inline_figures) = (BTreeSet::new(), 0);
    for file in documents() {
        let name = file.display();
        let text = fs::read_to_string(&file).expect("a document");
        let made = with_tables(&text, &root().join("results"));
        let (made, names) = made.unwrap_or_else(|error| panic!("{name}: {error}"));
        shown.extend(names);
        let inline = with_inline_figures(&made, &root().join("results"));
        let (made, marks) = inline.unwrap_or_else(|error| panic!("{name}: {error}"));
        inline_figures += marks;
        if writes && made != text {
            fs::write(&file, &made).expect("a document");
        } else {
            let lines = text.lines().zip(made.lines());
            let first = (1..)
                .zip(lines)
                .find(|(_, (found, wanted))| found != wanted);
            assert!(
                made == text,
                "{name}: a figure differs from its results (`make figures` writes it anew): line, found and expected {first:?}"
            );
        }
    }
    assert!(!shown.is_empty(), "no document has a marked table");
    assert!(inline_figures > 50, "{inline_figures} figures in sentences");
}

#[test]
fn a_figure_in_a_sentence_is_computed_from_its_rows() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows = "# command: none\nscene,\"gain, %\"\na,-2.54 [-3.0 to 1.25]\nb,b_1k: 7\nc,-\n";
    fs::write(folder.path().join("a.csv"), rows).expect("writable");
    let made = |text: &str| with_inline_figures(text, folder.path()).map(|(text, _)| text);
    for (typed, formula, figure) in [
        ("9.9", "one; a; gain, %; scene=a", "2.5"),
        ("-9", "one; a; gain, %; scene=a", "-3"),
        ("0.00", "one; a; gain, %@2; scene=a", "1.25"),
        ("0", "max; a; gain, %; scene=a|b", "7"),
        ("-0.0", "min; a; gain, %; scene=a|b", "-2.5"),
    ] {
        let (text, wanted) = [typed, figure]
            .map(|number| format!("It saves {number}<!-- = {formula} --> %."))
            .into();
        assert_eq!(made(&text), Ok(wanted));
    }
    for (formula, error) in [
        ("one; a; gain, %; scene=a|b", "expected one row, found 2"),
        ("max; a; gain, %; scene=d", "no row"),
        ("max; a; gain, %; scene=c", "no number in '-'"),
        ("max; a; loss; scene=a", "no column 'loss'"),
        ("max; a; gain, %; place=a", "no column 'place'"),
        ("mean; a; gain, %; scene=a", "expected min, max or one"),
    ] {
        let found = made(&format!("1<!-- = {formula} -->")).expect_err(formula);
        assert!(found.contains(error), "{found}");
    }
}

#[test]
fn every_results_file_names_its_command_and_is_used_by_a_document() {
    let texts: Vec<String> = (documents().iter())
        .map(|file| fs::read_to_string(file).expect("a document"))
        .collect();
    for entry in fs::read_dir(root().join("results")).expect("a folder") {
        let file = entry.expect("an entry").path();
        let results = Results::read(&file).unwrap_or_else(|error| panic!("{error}"));
        assert!(!results.rows.is_empty(), "{}: no rows", file.display());
        let name = file.file_stem().expect("a name").to_string_lossy();
        let marks = [
            format!("results/{name}.csv"),
            format!("figures: {name} -->"),
        ];
        let used = |text: &String| marks.iter().any(|mark| text.contains(mark));
        assert!(
            texts.iter().any(used),
            "no document refers to {}",
            file.display()
        );
    }
}

#[test]
fn tables_of_figures_come_from_results_files() {
    let mut typed = Vec::new();
    for file in documents() {
        let text = fs::read_to_string(&file).expect("a document");
        let name = file.file_name().expect("a name").to_string_lossy();
        let tables = typed_tables(&name, &text).into_iter();
        typed.extend(tables.map(|table| format!("{}: {table}", file.display())));
    }
    assert!(
        typed.is_empty(),
        "expected tables between marks (`<!-- figures: NAME -->`), found typed ones:\n{}",
        typed.join("\n")
    );
    let row = "| a | 1.5 | 2.5 | 3.5 | 4.5 | 5.5 | 6.5 | 7.5 |\n";
    let table = format!("| x |\n| --- |\n{row}{row}");
    assert_eq!(typed_tables("a.md", &table).len(), 1);
    let marked = format!("<!-- figures: a -->\n{table}<!-- end -->\n");
    assert!(typed_tables("a.md", &marked).is_empty());
    assert_eq!(typed_tables("a.md", &format!("{marked}\n{table}")).len(), 1);
}

#[test]
fn a_changed_digit_is_found_and_an_open_mark_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.csv"), "# command: none\nx,y\n1,2.5\n").expect("writable");
    let table = "| x | y |\n| --- | --- |\n| 1 | 2.5 |\n";
    let document = format!("Before.\n<!-- figures: a -->\n{table}<!-- end -->\nAfter.\n");
    let made = |text: &str| with_tables(text, folder.path());
    assert_eq!(
        made(&document),
        Ok((document.clone(), vec!["a".to_owned()]))
    );
    let (mended, _) = made(&document.replace("2.5", "2.6")).expect("a table");
    assert_eq!(mended, document);
    assert!(made("<!-- figures: a -->\nno end\n").is_err());
    assert!(made(&document.replace("figures: a", "figures: b")).is_err());
    fs::write(folder.path().join("a.csv"), "x,y\n1,2.5\n").expect("writable");
    assert!(
        made(&document)
            .expect_err("no command")
            .contains("# command:")
    );
}
