//! The parameters of the model, read from TOML. `data/sgrt-default.toml` documents the defaults.

use super::prefetch::RayPrefetching;
use super::ray_sort::{self, RaySort};
use formats::raytrace::TraversalKind;
use serde::{Deserialize, Serialize};

/// The default parameters, with comments.
pub const DEFAULT_TOML: &str = include_str!("../data/sgrt-default.toml");

/// All parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SgrtConfig {
    /// Traversal and intersection units.
    pub tni: Tni,
    /// Caches of the hierarchy's nodes and triangles.
    pub cache: Cache,
    /// External memory.
    pub memory: Memory,
    /// Programmable cores.
    pub srp: Srp,
    /// G-buffer record.
    pub gbuffer: Gbuffer,
    /// Energy per operation.
    pub energy: Energy,
    /// What only the cycle-level model of the units uses.
    pub cycles: Cycles,
}

/// Fixed-function traversal and intersection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Tni {
    /// Number of units.
    pub units: u32,
    /// Clock in MHz.
    pub clock_mhz: f64,
    /// Traversal pipelines per unit.
    pub trv_pipelines: u32,
    /// Issue cycles per step at a binary node.
    pub trv_cycles_per_step: f64,
    /// Issue cycles per step at an eight-wide node.
    pub trv_cycles_per_wide_step: f64,
    /// Stages of a traversal pipeline.
    pub trv_depth_cycles: u32,
    /// Intersection pipelines per unit.
    pub ist_pipelines: u32,
    /// Issue cycles per ray-triangle test.
    pub ist_cycles_per_test: f64,
    /// Stages of an intersection pipeline.
    pub ist_depth_cycles: u32,
    /// Rays in flight per unit.
    pub rays_in_flight: u32,
    /// Rays that a unit accepts or returns per cycle.
    pub rays_per_cycle: f64,
    /// The order in which units take the rays of a batch.
    #[serde(default = "ray_sort::none", skip_serializing_if = "is_unsorted")]
    pub ray_sort: RaySort,
}

fn is_unsorted(sort: &RaySort) -> bool {
    *sort == ray_sort::none()
}

/// Caches of the hierarchy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Cache {
    /// Node cache of each unit.
    pub node_l1_bytes: u64,
    /// Triangle cache of each unit.
    pub triangle_l1_bytes: u64,
    /// Ways of both L1 caches.
    pub l1_ways: u32,
    /// Cache shared by all units.
    pub l2_bytes: u64,
    /// Ways of the L2.
    pub l2_ways: u32,
    /// Line size of all caches.
    pub line_bytes: u64,
    /// Cycles from an L1 miss to data from the L2.
    pub l2_latency_cycles: u32,
    /// Share of node visits that hit the L1, if the trace has no addresses.
    pub node_l1_hit_rate: HitRates,
    /// Share of triangle visits that hit the L1, if the trace has no addresses.
    pub triangle_l1_hit_rate: HitRates,
    /// Share of L1 misses that hit the L2, if the trace has no addresses.
    pub l2_hit_rate: HitRates,
}

/// A hit rate by class of ray, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct HitRates {
    /// Primary rays.
    pub primary: f64,
    /// Shadow rays of primary hits.
    pub shadow: f64,
    /// All later rays of the ray tree.
    pub secondary: f64,
}

/// External memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Peak bandwidth, 10^9 bytes per second.
    pub bandwidth_gb_s: f64,
    /// Latency of a read.
    pub latency_ns: f64,
    /// Attributes and texels per shaded hit.
    pub shading_bytes: f64,
    /// Frame buffer bytes per pixel.
    pub frame_buffer_bytes: u32,
}

/// Programmable cores and the cost of kernels in cycles of one lane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Srp {
    /// Number of cores.
    pub cores: u32,
    /// Lanes per core.
    pub lanes_per_core: u32,
    /// Clock in MHz.
    pub clock_mhz: f64,
    /// Cycles per generated ray.
    pub ray_generation_cycles: f64,
    /// Cycles per closest-hit ray, hit or miss.
    pub shading_cycles: f64,
    /// Cycles per alpha look-up.
    pub alpha_test_cycles: f64,
    /// Cycles per left pixel projected into the right eye.
    pub reproject_cycles: f64,
    /// Cycles per right pixel tested.
    pub detect_cycles: f64,
    /// Cycles per right pixel reused.
    pub reuse_cycles: f64,
    /// Cycles per left pixel of its row that a right pixel is tested against; 0 if detection looks only at what the
    /// reproject kernel scattered into the right pixel.
    pub row_test_cycles: f64,
    /// True if an inspector compacts pixels by kernel (inspector-executor), so that no lane idles; false if each warp
    /// runs the kernels of all its pixels.
    pub compaction: bool,
}

