//! `tracegen rays`.

use super::scene_args::SceneArgs;
use clap::Args;

/// Arguments of `tracegen rays`.
#[derive(Args, Debug)]
pub struct RaysArgs {
    #[command(flatten)]
    scene: SceneArgs,
}

/// Runs `tracegen rays`.
///
/// # Errors
/// Unreadable input or wrong use.
pub fn run(args: RaysArgs) -> anyhow::Result<()> {
    let _ = args.scene;
    anyhow::bail!("this build has no rays capture")
}
