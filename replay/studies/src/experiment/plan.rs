//! Points, and where they come from.

use super::keys::{parsed, set};
use serde::{Deserialize, Serialize};
use sim::config::{Mode, Order, RunConfig};
use sim::preset::Preset;
use thiserror::Error;
use toml::{Table, Value};

/// Upper limit for the number of points. More are taken for a mistake.
pub const MOST_POINTS: usize = 100_000;

/// A dotted key of the configuration, and a value.
pub type Setting = (String, Value);

/// A key and its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Axis {
    /// Dotted key of the configuration.
    pub key: String,
    /// Values in file order.
    #[cfg_attr(feature = "testing", schemars(with = "Vec<serde_json::Value>"))]
    pub values: Vec<Value>,
}

impl Axis {
    /// Parses `KEY=V1,V2,...`, whose values are numbers, booleans or text.
    pub fn parse(text: &str) -> Option<Self> {
        let (key, values) = text
            .split_once('=')
            .filter(|(key, values)| !key.is_empty() && !values.is_empty())?;
        let value = |text: &str| {
            let text = text.trim();
            let number = text.parse().map(Value::Integer).ok();
            let real = || text.parse().map(Value::Float).ok();
            let flag = || text.parse().map(Value::Boolean).ok();
            let value = number.or_else(real).or_else(flag);
            value.unwrap_or_else(|| Value::String(text.to_owned()))
        };
        Some(Self {
            key: key.to_owned(),
            values: values.split(',').map(value).collect(),
        })
    }

    fn settings(&self) -> impl Iterator<Item = Setting> {
        let setting = |value: &Value| (self.key.clone(), value.clone());
        self.values.iter().map(setting)
    }
}

/// A configuration and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Values of the axes, in order.
    pub settings: Vec<Setting>,
    /// The value tried alone, if any.
    pub change: Option<Setting>,
    /// The complete configuration.
    pub config: RunConfig,
}

impl Point {
    /// Whether the point changes no setting of the base configuration.
    pub(super) fn is_base(&self) -> bool {
        self.settings.is_empty() && self.change.is_none()
    }

    /// `order=z2-sta l1.size_bytes=8KiB`, followed by the change.
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
pub fn plain(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

/// Reasons why an experiment cannot be planned. Errors in files name the line.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// Invalid TOML.
    #[error("line {line}: {message}")]
    Syntax {
        /// Line, counted from 1.
        line: usize,
        /// The parser's message.
        message: String,
    },
    /// An unknown key, or an invalid value.
    #[error("line {line}: `{key}`: {message}")]
    Key {
        /// Line, counted from 1.
        line: usize,
        /// Dotted key.
        key: String,
        /// What was expected and found.
        message: String,
    },
    /// An impossible configuration.
    #[error("point {point}: {message}")]
    Point {
        /// Settings of the point.
        point: String,
        /// Description of the error.
        message: String,
    },
    /// Too many points.
    #[error("expected at most {MOST_POINTS} points, found {found}")]
    TooMany {
        /// Number of points.
        found: usize,
    },
}

/// Points in the order of their results, with valid configurations.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The configuration of every point before its settings and its change.
    pub base: RunConfig,
    /// The points: changes outermost, then axes, the last one varying fastest.
    pub points: Vec<Point>,
}

impl Plan {
    /// The product of `axes`, with the base and with every single change.
    ///
    /// # Errors
    /// Too many points, or an impossible configuration.
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

    /// A single point, and with `both_modes` the same in the other mode as a change.
    ///
    /// # Errors
    /// An impossible configuration.
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
    /// An impossible configuration.
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

    /// Requests per-tile counts with the first caches, for the baseline and for the paper's proposal.
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

    /// Adds every timed point on another machine: `machine` with the point's cache sizes and order.
    ///
    /// # Errors
    /// An impossible configuration.
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
