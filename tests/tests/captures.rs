//! Tests of `tracegen sweep`, which makes the captures of a manifest.

use parallax_tests::{encodings, program, refuse, run_ok};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

const MANIFEST: &str = "\
[base]
size = \"16x24\"
[[captures]]
command = \"rays\"
scene = [\"teapot\", \"chess\"]
hmd = [\"vive\", \"quest2\"]
";

struct Captures {
    folder: tempfile::TempDir,
}

impl Captures {
    fn new(manifest: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("m.toml"), manifest).expect("temporary file");
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, out: &str, flags: &[&str]) -> Command {
        let mut command = program("tracegen");
        command
            .arg("sweep")
            .arg(self.path("m.toml"))
            .arg("-o")
            .arg(self.path(out));
        command.args(flags);
        command
    }

    /// Runs the sweep and returns the last line of its output.
    fn run(&self, out: &str, flags: &[&str]) -> String {
        let output = run_ok(&mut self.command(out, flags));
        String::from_utf8_lossy(&output.stderr).trim().to_owned()
    }

    fn names(&self, out: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(out)).expect("the folder");
        let name = |e: fs::DirEntry| e.file_name().to_string_lossy().into_owned();
        let mut names: Vec<String> = entries.flatten().map(name).collect();
        names.sort();
        names
    }
}

#[test]
fn shards_make_each_capture_once_and_equal_to_the_command_line() {
    let captures = Captures::new(MANIFEST);
    let summary = captures.run("out", &["--shard", "2/2"]);
    assert!(
        summary.ends_with("1 captures: 1 made, 0 there with the same recipe"),
        "the chess set has three times the teapot's triangles: {summary}"
    );
    let summary = captures.run("out", &[]);
    assert!(
        summary.ends_with("4 captures: 3 made, 1 there with the same recipe"),
        "{summary}"
    );
    let names: Vec<String> = ["chess-quest2", "chess-vive", "teapot-quest2", "teapot-vive"]
        .iter()
        .flat_map(|name| ["raytrace", "raytrace.recipe"].map(|kind| format!("{name}.{kind}")))
        .collect();
    assert_eq!(captures.names("out"), names);

    // The command in the recipe makes the same trace.
    let recipe = captures.path("out/chess-vive.raytrace.recipe");
    let recipe = fs::read_to_string(recipe).expect("a recipe");
    let (recipe, checksum) = recipe.split_once('\n').expect("two lines");
    assert_eq!(recipe, "rays chess --hmd vive --size 16x24");
    let by_hand = captures.path("by-hand.raytrace");
    run_ok(
        program("tracegen")
            .args(recipe.split_whitespace())
            .arg("-o")
            .arg(&by_hand),
    );
    let [a, b] = [&captures.path("out/chess-vive.raytrace"), &by_hand]
        .map(|p| fs::read(p).expect("a trace"));
    assert!(a == b);
    let info = run_ok(program("replay").args(["info", "--json"]).arg(&by_hand)).stdout;
    let info: serde_json::Value = serde_json::from_slice(&info).expect("JSON");
    let content = info["checksum"].as_str().expect("a checksum");
    assert_eq!(checksum, format!("# content checksum {content}\n"));

    // A changed recipe and a missing recipe cause a new capture.
    fs::write(captures.path("m.toml"), MANIFEST.replace("16x24", "24x16")).expect("temporary file");
    assert!(captures.run("out", &[]).contains("4 made"));
    fs::remove_file(captures.path("out/teapot-vive.raytrace.recipe")).expect("removed");
    assert!(captures.run("out", &[]).contains("1 made, 3 there"));
}

#[test]
fn changed_settings_of_rays_recapture_only_the_rays() {
    let manifest = |raster: &str, rays: &str| {
        format!(
            "[[captures]]\nscene = \"teapot\"\nno-plain = true\nsize = \"{raster}\"\n\
             [[captures]]\ncommand = \"rays\"\nscene = \"teapot\"\nsize = \"{rays}\"\n"
        )
    };
    let captures = Captures::new(&manifest("16x24", "16x24"));
    assert!(captures.run("out", &[]).contains("2 made"));
    assert!(captures.run("out", &[]).contains("0 made, 2 there"));
    let trace = |kind: &str| {
        let path = captures.path(&format!("out/teapot.{kind}"));
        fs::metadata(path)
            .and_then(|m| m.modified())
            .expect("a trace")
    };
    for (raster, rays, kept) in [
        ("16x24", "24x16", "textrace"),
        ("24x16", "24x16", "raytrace"),
    ] {
        let before = trace(kept);
        fs::write(captures.path("m.toml"), manifest(raster, rays)).expect("temporary file");
        let summary = captures.run("out", &[]);
        assert!(summary.contains("1 made, 1 there"), "{summary}");
        assert_eq!(trace(kept), before);
    }
}

#[test]
fn a_truncated_or_foreign_trace_with_a_recipe_is_captured_again() {
    let captures = Captures::new(MANIFEST);
    captures.run("out", &[]);
    let path = |name: &str| captures.path(&format!("out/{name}.raytrace"));
    let whole = fs::read(path("teapot-vive")).expect("a trace");
    fs::write(path("teapot-vive"), &whole[..whole.len() - 64]).expect("a file");
    fs::copy(path("chess-vive"), path("chess-quest2")).expect("a file");
    let plan = run_ok(&mut captures.command("out", &["--plan", "--json"])).stdout;
    let plan: serde_json::Value = serde_json::from_slice(&plan).expect("JSON");
    let done = plan["captures"].as_array().expect("captures").iter();
    let done: Vec<&serde_json::Value> = done.map(|c| &c["done"]).collect();
    assert_eq!(done, [false, true, true, false]);
    let summary = captures.run("out", &[]);
    assert!(summary.contains("2 made, 2 there"), "{summary}");
    assert!(fs::read(path("teapot-vive")).expect("a trace") == whole);
}

