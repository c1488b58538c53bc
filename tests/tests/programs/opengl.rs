//! Tests of `tracegen app --gl` and `--apitrace`.

use super::pixels::{explains_pixel, records};
use formats::textrace::Textrace;
use formats::view::Eye;
use parallax_tests::{has_lavapipe, program, refuse, run_ok, skipped};
use std::path::Path;
use std::process::Command;

/// Size of an eye's half of the picture of `gl_program`.
const EYE_PX: [usize; 2] = [240, 200];

/// Whether EGL and zink are installed.
pub(crate) fn has_zink(folder: &Path) -> bool {
    let picture = folder.join("probe");
    let mut probe = Command::new(env!("CARGO_BIN_EXE_gl_program"));
    probe.arg("1").arg(&picture);
    for (name, value) in [
        ("GALLIUM_DRIVER", "zink"),
        ("MESA_LOADER_DRIVER_OVERRIDE", "zink"),
    ] {
        probe.env(name, value);
    }
    let output = probe.env("LIBGL_ALWAYS_SOFTWARE", "1").output();
    let renderer = String::from_utf8_lossy(&output.expect("gl_program starts").stdout).into_owned();
    if !renderer.contains("zink") {
        skipped!("OpenGL on Mesa's zink is absent (libegl1, libgl1-mesa-dri)");
        return false;
    }
    true
}

/// Captures `gl_program` and returns the messages.
fn capture(trace: &Path, picture: &Path, flag: &str) -> String {
    let mut capture = program("tracegen");
    capture
        .args(["app", "--gl", "--frames", "2", "--to-end", flag, "-o"])
        .arg(trace)
        .arg("--")
        .arg(env!("CARGO_BIN_EXE_gl_program"))
        .arg("3")
        .arg(picture);
    String::from_utf8_lossy(&run_ok(&mut capture).stderr).into_owned()
}

#[test]
fn a_check_of_an_opengl_program_changes_no_figure() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    if !has_lavapipe() || !has_zink(folder.path()) {
        return;
    }
    let picture = folder.path().join("picture");
    let [plain, checked] = ["--eyes=halves", "--check"].map(|flag| {
        let trace = folder.path().join(format!("{flag}.textrace"));
        let said = capture(&trace, &picture, flag);
        let lines = said.lines();
        let figures: Vec<String> = lines
            .filter(|line| line.contains(" quads, ") || line.contains("not in the trace"))
            .map(str::to_owned)
            .collect();
        (trace, figures, std::fs::read(&picture).expect("a picture"))
    });
    assert_eq!((&plain.1, &plain.2), (&checked.1, &checked.2));
    let post = plain
        .1
        .iter()
        .any(|line| line.contains("post-processing (1 draws, "));
    assert!(post, "{:?}", plain.1);
    super::assert_same(&plain.0, &checked.0);
}

#[test]
fn every_pixel_of_an_opengl_program_shows_a_texel_of_its_last_record() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    if !has_lavapipe() || !has_zink(folder.path()) {
        return;
    }
    let [trace, picture] = ["gl.textrace", "picture"].map(|name| folder.path().join(name));
    let said = capture(&trace, &picture, "--check");
    assert!(said.contains("by viewport halves: 2 draws"), "{said}");
    assert!(said.contains("5 draws equal, 0 different"), "{said}");
    let trace = Textrace::open(&trace).expect("a trace");
    let picture = std::fs::read(picture).expect("a picture");
    let mut explained = 0;
    for (eye, left_px) in [(Eye::Left, 0), (Eye::Right, EYE_PX[0])] {
        let mut records = records(&trace, eye);
        for y in 0..EYE_PX[1] {
            for x in 0..EYE_PX[0] {
                let at = 4 * (y * 2 * EYE_PX[0] + left_px + x);
                let color: [u8; 4] = picture[at..at + 4].try_into().expect("four bytes");
                let of_pixel = records.remove(&[x, y]).unwrap_or_default();
                match of_pixel.last() {
                    None => assert_eq!(color, [0; 4], "{eye} {x},{y} is lit without a record"),
                    Some(last) => {
                        let explains = explains_pixel(trace.tables(), last, "plain", color);
                        assert!(explains, "{eye} {x},{y} shows {color:?}");
                        explained += 1;
                    }
                }
            }
        }
    }
    println!("{explained} pixels explained");
    assert!(explained > 20_000, "{explained} pixels");
}

#[test]
fn files_that_cannot_be_replayed_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = folder.path().join("a.textrace");
    let capture = |file: &Path| {
        let mut command = program("tracegen");
        command
            .args(["app", "--apitrace"])
            .arg(file)
            .arg("-o")
            .arg(&trace);
        command
    };
    let missing = folder.path().join("missing.trace");
    refuse(&mut capture(&missing), &["missing.trace", "No such file"]);
    refuse(&mut capture(folder.path()), &["found no regular file"]);
    let both = ["--apitrace", "a.trace", "-o", "a.textrace", "--", "true"];
    refuse(
        program("tracegen").arg("app").args(both),
        &["cannot be used with"],
    );
    assert!(!trace.exists());
}
