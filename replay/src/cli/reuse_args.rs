//! Options of the commands that reuse hits: rule, level of reuse and model parameters.

use super::choice::choice;
use anyhow::Context;
use clap::Args;
use sgrt::compose::Reuse;
use sgrt::config::SgrtConfig;
use sgrt::presets::{self, Preset};
use sgrt::rules::{self, Rule};
use sgrt::{DEFAULT_REUSE, DEFAULT_RULE};
use std::path::{Path, PathBuf};

/// What is reused, and the machine.
#[derive(Clone, Debug, Default, Args)]
pub struct ReuseArgs {
    /// The machine and the rule by name.
    #[arg(long, value_name = "NAME", help = presets::help(), value_parser = preset)]
    pub preset: Option<&'static Preset>,
    #[arg(long, value_name = "RULE", help = rule_help())]
    rule: Option<Rule>,
    /// Values that a reprojected pixel reuses [default: shadow]
    #[arg(long, value_parser = choice::<Reuse>())]
    reuse: Option<Reuse>,
    /// TOML file with model parameters; others keep their defaults
    #[arg(long, value_name = "TOML")]
    pub config: Option<PathBuf>,
}

fn rule_help() -> String {
    format!("{} [default: {DEFAULT_RULE}]", rules::help())
}

/// The preset of a name.
fn preset(name: &str) -> Result<&'static Preset, String> {
    let names = || presets::PRESETS.map(|preset| preset.name).join(" or ");
    presets::find(name).ok_or_else(|| format!("expected {}", names()))
}

impl ReuseArgs {
    /// The rule: the user's, else the preset's, else the default.
    pub fn rule(&self) -> anyhow::Result<Rule> {
        let named = self.preset.map_or(DEFAULT_RULE, |preset| preset.rule);
        self.rule.clone().map_or_else(|| Ok(named.parse()?), Ok)
    }

    /// What is reused: the user's, else the preset's, else the default.
    pub fn reuse(&self) -> Reuse {
        let named = self.preset.map_or(DEFAULT_REUSE, |preset| preset.reuse);
        self.reuse.unwrap_or(named)
    }

    /// The parameters: the defaults, the preset's over them, the file's over both.
    pub fn parameters(&self) -> anyhow::Result<SgrtConfig> {
        read_config(self.preset, self.config.as_deref())
    }
}

/// The parameters: the defaults, the preset's over them, the file's over both.
pub(super) fn read_config(
    preset: Option<&'static Preset>,
    path: Option<&Path>,
) -> anyhow::Result<SgrtConfig> {
    let named = preset.map_or("", |preset| preset.parameters);
    let Some(path) = path else {
        return Ok(SgrtConfig::from_overrides(named)?);
    };
    let text = shell::read_settings(path)?;
    SgrtConfig::from_layers(&[named, &text]).with_context(|| path.display().to_string())
}
