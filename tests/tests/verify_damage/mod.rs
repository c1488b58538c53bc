//! What `tracegen verify` and `replay validate` say to captures with a single error: each field of the tables,
//! each column of a record, the primitive lists and the indices. `results/verify-damage.csv` has the results of
//! this test; `UPDATE_GOLDEN=1` rewrites it, and `make figures` then updates the table in
//! docs/results/verify.md. For damages of graded size, the smallest reported one is searched. The test checks
//! that size, and that damages two steps below are not reported (drivers differ by a step).

mod bytes;
mod damages;
mod geometry;
mod records;
mod tables;
mod trace;
mod unfound;

use damages::{Change, Damage, Sound};
use parallax_tests::{program, root, run_ok};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use trace::Trace;

const SCENE: &str = "atrium-shadows";

/// Exit codes of `replay validate` and, where it finds nothing, of `tracegen verify`, and the first error.
struct Outcome {
    found_by: &'static str,
    code: i32,
    errors: String,
}

/// Checks a trace as a user does; all runs share the prepared textures of the scene.
fn check(trace: &Path, cache: &Path) -> Outcome {
    let run = |name: &'static str, arguments: &[&str]| {
        let mut command = program(name);
        command.env("PARALLAX_CACHE_SIZE", "1GiB");
        command.env("PARALLAX_CACHE_DIR", cache);
        let output = command.args(arguments).arg(trace).output();
        let output = output.expect("the program starts");
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!errors.contains("panicked"), "{errors}");
        (output.status.code().unwrap_or(-1), errors)
    };
    let (code, errors) = run("replay", &["validate"]);
    if code != 0 {
        return Outcome {
            found_by: "replay validate",
            code,
            errors,
        };
    }
    let (code, errors) = run(
        "tracegen",
        &["verify", SCENE, "--quiet", "--threads", "1", "--trace"],
    );
    Outcome {
        found_by: "tracegen verify",
        code,
        errors,
    }
}

/// The first error, without parts that differ between machines.
fn first_error(errors: &str) -> String {
    let line = errors.lines().find(|line| line.contains("error"));
    let line = line.unwrap_or_default();
    let text = line.split_once("error: ").map_or(line, |(_, text)| text);
    // Measured figures differ between drivers, so only the kind of report is compared.
    let mut kind = String::new();
    for part in text.split_inclusive(": ").take(2) {
        kind += part;
    }
    let kind = kind.trim_end_matches(": ");
    if let Some((what, _)) = kind.split_once(" over ") {
        return what.to_owned();
    }
    match kind.split_once(": ") {
        Some((what, count)) if count.ends_with(" unexplained") => format!("{what}: unexplained"),
        _ => kind.to_owned(),
    }
}

/// Checks damages, several at a time.
struct Bench<'a> {
    folder: &'a Path,
    sound: &'a Sound,
    /// Rows of the committed table.
    before: &'a str,
    searches: bool,
}

/// A row of the table, or what is wrong.
type Row = Result<String, String>;

impl Bench<'_> {
    fn attempt(&self, worker: usize, change: &Change) -> Outcome {
        let file = self.folder.join(format!("damaged-{worker}.textrace"));
        std::fs::write(&file, change(self.sound)).expect("room");
        let mut outcome = check(&file, &self.folder.join("cache"));
        let named = file.to_string_lossy().into_owned();
        outcome.errors = outcome.errors.replace(&named, "FILE");
        outcome
    }

    fn row(&self, worker: usize, Damage { field, sizes }: &Damage) -> Row {
        let known = |what: &str| {
            let row = [field.as_str(), what].map(quoted).join(",") + ",";
            // Rows of damages that neither program finds have no program.
            let unfound = format!("{row}-,");
            let mut lines = self.before.lines();
            lines.any(|line| line.starts_with(&row) && !line.starts_with(&unfound))
        };
        let at = sizes.iter().position(|(what, _)| known(what));
        let first = if self.searches { 0 } else { at.unwrap_or(0) };
        let found = (sizes[first..].iter())
            .map(|(what, change)| (what, self.attempt(worker, change)))
            .find(|(_, outcome)| !self.searches || matches!(outcome.code, 1 | 2));
        let (what, outcome) = found.ok_or_else(|| format!("{field}: no size"))?;
        if !matches!(outcome.code, 1 | 2) {
            return Err(format!("{field}: {what}: {}", outcome.errors));
        }
        if let Some((below, change)) = first.checked_sub(2).map(|below| &sizes[below]) {
            let outcome = self.attempt(worker, change);
            if outcome.code != 0 {
                return Err(format!(
                    "{field}: {below} is reported as well: {}",
                    outcome.errors
                ));
            }
        }
        let reported = first_error(&outcome.errors);
        let code = outcome.code.to_string();
        let row = [field.as_str(), what, outcome.found_by, &code, &reported].map(quoted);
        Ok(row.join(","))
    }
}

