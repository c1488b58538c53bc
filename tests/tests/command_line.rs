//! Tests of versions, completions, manual pages and messages of the programs.

use parallax_tests::{program, refuse, root, run_ok};
use std::collections::BTreeSet;
use std::process::Command;

const PROGRAMS: [&str; 2] = ["tracegen", "replay"];

/// The output of `replay run` on a golden trace.
fn run(arguments: &[&str]) -> std::process::Output {
    let mut command = program("replay");
    command
        .arg("run")
        .arg(root().join("traces/atrium.textrace"));
    run_ok(command.args(arguments))
}

/// The subcommands in a program's help.
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

/// Commands of a program that the page of commands names: the second word in `code`.
fn commands_of_the_page(page: &str, name: &str) -> BTreeSet<String> {
    let codes = page.split('`').skip(1).step_by(2);
    let of_program = codes.filter_map(|code| code.strip_prefix(name)?.strip_prefix(' '));
    of_program
        .filter_map(|rest| rest.split_whitespace().next())
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_page_of_commands_lists_exactly_the_subcommands_of_both_programs() {
    let page = root().join("docs/use/commands.md");
    let page = std::fs::read_to_string(page).expect("the page");
    for name in PROGRAMS {
        let expected: BTreeSet<String> = subcommands(name).into_iter().collect();
        assert_eq!(commands_of_the_page(&page, name), expected, "{name}");
    }
}

#[test]
fn a_misspelt_subcommand_is_suggested() {
    for name in PROGRAMS {
        // Two letters resemble no name.
        for subcommand in subcommands(name).into_iter().filter(|of| of.len() > 3) {
            let mut misspelt = subcommand.clone();
            misspelt.remove(subcommand.len() / 2);
            let suggested = format!("'{subcommand}'");
            refuse(
                program(name).arg(&misspelt),
                &["similar subcommand", &suggested],
            );
        }
    }
}

#[test]
fn the_counts_of_a_capture_are_its_result() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rays = |output: &str| {
        let mut command = program("tracegen");
        command.args(["-q", "rays", "teapot", "--size", "32x32", "-o", output]);
        run_ok(command.current_dir(folder.path()))
    };
    let to_file = rays("a.raytrace");
    let text = String::from_utf8(to_file.stdout).expect("UTF-8");
    assert!(
        text.contains("rays: ") && to_file.stderr.is_empty(),
        "{text}"
    );
    assert!(rays("-").stdout.starts_with(b"PLXTRACE"));
    if parallax_tests::has_lavapipe() {
        let mut raster = program("tracegen");
        raster.args([
            "-q",
            "raster",
            "atrium",
            "--size",
            "32x32",
            "-o",
            "a.textrace",
        ]);
        let output = run_ok(raster.current_dir(folder.path()));
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(
            text.contains(" quads, ") && output.stderr.is_empty(),
            "{text}"
        );
    }
}

#[test]
fn versions_name_the_formats() {
    // The title of the specification lists every version in order, the last minor version of each major one last.
    let specification = std::fs::read_to_string(root().join("FORMAT.md")).expect("FORMAT.md");
    let title = specification.lines().next().unwrap_or_default();
    let words = title.split([' ', ',']).filter(|word| word.contains('.'));
    let mut latest = std::collections::BTreeMap::new();
    for (major, minor) in words.filter_map(|version| version.split_once('.')) {
        latest.insert(major, format!("{major}.{minor}"));
    }
    let versions: Vec<String> = latest.into_values().collect();
    let [first, middle @ .., last] = &versions[..] else {
        panic!("{title}");
    };
    let expected = format!(
        ".textrace formats {first}, {} and {last}, .raytrace format {first}",
        middle.join(", ")
    );
    for name in PROGRAMS {
        let text = String::from_utf8(run_ok(program(name).arg("--version")).stdout).expect("UTF-8");
        assert!(text.starts_with(name), "{text}");
        assert!(text.contains(&expected), "{expected}: {text}");
    }
}

#[test]
fn completions_of_every_shell_contain_every_subcommand() {
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
    // An argument that the parser refuses.
    let output = refuse(
        program("replay").args(["run", "--no\u{7}-such"]),
        &["-such"],
    );
    assert!(!output.stderr.contains(&0x7));
}

