//! Tests of folders of techniques: refusals and measurements.

use super::testing::{folder, manifest, write};
use super::*;
use formats::view::Eye;
use serde_json::{Value, json};
use std::fs;

/// The error of a folder whose manifest was changed, without the path before it.
fn refusal(change: impl Fn(&mut Value)) -> String {
    let root = tempfile::tempdir().unwrap();
    let mut text = manifest();
    change(&mut text);
    fs::write(root.path().join("manifest.json"), text.to_string()).unwrap();
    let error = Folder::open(root.path()).unwrap_err().to_string();
    let (path, problem) = error.split_once("manifest.json: ").expect("names the file");
    assert!(path.starts_with(root.path().to_str().unwrap()), "{error}");
    problem.to_owned()
}

#[test]
fn a_manifest_that_breaks_a_rule_is_refused_with_its_key() {
    let cases: [(&str, Value, &str); 12] = [
        (
            "/schema",
            json!("x/2"),
            "`schema`: expected tracegen.techniques/1, found `x/2`",
        ),
        (
            "/frames",
            json!([0, 2, 1]),
            "`frames`: expected at least one, numbers ascending, found [0, 2, 1]",
        ),
        (
            "/baseline",
            json!("mono"),
            "`baseline`: expected a technique of `rows`, found `mono`",
        ),
        (
            "/size_px",
            json!([0, 48]),
            "`size_px`: expected 1 to 16384 pixels each way, found [0, 48]",
        ),
        (
            "/pixels_per_degree",
            json!(-1.0),
            "`pixels_per_degree`: expected 0.1 to 1000, found -1",
        ),
        (
            "/lens/1/radius",
            json!(0.0),
            "`lens[1]`: expected lens: centre x and y from",
        ),
        (
            "/rows/1/technique",
            json!("per-eye"),
            "`rows[1].technique`: expected a unique name, found `per-eye`",
        ),
        (
            "/rows/2/frames/1/frame",
            json!(7),
            "`rows[2].frames`: expected the frames [0, 1, 2], found [0, 7, 2]",
        ),
        (
            "/rows/2/frames/1/frame_s/0",
            json!(0.0),
            "`rows[2].frames[1].frame_s[0]`: expected a number above 0, found 0",
        ),
        (
            "/rows/1/frames/0/baseline_s",
            json!([1.0]),
            "`rows[1].frames[0].baseline_s`: expected 3 times, one for each of `frame_s`, found 1",
        ),
        (
            "/rows/1/frames/0/stages_s/render",
            json!("long"),
            "`rows[1].frames[0].stages_s.render`: expected at least 0, found \"long\"",
        ),
        (
            "/rows/0/frames/0/fragments",
            json!(-3),
            "expected a manifest of techniques: invalid value: integer `-3`, expected u64",
        ),
    ];
    for (pointer, value, expected) in cases {
        let found = refusal(|m| *m.pointer_mut(pointer).expect("a key") = value.clone());
        assert!(found.starts_with(expected), "{pointer}: {found}");
    }
}

#[test]
fn paths_outside_the_folder_are_refused() {
    for path in [
        "../secret.png",
        "/etc/passwd",
        "images/../../x.png",
        "",
        "..\\x.png",
    ] {
        let found = refusal(|m| m["rows"][1]["frames"][2]["images"][1] = json!(path));
        assert_eq!(
            found,
            format!(
                "`rows[1].frames[2].images[1]`: expected a path inside the folder, found `{path}`"
            )
        );
    }
    let found = refusal(|m| m["rows"][0]["trace"] = json!("../a.textrace"));
    assert!(found.starts_with("`rows[0].trace`"), "{found}");
}

#[cfg(unix)]
#[test]
fn a_link_to_a_file_outside_the_folder_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let inside = root.path().join("inside");
    folder(&inside);
    fs::write(root.path().join("secret.png"), b"x").unwrap();
    let image = inside.join("images/grey/0001-left.png");
    fs::remove_file(&image).unwrap();
    std::os::unix::fs::symlink("../../../secret.png", &image).unwrap();
    let error = picture_figures(&Folder::open(&inside).unwrap(), &|_| ()).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("0001-left.png: expected a file inside"),
        "{error}"
    );
}

/// Writes the checksums of a folder's files into its manifest, as `tracegen techniques` does.
fn add_checksums(root: &std::path::Path) {
    let mut text = manifest();
    for row in text["rows"].as_array_mut().unwrap() {
        let path = root.join(row["trace"].as_str().unwrap());
        let trace = formats::Trace::open(&path).unwrap();
        row["trace_checksum"] = json!(format!("{:08x}", trace.content_checksum()));
        for frame in row["frames"].as_array_mut().unwrap() {
            let sum = |image: &Value| {
                let bytes = fs::read(root.join(image.as_str().unwrap())).unwrap();
                formats::container::checksum(&bytes)
            };
            let images = frame["images"].as_array().unwrap();
            frame["image_checksums"] = images.iter().map(sum).collect();
        }
    }
    fs::write(root.join("manifest.json"), text.to_string()).unwrap();
}

