//! Paths of the head and of the gaze as CSV.

use scene::paths::{HeadPath, Moments, PathOrigin, PathSpec, read_gazes};
use scene::{Scene, SceneError, cameras};
use std::path::Path;

/// Reads a file as poses and as gazes.
pub fn run(bytes: &[u8]) {
    crate::gltf::with_files(&[("path.csv", bytes)], |folder| {
        let file = folder.join("path.csv");
        if let Err(error) = follow(&PathSpec::Poses(file.clone())) {
            printable(&error);
        }
        match read_gazes(&file) {
            Ok(rows) => {
                assert!(rows.is_sorted_by(|a, b| a.time_s < b.time_s));
                let within = |deg: f64| deg.abs() < 90.0;
                assert!(rows.iter().all(|r| within(r.x_deg) && within(r.y_deg)));
            }
            Err(error) => printable(&error),
        }
    });
}

/// Checks that an error's text is fit for a terminal and of limited length.
pub fn printable(error: &SceneError) {
    let text = error.to_string();
    assert!(!text.contains(char::is_control), "{text:?}");
    assert!(text.len() < 4000, "{} bytes", text.len());
}

/// Follows a path from both origins and checks that every pose is a position and a rotation.
pub fn follow(spec: &PathSpec) -> Result<(), SceneError> {
    let camera = cameras::default_camera(&Scene::default());
    for origin in [PathOrigin::Camera, PathOrigin::World] {
        let (path, _) = HeadPath::open(spec, Some(origin))?;
        let moments = Moments {
            frames: 0..3,
            fps: 2.0,
            scene_start_s: 0.0,
        };
        for pose in path.poses(&camera, &moments)? {
            assert!(pose.is_finite(), "{pose}");
            let turn = pose.matrix3;
            assert!((turn.determinant() - 1.0).abs() < 1e-3, "{pose}");
            let identity = glam::Mat3A::IDENTITY;
            assert!((turn * turn.transpose()).abs_diff_eq(identity, 1e-3));
        }
        assert!(path.start(&camera)?.eye.is_finite());
    }
    Ok(())
}

/// Follows the camera's animation in a glTF file.
pub fn follow_gltf(file: &Path) {
    if let Err(error) = follow(&PathSpec::Gltf(file.to_owned(), None)) {
        printable(&error);
    }
}
