//! Results of stereo rendering techniques: table, JSON, CSV and page.

mod columns;
mod frusta;
mod page;
mod plots;
mod published;

pub use page::Scene;

use super::columns::{Columns, columns_of};
use super::document::Document;
use super::table::{Style, Table};
use columns::{columns, order_columns};
use formats::view::Lens;
use published::{claim_columns, claims};
use serde::Serialize;
use sim::config::{Order, RunConfig};
use studies::techniques::manifest::{Auto, Manifest};
use studies::techniques::{Measured, Measures, OrderGain};

/// Measurements of the techniques on some scenes.
pub struct TechniquesReport<'a> {
    /// The scenes.
    pub scenes: &'a [Measures<'a>],
    /// Their manifests.
    pub manifests: Vec<&'a Manifest>,
    /// Caches, sampling and layout; its order is the order of the table.
    pub config: RunConfig,
    /// Orders of the replays.
    pub orders: Vec<Order>,
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TechniquesJson<'a> {
    config: RunConfig,
    scenes: Vec<SceneFacts<'a>>,
    rows: Table,
    orders: Table,
    published: Table,
}

/// Facts about a scene, for the JSON.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct SceneFacts<'a> {
    scene: &'a str,
    path: Option<&'a str>,
    frames: &'a [u32],
    scene_triangles: u64,
    instances: u64,
    size_px: [u32; 2],
    hmd: &'a str,
    #[cfg_attr(feature = "testing", schemars(with = "[serde_json::Value; 2]"))]
    lens: [Lens; 2],
    pixels_per_degree: f32,
    adapter: &'a str,
    driver: &'a str,
    software_driver: bool,
    measured_by: &'a str,
    baseline: &'a str,
    auto: Option<&'a Auto>,
}

impl<'a> TechniquesReport<'a> {
    /// The order whose saving is shown, and the order that it is compared with.
    fn gain_orders(&self) -> (Order, Order) {
        let own = self.config.order;
        let other = if own == Order::MORTON {
            Order::Z2_STA
        } else {
            own
        };
        (other, Order::MORTON)
    }

    fn measured(&self) -> Vec<&'a Measured<'a>> {
        self.scenes.iter().flat_map(|scene| &scene.rows).collect()
    }

    /// The figures for a terminal.
    fn short_table(&self) -> Table {
        let one = self.scenes.len() == 1;
        let columns = columns::SHORT
            .into_iter()
            .filter(|key| !(one && *key == "scene"));
        let table = self.rows().picked(columns);
        table.grouped_by(usize::from(!one))
    }

    /// Late frames at the refresh rates of displays.
    fn pacing_table(&self) -> Table {
        let one = self.scenes.len() == 1;
        let keys = columns::pacing_keys();
        let keys = keys.iter().map(String::as_str);
        let table = self
            .rows()
            .picked(keys.filter(|key| !(one && *key == "scene")));
        table.grouped_by(usize::from(!one))
    }

    /// Saving of an order with and without each technique.
    fn order_table(&self) -> Table {
        let (order, against) = self.gain_orders();
        let columns = order_columns(&self.orders, order, against);
        let scenes = self.scenes.iter();
        let gains: Vec<OrderGain> = scenes.flat_map(|s| s.order_gains(order, against)).collect();
        Table::new(&columns, &gains).grouped_by(1)
    }

    /// Published savings and the measured ones.
    fn claim_table(&self) -> Table {
        Table::new(&claim_columns(), &claims(self.scenes))
    }
}

impl<'r> Document for TechniquesReport<'r> {
    const SCHEMA: &'static str = "replay.techniques/2";
    const HAS_DETAILS: bool = true;

    fn content(&self) -> impl Serialize {
        let facts = |(scene, m): (&'r Measures<'r>, &&'r Manifest)| SceneFacts {
            scene: scene.scene,
            path: m.path.as_deref(),
            frames: &m.frames,
            scene_triangles: m.scene_triangles,
            instances: m.instances,
            size_px: m.size_px,
            hmd: &m.hmd.name,
            lens: m.lens,
            pixels_per_degree: m.pixels_per_degree,
            adapter: &m.adapter,
            driver: &m.driver,
            software_driver: m.software_driver,
            measured_by: &m.tool,
            baseline: &m.baseline,
            auto: m.auto.as_ref(),
        };
        TechniquesJson {
            config: self.config,
            scenes: self.scenes.iter().zip(&self.manifests).map(facts).collect(),
            rows: self.rows(),
            orders: self.order_table(),
            published: self.claim_table(),
        }
    }

    fn rows(&self) -> Table {
        let rows = self.measured();
        let columns = columns(&rows, self.config.order);
        Table::new(&columns, &rows).grouped_by(1)
    }

    fn answer(&self) -> Vec<String> {
        self.sentences()
    }

    /// Time with its quartiles, error and traffic of each technique.
    fn text(&self, style: Style) -> String {
        let one = self.scenes.len() == 1;
        let rows = self.measured();
        let mut columns = columns_of::<&Measured>()
            .text("scene", "scene", |m| m.scene)
            .text("technique", "technique", |m| m.row.technique.clone())
            .real("time", "time", "\u{d7} baseline", 2, |m| {
                m.timing.ratio.median
            })
            .text("quartiles", "quartiles", |m| {
                format!("{:.2} to {:.2}", m.timing.ratio.q1, m.timing.ratio.q3)
            })
            .real("flip_mean", "mean FLIP", "", 4, |m| m.pictures.flip_mean);
        let traffic = self.rows().picked(["external_mb_per_frame"]);
        columns.drain(..usize::from(one));
        let mut table = Table::new(&columns, &rows);
        table.headings.extend(traffic.headings);
        for (row, cells) in table.rows.iter_mut().zip(traffic.rows) {
            row.extend(cells);
        }
        table.grouped_by(usize::from(!one)).styled(style)
    }

    /// All columns, pacing, orders, and notes about the driver.
    fn details(&self, style: Style) -> String {
        let mut text = self.short_table().styled(style);
        text += "\n";
        text += &self.pacing_table().styled(style);
        let orders = self.order_table();
        if !orders.rows.is_empty() {
            text += "\n";
            text += &orders.styled(style);
        }
        let software = self.manifests.iter().find(|m| m.software_driver);
        if let Some(manifest) = software {
            text += &format!(
                "\nframe times are a processor's: rendered by {}\n",
                formats::text::printable(&manifest.adapter)
            );
        }
        text
    }
}
