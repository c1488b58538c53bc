//! Options of `tracegen rays` for light beyond Whitted's model.

use clap::Args;
use formats::raytrace::RayLighting;
use formats::raytrace::tables::{MAX_DEPTH, MAX_OCCLUSION_RAYS, MAX_SUN_RADIUS_DEG};
use scene::{TextureSlot, TextureSlots};

/// Light beyond Whitted's model.
#[derive(Args, Debug)]
#[command(next_help_heading = "Light")]
pub(super) struct LightArgs {
    /// Radius of point lights: one shadow ray per sample to a random point of the sphere that they
    /// become.
    #[arg(long, value_name = "METRES", default_value_t = 0.0, value_parser = radius_m)]
    light_radius: f32,
    /// Angular radius of parallel lights (the sun's is 0.27): one shadow ray per sample in a random
    /// direction.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = sun_radius_deg)]
    sun_radius: f32,
    /// Ambient-occlusion rays per primary hit; what they leave open scales the light of the sky.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "bounces",
          value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_OCCLUSION_RAYS)))]
    ambient_occlusion: u32,
    /// Distance up to which surfaces occlude.
    #[arg(long, value_name = "METRES", default_value_t = 1.0, requires = "ambient_occlusion",
          value_parser = radius_m)]
    occlusion_distance: f32,
    /// Diffuse rays of a path in a row: global illumination by path tracing instead of the even light
    /// of the sky. Use --spp for less noise.
    #[arg(long, value_name = "N", default_value_t = 0,
          value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_DEPTH)))]
    bounces: u32,
    /// Glass and blended surfaces colour the light of shadow rays, instead of casting no shadow or a
    /// full one.
    #[arg(long)]
    coloured_shadows: bool,
    /// Normal maps bend the shading normals.
    #[arg(long)]
    normal_maps: bool,
    /// Seed of the random points and directions.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) seed: u64,
}

impl LightArgs {
    /// The lighting, unless it is Whitted's.
    pub(super) fn lighting(&self) -> Option<RayLighting> {
        let occludes = self.ambient_occlusion > 0;
        let lighting = RayLighting {
            light_radius_m: self.light_radius,
            sun_radius_deg: self.sun_radius,
            occlusion_rays: self.ambient_occlusion,
            occlusion_m: if occludes {
                self.occlusion_distance
            } else {
                0.0
            },
            bounces: self.bounces,
            coloured_shadows: self.coloured_shadows,
            normal_maps: self.normal_maps,
        };
        (lighting != RayLighting::default()).then_some(lighting)
    }

    /// The textures that rays sample.
    pub(super) fn texture_slots(&self) -> TextureSlots {
        let mut slots = rays::TEXTURE_SLOTS.to_vec();
        if self.normal_maps {
            slots.push(TextureSlot::Normal);
        }
        TextureSlots::of(&slots)
    }
}

fn within(text: &str, most: f32, unit: &str) -> Result<f32, String> {
    let value: f32 = text
        .parse()
        .map_err(|_| format!("expected a number of {unit}"))?;
    if (0.0..=most).contains(&value) {
        return Ok(value);
    }
    Err(format!("expected 0 to {most} {unit}"))
}

fn radius_m(text: &str) -> Result<f32, String> {
    within(text, 1e6, "metres")
}

fn sun_radius_deg(text: &str) -> Result<f32, String> {
    within(text, MAX_SUN_RADIUS_DEG, "degrees")
}