#[cfg(unix)]
#[test]
fn a_pipe_instead_of_a_recipe_or_a_trace_is_refused() {
    let captures =
        Captures::new("[[captures]]\ncommand = \"rays\"\nscene = \"teapot\"\nsize = \"16x24\"\n");
    for name in ["teapot.raytrace", "teapot.raytrace.recipe"] {
        captures.run("out", &[]);
        let path = captures.path("out").join(name);
        fs::remove_file(&path).expect("removed");
        run_ok(Command::new("mkfifo").arg(&path));
        refuse(&mut captures.command("out", &[]), &[name, "a pipe"]);
        fs::remove_file(&path).expect("removed");
    }
}

#[test]
fn captures_have_the_encoding_of_the_manifest() {
    let captures = Captures::new(
        "[base]\nsize = \"32x24\"\nno-plain = true\n[[captures]]\nscene = \"teapot\"\n\
         encoding = [\"delta\", \"planes\"]\n",
    );
    captures.run("out", &[]);
    let [delta, planes] = ["delta", "planes"].map(|encoding| {
        let trace = captures.path(&format!("out/teapot-{encoding}.textrace"));
        assert_eq!(encodings(&trace), [encoding]);
        run_ok(program("replay").arg("dump").arg(trace)).stdout
    });
    assert!(delta == planes && !delta.is_empty());
    let captures = Captures::new("[[captures]]\nscene = \"teapot\"\nencoding = \"raw\"\n");
    refuse(
        &mut captures.command("out", &[]),
        &["m.toml", "[[captures]] 1", "'raw'", "--encoding"],
    );
}

#[test]
fn the_plan_lists_recipes_costs_and_finished_captures() {
    let captures = Captures::new(MANIFEST);
    let text = run_ok(&mut captures.command("out", &["--plan"])).stdout;
    let text = String::from_utf8(text).expect("text");
    assert_eq!(text.lines().count(), 4);
    assert!(
        text.starts_with("teapot-vive.raytrace: rays teapot --hmd vive --size 16x24\n"),
        "{text}"
    );
    let summary = captures.run("out", &["--shard", "1/4"]);
    assert!(summary.contains("2 made"), "both teapots: {summary}");
    let plan = run_ok(&mut captures.command("out", &["--plan", "--json"])).stdout;
    let plan: serde_json::Value = serde_json::from_slice(&plan).expect("JSON");
    assert_eq!(plan["schema"], "tracegen.plan/1");
    let done: Vec<&serde_json::Value> = plan["captures"]
        .as_array()
        .expect("captures")
        .iter()
        .map(|c| &c["done"])
        .collect();
    assert_eq!(done, [true, true, false, false]);
    // Samples, and ten samples for each of the teapot's triangles.
    assert_eq!(plan["captures"][0]["cost"], 2 * 16 * 24 + 10 * 14_972);
}

#[test]
fn a_slurm_script_captures_one_shard_per_task() {
    let captures = Captures::new(MANIFEST);
    let script = run_ok(&mut captures.command("it's out", &["--emit-slurm", "2"])).stdout;
    fs::write(captures.path("job.sh"), script).expect("temporary file");
    for task in ["2", "1"] {
        run_ok(
            Command::new("sh")
                .arg(captures.path("job.sh"))
                .env("SLURM_ARRAY_TASK_ID", task),
        );
    }
    assert_eq!(captures.names("it's out").len(), 8);
}

#[test]
fn bad_captures_are_refused_before_the_first_and_failures_are_listed_after_the_last() {
    let scene = |line: &str| {
        let usual = if line.starts_with("scene") {
            ""
        } else {
            "scene = \"teapot\"\n"
        };
        usual.to_owned()
    };
    for (line, expected) in [
        ("hmd = \"rift\"", "rift"),
        ("shadow = true", "--shadow"),
        ("size = \"0x4\"", "0x4"),
        ("threads = 2", "the sweep sets it itself"),
        ("scene = [\"teapot\", \"none.gltf\"]", "none.gltf"),
    ] {
        let captures = Captures::new(&format!("[[captures]]\n{}{line}\n", scene(line)));
        refuse(
            &mut captures.command("out", &[]),
            &["m.toml", "[[captures]] 1", expected],
        );
        assert!(!captures.path("out").exists());
    }
    let captures = Captures::new(
        "[base]\nsize = \"16x16\"\ncommand = \"rays\"\n[[captures]]\nscene = \"teapot\"\ncamera = [\"none\", \"low\"]\n",
    );
    refuse(
        &mut captures.command("out", &[]),
        &["none", "1 of 2 captures failed: teapot-none.raytrace"],
    );
    assert_eq!(
        captures.names("out"),
        ["teapot-low.raytrace", "teapot-low.raytrace.recipe"]
    );
    refuse(&mut captures.command("out", &["--json"]), &["--plan"]);
    refuse(
        &mut captures.command("out", &["--shard", "3/2"]),
        &["found `3/2`"],
    );
    fs::write(captures.path("file"), "").expect("temporary file");
    refuse(&mut captures.command("file", &[]), &["file"]);
}
