//! Checks the dependencies between the crates with `cargo tree`.

use std::process::Command;

/// Names of all dependencies of `package`, itself first.
fn tree(package: &str) -> Vec<String> {
    let arguments = ["tree", "-p", package, "-e", "normal", "--prefix", "none"];
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(arguments)
        .args(["--offline", "--locked"])
        .current_dir(parallax_tests::root())
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).expect("cargo tree prints UTF-8");
    let name = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
    let names: Vec<String> = text.lines().map(name).collect();
    assert_eq!(names[0], package, "unexpected tree: {text}");
    names
}

fn assert_free_of(package: &str, forbidden: &[&str]) {
    let names = tree(package);
    for name in forbidden {
        assert!(
            !names.iter().any(|n| n == name),
            "{package} depends on {name}"
        );
    }
}

#[test]
fn replay_depends_neither_on_tracegen_nor_on_a_gpu() {
    let rooms = ["scene", "scenes", "record", "raster", "rays"];
    assert_free_of("replay", &rooms);
    assert_free_of("replay", &["tracegen", "wgpu", "naga", "gltf"]);
}

#[test]
fn models_depend_neither_on_studies_nor_on_reports() {
    assert_free_of(
        "sim",
        &["shell", "image-error", "sgrt", "studies", "report"],
    );
    assert_free_of("sim", &["plotters", "parquet", "maud", "toml", "anyhow"]);
    assert_free_of(
        "sgrt",
        &["shell", "studies", "report", "plotters", "parquet"],
    );
    for model in ["frame", "locality"] {
        assert_free_of(model, &["shell", "sgrt", "studies", "report", "anyhow"]);
    }
    assert_free_of(
        "studies",
        &["report", "replay", "plotters", "parquet", "maud"],
    );
}

#[test]
fn tracegen_reads_what_the_layer_writes_without_the_layer() {
    for package in ["spool", "programs", "tracegen"] {
        assert_free_of(package, &["layer", "rspirv"]);
    }
    assert!(tree("layer").iter().any(|n| n == "spool"));
    assert_free_of("xr", &["layer", "programs", "tracegen", "scene", "cmake"]);
}

#[test]
fn record_depends_only_on_formats() {
    let names = tree("record");
    assert!(names.iter().any(|n| n == "formats"));
    let others = [
        "scene",
        "scenes",
        "textures",
        "visibility",
        "raster",
        "rays",
    ];
    assert_free_of("record", &others);
    assert_free_of("record", &["tracegen", "replay", "wgpu", "ash", "gltf"]);
}

#[test]
fn rays_are_traced_without_a_gpu() {
    assert_free_of("rays", &["wgpu", "naga", "ash", "raster", "record"]);
}

#[test]
fn only_raster_depends_on_the_driver() {
    for package in ["scene", "scenes", "textures", "visibility", "techniques"] {
        assert_free_of(package, &["wgpu", "naga", "raster", "rays"]);
    }
    assert!(tree("raster").iter().any(|n| n == "wgpu"));
    assert_free_of("raster", &["osmesa", "glow"]);
}
