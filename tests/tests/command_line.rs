//! What the programs say: versions, completions, manuals, messages.

use parallax_tests::{program, refuse, root, run_ok};
use std::process::Command;

const PROGRAMS: [&str; 2] = ["tracegen", "replay"];

/// The subcommands that a program's help lists.
fn subcommands(name: &str) -> Vec<String> {
    let help = run_ok(program(name).arg("--help")).stdout;
    let help = String::from_utf8(help).expect("UTF-8");
    let list = help
        .split("Commands:\n")
        .nth(1)
        .expect("a list of commands");
    let names = list.lines().take_while(|line| !line.trim().is_empty());
    let names: Vec<String> = names
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .map(str::to_owned)
        .filter(|name| name != "help")
        .collect();
    assert!(names.len() >= 5, "{names:?}");
    names
}

#[test]
fn versions_name_the_formats() {
    for name in PROGRAMS {
        let text = String::from_utf8(run_ok(program(name).arg("--version")).stdout).expect("UTF-8");
        assert!(text.starts_with(name), "{text}");
        assert!(
            text.contains(".textrace and .raytrace format 1.1"),
            "{text}"
        );
    }
}

#[test]
fn completions_of_every_shell_know_every_subcommand() {
    for name in PROGRAMS {
        for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
            let script = run_ok(program(name).args(["completions", shell])).stdout;
            let script = String::from_utf8(script).expect("UTF-8");
            for subcommand in subcommands(name) {
                assert!(script.contains(&subcommand), "{name} {shell}: {subcommand}");
            }
        }
    }
}

#[test]
fn every_subcommand_has_its_manual_page() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in PROGRAMS {
        run_ok(program(name).arg("man").arg(folder.path()));
        for subcommand in subcommands(name) {
            let page = folder.path().join(format!("{name}-{subcommand}.1"));
            let text = std::fs::read_to_string(&page).expect("a page");
            assert!(text.contains(".TH"), "{}", page.display());
        }
        let main = std::fs::read_to_string(folder.path().join(format!("{name}.1")));
        assert!(main.expect("a page").contains("Exit codes"));
    }
}

#[test]
fn terminal_escapes_in_names_are_not_printed_raw() {
    let name = "no\u{1b}[2J-such";
    let commands: [(&str, &[&str]); 3] = [
        ("replay", &["run", name]),
        ("tracegen", &["scenes", name]),
        ("tracegen", &["rays", "no\u{1b}[2J-such.gltf", "-o", "-"]),
    ];
    for (program_name, arguments) in commands {
        let output = refuse(
            program(program_name).args(arguments),
            &["no\\u{1b}[2J-such"],
        );
        assert!(!output.stderr.contains(&0x1b), "{arguments:?}");
    }
    // An argument that the parser itself refuses.
    let output = refuse(
        program("replay").args(["run", "--no\u{7}-such"]),
        &["-such"],
    );
    assert!(!output.stderr.contains(&0x7));
}

#[test]
fn an_error_is_told_once() {
    let output = refuse(program("replay").args(["run", "no-such.textrace"]), &[]);
    let text = String::from_utf8(output.stderr).expect("UTF-8");
    for part in ["no-such.textrace", "No such file", "error"] {
        let times = text.matches(part).count();
        assert!(
            times == 1 || part == "error",
            "{part} {times} times in {text}"
        );
    }
    assert_eq!(text.lines().count(), 1, "{text}");
}

#[test]
fn quiet_prints_the_result_alone() {
    let trace = root().join("traces/atrium-shadows.textrace");
    let run = |quiet: &[&str]| run_ok(program("replay").arg("run").arg(&trace).args(quiet));
    let (told, quiet) = (run(&[]), run(&["--quiet"]));
    assert!(!told.stderr.is_empty() && quiet.stderr.is_empty());
    assert_eq!(told.stdout, quiet.stdout);
    let mut rays = program("tracegen");
    rays.args(["-q", "rays", "teapot", "--size", "32x32", "-o", "-"]);
    assert!(run_ok(&mut rays).stderr.is_empty());
}

#[test]
fn a_capture_that_sees_nothing_warns_with_bounds_and_camera() {
    let away = [
        "--eye", "0,100,0", "--target", "0,200,1", "--size", "32x32", "-q", "-o", "-",
    ];
    let nothing_seen = |command: &mut Command| {
        let output = run_ok(command.args(away));
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        for part in [
            "warning",
            "nothing of the scene is seen",
            "[0.00, 100.00, 0.00]",
            "reaches from",
        ] {
            assert!(text.contains(part), "no {part:?} in {text}");
        }
    };
    nothing_seen(program("tracegen").args(["rays", "teapot"]));
    nothing_seen(program("tracegen").args(["raster", "teapot", "--no-plain"]));
}

#[test]
fn frames_are_offered_where_a_trace_holds_several() {
    refuse(
        program("tracegen").args(["rays", "teapot", "--frames", "2", "-o", "-"]),
        &["--frames"],
    );
    let help = run_ok(program("tracegen").args(["raster", "--help"])).stdout;
    assert!(String::from_utf8_lossy(&help).contains("--frames"));
}

#[cfg(unix)]
#[test]
fn a_path_that_is_no_text_is_no_panic() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder
        .path()
        .join(std::ffi::OsStr::from_bytes(b"a\xff.raytrace"));
    let mut rays = program("tracegen");
    run_ok(
        rays.args(["rays", "teapot", "--size", "32x32", "-o"])
            .arg(&path),
    );
    run_ok(program("replay").arg("validate").arg(&path));
}
