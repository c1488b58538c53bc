//! Points and their provenance.

use super::file::{parsed, set};
use crate::config::{Mode, Order, RunConfig};
use crate::preset::Preset;
use serde::{Deserialize, Serialize};
use thiserror::Error;
use toml::{Table, Value};

/// More points than this are taken for a mistake.
pub const MOST_POINTS: usize = 100_000;

/// A key of the configuration, with dots, and a value.
pub type Setting = (String, Value);

/// A key and its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Key of the configuration, with dots.
    pub key: String,
    /// Values in the order of the file.
    pub values: Vec<Value>,
}

impl Axis {
    fn settings(&self) -> impl Iterator<Item = Setting> {
        let setting = |value: &Value| (self.key.clone(), value.clone());
        self.values.iter().map(setting)
    }
}

/// One configuration and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Values of the axes, in their order.
    pub settings: Vec<Setting>,
    /// The value that is tried alone, if any.
    pub change: Option<Setting>,
    /// The whole configuration.
    pub config: RunConfig,
}

impl Point {
    /// `order=z2-sta l1.size_bytes=8KiB`, with the change at the end.
    #[must_use]
    pub fn title(&self) -> String {
        let parts: Vec<String> = self
            .settings
            .iter()
            .chain(&self.change)
            .map(|(key, value)| format!("{key}={}", plain(value)))
            .collect();
        if parts.is_empty() {
            "base".to_owned()
        } else {
            parts.join(" ")
        }
    }
}

/// A value without quotes.
#[must_use]
pub fn plain(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

/// Why an experiment cannot be planned. What comes from a file names the line.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// No TOML.
    #[error("line {line}: {message}")]
    Syntax {
        /// Line from 1.
        line: usize,
        /// The parser's words.
        message: String,
    },
    /// A key that the experiment or the configuration does not have, or a value it does not take.
    #[error("line {line}: `{key}`: {message}")]
    Key {
        /// Line from 1.
        line: usize,
        /// Key with dots.
        key: String,
        /// Expected and found.
        message: String,
    },
    /// A configuration that no machine can have.
    #[error("point {point}: {message}")]
    Point {
        /// What is set at the point.
        point: String,
        /// What is wrong.
        message: String,
    },
    /// Too many points.
    #[error("expected at most {MOST_POINTS} points, found {found}")]
    TooMany {
        /// Points.
        found: usize,
    },
}

/// Points in the order of their results, each a configuration that a machine can have.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What every point has but for its settings and its change.
    pub base: RunConfig,
    /// The points: changes outermost, then the axes, the last one running fastest.
    pub points: Vec<Point>,
}

impl Plan {
    /// The product of `axes`, with the base and with every single change.
    ///
    /// # Errors
    /// Too many points, or one whose configuration is impossible.
    pub fn cross(
        base: RunConfig,
        axes: &[Axis],
        one_at_a_time: &[Axis],
    ) -> Result<Self, PlanError> {
        let count = |axis: &Axis| axis.values.len();
        let changes = 1 + one_at_a_time.iter().map(count).sum::<usize>();
        let product = axes.iter().map(count).try_fold(changes, usize::checked_mul);
        let found = product.unwrap_or(usize::MAX);
        if found > MOST_POINTS {
            return Err(PlanError::TooMany { found });
        }
        let mut grid: Vec<Vec<Setting>> = vec![Vec::new()];
        for axis in axes {
            let longer = |settings: &Vec<Setting>| -> Vec<Vec<Setting>> {
                let with = |setting| [settings.clone(), vec![setting]].concat();
                axis.settings().map(with).collect()
            };
            grid = grid.iter().flat_map(longer).collect();
        }
        let changes = one_at_a_time.iter().flat_map(Axis::settings).map(Some);
        let changes: Vec<Option<Setting>> = std::iter::once(None).chain(changes).collect();
        let table = Table::try_from(base).unwrap_or_default();
        let mut points = Vec::with_capacity(found);
        for change in &changes {
            for settings in &grid {
                let mut table = table.clone();
                for (key, value) in settings.iter().chain(change) {
                    set(&mut table, key, value.clone());
                }
                let mut point = Point {
                    settings: settings.clone(),
                    change: change.clone(),
                    config: base,
                };
                point.config = parsed(&table).map_err(|message| PlanError::Point {
                    point: point.title(),
                    message,
                })?;
                points.push(point);
            }
        }
        Self { base, points }.checked()
    }

