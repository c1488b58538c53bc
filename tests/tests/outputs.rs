//! Outputs of the programs: only regular files are replaced, never an input, and files are complete or
//! absent.
#![cfg(unix)]

use parallax_tests::{program, refuse, root, run_ok};
use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn golden(name: &str) -> PathBuf {
    root().join("traces").join(name)
}

/// `tracegen rays` with a small picture, which needs no driver.
fn rays() -> Command {
    let mut command = program("tracegen");
    command.args(["rays", "teapot", "--size", "96x96", "--quiet"]);
    command
}

/// The commands that write a file, without the path, which comes last.
fn writers() -> Vec<Command> {
    let missing = "no-such.textrace";
    let with = |mut command: Command, arguments: &[&str]| {
        command.args(arguments);
        command
    };
    let elsewhere = std::env::temp_dir().join("parallax-never-written");
    let mut picture = rays();
    picture.arg("-o").arg(elsewhere).arg("--image");
    vec![
        with(rays(), &["-o"]),
        picture,
        with(program("tracegen"), &["raster", "atrium", "-o"]),
        with(
            program("replay"),
            &["convert", missing, "--to", "din", "-o"],
        ),
        with(
            program("replay"),
            &["convert", missing, "--to", "textrace", "-o"],
        ),
        with(program("replay"), &["paper", missing, "--csv"]),
        with(program("replay"), &["paper", missing, "--html"]),
        with(program("replay"), &["report", missing, "-o"]),
        with(program("replay"), &["reproject", missing, "--html"]),
        with(program("replay"), &["reproject", missing, "--image"]),
    ]
}

#[test]
fn only_regular_files_and_new_names_are_written_which_is_checked_before_the_work() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder")).expect("a folder");
    fs::write(at("target"), "kept").expect("a file");
    symlink("target", at("link")).expect("a link");
    let _socket = UnixListener::bind(at("socket")).expect("a socket");
    run_ok(Command::new("mkfifo").arg(at("pipe")));
    fs::write(at("read-only"), "kept").expect("a file");
    fs::set_permissions(at("read-only"), fs::Permissions::from_mode(0o444)).expect("permissions");
    let ids = || {
        let mut ids: Vec<_> = fs::read_dir(folder.path())
            .expect("a folder")
            .map(|entry| entry.expect("an entry").path())
            .map(|path| (fs::symlink_metadata(&path).expect("metadata").ino(), path))
            .collect();
        ids.sort();
        ids
    };
    let before = ids();
    for (name, found) in [
        ("folder", "a folder"),
        ("link", "a symbolic link to target"),
        ("socket", "a socket"),
        ("pipe", "a pipe"),
        ("read-only", "a read-only one"),
        ("new/", "the name of a file"),
    ] {
        for mut writer in writers() {
            // Checking outputs first reports them before the missing trace.
            refuse(writer.arg(at(name)), &["cannot write", name, found]);
        }
    }
    assert_eq!(ids(), before, "something was replaced or left behind");
    assert_eq!(fs::read(at("target")).expect("readable"), b"kept");
}

#[test]
fn a_missing_folder_is_reported_before_the_work() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // Reports create their folder; traces, pictures and accesses do not.
    for mut writer in writers().into_iter().take(5) {
        let path = folder.path().join("none/file");
        refuse(
            writer.arg(path),
            &["cannot write", "none/file", "found none"],
        );
    }
}

#[test]
fn an_unwritable_folder_is_reported_before_the_work() {
    // No user, not even root, can create files there.
    if Path::new("/proc/self").exists() {
        for mut writer in writers() {
            refuse(
                writer.arg("/proc/parallax"),
                &["cannot write", "/proc/parallax"],
            );
        }
    }
}

