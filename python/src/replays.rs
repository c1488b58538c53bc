//! Replays: settings from text, rows as the bytes of a Parquet file.

use crate::errors::Failure;
use crate::jobs::{self, Traces};
use crate::policies;
use anyhow::{Context, Result, anyhow, bail};
use pyo3::prelude::*;
use replay::config::{Order, RunConfig};
use replay::experiment::{self, ExperimentFile, Outcome, Plan, PlanError, Subject, parse_config};
use replay::memory::Replacement;
use replay::order::{FoundTiles, TileRef};
use replay::report::document::Document;
use replay::report::sweep::SweepReport;
use replay::report::{parquet, run::RunReport};
use std::path::PathBuf;

/// The text of settings, its source, and the settings that replace some of them.
#[derive(Clone, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    /// TOML.
    text: String,
    /// The file that errors name.
    file: Option<PathBuf>,
    /// The tile order, if it replaces that of the text.
    order: Option<String>,
    /// The policy of L1 and L2, if it replaces that of the text.
    policy: Option<String>,
    /// Names of the caller's own policies in use.
    policies: Vec<String>,
    /// Also count by tile.
    tiles: bool,
}

impl Settings {
    /// True if the replay calls Python.
    fn calls_python(&self) -> bool {
        !self.policies.is_empty()
    }

    /// An error of the text, with the file's name or without a line number.
    fn fault(&self, name: &str, error: PlanError) -> anyhow::Error {
        match (&self.file, error) {
            (Some(file), error) => anyhow!("{}: {error}", file.display()),
            (None, PlanError::Key { key, message, .. }) => anyhow!("{name}: `{key}`: {message}"),
            (None, PlanError::Syntax { message, .. }) => anyhow!("{name}: {message}"),
            (None, error) => anyhow!("{name}: {error}"),
        }
    }

    /// The configuration.
    pub fn config(&self) -> Result<RunConfig> {
        let parsed = parse_config(&self.text);
        let mut config = parsed.map_err(|error| self.fault("config", error))?;
        if let Some(name) = &self.order {
            config.order = order(name)?;
        }
        if let Some(name) = &self.policy {
            let Some(policy) = Replacement::find(name) else {
                bail!("policy: expected a name of a policy, found `{name}`");
            };
            config.level.l1.replacement = policy;
            config.level.l2.replacement = policy;
        }
        config.tile_maps |= self.tiles;
        config.validate()?;
        Ok(config)
    }
}

/// The order with a name, or the command line's error.
fn order(name: &str) -> Result<Order> {
    Order::by_name(name).map_err(|why| {
        let known: Vec<&str> = Order::all().map(Order::name).collect();
        let similar = Order::similar(name);
        match (why, similar) {
            (Some(why), _) => anyhow!("order: {why}"),
            (None, Some(similar)) => anyhow!(
                "order: expected one of {}, found `{name}`; did you mean `{}`?",
                known.join(", "),
                similar.name()
            ),
            (None, None) => anyhow!(
                "order: expected one of {}, found `{name}`",
                known.join(", ")
            ),
        }
    })
}

/// Checks that listed orders fit this trace.
pub fn check_orders<'a>(
    configs: impl IntoIterator<Item = &'a RunConfig>,
    subject: &Subject<'_>,
) -> Result<()> {
    let tables = subject.source.tables();
    for config in configs {
        let mut passes = tables.passes.clone();
        for pass in &mut passes {
            pass.tiles = pass.size_px.map(|size| size.div_ceil(config.tile_px));
        }
        config.order.check_for(&passes).map_err(|(pass, fault)| {
            let found = match fault.found {
                FoundTiles::Wrong(at) => tile_name(&passes, at),
                missing @ FoundTiles::Missing(_) => missing.to_string(),
            };
            anyhow!(
                "{}: pass {pass}, item {}: expected {}, found {found}",
                config.order.name(),
                fault.item,
                fault.expected,
            )
        })?;
    }
    Ok(())
}