    /// One point, and the same in the other mode as a change if `both_modes`.
    ///
    /// # Errors
    /// A configuration that no machine can have.
    pub fn single(config: RunConfig, both_modes: bool) -> Result<Self, PlanError> {
        let point = Point {
            settings: Vec::new(),
            change: None,
            config,
        };
        let mut plan = Self {
            base: config,
            points: vec![point],
        };
        if both_modes {
            plan.add_functional();
        }
        plan.checked()
    }

    /// The Z2 paper's experiment: every order with every pair of L1 and L2 sizes in bytes.
    ///
    /// # Errors
    /// A configuration that no machine can have.
    pub fn paper(
        base: RunConfig,
        caches_bytes: &[(u64, u64)],
        orders: &[Order],
        functional: bool,
    ) -> Result<Self, PlanError> {
        let mut points = Vec::new();
        for &(l1_bytes, l2_bytes) in caches_bytes {
            for &order in orders {
                let mut config = RunConfig { order, ..base };
                config.level.l1.size_bytes = l1_bytes;
                config.level.l2.size_bytes = l2_bytes;
                let setting = |key: &str, value: Value| (key.to_owned(), value);
                points.push(Point {
                    settings: vec![
                        setting("l1.size_bytes", Value::Integer(l1_bytes as i64)),
                        setting("l2.size_bytes", Value::Integer(l2_bytes as i64)),
                        setting("order", Value::String(order.name().to_owned())),
                    ],
                    change: None,
                    config,
                });
            }
        }
        let mut plan = Self { base, points };
        if functional {
            plan.add_functional();
        }
        plan.checked()
    }

    /// Asks for counts by tile of the first caches, for the baseline and for what the paper
    /// proposes.
    #[must_use]
    pub fn with_tile_maps(mut self) -> Self {
        let caches = |point: &Point| [point.config.level.l1, point.config.level.l2];
        let first = self.points.first().map(caches);
        for point in &mut self.points {
            let mapped = [Order::MORTON, Order::Z2_STA].contains(&point.config.order);
            if mapped && point.change.is_none() && Some(caches(point)) == first {
                point.config.tile_maps = true;
                point.config.timeline = point.config.is_looping();
            }
        }
        self
    }

    /// Adds every timed point on another machine: `machine` but for its caches' sizes and its order.
    ///
    /// # Errors
    /// A configuration that no machine can have.
    pub fn beside(mut self, preset: Preset, machine: RunConfig) -> Result<Self, PlanError> {
        let timed = (self.points.iter())
            .filter(|point| point.change.is_none() && point.config.is_looping());
        let others = timed.map(|point| {
            let mut config = RunConfig {
                order: point.config.order,
                ..machine
            };
            config.level.l1.size_bytes = point.config.level.l1.size_bytes;
            config.level.l2.size_bytes = point.config.level.l2.size_bytes;
            Point {
                settings: point.settings.clone(),
                change: Some(on_preset(preset)),
                config,
            }
        });
        let others: Vec<Point> = others.collect();
        self.points.extend(others);
        self.checked()
    }

    /// Adds every timed point in functional mode.
    fn add_functional(&mut self) {
        let timed = self.points.iter().filter(|p| p.config.is_looping());
        let functional: Vec<Point> = timed
            .map(|point| Point {
                settings: point.settings.clone(),
                change: Some(functional()),
                config: RunConfig {
                    mode: Mode::Functional,
                    ..point.config
                },
            })
            .collect();
        self.points.extend(functional);
    }

    fn checked(self) -> Result<Self, PlanError> {
        for point in &self.points {
            point.config.validate().map_err(|error| PlanError::Point {
                point: point.title(),
                message: error.to_string(),
            })?;
        }
        Ok(self)
    }
}

/// The change to functional mode.
pub(super) fn functional() -> Setting {
    ("mode".to_owned(), Value::String("functional".to_owned()))
}

/// The change to the machine of a preset.
pub(super) fn on_preset(preset: Preset) -> Setting {
    ("preset".to_owned(), Value::String(preset.name().to_owned()))
}