/// Bytes of the fields of a G-buffer record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Gbuffer {
    /// Colour.
    pub color_bytes: u32,
    /// Normal.
    pub normal_bytes: u32,
    /// Texture coordinates.
    pub texcoord_bytes: u32,
    /// Position.
    pub position_bytes: u32,
    /// Object number, part of the record if error detection reads it.
    pub object_bytes: u32,
    /// Triangle number, part of the record if error detection reads it.
    pub triangle_bytes: u32,
    /// Outcomes of the shadow rays, part of the record if error detection reads them.
    pub shadow_bytes: u32,
    /// Position in the copy that error detection reads: three coordinates, or a depth, as the pixel gives the direction.
    pub detect_position_bytes: u32,
    /// Where that copy waits for the right eye.
    pub rows: RowStorage,
}

/// Where the fields that error detection reads of left pixels wait for the right eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum RowStorage {
    /// In DRAM: written once per left pixel, fetched by DMA for each band of right tiles (paper, section III).
    Dram,
    /// On chip: the left eye's bands of tiles alternate with the right eye's, so that only the rows of a few bands are alive.
    Chip,
}

/// Parameters that only the cycle-level model of the units uses (`--timing cycle`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Cycles {
    /// Rays that advance in lock step; 1 for single rays.
    pub warp_rays: u32,
    /// Lines that each node or triangle cache can have in flight.
    pub l1_mshrs: u32,
    /// Lines that the L2 can have in flight.
    pub l2_mshrs: u32,
    /// Tiles that are between the dispatch of their first ray and the end of their shading.
    pub tile_buffers: u32,
    /// True if a unit returns its rays in order of dispatch; a finished ray then keeps its slot until all earlier ones
    /// have returned.
    pub in_order_return: bool,
    /// Rays of a batch that return together: a finished ray keeps its slot until the others of its group have finished.
    #[serde(default = "single", skip_serializing_if = "is_single")]
    pub return_group_rays: u32,
    /// What is fetched ahead into the node and triangle caches.
    #[serde(default, skip_serializing_if = "Prefetch::is_none")]
    pub prefetch: Prefetch,
}

fn single() -> u32 {
    1
}

fn is_single(rays: &u32) -> bool {
    *rays == 1
}

/// Prefetching into the node and triangle caches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Prefetch {
    /// The prefetcher.
    pub prefetcher: RayPrefetching,
    /// Most bytes of a treelet, its root included; for `treelet`.
    pub treelet_bytes: u32,
    /// Entries that are fetched at a pop; for `ttp`.
    pub stack_entries: u32,
    /// True if a ray also visits popped entries that lie behind its nearest triangle so far.
    pub visits_dropped: bool,
}

impl Prefetch {
    /// True if nothing is fetched ahead.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// Energy per operation and per byte.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Energy {
    /// Per step at a binary node.
    pub step_pj: f64,
    /// Per step at an eight-wide node.
    pub wide_step_pj: f64,
    /// Per ray-triangle test.
    pub triangle_test_pj: f64,
    /// Per ray accepted and returned.
    pub ray_pj: f64,
    /// Per cycle of one lane of a programmable core.
    pub srp_lane_cycle_pj: f64,
    /// Per byte read from an L1.
    pub l1_pj_per_byte: f64,
    /// Per byte read from the L2.
    pub l2_pj_per_byte: f64,
    /// Per byte read from or written to the tile G-buffer.
    pub sram_pj_per_byte: f64,
    /// Per byte read from or written to external memory.
    pub dram_pj_per_byte: f64,
    /// Static power.
    pub static_mw: f64,
}

/// Invalid parameters.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// Invalid TOML, an unknown key, or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// A value outside its range.
    #[error("{key}: expected {expected}, found {found}")]
    Range {
        /// Dotted key.
        key: String,
        /// The valid values.
        expected: &'static str,
        /// The value found.
        found: String,
    },
}