#[test]
fn no_output_replaces_an_input_or_another_output() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::copy(golden("teapot-rays.raytrace"), at("a.raytrace")).expect("a copy");
    fs::copy(golden("atrium.textrace"), at("a.textrace")).expect("a copy");
    fs::hard_link(at("a.raytrace"), at("hard")).expect("a hard link");
    fs::write(at("scene.gltf"), include_str!("data/missing-texture.gltf")).expect("a scene");
    let in_folder = |name: &str, arguments: &[&str]| {
        let mut command = program(name);
        command.current_dir(folder.path()).args(arguments);
        command
    };
    for (name, arguments) in [
        (
            "replay",
            &["reproject", "a.raytrace", "--image", "./a.raytrace"][..],
        ),
        ("replay", &["reproject", "a.raytrace", "--html", "hard"]),
        (
            "replay",
            &[
                "convert",
                "a.textrace",
                "--to",
                "textrace",
                "-o",
                "a.textrace",
            ],
        ),
        ("replay", &["paper", "a.textrace", "--csv", "a.textrace"]),
        ("tracegen", &["rays", "scene.gltf", "-o", "./scene.gltf"]),
        (
            "tracegen",
            &["raster", "scene.gltf", "-o", "x", "--image", "scene.gltf"],
        ),
    ] {
        refuse(
            &mut in_folder(name, arguments),
            &["would replace the input"],
        );
    }
    for (name, arguments) in [
        (
            "tracegen",
            &["raster", "atrium", "-o", "x.png", "--image", "x.png"][..],
        ),
        (
            "tracegen",
            &["rays", "teapot", "-o", "x.png", "--image", "./x.png"],
        ),
        (
            "replay",
            &["reproject", "a.raytrace", "--image", "x", "--html", "./x"],
        ),
        (
            "replay",
            &["paper", "a.textrace", "--csv", "x.csv", "--html", "x.html"],
        ),
        ("replay", &["report", "a.textrace", "-o", "x.json"]),
    ] {
        refuse(&mut in_folder(name, arguments), &["the same output twice"]);
    }
    let mut left: Vec<_> = fs::read_dir(folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    left.sort();
    assert_eq!(left, ["a.raytrace", "a.textrace", "hard", "scene.gltf"]);
    assert_eq!(
        fs::read(at("hard")).expect("readable"),
        fs::read(golden("teapot-rays.raytrace")).expect("readable")
    );
}

/// Command lines whose last word is an output over the input `x` of the same command.
const OVER_INPUTS: &[(&str, &str)] = &[
    ("tracegen", "page x.html -o OUT"),
    ("tracegen", "page x.html -o o --image OUT"),
    ("tracegen", "page x.html --list --list-page OUT"),
    ("tracegen", "page x.html --query ?a --rules x.html -o OUT"),
    ("tracegen", "page https://a.test/ --rules x.html -o OUT"),
    ("tracegen", "page https://a.test/ --iwer x.html -o OUT"),
    (
        "tracegen",
        "page https://a.test/ --chromium ./x.html -o OUT",
    ),
    ("tracegen", "app --apitrace x.html -o OUT"),
    ("tracegen", "app -o OUT -- ./x.html"),
    ("tracegen", "app -o OUT -- sh x.html"),
    ("tracegen", "app -o OUT -- sh --file=x.html"),
    ("tracegen", "app --rules x.html -o OUT -- sh"),
    ("tracegen", "raster x.html -o OUT"),
    ("tracegen", "rays x.html -o o --image OUT"),
    (
        "tracegen",
        "verify atrium --trace x.html --write-reference OUT",
    ),
    ("replay", "orders x.html --csv OUT"),
    ("replay", "orders a.textrace --order-file x.html --html OUT"),
    (
        "replay",
        "orders a.textrace --order-file so/X --search anneal --save-orders so",
    ),
    (
        "replay",
        "orders a.textrace --order-file so/X --search anneal --save-orders ./so/../so",
    ),
    ("replay", "convert x.html --to din -o OUT"),
    ("replay", "run a.textrace --config x.html --timeline OUT"),
    ("replay", "schedule x.html --html OUT"),
    (
        "replay",
        "schedule a.textrace --config x.html --timeline OUT",
    ),
    ("replay", "locality --addresses x.html --html OUT"),
    ("replay", "report a.textrace --image atrium=x.html -o OUT"),
    ("replay", "dump x.html --parquet OUT"),
    ("replay", "readings a.textrace --config x.html --html OUT"),
];

#[test]
fn inputs_of_every_kind_are_kept_under_all_of_their_names() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("so")).expect("a folder");
    fs::create_dir_all(at("sub")).expect("a folder");
    fs::copy(golden("atrium.textrace"), at("a.textrace")).expect("a copy");
    fs::write(at("x.html"), "kept").expect("a file");
    fs::write(at("so/X"), "kept").expect("a file");
    fs::set_permissions(at("x.html"), fs::Permissions::from_mode(0o755)).expect("permissions");
    fs::hard_link(at("x.html"), at("hard")).expect("a hard link");
    let absolute = at("x.html");
    let absolute = absolute.to_str().expect("text");
    for (name, line) in OVER_INPUTS {
        for output in ["x.html", "./x.html", "sub/../x.html", "hard", absolute] {
            let words = line.split(' ').map(|word| word.replace("OUT", output));
            let mut command = program(name);
            command.args(words).current_dir(folder.path());
            let expected = match line.contains("so/X") {
                true => "a folder without inputs",
                false => "would replace the input",
            };
            refuse(&mut command, &[expected]);
        }
    }
    // A relative input from another folder.
    let mut command = program("tracegen");
    command.args(["app", "-o", "../x.html", "--", "../x.html"]);
    refuse(command.current_dir(at("sub")), &["would replace the input"]);
    for name in ["x.html", "hard", "so/X"] {
        assert_eq!(fs::read(at(name)).expect("readable"), b"kept", "{name}");
    }
}

