//! A guess of a scene's unit of length, where only its size can tell.

use crate::{Camera, Scene, cameras};

/// Sizes of scenes that are plausible in metres.
const PLAUSIBLE_M: std::ops::RangeInclusive<f32> = 0.02..=100.0;

/// A warning for a scene that `camera` shows as a whole, if its size suggests another unit than the metre.
/// `ipd_m` is the distance between the eyes.
pub fn warning(scene: &Scene, camera: &Camera, ipd_m: f32) -> Option<String> {
    let (low, high) = scene.bounds()?;
    let size = (high - low).max_element();
    // Someone who placed a camera knows the unit.
    if PLAUSIBLE_M.contains(&size) || camera.name != cameras::DEFAULT_NAME {
        return None;
    }
    let ipd_mm = f64::from(ipd_m) * 1000.0;
    let advice = |units: f64| {
        format!(
            "--ipd {} stands for {ipd_mm:.0} mm",
            significant(ipd_mm * units)
        )
    };
    let guess = if size > 100.0 * PLAUSIBLE_M.end() {
        format!("if its unit is the millimetre, {}", advice(1000.0))
    } else if size > *PLAUSIBLE_M.end() {
        format!("if its unit is the centimetre, {}", advice(100.0))
    } else if size > 0.0 {
        let as_large = advice(size.into());
        format!("if it stands for something of 1 m, {as_large}")
    } else {
        return None;
    };
    Some(format!(
        "the scene is {} m large: {guess}",
        significant(size.into())
    ))
}

/// A number rounded to three digits.
fn significant(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Mesh};
    use glam::{Affine3A, Vec3};

    fn of_size(size: f32) -> Scene {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y / 2.0];
        let mesh = Mesh {
            positions: corners.map(|corner| corner * size).to_vec(),
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        Scene {
            meshes: vec![mesh],
            instances: vec![Instance {
                mesh: 0,
                transform: Affine3A::IDENTITY,
            }],
            ..Scene::default()
        }
    }

    #[test]
    fn a_scene_that_is_too_large_or_too_small_for_metres_gets_an_ipd() {
        for (size, parts) in [
            (0.0, None),
            (0.0015, Some(("0.0015 m large", "1 m, --ipd 0.096 stands"))),
            (0.021, None),
            (99.0, None),
            (
                101.0,
                Some(("101 m large", "centimetre, --ipd 6400 stands for 64 mm")),
            ),
            (9999.0, Some(("10000 m large", "centimetre"))),
            (
                10_100.0,
                Some(("10100 m large", "millimetre, --ipd 64000 stands")),
            ),
        ] {
            let scene = of_size(size);
            let camera = cameras::default_camera(&scene);
            let found = warning(&scene, &camera, 0.064);
            assert_eq!(found.is_some(), parts.is_some(), "{size}: {found:?}");
            if let (Some(found), Some((length, guess))) = (found, parts) {
                assert!(found.contains(length) && found.contains(guess), "{found}");
            }
        }
    }

    #[test]
    fn a_scene_with_a_chosen_camera_gets_none() {
        let scene = of_size(500.0);
        let mut camera = cameras::default_camera(&scene);
        assert!(warning(&scene, &camera, 0.064).is_some());
        camera.name = "custom".to_owned();
        assert_eq!(warning(&scene, &camera, 0.064), None);
    }
}