#[test]
fn each_damage_is_reported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file: PathBuf = folder.path().join("sound.textrace");
    let mut capture = program("tracegen");
    capture.args([
        "raster",
        SCENE,
        "--no-plain",
        "--geometry",
        "--size",
        "96x112",
        "-o",
    ]);
    run_ok(capture.arg(&file));
    let sound = Sound {
        bytes: std::fs::read(&file).expect("a file"),
        trace: Trace::read(&file),
    };
    assert!(
        sound.trace.bytes() == sound.bytes,
        "written anew, it is the same file"
    );
    let outcome = check(&file, &folder.path().join("cache"));
    assert_eq!(outcome.code, 0, "{}", outcome.errors);
    let committed = root().join("results/verify-damage.csv");
    let before = std::fs::read_to_string(&committed).unwrap_or_default();
    let bench = Bench {
        folder: folder.path(),
        sound: &sound,
        before: &before,
        searches: std::env::var_os("UPDATE_GOLDEN").is_some(),
    };
    let damages = [
        records::of_records(),
        records::of_tiles(),
        tables::of_textures(),
        tables::of_samplers(),
        tables::of_draws(),
        tables::of_description(),
        geometry::of_meshes(),
        geometry::of_lists(),
        bytes::of_table_bytes(),
        bytes::of_indices(),
        bytes::of_container(),
    ];
    let damages: Vec<Damage> = damages.into_iter().flatten().collect();
    assert!(damages.len() > 149, "{}", damages.len());
    let rows = in_parallel(damages.len(), |worker, number| {
        bench.row(worker, &damages[number])
    });
    let mut csv = String::from(
        "# command: UPDATE_GOLDEN=1 cargo test --release --workspace --test e2e verify_damage\nfield,damage,found by,exit code,reported as\n",
    );
    let mut wrong = Vec::new();
    for row in rows {
        match row {
            Ok(row) => writeln!(csv, "{row}").expect("a string"),
            Err(what) => wrong.push(what),
        }
    }
    // Damages that neither program finds.
    let unfound = unfound::all();
    let found = in_parallel(unfound.len(), |worker, number| {
        bench.attempt(worker, &unfound[number].0.sizes[0].1)
    });
    for ((damage, why), outcome) in unfound.iter().zip(found) {
        let what = &damage.sizes[0].0;
        if outcome.code != 0 {
            wrong.push(format!(
                "{}: {what} is reported: {}",
                damage.field, outcome.errors
            ));
        }
        let reported = format!("not found: {why}");
        let row = [damage.field.as_str(), what, "-", "0", &reported].map(quoted);
        writeln!(csv, "{}", row.join(",")).expect("a string");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    compare_or_update(&committed, &csv);
}

/// Results for 0 to `count` from a few threads, in order.
fn in_parallel<T: Send>(count: usize, of: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for worker in 0..workers {
            let (next, results, of) = (&next, &results, &of);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= count {
                        return;
                    }
                    let result = of(worker, number);
                    results.lock().expect("no panic").push((number, result));
                }
            });
        }
    });
    let mut results = results.into_inner().expect("no panic");
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Quotes a field of a CSV file.
fn quoted(text: &str) -> String {
    if text.contains([',', '"']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Compares a file with its expected content, or writes it.
fn compare_or_update(file: &Path, whole: &str) {
    let found = std::fs::read_to_string(file).unwrap_or_default();
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        let folder = file.parent().expect("a folder");
        std::fs::create_dir_all(folder).expect("a folder");
        std::fs::write(file, whole).expect("a file");
        return;
    }
    let name = file.display();
    assert!(
        found == whole,
        "{name}: expected (UPDATE_GOLDEN=1 writes it)\n{whole}"
    );
}
