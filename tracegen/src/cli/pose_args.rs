//! Flags for the time and the animation of a scene.

use clap::Args;
use scene::LoadOptions;

/// Longest time, seconds: one year, for which double precision still resolves milliseconds.
const MAX_TIME_S: f64 = 365.0 * 86_400.0;

/// The pose of an animated scene.
#[derive(Args, Clone, Debug)]
pub struct PoseArgs {
    /// Scene time of the first frame, in seconds. Later frames follow at the frame rate.
    ///
    /// An animation of a glTF file repeats after its last key.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = parse_time,
          allow_negative_numbers = true)]
    pub time: f64,
    /// Animation of a glTF file to play: its name, its number, `all` or `none` [default: the first
    /// one].
    #[arg(long, value_name = "NAME|NUMBER|all|none")]
    pub animation: Option<String>,
}

impl PoseArgs {
    /// The same options for a scene in this pose.
    pub fn applied_to(&self, options: &LoadOptions) -> LoadOptions {
        LoadOptions {
            animation: self.animation.clone(),
            time_s: self.time,
            ..options.clone()
        }
    }
}

fn parse_time(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time_s) if (0.0..=MAX_TIME_S).contains(&time_s) => Ok(time_s),
        _ => Err(format!(
            "expected 0 to {MAX_TIME_S} seconds, found '{text}'"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::parse_time;

    #[test]
    fn times_are_finite_and_not_negative() {
        assert_eq!(parse_time("1.5"), Ok(1.5));
        for bad in ["-1", "nan", "inf", "1e9", "soon"] {
            let error = parse_time(bad).unwrap_err();
            assert!(error.contains("0 to 31536000 seconds"), "{error}");
        }
    }
}