/// A tile of a render pass in Python's notation: eye, column, row.
fn tile_name(passes: &[formats::textrace::Pass], at: TileRef) -> String {
    let Some(pass) = passes.get(at.pass as usize) else {
        return "a tile of no pass".to_owned();
    };
    let eye = pass.eye.map_or(0, |eye| eye as u32);
    let columns = pass.tiles[0].max(1);
    format!("({eye}, {}, {})", at.tile % columns, at.tile / columns)
}

/// Replays a plan, and passes its outcome to `of`.
fn replayed<T: Send>(
    paths: &[PathBuf],
    policies: &[String],
    plan: &Plan,
    stop: &jobs::Stop,
    of: impl FnOnce(&Outcome<'_>) -> Result<T> + Send,
) -> Result<T, Failure> {
    let traces = Traces::open(paths, stop)?;
    let subjects = traces.subjects();
    for subject in &subjects {
        check_orders(plan.points.iter().map(|point| &point.config), subject)?;
    }
    policies::watched(policies, stop, || {
        let outcome = experiment::run(plan, &subjects, None, &|_| ())?;
        of(&outcome)
    })
}

fn rows(file: &ExperimentFile, outcome: &Outcome<'_>) -> Result<Vec<u8>> {
    Ok(parquet::bytes(&SweepReport::new(file, outcome).rows())?)
}

/// The row of each trace replayed with a configuration.
#[pyfunction]
pub fn run(py: Python<'_>, paths: Vec<PathBuf>, settings: Settings) -> PyResult<Vec<u8>> {
    jobs::run_and_wait(py, settings.calls_python(), move |stop| {
        let config = settings.config()?;
        let plan = Plan::single(config, false)?;
        let file = ExperimentFile {
            traces: Vec::new(),
            base: config,
            axes: Vec::new(),
            one_at_a_time: Vec::new(),
        };
        replayed(&paths, &settings.policies, &plan, &stop, |outcome| {
            rows(&file, outcome)
        })
    })
}

/// The output of `replay run --json`.
#[pyfunction]
pub fn result(py: Python<'_>, path: PathBuf, settings: Settings) -> PyResult<String> {
    jobs::run_and_wait(py, settings.calls_python(), move |stop| {
        let plan = Plan::single(settings.config()?, false)?;
        replayed(&[path], &settings.policies, &plan, &stop, |outcome| {
            let rows = outcome.rows();
            let row = rows.first().context("no result")?;
            Ok(RunReport {
                row,
                by_texture: false,
            }
            .json()?)
        })
    })
}

/// The rows of an experiment file. Its traces are used if `paths` is empty.
#[pyfunction]
pub fn sweep(py: Python<'_>, paths: Vec<PathBuf>, settings: Settings) -> PyResult<Vec<u8>> {
    jobs::run_and_wait(py, settings.calls_python(), move |stop| {
        let fault = |error| settings.fault("experiment", error);
        let file = ExperimentFile::parse(&settings.text).map_err(fault)?;
        let plan = file.plan().map_err(fault)?;
        let mut paths = paths;
        if paths.is_empty() {
            let folder = settings.file.as_deref().and_then(|file| file.parent());
            let beside = |trace: &String| folder.map_or_else(|| trace.into(), |f| f.join(trace));
            paths.extend(file.traces.iter().map(beside));
        }
        if paths.is_empty() {
            return Err(anyhow!("traces: expected at least one, found none").into());
        }
        replayed(&paths, &settings.policies, &plan, &stop, |outcome| {
            rows(&file, outcome)
        })
    })
}

/// A configuration with all its keys, as JSON.
#[pyfunction]
pub fn config_json(settings: Settings) -> PyResult<String> {
    let json = settings
        .config()
        .and_then(|c| Ok(serde_json::to_string(&c)?));
    Ok(json.map_err(Failure::Own)?)
}

/// The text of a TOML file.
#[pyfunction]
pub fn read_settings(path: PathBuf) -> PyResult<String> {
    Ok(shell::read_settings(&path).map_err(Failure::Own)?)
}
