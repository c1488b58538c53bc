//! Readings of the SGRT paper: the paper leaves open what its figure 3 measures and what is reused. A reading is
//! one choice for each open question. All readings of a trace are run, so that a conclusion can be held against
//! each of them.

use super::compose::Reuse;
use super::config::SgrtConfig;
use super::detect::decide;
use super::energy_bounds::relative_bounds;
use super::frame::FrameError;
use super::hardware::{Comparison, RemainingWork};
use super::loaded::LoadedTrace;
use super::rules::Rule;
use super::run::{EnergyPj, Run};
use serde::Serialize;

/// What performance and energy are measured of ("for the T&I unit", section IV).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Scope {
    /// Cycles of the T&I units; energy of the units and their caches.
    Units,
    /// The same, with the DRAM traffic of the hierarchy.
    UnitsAndMemory,
    /// The whole frame: units, cores and all memory traffic.
    Frame,
}

/// The left pixels that a right pixel is tested against ("the whole pixels in the same row", section III).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum RowTest {
    /// What the reproject kernel scattered into the pixel.
    Arrivals,
    /// Every left pixel of its row, one after the other.
    WholeRow,
}

/// Where the G-buffer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum GbufferPlace {
    /// One tile on chip; rows go through DRAM.
    Tile,
    /// The whole screen in DRAM.
    Screen,
}

/// One choice for each open question.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Reading {
    /// What figure 3 measures.
    pub scope: Scope,
    /// What a reused pixel takes from the left one.
    pub reuse: Reuse,
    /// Error detection.
    pub rule: Rule,
    /// The left pixels that a right pixel is tested against.
    pub row_test: RowTest,
    /// Where the G-buffer is.
    pub gbuffer: GbufferPlace,
}

/// The figures of a reading on a trace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Figures {
    /// Frames per second relative to tracing both eyes completely.
    pub relative_performance: f64,
    /// Energy relative to tracing both eyes completely.
    pub relative_energy: f64,
    /// Least and most relative energy, if the energies are scaled to 14 nm.
    pub relative_energy_bounds: [f64; 2],
    /// Frames per second with reprojection.
    pub frames_per_second: f64,
}

/// Lane cycles of a test against one left pixel of the row: a subtraction, a comparison and a minimum, with the
/// address arithmetic in a second issue slot.
const ROW_TEST_CYCLES: f64 = 4.0;

/// All readings, in a fixed order: 2 rules x 4 levels of reuse x 6 scopes, row tests and places of the G-buffer.
pub fn all() -> Vec<Reading> {
    let mut out = Vec::new();
    for (scope, row_test, gbuffer) in SCOPES {
        for reuse in Reuse::ALL {
            for rule in rules() {
                out.push(Reading {
                    scope,
                    reuse,
                    rule,
                    row_test,
                    gbuffer,
                });
            }
        }
    }
    out
}

/// Row tests and the G-buffer's place change nothing in the units.
const SCOPES: [(Scope, RowTest, GbufferPlace); 6] = [
    (Scope::Units, RowTest::Arrivals, GbufferPlace::Tile),
    (Scope::UnitsAndMemory, RowTest::Arrivals, GbufferPlace::Tile),
    (Scope::Frame, RowTest::Arrivals, GbufferPlace::Tile),
    (Scope::Frame, RowTest::Arrivals, GbufferPlace::Screen),
    (Scope::Frame, RowTest::WholeRow, GbufferPlace::Tile),
    (Scope::Frame, RowTest::WholeRow, GbufferPlace::Screen),
];

/// A rule without visible errors at real sizes. The paper does not state its own.
const STRICT_RULE: &str = "depth=0.02+row=0.02+object+opaque+triangles";

/// Every arrival reused, and a strict rule.
fn rules() -> [Rule; 2] {
    ["none", STRICT_RULE].map(|text| text.parse().unwrap_or_default())
}

impl LoadedTrace<'_> {
    /// The figures of every reading, in the order of [`all`].
    ///
    /// # Errors
    /// [`FrameError`] for a tile whose addresses cannot be read.
    pub fn readings(&self, config: &SgrtConfig) -> Result<Vec<(Reading, Figures)>, FrameError> {
        let mut decided: Vec<(Rule, Reuse, RemainingWork)> = Vec::new();
        for rule in rules() {
            let decisions = decide(&self.frame, &self.arrived, &rule);
            for reuse in Reuse::ALL {
                let work = RemainingWork::new(&self.frame, &decisions, reuse);
                decided.push((rule.clone(), reuse, work));
            }
        }
        let works: Vec<_> = decided.iter().map(|(.., work)| (work, config)).collect();
        let misses = self.misses(&works)?;
        let mut runs: Vec<(&Rule, Reuse, RowTest, Comparison)> = Vec::new();
        for ((rule, reuse, work), misses) in decided.iter().zip(&misses) {
            for row_test in [RowTest::Arrivals, RowTest::WholeRow] {
                let config = with_row_test(config, row_test);
                let compared = self.compare(&work.tiles, misses, rule.reads(), &config);
                runs.push((rule, *reuse, row_test, compared));
            }
        }
        let figures = |reading: Reading| {
            let of = (&reading.rule, reading.reuse, reading.row_test);
            let run = runs
                .iter()
                .find(|(rule, reuse, test, _)| (*rule, *reuse, *test) == of);
            run.map(|(.., compared)| {
                let figures = measure(compared, reading.scope, reading.gbuffer, config);
                (reading, figures)
            })
        };
        Ok(all().into_iter().filter_map(figures).collect())
    }
}

