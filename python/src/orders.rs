//! Tile orders given by Python code as lists of tiles.

use crate::errors::Failure;
use crate::jobs::{self, Stop, Traces};
use crate::replays::{Settings, check_orders};
use anyhow::{Result, anyhow, bail};
use formats::textrace::{Pass, Textrace};
use pyo3::prelude::*;
use replay::config::{Order, RunConfig};
use replay::order::curve::Curve;
use replay::order::parts::Parts;
use replay::order::{Interleave, Listed, Phase, TileRef, View, Views, WorkItem, frames, views};
use replay::stream::{TileSource as _, plan, rendered};
use std::path::{Path, PathBuf};

/// Eye (0 left, 1 right), column and row.
type Tile = (u32, u32, u32);

/// One tile, or two tiles and how their primitives are interleaved.
type Item = (Tile, Option<(Tile, String)>);

/// Frame, layer, index of the left pass, tile columns and rows.
type Pair = (u32, u32, u32, u32, u32);

/// The pairs of views of a trace with tiles of this size.
fn pairs_of(passes: &[Pass]) -> Vec<[View; 2]> {
    let phases = frames(passes)
        .into_iter()
        .flat_map(|frame| views(passes, frame));
    phases
        .filter_map(|phase| match phase {
            Views::Pair(left, right) => Some([left, right]),
            Views::One(_) => None,
        })
        .collect()
}

/// The render passes of a trace with tiles of this size.
fn passes_of(path: &Path, tile_px: u32) -> Result<Vec<Pass>> {
    let mut passes = Textrace::open(path)?.tables().passes.clone();
    for pass in &mut passes {
        pass.tiles = pass.size_px.map(|size| size.div_ceil(tile_px.max(1)));
    }
    Ok(passes)
}

/// The pairs of views that an order combines.
#[pyfunction]
pub fn pairs(py: Python<'_>, path: PathBuf, tile_px: u32) -> PyResult<Vec<Pair>> {
    jobs::run(py, move |_| {
        let passes = passes_of(&path, tile_px)?;
        let pairs = pairs_of(&passes).into_iter().map(|[left, _]| {
            let pass = &passes[left.pass as usize];
            let [columns, rows] = left.tiles;
            (pass.frame, pass.layer.into(), left.pass, columns, rows)
        });
        Ok(pairs.collect())
    })
}

fn tile(eyes: [View; 2], (eye, x, y): Tile) -> Option<TileRef> {
    eyes.get(eye as usize)?.tile([x, y])
}

fn item(eyes: [View; 2], (first, second): &Item) -> Result<WorkItem> {
    let [columns, rows] = eyes[0].tiles;
    let place = |at: Tile| {
        tile(eyes, at).ok_or_else(|| {
            anyhow!("expected an eye of 0 or 1, a column below {columns} and a row below {rows}, found {at:?}")
        })
    };
    let first = place(*first)?;
    let Some((second, interleave)) = second else {
        return Ok(WorkItem::Tile(first));
    };
    let interleave = match interleave.as_str() {
        "alternate" => Interleave::Alternate,
        "merge" => Interleave::Merge,
        other => bail!("expected alternate or merge, found {other:?}"),
    };
    Ok(WorkItem::Pair(first, place(*second)?, interleave))
}

/// Registers an order, one list of items per pair of views, under a name that configurations
/// accept.
#[pyfunction]
pub fn name_order(
    py: Python<'_>,
    path: PathBuf,
    tile_px: u32,
    name: String,
    lists: Vec<Vec<Item>>,
) -> PyResult<String> {
    jobs::run(py, move |_| {
        let passes = passes_of(&path, tile_px)?;
        let mut listed = Listed::default();
        let mut sum = crc32fast::Hasher::new();
        for (eyes, list) in pairs_of(&passes).into_iter().zip(&lists) {
            let mut items = Vec::with_capacity(list.len());
            for (index, of) in list.iter().enumerate() {
                let item = item(eyes, of);
                items.push(item.map_err(|error| anyhow!("{name}: item {index}: {error}"))?);
            }
            sum.update(format!("{items:?}").as_bytes());
            listed.pairs.push((eyes[0].pass, items));
        }
        if listed.pairs.is_empty() {
            let path = path.display();
            return Err(
                anyhow!("{path}: expected a left and a right view for {name}, found none").into(),
            );
        }
        let name = format!("{name}@{:08x}", sum.finalize());
        Ok(Order::own(&name, Parts::of(Curve::MORTON), listed)
            .name()
            .to_owned())
    })
}

/// The items of a named order, one list per pair of views.
#[pyfunction]
pub fn order_items(py: Python<'_>, path: PathBuf, settings: Settings) -> PyResult<Vec<Vec<Item>>> {
    jobs::run(py, move |stop: Stop| {
        let config = settings.config()?;
        let traces = Traces::open(&[path], &stop)?;
        let subject = &traces.subjects()[0];
        check_orders([&config], subject)?;
        let rendered = rendered(subject.source, &config)?;
        let phases = plan(&rendered, &config).map_err(anyhow::Error::from)?;
        listed(&config, &phases, &rendered.tables().passes)
    })
}

fn listed(
    config: &RunConfig,
    phases: &[Phase],
    passes: &[Pass],
) -> Result<Vec<Vec<Item>>, Failure> {
    let mut lists = Vec::new();
    for [left, right] in pairs_of(passes) {
        let place = |at: TileRef| {
            let (eye, view) = if at.pass == left.pass {
                (0, left)
            } else {
                (1, right)
            };
            (eye, at.tile % view.tiles[0], at.tile / view.tiles[0])
        };
        let is_of_pair = |item: &&WorkItem| {
            item.tiles()
                .all(|at| at.pass == left.pass || at.pass == right.pass)
        };
        let mut list = Vec::new();
        for item in phases.iter().flatten().filter(is_of_pair) {
            list.push(match *item {
                WorkItem::Tile(at) => (place(at), None),
                WorkItem::Pair(a, b, interleave) => {
                    let interleave = match interleave {
                        Interleave::Alternate => "alternate",
                        Interleave::Merge => "merge",
                        Interleave::Halves => {
                            let name = config.order.name();
                            return Err(anyhow!(
                                "order: {name} renders halves of tiles, so it is no list of tiles"
                            )
                            .into());
                        }
                    };
                    (place(a), Some((place(b), interleave.to_owned())))
                }
            });
        }
        lists.push(list);
    }
    Ok(lists)
}
