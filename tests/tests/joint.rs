//! The trace file is the only joint: `replay` knows nothing of capture or of a GPU.

use std::process::Command;

#[test]
fn replay_depends_neither_on_tracegen_nor_on_a_gpu() {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args([
            "tree",
            "-p",
            "replay",
            "-e",
            "normal",
            "--prefix",
            "none",
            "--offline",
            "--locked",
        ])
        .current_dir(parallax_tests::root())
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let tree = String::from_utf8(output.stdout).expect("cargo tree prints UTF-8");
    assert!(tree.starts_with("replay "), "unexpected tree: {tree}");
    for forbidden in ["tracegen ", "wgpu ", "naga ", "gltf "] {
        assert!(
            !tree.lines().any(|line| line.starts_with(forbidden)),
            "replay depends on {forbidden}"
        );
    }
}