#[test]
fn an_error_is_printed_once() {
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
fn quiet_prints_only_the_result() {
    let trace = root().join("traces/atrium-shadows.textrace");
    let run = |quiet: &[&str]| run_ok(program("replay").arg("run").arg(&trace).args(quiet));
    let (verbose, quiet) = (run(&[]), run(&["--quiet"]));
    assert!(!verbose.stderr.is_empty() && quiet.stderr.is_empty());
    assert_eq!(verbose.stdout, quiet.stdout);
    let mut rays = program("tracegen");
    rays.args(["-q", "rays", "teapot", "--size", "32x32", "-o", "-"]);
    assert!(run_ok(&mut rays).stderr.is_empty());
}

#[cfg(unix)]
#[test]
fn an_unwritable_log_is_ignored_and_an_unwritable_result_is_an_error() {
    let Ok(full) = std::fs::OpenOptions::new().write(true).open("/dev/full") else {
        parallax_tests::skipped!("there is no /dev/full");
        return;
    };
    let full = || full.try_clone().expect("a handle");
    let trace = root().join("traces/atrium-shadows.textrace");
    let run = |arguments: &[&str]| {
        let mut command = program("replay");
        command.args(arguments).arg(&trace);
        command
    };
    let verbose = run_ok(&mut run(&["run"]));
    assert!(
        !verbose.stderr.is_empty(),
        "it prints figures about the run"
    );
    let without_log = run_ok(run(&["run"]).stderr(full()));
    assert_eq!(without_log.stdout, verbose.stdout);
    for arguments in [&["run", "no-such"][..], &["run", "--no\u{7}-such"]] {
        let output = program("replay").args(arguments).stderr(full()).output();
        assert_eq!(output.expect("it starts").status.code(), Some(2));
    }
    for arguments in [&["run"][..], &["convert", "--to", "din"]] {
        let output = run(arguments).stdout(full()).output().expect("it starts");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        let expected = "cannot write standard output: No space left";
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn flags_without_effect_on_the_conversion_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = root().join("traces/atrium-shadows.textrace");
    for (arguments, expected) in [
        (
            "--to din --encoding raw -o a",
            "--encoding: only with --to textrace",
        ),
        (
            "--to raytrace --encoding delta -o a",
            "--encoding: only with --to textrace",
        ),
        (
            "--to textrace --granularity texel -o a",
            "--granularity: expected accesses",
        ),
        (
            "--to textrace --order morton -o a",
            "--order: it has no effect on a trace",
        ),
        (
            "--to textrace --texel-format bc7 -o a",
            "--texel-format: it has no effect on a trace",
        ),
        (
            "--to u32 --compress zstd -o a.gz",
            "--compress zstd: expected gzip, because the output is named a.gz",
        ),
        (
            "--to textrace --compress gzip -o a",
            "--compress: a trace cannot be compressed",
        ),
        (
            "--to textrace -o a.gz",
            "--output a.gz: a trace cannot be compressed",
        ),
    ] {
        let mut command = program("replay");
        command
            .current_dir(folder.path())
            .arg("convert")
            .arg(&trace);
        refuse(command.args(arguments.split(' ')), &[expected]);
    }
    let left = std::fs::read_dir(folder.path())
        .expect("the folder")
        .count();
    assert_eq!(left, 0);
}

#[test]
fn orders_are_refused_for_addresses_and_tables_go_to_a_folder() {
    let trace = root().join("traces/atrium-shadows.textrace");
    let mut command = program("replay");
    command.args(["locality", "--addresses", "a.u32", "--orders", "all"]);
    refuse(&mut command, &["--orders", "--addresses"]);
    let mut command = program("replay");
    command.args(["locality", "--csv"]).arg(&trace).arg(&trace);
    refuse(&mut command, &["--csv", "expected a folder, found a file"]);
}

#[test]
fn a_capture_without_visible_triangles_warns_with_bounds_and_camera() {
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
fn a_scene_whose_size_suggests_another_unit_gets_a_distance_between_the_eyes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("large.obj");
    let triangle = "v 0 0 0\nv 500 0 0\nv 0 500 0\nf 1 2 3\n";
    std::fs::write(&scene, triangle).expect("writable");
    let said = |flags: &str| {
        let mut rays = program("tracegen");
        rays.arg("rays").arg(&scene).args(flags.split(' '));
        let output = run_ok(rays.args(["--size", "32x32", "-q", "-o", "-"]));
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    let warning =
        "the scene is 500 m large: if its unit is the centimetre, --ipd 6400 stands for 64 mm";
    assert!(said("--fps 72").contains(warning));
    for flags in ["--ipd 6400", "--eye 0,0,900 --target 0,0,0"] {
        let text = said(flags);
        assert!(!text.contains("--ipd"), "{flags}: {text}");
    }
}

#[test]
fn frames_are_listed_if_a_trace_has_several() {
    refuse(
        program("tracegen").args(["rays", "teapot", "--frames", "2", "-o", "-"]),
        &["--frames"],
    );
    let help = run_ok(program("tracegen").args(["raster", "--help"])).stdout;
    assert!(String::from_utf8_lossy(&help).contains("--frames"));
}

#[cfg(unix)]
#[test]
fn a_path_that_is_not_utf8_causes_no_panic() {
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

#[test]
fn the_table_of_a_run_has_the_textures_and_the_tiles_that_were_asked_for() {
    let shown = |arguments: &[&str]| String::from_utf8(run(arguments).stdout).expect("text");
    let json: serde_json::Value =
        serde_json::from_str(&shown(&["--json", "--tiles"])).expect("JSON");
    let plain = shown(&[]);
    let textures = shown(&["--count-by", "texture"]);
    let parts = json["result"]["by_texture"].as_array().expect("textures");
    let misses = |part: &&serde_json::Value| part["l2"]["line_misses"].as_u64();
    let busiest = parts.iter().max_by_key(misses).expect("a texture");
    let busiest = busiest["name"].as_str().expect("a name");
    assert!(
        textures.contains(busiest) && !plain.contains(busiest),
        "{textures}"
    );
    let tiles = shown(&["--tiles"]);
    let map = &json["result"]["tile_maps"][1];
    assert!(tiles.contains("overdraw") && !plain.contains("overdraw"));
    let last = tiles
        .lines()
        .rfind(|line| line.trim_start().starts_with("1 "));
    let last: Vec<&str> = last.expect("a tile").split_whitespace().collect();
    let of_map = |key: &str| map[key].as_array().and_then(|of| of.last()?.as_u64());
    let (columns, rows) = (&map["tiles"][0], &map["tiles"][1]);
    let place = [columns, rows].map(|size| (size.as_u64().expect("a size") - 1).to_string());
    assert_eq!(last[1..3], place);
    let found = [4, 5, 6].map(|column| last[column].parse::<u64>().ok());
    assert_eq!(found, ["footprints", "l1_misses", "l2_misses"].map(of_map));
}

#[test]
fn the_warning_of_the_first_miss_model_names_what_differs_from_the_preset() {
    let warned = |arguments: &[&str]| String::from_utf8(run(arguments).stderr).expect("text");
    let preset = ["--preset", "z2-paper"];
    assert!(!warned(&preset).contains("first-miss"));
    let changed = warned(&[&preset[..], &["--loop-cycles", "20"]].concat());
    let expected = "not the machine of --preset z2-paper (tmu.loop_cycles differs)";
    assert!(changed.contains(expected), "{changed}");
}

#[test]
fn every_command_prints_what_its_trace_lacks() {
    use formats::textrace::Encoding;
    use parallax_tests::traces::{program_tables, texture_trace_of};
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = folder.path().join("p.textrace");
    let bytes = texture_trace_of(&program_tables(), Encoding::Delta, 5);
    std::fs::write(&trace, bytes).expect("a trace");
    let experiment = folder.path().join("e.toml");
    std::fs::write(&experiment, "[axes]\norder = [\"morton\"]\n").expect("a file");
    let text = |path: &std::path::Path| path.to_str().expect("a path").to_owned();
    let (trace, experiment) = (text(&trace), text(&experiment));
    let (trace, experiment) = (trace.as_str(), experiment.as_str());
    // These read no texture trace, only a folder with some, or a plan first.
    let others = [
        "completions",
        "man",
        "predict",
        "readings",
        "reproject",
        "sample",
        "techniques",
        "temporal",
    ];
    for command in subcommands("replay") {
        let output = text(&folder.path().join(&command));
        let output = output.as_str();
        let arguments: Vec<&str> = match command.as_str() {
            other if others.contains(&other) => continue,
            "accuracy" => vec!["-o", output, trace],
            "calibrate" => vec!["--try", "cores=1,2", trace, trace],
            "compare" | "diff" => vec![trace, trace],
            "convert" => vec!["--to", "din", "-o", output, trace],
            "report" | "view" => vec!["-o", output, trace],
            "sweep" => vec!["-o", output, experiment, trace],
            _ => vec![trace],
        };
        let mut run = program("replay");
        run.arg(&command).args(&arguments);
        let run = run.output().expect("the program starts");
        let message = String::from_utf8_lossy(&run.stderr).into_owned();
        for notice in [
            "note: ",
            "p.textrace: not in the trace: reads by vertex shaders of two-dimensional textures (2 draws, 6 vertices, \
             12 reads without loops; 1 indirect draws of unknown size)\n",
            "p.textrace: not in the trace, or less exactly: texel buffers (1 draws, 7 fragments)\n",
        ] {
            assert!(message.contains(notice), "{command}: {message}");
        }
    }
}
