//! `python3 -m studies`: the list, wrong names, and a run of the cheapest study, whose tables must be those of `results/`.

use parallax_tests::{program, root};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the command with the built programs; none, with a line on stderr, without Python 3.11.
fn studies(words: &[&str]) -> Option<Output> {
    let found = Command::new("python3")
        .args(["-c", "import tomllib"])
        .output();
    if !found.is_ok_and(|output| output.status.success()) {
        parallax_tests::skipped!("python3 with `import tomllib` is absent");
        return None;
    }
    let replay = program("replay");
    let built = Path::new(replay.get_program()).parent().expect("a folder");
    let mut command = Command::new("python3");
    command.args(["-B", "-m", "studies"]).args(words);
    if !words.is_empty() {
        command.arg("--bin").arg(built);
    }
    Some(
        command
            .current_dir(root())
            .output()
            .expect("python3 starts"),
    )
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn every_module_is_listed_with_a_line_and_runs() {
    let Some(output) = studies(&[]) else { return };
    let list = text(&output.stdout);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let mut modules = 0;
    for entry in fs::read_dir(root().join("studies")).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path
            .file_stem()
            .expect("a name")
            .to_string_lossy()
            .replace('_', "-");
        let source = fs::read_to_string(&path).unwrap_or_default();
        if !source.contains("\ndef run(study):") {
            continue;
        }
        modules += 1;
        let line = list
            .lines()
            .find(|line| line.split(' ').next() == Some(&name));
        let about = line.unwrap_or_else(|| panic!("no line for {name} in\n{list}"));
        assert!(about.len() > name.len() + 20, "{about}");
    }
    assert!(modules > 25, "{modules} modules");
    assert_eq!(list.lines().skip(2).count(), modules, "{list}");
}

#[test]
fn every_results_file_names_a_study_that_exists() {
    let mut named = 0;
    for entry in fs::read_dir(root().join("results")).expect("a folder") {
        let path = entry.expect("an entry").path();
        let results = fs::read_to_string(&path).expect("a results file");
        for line in results.lines().take_while(|line| line.starts_with('#')) {
            assert!(
                !line.contains("scripts/") || line.contains("scripts/fuzz.sh"),
                "{}: {line}",
                path.display()
            );
            let Some((_, command)) = line.split_once("python3 -m studies ") else {
                continue;
            };
            named += 1;
            let name = command.split(' ').next().expect("a word").replace('-', "_");
            assert!(
                root().join(format!("studies/{name}.py")).is_file(),
                "{}: {line}",
                path.display()
            );
        }
    }
    assert!(named > 50, "{named} results of studies");
}

#[test]
fn the_constants_are_those_of_the_results() {
    let out = tempfile::tempdir().expect("a folder");
    let folder = out.path().to_str().expect("a path in UTF-8");
    let Some(output) = studies(&["reproduce", "constants", "--out", folder]) else {
        return;
    };
    let said = text(&output.stdout);
    assert!(output.status.success(), "{said}{}", text(&output.stderr));
    for name in ["z2-constants.csv", "sgrt-constants.csv"] {
        assert!(said.contains(&format!("{name}: 0 of ")), "{said}");
        let made = fs::read_to_string(out.path().join("reproduce").join(name)).expect("a table");
        let kept = fs::read_to_string(root().join("results").join(name)).expect("a table");
        assert_eq!(made, kept, "{name}");
    }
}

#[test]
fn the_drawings_are_those_of_the_documents() {
    if !parallax_tests::has_lavapipe() {
        return;
    }
    let out = tempfile::tempdir().expect("a folder");
    let folder = out.path().to_str().expect("a path in UTF-8");
    let Some(output) = studies(&["drawings", "--results", folder]) else {
        return;
    };
    assert!(output.status.success(), "{}", text(&output.stderr));
    let mut drawings = 0;
    for entry in fs::read_dir(out.path()).expect("a folder") {
        let made = entry.expect("an entry").path();
        let name = made.file_name().expect("a name");
        let kept = fs::read(root().join("docs/images").join(name)).expect("a drawing");
        assert!(fs::read(&made).expect("a drawing") == kept, "{name:?}");
        drawings += 1;
    }
    assert_eq!(drawings, 5);
}

#[test]
fn an_unknown_study_and_an_absent_scene_are_named() {
    let Some(output) = studies(&["oders"]) else {
        return;
    };
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("found 'oders'"),
        "{}",
        text(&output.stderr)
    );
    let out = tempfile::tempdir().expect("a folder");
    let folder = out.path().to_str().expect("a path in UTF-8");
    let output =
        studies(&["policies", "--scenes", folder, "--results", folder]).expect("Python is there");
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{errors}");
    assert!(
        errors.contains("skipped: policies: ") && errors.contains("crytek-sponza/sponza.gltf"),
        "{errors}"
    );
    assert_eq!(fs::read_dir(out.path()).expect("a folder").count(), 0);
}

/// `python3 -m studies extensions` also compiles and uses them.
#[test]
fn each_kind_of_extension_edits_no_more_files_than_its_limit() {
    if let Some(output) = studies(&["extensions", "--count"]) {
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
}