#[test]
fn a_picture_or_a_trace_of_another_row_is_refused() {
    let root = tempfile::tempdir().unwrap();
    folder(root.path());
    add_checksums(root.path());
    let open = || Folder::open(root.path()).unwrap();
    picture_figures(&open(), &|_| ()).unwrap();
    let of_row = open().manifest.rows[1].trace_checksum.clone().unwrap();
    open().check_trace(1, &of_row).unwrap();
    let error = open().check_trace(1, "0badcafe").unwrap_err().to_string();
    let expected = format!("expected the checksum {of_row} of the manifest, found 0badcafe");
    assert!(
        error.contains(&expected) && error.contains("superfrustum.textrace: "),
        "{error}"
    );

    let picture = |name: &str| root.path().join("images/superfrustum").join(name);
    fs::copy(picture("0000-left.png"), picture("0001-left.png")).unwrap();
    let error = picture_figures(&open(), &|_| ()).unwrap_err().to_string();
    assert!(
        error.contains("superfrustum/0001-left.png: expected the checksum "),
        "{error}"
    );
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_in_a_folder_are_refused_instead_of_read() {
    let pipe = |path: &std::path::Path| {
        fs::remove_file(path).unwrap();
        let made = std::process::Command::new("mkfifo").arg(path).status();
        assert!(made.unwrap().success());
    };
    let root = tempfile::tempdir().unwrap();
    folder(root.path());
    let image = root.path().join("images/grey/0001-left.png");
    pipe(&image);
    pipe(&root.path().join("traces/grey.textrace"));
    let opened = Folder::open(root.path()).unwrap();
    for error in [
        picture_figures(&opened, &|_| ()).unwrap_err(),
        opened.file("traces/grey.textrace").unwrap_err(),
    ] {
        let error = error.to_string();
        let expected = "expected a regular file, found a pipe";
        assert!(
            error.contains("grey") && error.ends_with(expected),
            "{error}"
        );
    }
    let path = root.path().join("manifest.json");
    pipe(&path);
    let error = Folder::open(root.path()).unwrap_err().to_string();
    assert!(error.ends_with("found a pipe"), "{error}");
    fs::remove_file(&path).unwrap();
    std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
    let error = Folder::open(root.path()).unwrap_err().to_string();
    assert!(error.ends_with("found a device"), "{error}");
}

#[test]
fn a_truncated_manifest_is_refused_without_a_panic() {
    let root = tempfile::tempdir().unwrap();
    let text = manifest().to_string();
    for end in (0..text.len()).step_by(97) {
        fs::write(root.path().join("manifest.json"), &text[..end]).unwrap();
        assert!(Folder::open(root.path()).is_err(), "{end}");
    }
}

#[test]
fn a_picture_that_is_missing_damaged_or_of_another_size_is_named() {
    let root = tempfile::tempdir().unwrap();
    folder(root.path());
    let path = root.path().join("images/superfrustum/0002-right.png");
    let error = || {
        let folder = Folder::open(root.path()).unwrap();
        picture_figures(&folder, &|_| ()).unwrap_err().to_string()
    };
    let other = image_error::Picture::filled([64, 47], [0; 3]);
    fs::write(&path, image_error::png::encode(&other).unwrap()).unwrap();
    assert!(
        error().ends_with("0002-right.png: expected 64x48 pixels, found 64x47"),
        "{}",
        error()
    );
    fs::write(&path, b"\x89PNG").unwrap();
    assert!(
        error().contains("0002-right.png: not a PNG picture"),
        "{}",
        error()
    );
    fs::remove_file(&path).unwrap();
    assert!(error().contains("0002-right.png: "), "{}", error());
}

#[test]
fn errors_are_counted_only_where_pictures_differ() {
    let root = tempfile::tempdir().unwrap();
    folder(root.path());
    let figures = picture_figures(&Folder::open(root.path()).unwrap(), &|_| ()).unwrap();
    for lossless in &figures[..2] {
        assert_eq!((lossless.flip_mean, lossless.flip_worst), (0.0, 0.0));
        assert_eq!(
            (lossless.identical_pct, lossless.flicker),
            (100.0, Some(0.0))
        );
        assert_eq!((lossless.psnr_db, lossless.ssim), (100.0, 1.0));
    }
    let grey = &figures[2];
    // Only the second of three frames has an error, in both eyes.
    assert_eq!((grey.worst_frame, grey.worst_eye), (1, Eye::Left));
    assert!((grey.flip_worst - 3.0 * grey.flip_mean).abs() < 1e-12);
    assert!((grey.identical_pct - 200.0 / 3.0).abs() < 1e-9);
    // A third of the squared error of the worst picture, not a third of its distance to the cap.
    assert!((grey.psnr_db - (grey.psnr_worst_db + 10.0 * 3.0_f64.log10())).abs() < 0.5);
    assert_eq!(grey.by_frame[0], 0.0);
    assert!(
        grey.by_frame[1] > 0.01 && grey.ssim_worst < 0.99,
        "{grey:?}"
    );
    // The error appears and disappears, so both pairs of frames flicker.
    assert!(grey.flicker.unwrap() > 0.01);
}

#[test]
fn nonconsecutive_frames_have_no_flicker() {
    let root = tempfile::tempdir().unwrap();
    let mut text = manifest();
    text["frames"] = json!([0, 5, 10]);
    for row in 0..3 {
        for (i, number) in [0, 5, 10].into_iter().enumerate() {
            text["rows"][row]["frames"][i]["frame"] = json!(number);
        }
    }
    write(root.path(), &text);
    let figures = picture_figures(&Folder::open(root.path()).unwrap(), &|_| ()).unwrap();
    assert_eq!(figures[2].flicker, None);
}

#[test]
fn the_figures_do_not_depend_on_the_threads() {
    let root = tempfile::tempdir().unwrap();
    folder(root.path());
    let folder = Folder::open(root.path()).unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| picture_figures(&folder, &|_| ()).unwrap())
    };
    assert_eq!(with(1), with(3));
}
