//! Where highlights are seen from.

use super::*;
use glam::Mat4;
use scene::Light;

const WALL_M: f32 = 0.4;

/// A metal wall in front of the eyes, lit from behind them. Its highlight is where an eye looks straight at it.
fn shiny_wall() -> Scene {
    let corners = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
    let wall = Mesh {
        positions: corners.map(|[x, y]| Vec3::new(x, y, -WALL_M)).into(),
        normals: vec![Vec3::Z; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    };
    let metal = Material {
        roughness: 0.5,
        metallic: 1.0,
        ..Material::default()
    };
    let mut scene = scene(vec![wall], vec![metal], Vec::new());
    scene.lights = vec![Light::Directional {
        direction: Vec3::NEG_Z,
        color: Vec3::splat(0.2),
    }];
    scene.sky = Vec3::ZERO;
    scene
}

/// The mean column of the light above a threshold, in pixels.
fn brightest_px(picture: &[u8]) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    for (at, texel) in picture.chunks_exact(4).enumerate() {
        let weight = f64::from(texel[0].saturating_sub(60));
        sum += weight * (f64::from(at as u32 % SIZE_PX[0]) + 0.5);
        all += weight;
    }
    assert!(all > 1000.0, "{all}");
    sum / all
}

#[test]
fn highlights_have_the_disparity_that_was_asked_for_and_the_trace_stays() {
    let scene = shiny_wall();
    let eyes = views(&scene, SIZE_PX).eyes;
    let mut traces = Vec::new();
    for share in [1.0, 0.0, 0.5, 2.0] {
        let settings = Settings {
            highlight_disparity: Some(share),
            ..Settings::default()
        };
        let planner = planner(&settings, SIZE_PX, BOTH);
        let captured = capture_as(&planner, &scene, 0, BUDGET, true).unwrap();
        let positions = eyes.map(|eye| Vec3::from(eye.position).as_dvec3());
        let between = (positions[0] + positions[1]) / 2.0;
        let seen = eyes.iter().zip(positions).zip(&captured.pictures);
        for ((eye, eye_m), picture) in seen {
            let seen_from = between + f64::from(share) * (eye_m - between);
            let on_wall = seen_from.with_z(f64::from(-WALL_M));
            let [projection, pose] = [eye.eye_to_clip, eye.world_to_eye]
                .map(|m| Mat4::from_cols_array_2d(&m).as_dmat4());
            let ndc = (projection * pose).project_point3(on_wall).truncate();
            let expected = (0.5 * ndc.x + 0.5) * f64::from(SIZE_PX[0]);
            let found = brightest_px(picture);
            assert!(
                (found - expected).abs() < 0.3,
                "{share}: {found}, not {expected}"
            );
        }
        traces.push(captured.trace);
    }
    assert!(traces.iter().all(|trace| *trace == traces[0]));
}
