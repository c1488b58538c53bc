//! Machines by name: what a configuration starts from in place of the defaults.

use crate::config::{BlockOrder, Mode, RunConfig, TmuModel};
use crate::registry::{Named, registry};

registry! { PresetRow:
    Z2_PAPER = row("z2-paper", "Threads stop at their first miss, and rates count first look-ups, as the Z2 paper's table suggests", z2_paper);
}

/// A named machine.
pub type Preset = Named<PresetRow>;

/// A row of the table of presets.
#[derive(Debug)]
pub struct PresetRow {
    name: &'static str,
    help: &'static str,
    over: fn(RunConfig) -> RunConfig,
}

const fn row(
    name: &'static str,
    help: &'static str,
    over: fn(RunConfig) -> RunConfig,
) -> PresetRow {
    PresetRow { name, help, over }
}

impl Preset {
    /// A configuration with what the preset sets.
    #[must_use]
    pub fn over(self, config: RunConfig) -> RunConfig {
        (self.row().over)(config)
    }
}

/// The nearest stated model. Its one free number is the loop; `docs/models/z2.md` says what it
/// was calibrated on, and why textures begin at multiples of 64 KiB. The paper's shadow rows save nothing or lose: of
/// the layouts of a shadow map that were tried, a linear one comes nearest to that.
fn z2_paper(mut config: RunConfig) -> RunConfig {
    config.mode = Mode::Timed;
    config.tmu.model = TmuModel::FirstMiss;
    config.tmu.loop_cycles = 24;
    config.tmu.threads = 64;
    config.layout.base_align_bytes = 64 << 10;
    config.layout.shadow_map_order = BlockOrder::Linear;
    config
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_machine_that_can_be_built() {
        for preset in Preset::all() {
            let config = preset.over(RunConfig::default());
            config.validate().unwrap();
            assert_ne!(config, RunConfig::default(), "{}", preset.name());
        }
    }
}
