//! `tracegen raster`.

use super::scene_args::SceneArgs;
use clap::Args;

/// Arguments of `tracegen raster`.
#[derive(Args, Debug)]
pub struct RasterArgs {
    #[command(flatten)]
    scene: SceneArgs,
}

/// Runs `tracegen raster`.
///
/// # Errors
/// Unreadable input or wrong use.
pub fn run(args: RasterArgs) -> anyhow::Result<()> {
    let _ = args.scene;
    anyhow::bail!("this build has no raster capture")
}
