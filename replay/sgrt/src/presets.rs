//! Named settings of `replay reproject`: a rule, what is reused, and parameters that differ from the defaults.

use super::compose::Reuse;

/// Named settings. A rule, a level of reuse or a parameter that the user gives replaces the preset's.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Name on the command line.
    pub name: &'static str,
    /// What it stands for, briefly.
    pub title: &'static str,
    /// The rule of error detection.
    pub rule: &'static str,
    /// What a reused pixel takes from the left one.
    pub reuse: Reuse,
    /// Parameters that differ from the defaults, as TOML.
    pub parameters: &'static str,
}

/// The paper's storage: what detection reads of a left pixel goes through DRAM (section III), in full width.
macro_rules! paper_storage {
    () => {
        "[gbuffer]\nobject_bytes = 4\ndetect_position_bytes = 12\nrows = \"dram\"\n"
    };
}

/// The reading of the SGRT paper that comes closest to its figure 3 on the scenes that `replay readings` calibrates on.
pub const SGRT_PAPER: Preset = Preset {
    name: "sgrt-paper",
    title: "the reading of the SGRT paper that is closest to its figure 3: every arrival is reused, with its colour where the material \
            looks the same from everywhere; what detection reads goes through DRAM",
    rule: "none",
    reuse: Reuse::Color,
    parameters: paper_storage!(),
};

/// The SGRT of Lee et al., "SGRT: A Mobile GPU Architecture for Real-Time Ray Tracing", HPG 2013. docs/models/sgrt.md lists
/// where each value is from.
static SGRT_2013: Preset = Preset {
    name: "sgrt-2013",
    title: "figure 3 on the SGRT of 2013: one box per issue cycle, four traversal units and an intersection unit per core",
    parameters: concat!(
        paper_storage!(),
        "[tni]\ntrv_pipelines = 4\ntrv_cycles_per_step = 2\ntrv_cycles_per_wide_step = 8\nist_pipelines = 1\n"
    ),
    ..SGRT_PAPER
};

/// The engine of Nah et al., "T&I Engine: Traversal and Intersection Engine for Hardware Accelerated Ray Tracing", SIGGRAPH
/// Asia 2011.
static TNI_2011: Preset = Preset {
    name: "tni-2011",
    title: "figure 3 on the T&I engine of 2011: many traversal units with one adder and one multiplier each",
    parameters: concat!(
        paper_storage!(),
        "[tni]\ntrv_pipelines = 24\ntrv_cycles_per_step = 12\ntrv_cycles_per_wide_step = 48\nist_pipelines = 4\n",
        "rays_in_flight = 512\n",
        "[cache]\nnode_l1_bytes = 65536\ntriangle_l1_bytes = 65536\nl2_bytes = 262144\n",
        "[cycles]\nl1_mshrs = 64\n"
    ),
    ..SGRT_PAPER
};

/// All presets.
pub static PRESETS: [&Preset; 3] = [&SGRT_PAPER, &SGRT_2013, &TNI_2011];

/// The preset of a name.
pub fn find(name: &str) -> Option<&'static Preset> {
    PRESETS.into_iter().find(|preset| preset.name == name)
}

/// Describes the choices of `--preset`.
pub fn help() -> String {
    let mut text = "Named settings; --rule, --reuse and --config replace parts of them:".to_owned();
    for preset in PRESETS {
        text += &format!("\n  {}: {}", preset.name, preset.title);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::config::{RowStorage, SgrtConfig};
    use super::super::rules::Rule;
    use super::*;

    #[test]
    fn every_preset_has_a_rule_and_parameters_that_exist() {
        for preset in PRESETS {
            let rule: Result<Rule, _> = preset.rule.parse();
            assert_eq!(rule.expect(preset.name).to_string(), preset.rule);
            assert!(std::ptr::eq(find(preset.name).expect("found"), preset));
            // The paper's storage, whatever the defaults are.
            let gbuffer = SgrtConfig::from_overrides(preset.parameters)
                .expect(preset.name)
                .gbuffer;
            let bytes = [
                gbuffer.object_bytes,
                gbuffer.triangle_bytes,
                gbuffer.detect_position_bytes,
            ];
            assert_eq!((bytes, gbuffer.rows), ([4, 4, 12], RowStorage::Dram));
        }
        assert!(find("sgrt").is_none());
    }
}
