//! Flags that say what a capture may leave out.

use anyhow::bail;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use formats::view::{Hmd, Lens};
use techniques::Settings;
use visibility::Culling;

/// Techniques of a capture.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Techniques")]
pub struct TechniqueArgs {
    /// How the draws of a frame are found.
    #[arg(long, value_name = "NAME", default_value = Culling::default().name(),
          value_parser = culling_parser())]
    cull: Culling,
    /// Leave out draws that others hide: what the last frame showed is drawn for its depth first.
    #[arg(long)]
    occlusion: bool,
    /// Radius of the circle that the lens shows of an eye's picture, as a tangent [default: half of
    /// the sum of the longer axis's tangents].
    #[arg(long, value_name = "TAN", allow_hyphen_values = true)]
    lens_radius: Option<f32>,
}

impl TechniqueArgs {
    /// What is left out.
    pub fn settings(&self) -> Settings {
        Settings {
            culling: self.cull,
            occlusion: self.occlusion,
            ..Settings::default()
        }
    }

    /// What the lenses show of the left and right eye's picture.
    ///
    /// # Errors
    /// A radius out of range.
    pub fn lenses(&self, hmd: &Hmd) -> anyhow::Result<[Lens; 2]> {
        let lenses = hmd.fov.map(|fov| {
            let lens = Lens::of(&fov);
            let radius = self.lens_radius.unwrap_or(lens.radius);
            Lens { radius, ..lens }
        });
        for lens in &lenses {
            if let Err(broken) = lens.check() {
                let (expected, found) = (broken.expected, broken.found);
                bail!("--lens-radius: expected {expected}, found {found}");
            }
        }
        Ok(lenses)
    }
}

fn culling_parser() -> impl TypedValueParser<Value = Culling> {
    let value = |technique: Culling| PossibleValue::new(technique.name()).help(technique.help());
    PossibleValuesParser::new(Culling::all().map(value)).try_map(|name| name.parse::<Culling>())
}
