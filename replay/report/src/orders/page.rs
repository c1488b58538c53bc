//! The HTML page: means and bounds by display, hardware costs, and a picture of each order's path.

use super::{Mean, OrdersReport, columns, means};
use crate::answers;
use crate::document::Document;
use crate::html::{self, Answer, Page, count};
use crate::lists::unique;
use crate::plots::PlotError;
use crate::plots::SeriesStyle;
use crate::plots::hbars::HBarChart;
use crate::plots::paths::{PathPlot, stops};
use crate::table::Table;
use maud::{Markup, html};
use sim::config::Order;
use sim::order::{PlanInputs, View, WorkItem};
use studies::orders_study::{BASELINE, OrderRow, RowKind};

/// Size of the pictures of paths in tiles.
const PATH_TILES: [u32; 2] = [12, 8];

/// The L2 size for those pictures, which gives strips of four columns.
const PATH_L2_BYTES: u64 = 4 * 1536;

impl OrdersReport<'_> {
    /// The page.
    ///
    /// # Errors
    /// A plot that could not be drawn.
    pub fn page(&self) -> Result<String, PlotError> {
        let mut page = Page::default();
        let display = |row: &OrderRow<'_>| (row.subject.id.display.clone(), row.offset_tiles);
        let mut displays = unique(self.rows.iter().map(display));
        displays.sort_by_key(|(_, offset)| offset.abs());
        for of in displays {
            let own = self.rows.iter().filter(|row| display(row) == of);
            let rows: Vec<OrderRow<'_>> = own.cloned().collect();
            let title = format!("Display {}: infinity {} tiles apart", of.0, of.1);
            page.add(title, of_display(&means::means(&rows)));
        }
        if !self.learned.is_empty() {
            page.add(
                "Learning from the last frames",
                self.learned_table().markup(),
            );
        }
        page.add("Paths", self.paths()?);
        page.add(
            "Machine",
            html::settings("configuration (TOML)", &self.config),
        );
        let about = html! {
            p {
                "Bytes between the L2 and memory in each tile order; the tables compare them with those of Morton order and of " code { (BASELINE.name()) }
                " with the same caches: geometric means over traces and caches. Bounds and searched orders know the frame's accesses in advance; no hardware can have them. "
                "The JSON file beside this page has every figure, the CSV file every row."
            }
        };
        let means = self.means();
        let answer = Answer {
            sentences: self.answer(),
            chart: html::figure(&best_and_bounds(&means).svg()?, ""),
            about,
        };
        Ok(page.text("Parallax: tile orders", &answer))
    }

    /// The path of each order over a small picture on the display of the first trace.
    fn paths(&self) -> Result<Markup, PlotError> {
        let mut pictures = Vec::new();
        let mut known: Vec<String> = Vec::new();
        for row in &self.rows {
            let RowKind::Order(order) = row.of else {
                continue;
            };
            let name = order.name().to_owned();
            if known.contains(&name) {
                continue;
            }
            let meta = &row.subject.source.tables().meta;
            let seen = PlanInputs {
                l2_bytes: PATH_L2_BYTES,
                tile_px: small_tile_px(row),
                ..PlanInputs::new(&row.config, meta)
            };
            let [left, right] = small_views(row);
            let items = order.parts().stereo(left, right, &seen);
            let plot = path(&name, &items);
            pictures.push(plot.svg());
            known.push(name);
        }
        Ok(html! {
            p { "On pictures of " (PATH_TILES[0]) " by " (PATH_TILES[1]) " tiles with an L2 that holds a row of four columns; pairings as on the display of the first trace, at this size." }
            (html::charts(pictures)?)
        })
    }
}

/// Means over everything, for the first treatment of caches between frames.
fn first_of<'m, 'a>(means: &'m [Mean<'a>]) -> impl Iterator<Item = &'m Mean<'a>> {
    let between = means.first().map(|mean| mean.between);
    means
        .iter()
        .filter(move |mean| Some(mean.between) == between)
}

