//! Folders of techniques: what is refused, and what is measured.

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
            "`rows[1].technique`: expected a name of its own, found `per-eye`",
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
fn paths_that_lead_out_of_the_folder_are_refused() {
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
fn a_link_that_leads_out_of_the_folder_is_refused() {
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

#[test]
fn a_manifest_cut_anywhere_is_refused_without_a_panic() {
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
fn errors_count_where_pictures_differ_and_nowhere_else() {
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
    // Only the second of three frames errs, in both eyes.
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
    // It comes and goes: both pairs of frames flicker.
    assert!(grey.flicker.unwrap() > 0.01);
}

#[test]
fn frames_that_do_not_follow_each_other_have_no_flicker() {
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
