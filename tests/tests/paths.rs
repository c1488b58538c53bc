//! Head paths and moving scenes, from the command line to the trace.

use formats::Trace;
use parallax_tests::{program, refuse, run_ok};
use std::fs;
use std::path::Path;

fn raster(folder: &Path, name: &str, flags: &[&str]) -> (Vec<u8>, Trace) {
    let (trace, image) = (
        folder.join(format!("{name}.textrace")),
        folder.join(format!("{name}.png")),
    );
    run_ok(
        program("tracegen")
            .arg("raster")
            .args(flags)
            .arg("-o")
            .arg(&trace)
            .arg("--image")
            .arg(&image),
    );
    let opened = Trace::open(&trace).expect("a trace");
    (fs::read(image).expect("a picture"), opened)
}

#[test]
fn a_pose_from_a_file_equals_the_pose_from_flags() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("path.csv");
    let header = "time_s,x_m,y_m,z_m,qx,qy,qz,qw";
    fs::write(&path, format!("{header}\n5,0.05,0.2,0.6,0,0,0,1\n")).expect("writable");
    let file = path.to_string_lossy();
    let size = ["teapot", "--size", "64x64"];
    let posed = ["--eye", "0.05,0.2,0.6", "--target", "0.05,0.2,-0.4"];
    let (flags, _) = raster(folder.path(), "flags", &[&size[..], &posed].concat());
    let world = ["--path", &file, "--path-origin", "world"];
    let (poses, _) = raster(folder.path(), "poses", &[&size[..], &world].concat());
    assert!(flags == poses);
    // Relative to the camera; the position in the file has no effect.
    let (camera, _) = raster(folder.path(), "camera", &size);
    let (moved, _) = raster(
        folder.path(),
        "moved",
        &[&size[..], &["--path", &file]].concat(),
    );
    assert!(camera != flags && moved != flags);
}

#[test]
fn a_moving_plant_is_captured_along_a_head_path() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let flags = [
        "plant", "--size", "64x48", "--path", "head", "--fps", "4", "--frames", "3",
    ];
    // The capture compares its pictures with those of the plain rendering.
    let (_, trace) = raster(folder.path(), "plant", &flags);
    let Trace::Texture(trace) = trace else {
        panic!("a texture trace");
    };
    let frames = &trace.tables().meta.frames;
    assert_eq!(
        frames.iter().map(|f| f.frame).collect::<Vec<_>>(),
        [0, 1, 2]
    );
    assert!(frames[0].eyes[0].world_to_eye != frames[1].eyes[0].world_to_eye);
    assert_eq!(trace.tables().draws.len(), 20_000);
    refuse(
        program("tracegen").args(["scenes", "plant:1000"]),
        &["plant:1000", "from 20000 to 100000"],
    );
}
