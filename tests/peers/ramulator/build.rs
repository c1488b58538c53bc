//! Compiles Ramulator 1 and its C interface.

use std::env::var;
use std::path::Path;
use std::process::Command;

fn main() {
    // Cargo tells no build script where a package is whose features are off.
    let mut metadata = Command::new(var("CARGO").expect("set by Cargo"));
    metadata.args([
        "metadata",
        "--format-version=1",
        "--all-features",
        "--locked",
    ]);
    let output = metadata.output().expect("cargo metadata");
    let text = String::from_utf8_lossy(&output.stdout);
    let mut strings = text.split('"');
    let manifest =
        strings.find(|path| path.contains("ramulator_wrapper-") && path.ends_with("Cargo.toml"));
    let manifest = manifest.unwrap_or_else(|| panic!("no ramulator_wrapper: {output:?}"));
    let sources = Path::new(manifest).with_file_name("ramulator/src");
    let own = "src/channels.cc";
    println!("cargo::rerun-if-changed={own}");
    let mut build = cc::Build::new();
    build.cpp(true).std("c++17").warnings(false).opt_level(2);
    build.include(&sources).file(own);
    build.files(["DDR4.cpp", "LPDDR4.cpp", "StatType.cpp"].map(|name| sources.join(name)));
    build.compile("ramulator");
}