fn with_row_test(config: &SgrtConfig, row_test: RowTest) -> SgrtConfig {
    let mut config = config.clone();
    config.srp.row_test_cycles = match row_test {
        RowTest::Arrivals => 0.0,
        RowTest::WholeRow if config.srp.row_test_cycles > 0.0 => config.srp.row_test_cycles,
        RowTest::WholeRow => ROW_TEST_CYCLES,
    };
    config
}

fn measure(
    compared: &Comparison,
    scope: Scope,
    gbuffer: GbufferPlace,
    config: &SgrtConfig,
) -> Figures {
    let run = match gbuffer {
        GbufferPlace::Tile => &compared.reprojected,
        GbufferPlace::Screen => &compared.whole_screen,
    };
    let reference = &compared.reference;
    let energy = |run: &Run| energy_of(run, scope, config);
    let time = |run: &Run| time_ns(run, scope, config);
    Figures {
        relative_performance: time(reference) / time(run),
        relative_energy: energy(run).total() / energy(reference).total(),
        relative_energy_bounds: relative_bounds(&energy(run), &energy(reference)),
        frames_per_second: 1e9 / time(run),
    }
}

fn time_ns(run: &Run, scope: Scope, config: &SgrtConfig) -> f64 {
    match scope {
        Scope::Units | Scope::UnitsAndMemory => run.tni_cycles * 1e3 / config.tni.clock_mhz,
        Scope::Frame => run.time_ns,
    }
}

fn energy_of(run: &Run, scope: Scope, config: &SgrtConfig) -> EnergyPj {
    let units = EnergyPj {
        tni_pj: run.energy.tni_pj,
        caches_pj: run.energy.caches_pj,
        ..EnergyPj::default()
    };
    match scope {
        Scope::Units => units,
        Scope::UnitsAndMemory => EnergyPj {
            dram_pj: run.dram.hierarchy_bytes as f64 * config.energy.dram_pj_per_byte,
            ..units
        },
        Scope::Frame => run.energy,
    }
}

/// Distance of a reading from published ratios: the root mean square of ln(ours / published) over performance and
/// energy. 0.1 is about 10 %. `None` without pairs.
pub fn rms_log(pairs: impl IntoIterator<Item = (Figures, [f64; 2])>) -> Option<f64> {
    let squares: Vec<f64> = pairs
        .into_iter()
        .flat_map(|(ours, [performance, energy])| {
            [
                ours.relative_performance / performance,
                ours.relative_energy / energy,
            ]
        })
        .map(|ratio| ratio.ln().powi(2))
        .collect();
    let count = squares.len() as f64;
    (count > 0.0).then(|| (squares.iter().sum::<f64>() / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::testing::{View, globe, trace, wall};
    use super::*;

    fn loaded(check: impl Fn(&LoadedTrace, &SgrtConfig)) {
        let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
        scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
        let source = trace(&scene, View::default());
        let loaded = LoadedTrace::load(&source).expect("loads");
        check(&loaded, &SgrtConfig::default());
    }

    #[test]
    fn a_reading_of_the_frame_equals_a_run_of_its_rule() {
        loaded(|loaded, config| {
            for (reading, figures) in loaded.readings(config).expect("runs") {
                if reading.scope != Scope::Frame {
                    continue;
                }
                let config = with_row_test(config, reading.row_test);
                let run = loaded
                    .run(&reading.rule, reading.reuse, &config)
                    .expect("runs");
                let ours = run.outcome;
                let expected = match reading.gbuffer {
                    GbufferPlace::Tile => [ours.relative_performance, ours.relative_energy],
                    GbufferPlace::Screen => {
                        let screen = ours.whole_screen;
                        [screen.relative_performance, screen.relative_energy]
                    }
                };
                let found = [figures.relative_performance, figures.relative_energy];
                assert_eq!(found, expected, "{reading:?}");
            }
        });
    }

    #[test]
    fn more_reuse_never_increases_unit_cost() {
        loaded(|loaded, config| {
            let readings = loaded.readings(config).expect("runs");
            assert_eq!(readings.len(), all().len());
            let units = readings.iter().filter(|(r, _)| r.scope == Scope::Units);
            let mut plain: Vec<_> = units.filter(|(r, _)| r.rule == Rule::default()).collect();
            plain.sort_by_key(|(r, _)| r.reuse);
            for pair in plain.windows(2) {
                assert!(pair[1].1.relative_performance >= pair[0].1.relative_performance);
                assert!(pair[1].1.relative_energy <= pair[0].1.relative_energy);
            }
        });
    }

    #[test]
    fn the_distance_to_published_ratios_is_computed_from_logarithms() {
        let ours = Figures {
            relative_performance: 1.1,
            relative_energy: 0.9,
            relative_energy_bounds: [0.8, 1.0],
            frames_per_second: 1.0,
        };
        let far = rms_log([(ours, [1.0, 0.9])]).expect("a pair");
        assert!((far - 1.1f64.ln() / 2f64.sqrt()).abs() < 1e-12);
        assert_eq!(rms_log([]), None);
    }
}