fn is_buildable(mean: &Mean<'_>) -> bool {
    mean.rows.first().is_some_and(|row| row.is_buildable())
}

pub(super) fn sentences(means: &[Mean<'_>]) -> Vec<String> {
    let orders = first_of(means).map(|mean| answers::Studied {
        name: mean.name(),
        change_pct: mean.change_pct().unwrap_or(0.0),
        is_buildable: is_buildable(mean),
        range_pct: mean.range_pct(),
        over_morton_pct: mean.over_morton().map(|of| of.value),
        state_bytes: mean.cost().map_or(0, |cost| cost.state_bytes.into()),
    });
    let rows = first_of(means).map(|mean| mean.rows.len()).max();
    let has_ranges = first_of(means).any(Mean::has_corners);
    let over = match (rows.unwrap_or(0), has_ranges) {
        (1, true) => "over the values that are not published".to_owned(),
        (rows, true) => format!(
            "mean over {}, over the values that are not published",
            count(rows, "trace")
        ),
        (rows, false) => format!("mean over {} of trace and caches", count(rows, "pair")),
    };
    answers::studied(BASELINE.name(), &orders.collect::<Vec<_>>(), &over)
}

/// Bytes of every order and bound relative to Morton, or to the baseline if Morton was not replayed.
fn best_and_bounds(means: &[Mean<'_>]) -> HBarChart {
    let has_morton = first_of(means).any(|mean| mean.over_morton().is_some());
    let reference = [BASELINE, Order::MORTON][usize::from(has_morton)];
    let row = |mean: &Mean<'_>| {
        let change = match has_morton {
            true => mean.over_morton().map(|of| of.value),
            false => mean.change_pct(),
        };
        let value = change.map(|change| 100.0 + change);
        let values = if is_buildable(mean) {
            vec![value, None]
        } else {
            vec![None, value]
        };
        (mean.name(), values)
    };
    HBarChart {
        title: "Bytes from memory by order".to_owned(),
        value_label: format!("% of the bytes of {}", reference.name()),
        series: SeriesStyle::list(&[
            ("hardware can follow it", 2),
            ("needs the future, or a bound", 7),
        ]),
        rows: first_of(means).map(row).collect(),
        decimals: Some(1),
    }
}

/// The tile size at which a picture has as many columns as the small picture.
fn small_tile_px(row: &OrderRow<'_>) -> u32 {
    row.subject.id.eye_size_px[0].div_ceil(PATH_TILES[0])
}

fn small_views(row: &OrderRow<'_>) -> [View; 2] {
    let px = small_tile_px(row);
    [0, 1].map(|pass| View {
        size_px: PATH_TILES.map(|tiles| tiles * px),
        ..View::grid(pass, PATH_TILES)
    })
}

fn path(name: &str, items: &[WorkItem]) -> PathPlot {
    PathPlot {
        title: name.to_owned(),
        note: "steps; the two tiles of a pair share one".to_owned(),
        tiles: PATH_TILES,
        stops: stops(items, PATH_TILES),
    }
}

fn of_display(means: &[Mean<'_>]) -> Markup {
    let table = Table::new(&columns::means(), means);
    let mut sections = Vec::new();
    for between in unique(means.iter().map(|mean| mean.between.to_string())) {
        let names = ["order", "buildable", "information"].into_iter();
        let keys = names.chain(columns::CHANGES).chain(["dram_row_hit_pct"]);
        let keys = keys.chain(columns::SIZES).chain(["decision_cycles"]);
        let shown = table.only("between_frames", &between).picked(keys);
        sections.push((between, shown.without_empty_columns()));
    }
    html! {
        @for (between, table) in &sections {
            @if sections.len() > 1 { h3 { "Caches between frames: " (between) } }
            (table.markup())
        }
        details {
            summary { "what the columns are" }
            (table.meanings())
        }
    }
}
