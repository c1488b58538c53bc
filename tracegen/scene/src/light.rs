//! Lighting shared by all renderers: the sun and sky of a file without lights, and the two
//! hemispheres around a scene.

use crate::{Light, Scene};
use glam::Vec3;

/// Sky radiance of a scene whose file has no lights: a clear day, much dimmer than the sun.
const DEFAULT_SKY: Vec3 = Vec3::new(0.38, 0.47, 0.62);

/// Fraction of the light that the ground reflects.
const GROUND_ALBEDO: f32 = 0.3;

impl Scene {
    /// Adds a sun to a scene without lights and, if its sky is black, a sky.
    ///
    /// The sun stands at 72 degrees of elevation, so that it reaches the floor of a narrow atrium
    /// with an open roof and still shows relief, and off both horizontal axes, so that no
    /// axis-aligned wall is exactly edge-on.
    pub fn light_if_unlit(&mut self) {
        if !self.lights.is_empty() {
            return;
        }
        self.lights.push(Light::Directional {
            direction: Vec3::new(0.26, -1.0, 0.19).normalize(),
            color: Vec3::new(3.2, 3.0, 2.7),
        });
        if self.sky == Vec3::ZERO {
            self.sky = DEFAULT_SKY;
        }
    }

    /// The brightest parallel light: its direction of travel and its irradiance.
    pub fn sun(&self) -> Option<(Vec3, Vec3)> {
        let suns = self.lights.iter().filter_map(|light| match *light {
            Light::Directional { direction, color } => Some((direction, color)),
            Light::Point { .. } => None,
        });
        suns.max_by(|a, b| a.1.element_sum().total_cmp(&b.1.element_sum()))
    }
}

/// Background and ambient light: a sky over a ground that reflects light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Radiance of the upper hemisphere, linear RGB.
    pub sky: Vec3,
    /// Radiance of the lower hemisphere, linear RGB.
    pub ground: Vec3,
}

impl Sky {
    /// The sky of a scene, and its ground under the brightest sun.
    pub fn new(scene: &Scene) -> Self {
        let (_, sun) = scene.sun().unwrap_or_default();
        Self {
            sky: scene.sky,
            ground: GROUND_ALBEDO * (0.5 * scene.sky + 0.15 * sun),
        }
    }

    /// Radiance along a ray that leaves the scene. The capture shader's `background` is the same.
    pub fn background(&self, direction: Vec3) -> Vec3 {
        let zenith = self.sky * Vec3::new(0.75, 0.85, 1.0);
        let sky = self.sky.lerp(zenith, direction.y.clamp(0.0, 1.0));
        self.ground.lerp(sky, smoothstep(-0.1, 0.02, direction.y))
    }

    /// Ambient radiance that reaches a surface of this normal, averaged over its hemisphere. The
    /// capture shader's `ambient` is the same.
    pub fn ambient(&self, normal: Vec3) -> Vec3 {
        self.ground.lerp(self.sky, 0.5 + 0.5 * normal.y)
    }
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
