//! Replays every order with every pair of caches on every trace, and computes bounds.

use super::row::{BASELINE, Bound, CornerBytes, OrderRow, RowKind, compare, row};
use super::search::{Ground, Method};
use super::{OrderFile, OrderFileError, bounds};
use crate::experiment::{self, Plan, Point, RunError, Subject, frame_count};
use formats::view::TILE_SIZE_PX;
use rayon::prelude::*;
use sim::config::{BetweenFrames, Order, RunConfig};
use sim::engine::{ReplayError, Work};
use sim::order::{Listed, PlanInputs, Views, views};
use thiserror::Error;

/// The subject of a study.
#[derive(Clone, Debug)]
pub struct OrdersStudy {
    /// The machine, except for cache sizes, order, and caches between frames.
    pub base: RunConfig,
    /// The machine at the corners of its ranges.
    pub corners: Option<Corners>,
    /// L1 and L2 sizes in bytes.
    pub caches_bytes: Vec<(u64, u64)>,
    /// What happens to caches between frames. Traces of one frame ignore it.
    pub between: Vec<BetweenFrames>,
    /// The orders, including the baseline.
    pub orders: Vec<Order>,
    /// Search methods for traces of one frame.
    pub methods: Vec<Method>,
    /// True if bounds are computed.
    pub bounds: bool,
}

/// A machine at the corners of its ranges.
#[derive(Clone, Debug)]
pub struct Corners {
    /// The machine at each corner.
    pub configs: Vec<RunConfig>,
    /// The ranges in words.
    pub over: String,
    /// Replays there only the baseline, Morton, zig-zag+sta+offset and this many of the best other orders; `None`: all
    /// orders.
    pub finalists: Option<usize>,
}

/// Reasons why a study fails.
#[derive(Debug, Error)]
pub enum OrdersError {
    /// A failed replay.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A failed search or bound.
    #[error("{label}: {error}")]
    Replay {
        /// The trace.
        label: String,
        /// The error.
        error: ReplayError,
    },
    /// An invalid file of a searched order.
    #[error("{file}: {error}")]
    File {
        /// The file.
        file: String,
        /// The error.
        error: OrderFileError,
    },
}

/// A searched order and its source.
#[derive(Clone, Debug)]
pub struct Searched {
    /// The name of the file or of the search.
    pub source: String,
    /// The order.
    pub file: OrderFile,
}

/// Traces, and the searched orders for each.
pub struct Subjects<'a> {
    /// The traces.
    pub traces: &'a [Subject<'a>],
    /// Orders from files.
    pub files: Vec<Searched>,
}

