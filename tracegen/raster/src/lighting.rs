//! The lighting of a frame.

use super::cascades::Cascade;
use glam::Vec3;
use scene::light::Sky;
use scene::{Light, Scene};

/// Largest number of point lights in the shader. The brightest are kept.
pub const MAX_POINT_LIGHTS: usize = 8;

/// Sun, sky, point lights and shadow cascades of one frame, shared by both eyes.
#[derive(Clone, Debug)]
pub struct Lighting {
    /// Unit vector towards the sun.
    pub to_sun: Vec3,
    /// Irradiance of the sun, linear RGB.
    pub sun: Vec3,
    /// Sky and ground.
    pub sky: Sky,
    /// Positions and radiant intensities.
    pub points: Vec<(Vec3, Vec3)>,
    /// Shadow cascades, nearest first.
    pub cascades: Vec<Cascade>,
    /// The point between the eyes, and the share of the distance from there to an eye at which the eye's highlights are
    /// computed. Without, each eye sees the highlights at its own position.
    pub highlights: Option<(Vec3, f32)>,
}

impl Lighting {
    /// The scene's brightest sun and point lights, and its sky.
    pub fn new(scene: &Scene) -> Self {
        let (direction, sun) = scene.sun().unwrap_or((Vec3::NEG_Y, Vec3::ZERO));
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
        Self {
            to_sun: (-direction).normalize_or(Vec3::Y),
            sun,
            sky: Sky::new(scene),
            points,
            cascades: Vec::new(),
            highlights: None,
        }
    }

    /// Where the highlights of the eye at a position are seen from.
    pub fn highlights_from(&self, eye: Vec3) -> Vec3 {
        self.highlights
            .map_or(eye, |(between, share)| between + share * (eye - between))
    }
}