#[test]
fn a_schedule_has_a_page_and_a_timeline_of_one_bandwidth() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [page, timeline] = ["p.html", "t.json"].map(|name| folder.path().join(name));
    let schedule = |bandwidths: &str| {
        let mut command = program("replay");
        command.arg("schedule").arg(golden("atrium.textrace"));
        command.args(["--schedulers", "z2-sta", "--bandwidth", bandwidths]);
        command.arg("--html").arg(&page).arg("--timeline");
        command.arg(&timeline);
        command
    };
    let found = "expected one trace and one bandwidth, found 1 and 2";
    refuse(&mut schedule("2,4"), &["--timeline", found]);
    assert!(!page.exists() && !timeline.exists());
    run_ok(&mut schedule("4"));
    let page = fs::read_to_string(page).expect("a page");
    assert!(page.contains("<svg") && page.contains("waits for DRAM"));
    let text = fs::read_to_string(timeline).expect("a timeline");
    let events: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let events = events["traceEvents"].as_array().expect("events");
    let named = events.iter().filter(|of| of["name"] == "process_name");
    let names: Vec<_> = named.map(|of| of["args"]["name"].clone()).collect();
    assert_eq!(names, ["first-idle", "z2-sta"]);
}

#[test]
fn a_replaced_file_keeps_its_permissions_and_a_new_one_follows_the_umask() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.din");
    let convert = |umask: &str| {
        let mut command = Command::new("sh");
        let script = format!("umask {umask}; exec \"$0\" \"$@\"");
        command
            .arg("-c")
            .arg(script)
            .arg(program("replay").get_program());
        command
            .arg("convert")
            .arg(golden("atrium-shadows.textrace"));
        run_ok(command.args(["--to", "din", "-o"]).arg(&path));
        fs::metadata(&path).expect("a file").permissions().mode() & 0o7777
    };
    assert_eq!(convert("027"), 0o640);
    fs::set_permissions(&path, fs::Permissions::from_mode(0o606)).expect("permissions");
    assert_eq!(convert("027"), 0o606);
}

#[test]
fn a_dash_is_standard_output_for_binary_and_text() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("file");
    let same = |mut to_file: Command, mut to_stdout: Command, flag: &str| {
        run_ok(to_file.arg(flag).arg(&path));
        let piped = run_ok(to_stdout.arg(flag).arg("-")).stdout;
        assert!(fs::read(&path).expect("readable") == piped, "{to_stdout:?}");
    };
    let convert = |to: &str| {
        let mut command = program("replay");
        command
            .arg("convert")
            .arg(golden("atrium-shadows.textrace"));
        command.args(["--to", to]);
        command
    };
    let reproject = || {
        let mut command = program("replay");
        command.arg("reproject").arg(golden("teapot-rays.raytrace"));
        command
    };
    same(rays(), rays(), "-o");
    same(convert("din"), convert("din"), "-o");
    same(convert("textrace"), convert("textrace"), "-o");
    same(reproject(), reproject(), "--html");
    same(reproject(), reproject(), "--image");
    refuse(
        reproject().args(["--json", "--html", "-"]),
        &["--json and --html -: the same output twice"],
    );
}

/// The names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| entry.expect("an entry").file_name())
        .map(|name| name.to_string_lossy().into_owned())
        .collect()
}