impl OrdersStudy {
    /// Replays, searches and computes bounds. Returns the rows trace by trace and the searched orders. Calls
    /// `done` with the number of replays of each step.
    ///
    /// # Errors
    /// An impossible configuration, an unreadable trace, or a file whose order does not belong to its trace.
    pub fn run<'a>(
        &self,
        subjects: &'a Subjects<'a>,
        done: &(dyn Fn(u64) + Sync),
    ) -> Result<(Vec<OrderRow<'a>>, Vec<Searched>, Work), OrdersError> {
        let plan = self.plan(&self.orders);
        let mut outcome = experiment::run(&plan, subjects.traces, None, done)?;
        let mut work = std::mem::take(&mut outcome.work);
        let mut of_traces: Vec<Vec<OrderRow<'a>>> = Vec::new();
        let all = outcome.rows();
        let per_trace = plan.points.len().max(1);
        for (subject, results) in subjects.traces.iter().zip(all.chunks(per_trace)) {
            let offset_tiles = offset(subject, &self.base);
            let mut rows = Vec::new();
            for of_point in results {
                rows.push(row(
                    subject,
                    offset_tiles,
                    RowKind::Order(of_point.point.config.order),
                    of_point.point.config,
                    of_point.result.clone(),
                ));
            }
            of_traces.push(rows);
        }
        if let Some(corners) = &self.corners {
            work.add(&self.add_corners(corners, subjects.traces, &mut of_traces, done)?);
        }
        let searched = self.searched(subjects)?;
        let extra = of_traces
            .par_iter_mut()
            .zip(subjects.traces)
            .map(|(rows, subject)| {
                let works = self.add_searched(subject, &searched, rows, done)?;
                if self.bounds {
                    self.add_bounds(subject, rows)?;
                }
                compare(rows);
                self.sort(rows);
                Ok(works)
            });
        let extra: Result<Vec<Work>, OrdersError> = extra.collect();
        extra?.iter().for_each(|of_trace| work.add(of_trace));
        Ok((of_traces.concat(), searched, work))
    }

    /// The machine with every pair of caches, and with every treatment of them between frames.
    pub fn configs(&self) -> impl Iterator<Item = RunConfig> {
        self.between.iter().flat_map(move |&between_frames| {
            self.caches_bytes.iter().map(move |&(l1_bytes, l2_bytes)| {
                let mut config = RunConfig {
                    between_frames,
                    ..self.base
                };
                config.level.l1.size_bytes = l1_bytes;
                config.level.l2.size_bytes = l2_bytes;
                config
            })
        })
    }

    /// Every order with every pair of caches.
    fn plan(&self, orders: &[Order]) -> Plan {
        let point = |config| Point {
            settings: Vec::new(),
            change: None,
            config,
        };
        let of = |config: RunConfig| {
            let orders = orders.iter();
            orders.map(move |&order| point(RunConfig { order, ..config }))
        };
        Plan {
            base: self.base,
            points: self.configs().flat_map(of).collect(),
        }
    }

    /// Number of replays of each trace.
    pub fn replays_per_trace(&self) -> usize {
        let corners = self.corners.as_ref().map_or(0, |corners| {
            let finalists = corners.finalists.map_or(usize::MAX, |best| best + 3);
            corners.configs.len() * self.orders.len().min(finalists)
        });
        self.between.len() * (self.caches_bytes.len() * self.orders.len() + corners)
    }

    /// Three fixed orders, and the other buildable ones with the fewest bytes over all traces and caches. Where the
    /// values of the machine leave nothing to save, the fixed ones show whether the ranges do.
    fn finalists(&self, of_traces: &[Vec<OrderRow<'_>>], best: usize) -> Vec<Order> {
        let fixed = [BASELINE, Order::MORTON, self.start()];
        let score = |order: Order| {
            let rows = of_traces.iter().flatten();
            let own = rows.filter(|row| row.config.order == order && row.is_buildable());
            let bytes: Vec<f64> = own
                .map(|row| (row.external_bytes.max(1) as f64).ln())
                .collect();
            (!bytes.is_empty()).then(|| bytes.iter().sum::<f64>())
        };
        let mut ranked: Vec<(f64, Order)> = (self.orders.iter())
            .filter(|order| !fixed.contains(order))
            .filter_map(|&order| Some((score(order)?, order)))
            .collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = ranked.into_iter().take(best).map(|(_, order)| order);
        (fixed.into_iter())
            .filter(|order| self.orders.contains(order))
            .chain(best)
            .collect()
    }

    /// Replays orders at the corners of the machine's ranges, and adds the bytes to their rows.
    fn add_corners(
        &self,
        corners: &Corners,
        traces: &[Subject<'_>],
        of_traces: &mut [Vec<OrderRow<'_>>],
        done: &(dyn Fn(u64) + Sync),
    ) -> Result<Work, OrdersError> {
        let orders = match corners.finalists {
            Some(best) => self.finalists(of_traces, best),
            None => self.orders.clone(),
        };
        let settings = self.between.iter().flat_map(|&between_frames| {
            (corners.configs.iter()).map(move |config| RunConfig {
                between_frames,
                ..*config
            })
        });
        let points = settings.flat_map(|config| {
            orders.iter().map(move |&order| Point {
                settings: Vec::new(),
                change: None,
                config: RunConfig { order, ..config },
            })
        });
        let plan = Plan {
            base: self.base,
            points: points.collect(),
        };
        let mut outcome = experiment::run(&plan, traces, None, done)?;
        let work = std::mem::take(&mut outcome.work);
        let all = outcome.rows();
        for (rows, of_trace) in of_traces
            .iter_mut()
            .zip(all.chunks(plan.points.len().max(1)))
        {
            let results: Vec<_> = (of_trace.iter())
                .map(|row| (&row.point.config, row.result.external_bytes))
                .collect();
            let finalists = rows
                .iter_mut()
                .filter(|row| orders.contains(&row.config.order));
            for row in finalists {
                let between = row.config.between_frames;
                let of = |order: Order| {
                    let own = results.iter().filter(move |(config, _)| {
                        config.order == order && config.between_frames == between
                    });
                    own.map(|(_, bytes)| *bytes)
                };
                let pairs = of(row.config.order).zip(of(BASELINE));
                row.corners = Some(CornerBytes {
                    over: corners.over.clone(),
                    bytes: pairs.map(|(own, base)| [own, base]).collect(),
                });
            }
        }
        Ok(work)
    }

    /// Searches orders for all traces of one frame, and checks the orders from files.
    fn searched(&self, subjects: &Subjects<'_>) -> Result<Vec<Searched>, OrdersError> {
        for searched in &subjects.files {
            let of = subjects
                .traces
                .iter()
                .find(|s| s.id.checksum == searched.file.trace);
            if let Some(subject) = of {
                let fail = |error| OrdersError::File {
                    file: searched.source.clone(),
                    error,
                };
                searched.file.check(subject.source.tables()).map_err(fail)?;
            }
        }
        let mut sizes: Vec<u64> = self.caches_bytes.iter().map(|(_, l2)| *l2).collect();
        sizes.sort_unstable();
        sizes.dedup();
        let search = |subject: &Subject<'_>| -> Result<Vec<Searched>, OrdersError> {
            let fail = |error| OrdersError::Replay {
                label: subject.label.clone(),
                error,
            };
            let frames = frame_count(subject.source.tables());
            if self.methods.is_empty() || frames != 1 {
                return Ok(Vec::new());
            }
            let start = self.start();
            let Some(ground) = Ground::new(subject.source, start, first_frame(subject), &self.base)
                .map_err(fail)?
            else {
                return Ok(Vec::new());
            };
            let jobs: Vec<(Method, u64)> = (self.methods.iter())
                .flat_map(|method| sizes.iter().map(|size| (*method, *size)))
                .collect();
            let found = jobs.par_iter().map(|&(method, size)| {
                let file = ground
                    .search(method, size, &subject.id.checksum)
                    .map_err(fail)?;
                Ok(Searched {
                    source: format!(
                        "{}.{}.{}k.order",
                        subject.id.name,
                        method.name(),
                        size >> 10
                    ),
                    file,
                })
            });
            found.collect()
        };
        let found: Result<Vec<Vec<Searched>>, OrdersError> =
            subjects.traces.par_iter().map(search).collect();
        let mut all = subjects.files.clone();
        all.extend(found?.into_iter().flatten());
        Ok(all)
    }

    /// The order from which searches start. It pairs tiles as the display needs it.
    fn start(&self) -> Order {
        Order::find("zig-zag+sta+offset").unwrap_or(BASELINE)
    }

    /// Replays the searched orders of a trace with the L2 for which they were searched.
    fn add_searched<'a>(
        &self,
        subject: &'a Subject<'a>,
        searched: &[Searched],
        rows: &mut Vec<OrderRow<'a>>,
        done: &(dyn Fn(u64) + Sync),
    ) -> Result<Work, OrdersError> {
        let offset_tiles = offset(subject, &self.base);
        let mut points = Vec::new();
        let mut names = Vec::new();
        for Searched { source, file } in searched
            .iter()
            .filter(|of| of.file.trace == subject.id.checksum)
        {
            let fail = |error| OrdersError::File {
                file: source.clone(),
                error,
            };
            let pass = file.check(subject.source.tables()).map_err(fail)?;
            let listed = Listed {
                pairs: vec![(pass, file.items.clone())],
            };
            let order = Order::listed(&file.name, self.start().parts(), listed);
            let plan = self.plan(&[order]);
            let of_size = plan
                .points
                .into_iter()
                .filter(|point| point.config.level.l2.size_bytes == file.l2_bytes);
            for point in of_size {
                names.push(file.name.clone());
                points.push(point);
            }
        }
        let mut work = Work::default();
        // Each configuration is run alone, because results are identified by the name of the order, which
        // several files may share.
        for (point, name) in points.into_iter().zip(names) {
            let plan = Plan {
                base: self.base,
                points: vec![point],
            };
            let outcome = experiment::run(&plan, std::slice::from_ref(subject), None, done)?;
            work.add(&outcome.work);
            if let Some(of_point) = outcome.rows().first() {
                rows.push(row(
                    subject,
                    offset_tiles,
                    RowKind::Searched(name),
                    of_point.point.config,
                    of_point.result.clone(),
                ));
            }
        }
        Ok(work)
    }

    /// Adds the bounds for every pair of caches.
    fn add_bounds<'a>(
        &self,
        subject: &'a Subject<'a>,
        rows: &mut Vec<OrderRow<'a>>,
    ) -> Result<(), OrdersError> {
        let offset_tiles = offset(subject, &self.base);
        let distinct_bytes = rows.first().map_or(0, |row| row.distinct_bytes);
        let fail = |error| OrdersError::Replay {
            label: subject.label.clone(),
            error,
        };
        let bound = |bound, config: RunConfig, bytes| OrderRow {
            subject,
            offset_tiles,
            of: RowKind::Bound(bound),
            config,
            cost: None,
            external_bytes: bytes,
            result: None,
            baseline_bytes: 0,
            baseline_cycles: None,
            greedy_bytes: None,
            corners: None,
            distinct_bytes,
        };
        let of_baseline = rows.iter().filter(|row| row.is_baseline());
        let configs: Vec<RunConfig> = of_baseline.map(|row| row.config).collect();
        for &config in &configs {
            rows.push(bound(Bound::Infinite, config, distinct_bytes));
        }
        if frame_count(subject.source.tables()) != 1 {
            return Ok(());
        }
        let frame = first_frame(subject);
        for order in [BASELINE, self.start()] {
            let misses = bounds::opt(subject.source, order, frame, &configs).map_err(fail)?;
            for (config, of_config) in configs.iter().zip(misses) {
                let bytes = u64::from(config.line_bytes);
                rows.push(bound(
                    Bound::Opt(order),
                    *config,
                    of_config.fully_associative * bytes,
                ));
                rows.push(bound(
                    Bound::OptWays(order),
                    *config,
                    of_config.set_associative * bytes,
                ));
            }
        }
        if let Some(ground) =
            Ground::new(subject.source, self.start(), frame, &self.base).map_err(fail)?
        {
            for config in &configs {
                let lines = config.level.l2.size_bytes / u64::from(config.line_bytes);
                let lines = bounds::windows(ground.lines(), lines);
                rows.push(bound(
                    Bound::Windows,
                    *config,
                    lines * u64::from(config.line_bytes),
                ));
            }
        }
        Ok(())
    }

    /// Sorts by caches, then orders as listed in the study, then searched orders, then bounds.
    fn sort(&self, rows: &mut [OrderRow<'_>]) {
        let caches = |row: &OrderRow<'_>| {
            let between = self
                .between
                .iter()
                .position(|of| *of == row.config.between_frames);
            let sizes = (
                row.config.level.l1.size_bytes,
                row.config.level.l2.size_bytes,
            );
            (
                between,
                self.caches_bytes.iter().position(|of| *of == sizes),
            )
        };
        let kind = |row: &OrderRow<'_>| match &row.of {
            RowKind::Order(order) => (0, self.orders.iter().position(|of| of == order)),
            RowKind::Searched(_) => (1, None),
            RowKind::Bound(_) => (2, None),
        };
        rows.sort_by_key(|row| (caches(row), kind(row)));
    }
}

