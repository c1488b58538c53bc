//! Flags for the lenses.

use super::values::numbers;
use anyhow::{bail, ensure};
use clap::Args;
use formats::view::{Hmd, Lens};
use std::str::FromStr;

/// The visible part of each eye's picture.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Techniques")]
pub struct LensArgs {
    /// Radius of the circle of an eye's picture that is visible through the lens, as a tangent [default: half
    /// of the sum of the longer axis's tangents].
    #[arg(long, value_name = "TAN", allow_hyphen_values = true)]
    lens_radius: Option<f32>,
    /// Centre of that circle in the right eye's picture, as tangents to the right and up from straight ahead;
    /// the left eye's circle is mirrored.
    #[arg(
        long,
        value_name = "X,Y",
        default_value = "0,0",
        allow_hyphen_values = true
    )]
    lens_center: Center,
}

/// `--lens-center`.
#[derive(Clone, Copy, Debug)]
struct Center([f32; 2]);

impl FromStr for Center {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers(text)
            .map(Self)
            .ok_or_else(|| format!("expected two tangents as in 0.05,-0.02, found '{text}'"))
    }
}

impl LensArgs {
    /// The visible parts of the left and right eye's pictures.
    ///
    /// # Errors
    /// A radius or a centre out of range, or a lens through which nothing is visible.
    pub fn lenses(&self, hmd: &Hmd) -> anyhow::Result<[Lens; 2]> {
        let Center([x, y]) = self.lens_center;
        let mirrored = [-1.0, 1.0];
        let lenses = [0, 1].map(|eye| Lens {
            center: [x * mirrored[eye], y],
            radius: self
                .lens_radius
                .unwrap_or_else(|| Lens::of(&hmd.fov[eye]).radius),
        });
        for (lens, fov) in lenses.iter().zip(&hmd.fov) {
            if let Err(broken) = lens.check() {
                let (expected, found) = (broken.expected, broken.found);
                bail!("--lens-radius, --lens-center: expected {expected}, found {found}");
            }
            // A point of the picture is visible only if it is inside the circle, so it suffices to check the
            // point nearest to the centre.
            let next = [
                lens.center[0].clamp(-fov.left, fov.right),
                lens.center[1].clamp(-fov.down, fov.up),
            ];
            ensure!(
                lens.contains(next),
                "--lens-radius, --lens-center: expected a lens that shows some of the picture, found one of radius {} around {:?}",
                lens.radius,
                lens.center
            );
        }
        Ok(lenses)
    }
}