impl Default for SgrtConfig {
    fn default() -> Self {
        toml::from_str(DEFAULT_TOML).expect("the embedded defaults parse")
    }
}

impl SgrtConfig {
    /// Issue cycles and energy of a traversal step.
    pub fn step(&self, traversal: TraversalKind) -> (f64, f64) {
        if traversal == TraversalKind::Bvh2 {
            return (self.tni.trv_cycles_per_step, self.energy.step_pj);
        }
        // The parameters are for eight boxes. Work is proportional to the boxes of a step.
        let share = traversal.width() as f64 / TraversalKind::Bvh8.width() as f64;
        let (cycles, pj) = (self.tni.trv_cycles_per_wide_step, self.energy.wide_step_pj);
        (cycles * share, pj * share)
    }

    /// The defaults, overridden by a file's values.
    ///
    /// # Errors
    /// [`ConfigError`] names the key and what was expected.
    pub fn from_overrides(text: &str) -> Result<Self, ConfigError> {
        Self::from_layers(&[text])
    }

    /// The defaults, overridden by each text in turn.
    ///
    /// # Errors
    /// [`ConfigError`] names the key and what was expected.
    pub fn from_layers(texts: &[&str]) -> Result<Self, ConfigError> {
        let mut table: toml::Table = toml::from_str(DEFAULT_TOML)?;
        for text in texts {
            overlay(&mut table, toml::from_str(text)?);
        }
        let config: Self = table.try_into()?;
        config.check()?;
        Ok(config)
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// `ConfigError::Range` for the first value out of range.
    pub fn check(&self) -> Result<(), ConfigError> {
        for (key, value) in self.numbers() {
            let rate = key.contains("hit_rate");
            let cost = key.starts_with("energy.")
                || key.starts_with("gbuffer.")
                || (key.starts_with("memory.") && key.ends_with("_bytes"));
            let kernel = key.starts_with("srp.") && key.ends_with("_cycles");
            let (expected, fits) = if rate {
                ("a rate from 0 to 1", (0.0..=1.0).contains(&value))
            } else if cost || kernel {
                ("a number of at least 0", value >= 0.0)
            } else {
                ("a number above 0", value > 0.0)
            };
            if !fits || !value.is_finite() {
                return Err(ConfigError::Range {
                    key,
                    expected,
                    found: value.to_string(),
                });
            }
        }
        let has_prefetcher = self.cycles.prefetch.prefetcher != Prefetch::default().prefetcher;
        if has_prefetcher && self.cycles.warp_rays > 1 {
            return Err(ConfigError::Range {
                key: "cycles.warp_rays".to_owned(),
                expected: "1 with a prefetcher, which follows the stacks of single rays",
                found: self.cycles.warp_rays.to_string(),
            });
        }
        let group = self.cycles.return_group_rays;
        if group > 1 && (self.cycles.warp_rays > 1 || self.cycles.in_order_return)
            || group > self.tni.rays_in_flight
        {
            return Err(ConfigError::Range {
                key: "cycles.return_group_rays".to_owned(),
                expected: "at most tni.rays_in_flight, and 1 with warp_rays or in_order_return",
                found: group.to_string(),
            });
        }
        let c = &self.cache;
        for (key, bytes, ways) in [
            ("cache.node_l1_bytes", c.node_l1_bytes, c.l1_ways),
            ("cache.triangle_l1_bytes", c.triangle_l1_bytes, c.l1_ways),
            ("cache.l2_bytes", c.l2_bytes, c.l2_ways),
        ] {
            let set = c.line_bytes.saturating_mul(u64::from(ways));
            let sets = bytes / set;
            if !bytes.is_multiple_of(set)
                || !sets.is_power_of_two()
                || sets * u64::from(ways) > 1 << 24
            {
                return Err(ConfigError::Range {
                    key: key.to_owned(),
                    expected: "a power of two of sets (ways x line_bytes each) and at most 2^24 lines",
                    found: format!("{bytes} bytes over sets of {set} bytes"),
                });
            }
        }
        Ok(())
    }

    /// Every parameter by its dotted key, in file order.
    pub fn numbers(&self) -> Vec<(String, f64)> {
        let mut out = Vec::new();
        if let Ok(table) = toml::Table::try_from(self) {
            collect("", &table, &mut out);
        }
        out
    }

    /// A copy with one parameter scaled. Integers are rounded and stay at least 1; for rates, the miss rate
    /// is scaled. `None` for an unknown key.
    pub fn scaled(&self, key: &str, factor: f64) -> Option<Self> {
        let mut table = toml::Table::try_from(self).ok()?;
        let mut parts = key.split('.').peekable();
        let mut at = &mut table;
        while let Some(part) = parts.next() {
            let value = at.get_mut(part)?;
            if parts.peek().is_some() {
                at = value.as_table_mut()?;
                continue;
            }
            *value = match *value {
                toml::Value::Integer(n) => {
                    toml::Value::Integer(((n as f64 * factor).round() as i64).max(1))
                }
                toml::Value::Float(x) if key.contains("hit_rate") => {
                    toml::Value::Float((1.0 - (1.0 - x) * factor).clamp(0.0, 1.0))
                }
                toml::Value::Float(x) => toml::Value::Float(x * factor),
                _ => return None,
            };
            return table.try_into().ok();
        }
        None
    }
}

fn overlay(base: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(toml::Value::Table(b)), toml::Value::Table(o)) => overlay(b, o),
            // An integer is valid for a floating-point parameter.
            (Some(slot @ toml::Value::Float(_)), toml::Value::Integer(n)) => {
                *slot = toml::Value::Float(n as f64);
            }
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

fn collect(prefix: &str, table: &toml::Table, out: &mut Vec<(String, f64)>) {
    for (key, value) in table {
        let name = format!("{prefix}{key}");
        match value {
            toml::Value::Table(inner) => collect(&format!("{name}."), inner, out),
            toml::Value::Integer(n) => out.push((name, *n as f64)),
            toml::Value::Float(x) => out.push((name, *x)),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_defaults_pass_their_own_check() {
        SgrtConfig::default().check().expect("valid");
    }

    #[test]
    fn a_file_can_contain_only_the_changed_keys() {
        let config = SgrtConfig::from_overrides("[tni]\nunits = 8\nclock_mhz = 700\n").expect("ok");
        assert_eq!(config.tni.units, 8);
        assert_eq!(config.tni.clock_mhz, 700.0);
        assert_eq!(config.srp, SgrtConfig::default().srp);
    }

    #[test]
    fn without_a_prefetcher_a_configuration_does_not_name_one() {
        let config = SgrtConfig::default();
        assert_eq!(config.cycles.prefetch, Prefetch::default());
        let text = toml::to_string(&config).expect("TOML");
        assert!(!text.contains("prefetch"));
        assert_eq!(SgrtConfig::from_overrides(&text).expect("valid"), config);
        let text = "[cycles]\nwarp_rays = 8\n[cycles.prefetch]\nprefetcher = 'ttp'";
        let error = SgrtConfig::from_overrides(text).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("cycles.warp_rays: expected 1")
        );
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_name() {
        let error = SgrtConfig::from_overrides("[tni]\ncolour = 8\n").unwrap_err();
        assert!(error.to_string().contains("colour"), "{error}");
    }

    #[test]
    fn the_error_for_a_value_out_of_range_has_key_expected_and_found() {
        let error = SgrtConfig::from_overrides("[memory]\nlatency_ns = -1.0\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "memory.latency_ns: expected a number above 0, found -1"
        );
        let error = SgrtConfig::from_overrides("[cache]\nl2_bytes = 100000\n").unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("cache.l2_bytes: expected a power of two")
        );
    }

    #[test]
    fn scaling_gives_whole_counts_and_valid_rates() {
        let base = SgrtConfig::default();
        assert_eq!(
            base.scaled("tni.ist_pipelines", 0.5)
                .expect("known")
                .tni
                .ist_pipelines,
            1
        );
        assert_eq!(base.scaled("tni.units", 2.0).expect("known").tni.units, 8);
        let scaled = base
            .scaled("cache.l2_hit_rate.primary", 2.0)
            .expect("known");
        assert!((scaled.cache.l2_hit_rate.primary - 0.7).abs() < 1e-12);
        assert!(base.scaled("no.such", 2.0).is_none());
    }

    #[test]
    fn every_parameter_can_be_scaled() {
        let base = SgrtConfig::default();
        for (key, _) in base.numbers() {
            assert!(base.scaled(&key, 2.0).is_some(), "{key}");
        }
    }
}
