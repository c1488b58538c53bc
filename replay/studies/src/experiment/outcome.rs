//! Results in plan order, as rows that know their comparison points.

use super::plan::{functional, on_preset};
use super::{Plan, Point, Setting, Subject, frame_count};
use sim::config::Order;
use sim::engine::Work;
use sim::paper::z2::{self, PublishedRow};
use sim::preset::Preset;
use sim::result::RunResult;
use std::collections::HashMap;

/// The results of a plan.
pub struct Outcome<'a> {
    /// The traces.
    pub subjects: &'a [Subject<'a>],
    /// The points.
    pub plan: &'a Plan,
    /// Work of this run; other results were stored already or belong to equal points.
    pub work: Work,
    /// `results[subject * points + point]`.
    results: Vec<RunResult>,
}

/// A point of a trace with its result, and the results that it is compared with.
#[derive(Clone, Copy)]
pub struct ResultRow<'a> {
    /// The trace.
    pub subject: &'a Subject<'a>,
    /// The point.
    pub point: &'a Point,
    /// Its result.
    pub result: &'a RunResult,
    /// The same settings in Morton order; none if the order does not vary.
    pub morton: Option<&'a RunResult>,
    /// The same settings without the change; none if there is no change.
    pub unchanged: Option<&'a RunResult>,
    /// The same settings in functional mode, unless that is the change.
    pub functional: Option<&'a RunResult>,
    /// The same settings on the machine of [`Preset::Z2_PAPER`], unless that is the change.
    pub z2_paper: Option<&'a RunResult>,
    /// Those in Morton order.
    pub z2_paper_morton: Option<&'a RunResult>,
    /// The paper's row for the scene that the trace stands in for.
    pub paper: Option<&'static PublishedRow>,
}

/// Key of a point in an index.
type PointName = (Vec<(String, String)>, Option<(String, String)>);

fn name(settings: &[Setting], change: Option<&Setting>, order: Option<&str>) -> PointName {
    let text = |(key, value): &Setting| match order {
        Some(order) if key == "order" => (key.clone(), format!("\"{order}\"")),
        _ => (key.clone(), value.to_string()),
    };
    (settings.iter().map(text).collect(), change.map(text))
}

impl<'a> Outcome<'a> {
    /// The results of every point on every trace, `results[subject * points + point]`.
    pub fn new(
        plan: &'a Plan,
        subjects: &'a [Subject<'a>],
        results: Vec<RunResult>,
        work: Work,
    ) -> Self {
        Self {
            subjects,
            plan,
            work,
            results,
        }
    }

    /// Describes for the user how much work was shared.
    pub fn shared(&self) -> String {
        self.work.summary(self.results.len())
    }

    /// One row per trace and point, in that order.
    pub fn rows(&self) -> Vec<ResultRow<'_>> {
        let points = &self.plan.points;
        let index: HashMap<PointName, usize> = points
            .iter()
            .enumerate()
            .map(|(i, p)| (name(&p.settings, p.change.as_ref(), None), i))
            .collect();
        let find = |settings: &[Setting], change, order| {
            index.get(&name(settings, change, order)).copied()
        };
        let functional = functional();
        let z2_paper = on_preset(Preset::Z2_PAPER);
        let neighbours: Vec<[Option<usize>; 5]> = points
            .iter()
            .map(|p| {
                let varies = p.settings.iter().any(|(key, _)| key == "order");
                let morton = Order::MORTON.name();
                [
                    varies.then(|| find(&p.settings, p.change.as_ref(), Some(morton))),
                    p.change.as_ref().map(|_| find(&p.settings, None, None)),
                    (p.change.is_none()).then(|| find(&p.settings, Some(&functional), None)),
                    (p.change.is_none()).then(|| find(&p.settings, Some(&z2_paper), None)),
                    (p.change.is_none() && varies)
                        .then(|| find(&p.settings, Some(&z2_paper), Some(morton))),
                ]
                .map(Option::flatten)
            })
            .collect();
        let mut rows = Vec::with_capacity(self.results.len());
        for (subject, results) in self.subjects.iter().zip(self.results.chunks(points.len())) {
            for ((point, result), of) in points.iter().zip(results).zip(&neighbours) {
                let [morton, unchanged, functional, z2_paper, z2_paper_morton] =
                    of.map(|i| i.map(|i| &results[i]));
                rows.push(ResultRow {
                    subject,
                    point,
                    result,
                    morton,
                    unchanged,
                    functional,
                    z2_paper,
                    z2_paper_morton,
                    paper: published(subject, point, point.config.order),
                });
            }
        }
        rows
    }
}

/// The paper's row for a trace's scene, if the caches are also the paper's.
fn published(subject: &Subject, point: &Point, order: Order) -> Option<&'static PublishedRow> {
    let [l1, l2] = [&point.config.level.l1, &point.config.level.l2].map(|cache| cache.size_bytes);
    let exact = l1.is_multiple_of(1024) && l2.is_multiple_of(1024);
    let kib = |bytes: u64| u32::try_from(bytes / 1024).ok().filter(|_| exact);
    z2::row(subject.stand_in_for?, kib(l1)?, kib(l2)?, order)
}

impl ResultRow<'_> {
    /// L1 and L2 size in KiB.
    pub fn caches_kib(&self) -> (f64, f64) {
        let config = &self.point.config;
        let kib = |bytes: u64| bytes as f64 / 1024.0;
        (
            kib(config.level.l1.size_bytes),
            kib(config.level.l2.size_bytes),
        )
    }

    /// Both sizes in KiB, as `8/128`.
    pub fn caches_title(&self) -> String {
        let (l1, l2) = self.caches_kib();
        format!("{l1}/{l2}")
    }

    /// Converts bytes of all frames to MB (10^6 bytes) per frame.
    pub fn mb_per_frame(&self, bytes: u64) -> f64 {
        self.per_frame(bytes as f64 / 1e6)
    }

    /// Converts a sum over all frames to a mean per frame.
    pub fn per_frame(&self, sum: f64) -> f64 {
        let frames = frame_count(self.subject.source.tables()).max(1);
        sum / f64::from(frames)
    }

    /// DRAM traffic of an infinite cache in bytes.
    pub fn bound_bytes(&self) -> u64 {
        self.result.unique_lines * u64::from(self.point.config.line_bytes)
    }

    /// DRAM traffic saved relative to another result, percent; none if that has no traffic.
    pub fn saved_pct(&self, against: Option<&RunResult>) -> Option<f64> {
        let whole = against?.external_bytes as f64;
        (whole > 0.0).then(|| 100.0 * (1.0 - self.result.external_bytes as f64 / whole))
    }
}