fn first_frame(subject: &Subject<'_>) -> u32 {
    let passes = &subject.source.tables().passes;
    passes.iter().map(|pass| pass.frame).min().unwrap_or(0)
}

/// Columns by which points at infinity are shifted between the eyes of the first frame.
fn offset(subject: &Subject<'_>, config: &RunConfig) -> i32 {
    let tables = subject.source.tables();
    let inputs = PlanInputs {
        tile_px: TILE_SIZE_PX,
        ..PlanInputs::new(config, &tables.meta)
    };
    let pairs = views(&tables.passes, first_frame(subject)).into_iter();
    let pair = pairs.into_iter().find_map(|phase| match phase {
        Views::Pair(left, right) => Some([left, right]),
        Views::One(_) => None,
    });
    pair.map_or(0, |eyes| inputs.offset(eyes)[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::config::{LevelConfig, Levels, Mode};
    use sim::engine::replay;
    use sim::result::TraceId;
    use sim::stream::testing::Synthetic;

    /// The ends of a figure are the changes of separate replays of the machine at each corner.
    #[test]
    fn ends_are_the_changes_at_the_corners() {
        let trace = Synthetic::new([96, 80], 120).generate();
        let machine = |l2_bytes, ways| RunConfig {
            mode: Mode::Functional,
            level: Levels::two(
                LevelConfig::lru(1 << 10),
                LevelConfig {
                    ways,
                    ..LevelConfig::lru(l2_bytes)
                },
            ),
            ..RunConfig::default()
        };
        let base = machine(8 << 10, 4);
        let configs = vec![machine(4 << 10, 2), machine(16 << 10, 8)];
        let study = OrdersStudy {
            base,
            corners: Some(Corners {
                configs: configs.clone(),
                over: "two corners".to_owned(),
                finalists: None,
            }),
            caches_bytes: vec![(1 << 10, 8 << 10)],
            between: vec![BetweenFrames::Keep],
            orders: vec![BASELINE, Order::MORTON],
            methods: Vec::new(),
            bounds: false,
        };
        let traces = [Subject::new(
            &trace,
            TraceId::default(),
            "synthetic".to_owned(),
        )];
        let subjects = Subjects {
            traces: &traces,
            files: Vec::new(),
        };
        let (rows, ..) = study.run(&subjects, &|_| ()).unwrap();
        let change = |config: &RunConfig| {
            let bytes = |order| {
                replay(&trace, &RunConfig { order, ..*config })
                    .unwrap()
                    .external_bytes as f64
            };
            100.0 * (bytes(Order::MORTON) / bytes(BASELINE) - 1.0)
        };
        let row = rows.iter().find(|row| !row.is_baseline()).unwrap();
        let figure = row.change_pct().unwrap();
        let mut all = vec![change(&base)];
        all.extend(configs.iter().map(change));
        assert_eq!(figure.value, all[0]);
        assert_eq!(
            figure.low,
            all.iter().copied().fold(f64::INFINITY, f64::min)
        );
        assert_eq!(
            figure.high,
            all.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        );
        assert!(figure.low < figure.high, "{all:?}");
    }
}
