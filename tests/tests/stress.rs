//! Tests of `tracegen stress`: mirrored eyes, and triangles that no rasteriser resolves.

use parallax_tests::{program, run_ok};
use serde_json::Value;

#[test]
fn mirrored_scenes_give_mirrored_eyes_and_slivers_are_warned_of() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // The program must not remove a user's file there.
    let kept = folder.path().join("scratch").join("thesis.txt");
    std::fs::create_dir(kept.parent().expect("a folder")).expect("writable");
    std::fs::write(&kept, "years of work").expect("writable");
    run_ok(
        program("tracegen")
            .args(["stress", "--only", "mirrored,slivers", "-o"])
            .arg(folder.path()),
    );
    let text = std::fs::read_to_string(&kept).expect("the user's file");
    assert_eq!(text, "years of work");
    let mut names: Vec<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .collect();
    names.retain(|entry| entry.as_ref().is_ok_and(|e| e.file_name() != "scratch"));
    assert_eq!(names.len(), 2, "{names:?}");
    let json = std::fs::read_to_string(folder.path().join("stress.json")).expect("a result");
    let json: Value = serde_json::from_str(&json).expect("JSON");
    let sweeps = json["sweeps"].as_array().expect("sweeps");
    let outcomes = |name: &str| -> Vec<&str> {
        let sweep = sweeps.iter().find(|s| s["name"] == name).expect(name);
        let points = sweep["points"].as_array().expect("points").iter();
        points
            .map(|p| p["outcome"].as_str().expect("an outcome"))
            .collect()
    };
    assert_eq!(outcomes("mirrored"), ["within"; 6]);
    assert_eq!(outcomes("slivers"), ["within", "within", "warned"]);
}