#[test]
fn a_program_stopped_at_any_moment_leaves_a_complete_file_or_none() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.raytrace");
    let start = Instant::now();
    run_ok(rays().arg("-o").arg(&path));
    let whole_run = start.elapsed();
    let whole = fs::read(&path).expect("readable");
    let mut random = 1_u32;
    for signal in ["TERM", "INT", "HUP", "QUIT", "KILL"] {
        for _ in 0..6 {
            fs::remove_file(&path).unwrap_or_default();
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let moment = whole_run.mul_f64(1.2 * f64::from(random) / f64::from(u32::MAX));
            let mut child = rays().arg("-o").arg(&path).spawn().expect("starts");
            std::thread::sleep(moment);
            let kill = format!("kill -{signal} {}", child.id());
            // It may have ended before.
            let _ = Command::new("sh")
                .args(["-c", &kill])
                .stderr(Stdio::null())
                .status();
            let status = child.wait().expect("ends");
            let mut left = names(folder.path());
            if signal == "KILL" {
                // Cleaning up is impossible then, but the remains have no final name.
                left.retain(|name| !(name.starts_with('.') && name.ends_with(".part")));
            }
            assert!(
                left.is_empty() || left == ["a.raytrace"],
                "SIG{signal} after {moment:?} left {left:?}"
            );
            if !left.is_empty() {
                assert!(fs::read(&path).expect("readable") == whole, "half a file");
            } else {
                assert!(!status.success(), "a program that was stopped must say so");
            }
        }
    }
}

#[test]
fn a_signal_that_the_parent_ignores_is_ignored() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.raytrace");
    let command = rays();
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' HUP; exec \"$0\" \"$@\""]);
    shell.arg(command.get_program()).args(command.get_args());
    let mut child = shell.arg("-o").arg(&path).spawn().expect("starts");
    std::thread::sleep(Duration::from_millis(100));
    let kill = format!("kill -HUP {}", child.id());
    let _ = Command::new("sh").args(["-c", &kill]).status();
    assert!(child.wait().expect("ends").success());
    assert!(path.exists());
}

#[test]
fn a_full_disk_is_reported_and_leaves_no_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // A limit on the size of files simulates the full disk.
    let limited = |command: &Command| {
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -f 2; exec \"$0\" \"$@\""]);
        shell.arg(command.get_program()).args(command.get_args());
        shell.current_dir(folder.path());
        shell
    };
    refuse(
        limited(&rays()).args(["-o", "a.raytrace"]),
        &["a.raytrace", "too large"],
    );
    refuse(
        limited(&rays()).args(["-o", "-", "--image", "a.png"]),
        &["too large"],
    );
    let mut convert = program("replay");
    convert.arg("convert").arg(golden("atrium.textrace"));
    refuse(
        limited(&convert).args(["--to", "csv", "-o", "a.csv"]),
        &["a.csv", "too large"],
    );
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn a_result_that_cannot_be_written_to_standard_output_is_an_error() {
    let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else {
        parallax_tests::skipped!("there is no /dev/full");
        return;
    };
    let to_full = |mut command: Command| {
        let full = full.try_clone().expect("a handle");
        let output = command.stdout(full).stderr(Stdio::piped()).output();
        let output = output.expect("starts");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{command:?}: {message}");
        assert!(message.contains("No space left"), "{command:?}: {message}");
    };
    for subcommand in ["info", "dump", "run", "validate"] {
        let mut command = program("replay");
        command
            .arg(subcommand)
            .arg(golden("atrium-shadows.textrace"));
        to_full(command);
    }
    let mut scenes = program("tracegen");
    scenes.arg("scenes");
    to_full(scenes);
    let mut command = rays();
    command.args(["-o", "-"]);
    to_full(command);
}

#[test]
fn a_closed_output_pipe_is_not_an_error() {
    for (arguments, trace) in [
        (&["dump"][..], "jungle.textrace"),
        (&["convert", "--to", "din"], "jungle.textrace"),
        // The page is larger than the buffer of a pipe.
        (&["reproject", "--html", "-"], "teapot-rays.raytrace"),
    ] {
        let mut command = program("replay");
        command.args(arguments).arg(golden(trace));
        let mut child = command.stdout(Stdio::piped()).spawn().expect("starts");
        let mut first = String::new();
        let stdout = child.stdout.take().expect("piped");
        BufReader::new(stdout)
            .read_line(&mut first)
            .expect("a line");
        assert!(!first.is_empty());
        assert!(child.wait().expect("ends").success(), "{arguments:?}");
    }
}

#[test]
fn an_invalid_picture_for_a_page_is_refused_before_the_replays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("text.png"), "no picture").expect("a file");
    let trace = golden("atrium.textrace");
    for (image, expected) in [
        ("text.png", "text.png: not a picture"),
        ("none.png", "none.png: cannot read"),
        ("hall=text.png", "expected one of atrium, found hall"),
    ] {
        let mut command = program("replay");
        command.arg("report").arg(&trace).args(["--image", image]);
        let output = refuse(
            command.args(["-o", "page.html"]).current_dir(folder.path()),
            &[expected],
        );
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!message.contains("replayed in"), "{message}");
        assert!(!at("page.html").exists());
    }
}
