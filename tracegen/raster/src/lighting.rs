//! The light that a frame is shaded with.

use super::cascades::Cascade;
use glam::Vec3;
use scene::{Light, Scene};

/// Point lights that the shader evaluates; the brightest are kept.
pub const MAX_POINT_LIGHTS: usize = 8;

/// Sun, sky, point lights and shadow cascades of one frame, shared by both eyes.
#[derive(Clone, Debug)]
pub struct Lighting {
    /// Unit vector towards the sun.
    pub to_sun: Vec3,
    /// Irradiance of the sun, linear RGB.
    pub sun: Vec3,
    /// Radiance of the upper hemisphere, linear RGB.
    pub sky: Vec3,
    /// Radiance of the lower hemisphere, linear RGB.
    pub ground: Vec3,
    /// Positions and radiant intensities.
    pub points: Vec<(Vec3, Vec3)>,
    /// Shadow cascades, nearest first.
    pub cascades: Vec<Cascade>,
}

impl Lighting {
    /// The scene's lights; a scene without any gets a late-morning sun under a blue sky.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let suns = scene.lights.iter().filter_map(|light| match light {
            Light::Directional { direction, color } => Some((*direction, *color)),
            Light::Point { .. } => None,
        });
        let brightest = suns.max_by(|a, b| a.1.element_sum().total_cmp(&b.1.element_sum()));
        let mut points: Vec<(Vec3, Vec3)> = scene
            .lights
            .iter()
            .filter_map(|light| match light {
                Light::Point { position, color } => Some((*position, *color)),
                Light::Directional { .. } => None,
            })
            .collect();
        points.sort_by(|a, b| b.1.element_sum().total_cmp(&a.1.element_sum()));
        points.truncate(MAX_POINT_LIGHTS);
        let unlit = brightest.is_none() && points.is_empty();
        let (direction, sun) = match brightest {
            Some(light) => light,
            None if unlit => (Vec3::new(-0.25, -1.0, -0.18), Vec3::new(5.0, 4.6, 4.0)),
            None => (Vec3::NEG_Y, Vec3::ZERO),
        };
        let sky = if unlit && scene.sky == Vec3::ZERO {
            Vec3::new(0.45, 0.55, 0.75)
        } else {
            scene.sky
        };
        Self {
            to_sun: (-direction).normalize_or(Vec3::Y),
            sun,
            sky,
            // Light thrown back by sunlit ground of albedo 0.3.
            ground: 0.3 * (0.5 * sky + sun * 0.15),
            points,
            cascades: Vec::new(),
        }
    }
}
