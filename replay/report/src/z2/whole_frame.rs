//! Breakdown of whole frames' traffic: a stacked bar of clients for each order, and the bandwidth at the
//! frame rates of displays.

use super::model::PaperReport;
use crate::columns::Column;
use crate::figures::whole_mj;
use crate::html::{Section, figures};
use crate::plots::stacked::StackedChart;
use crate::plots::{PlotError, SeriesStyle};
use crate::table::Table;
use maud::{Markup, html};
use sim::memory::Client;
use sim::result::ClientTraffic;
use studies::experiment::ResultRow;

/// Frame rates of headsets, Hz.
const RATES_HZ: [u32; 3] = [72, 90, 120];

/// The part of a bar that shows a client: a title for readers, which clients may share, or the client's name.
const fn part_of(client: Client) -> &'static str {
    match client {
        Client::Texture => "textures",
        Client::Index | Client::Vertex => "indices and vertices",
        Client::ShadedVertex => "shaded vertices",
        Client::PrimitiveList => "primitive lists",
        Client::GBuffer => "G-buffer",
        Client::Composition => "composition and warp",
        other => other.name(),
    }
}

/// The section of a page; `None` if whole frames were not counted.
///
/// # Errors
/// A chart that cannot be drawn.
pub(super) fn section(report: &PaperReport) -> Result<Option<Section>, PlotError> {
    let counted = |row: &&ResultRow| !row.result.clients.is_empty();
    let mut charts = Vec::new();
    for info in &report.traces {
        let rows = report.details(&info.label);
        if rows.iter().any(counted) {
            charts.push((chart(&info.label, &rows).svg()?, String::new()));
        }
    }
    if charts.is_empty() {
        return Ok(None);
    }
    let rows = report.rows.iter().filter(counted);
    let table = Table::new(&columns(), rows).grouped_by(2);
    let body = html! {
        (figures(&charts))
        p.note { "Bars show the first cache configuration. An order changes only the reads of textures and shaded vertices." }
        (table.without_empty_columns().markup())
        p.note { "GB/s are 10\u{2079} bytes per second, reads and writes of all clients together. mW are the power of this traffic in the DRAM of the configuration (LPDDR4 by default): writes count as reads, every second burst opens a row, standby and refresh are left out." }
    };
    Ok(Some(Section::new("Traffic by client", body)))
}

/// The bars of the orders of a trace.
///
/// # Errors
/// A chart that cannot be drawn.
pub(crate) fn of_orders(scene: &str, rows: &[&ResultRow]) -> Result<Markup, PlotError> {
    let table = Table::new(&columns(), rows.iter().copied());
    Ok(html! {
        (figures(&[(chart(scene, rows).svg()?, String::new())]))
        p.note { "Means over the frames, as " code { "replay run --frame" } " counts them. An order changes only the reads of textures and shaded vertices." }
        (table.without_empty_columns().markup())
    })
}

fn chart(scene: &str, rows: &[&ResultRow]) -> StackedChart {
    let bytes = |row: &ResultRow, part: &str| -> u64 {
        let clients = row.result.clients.iter();
        let of = clients.filter(|c| part_of(c.client) == part);
        of.map(ClientTraffic::bytes).sum()
    };
    // From bottom to top. Clients that share a part are neighbours in the list of clients.
    let mut parts = Client::ALL.map(part_of).to_vec();
    parts.dedup();
    let used: Vec<(&str, usize)> = (parts.into_iter().zip(0..))
        .filter(|(part, _)| rows.iter().any(|row| bytes(row, part) > 0))
        .collect();
    let bar = |row: &&ResultRow| {
        let parts = used
            .iter()
            .map(|(part, _)| row.mb_per_frame(bytes(row, part)));
        (row.point.config.order.title().to_owned(), parts.collect())
    };
    StackedChart {
        title: format!("{scene}: traffic by client"),
        value_label: "MB per frame".to_owned(),
        series: SeriesStyle::list(&used),
        bars: rows.iter().map(bar).collect(),
        bar_px: 72.0,
        decimals: Some(1),
        ..StackedChart::default()
    }
}

fn columns<'a>() -> Vec<Column<'static, ResultRow<'a>>> {
    let all = |row: &ResultRow| {
        row.result
            .clients
            .iter()
            .map(ClientTraffic::bytes)
            .sum::<u64>()
    };
    let mut columns = crate::columns::pick::<ResultRow>(&[
        "label",
        "caches",
        "order",
        "frame_mb_per_frame",
        "texture_share_pct",
        "reduction_pct",
        "frame_reduction_pct",
    ]);
    columns.extend(RATES_HZ.map(|hz| {
        Column::real(
            format!("gb_per_s_{hz}hz"),
            format!("at {hz} Hz"),
            "GB/s",
            2,
            move |row: &ResultRow| row.mb_per_frame(all(row)) * f64::from(hz) / 1000.0,
        )
    }));
    columns.extend(RATES_HZ.map(|hz| {
        Column::real(
            format!("dram_mw_{hz}hz"),
            format!("at {hz} Hz"),
            "mW",
            0,
            move |row: &ResultRow| Some(row.per_frame(whole_mj(row.result)?) * f64::from(hz)),
        )
    }));
    columns
}

#[cfg(test)]
mod tests {
    use super::super::testing::{with_edited, with_report};
    use super::*;

    #[test]
    fn a_page_has_a_bar_for_each_order_where_whole_frames_were_counted() {
        assert!(with_report(|report| section(report).unwrap().is_none()));
        let traffic = |client, read_bytes| ClientTraffic {
            client,
            read_bytes,
            write_bytes: 1_000_000,
            energy_mj: 1.0,
        };
        let text = with_edited(
            |point, result| {
                let texture = traffic(Client::Texture, 3_000_000 + 1000 * point as u64);
                result.clients = vec![
                    texture,
                    traffic(Client::Vertex, 500_000),
                    traffic(Client::Colour, 0),
                ];
            },
            |report| section(report).unwrap().unwrap().body.into_string(),
        );
        for expected in [
            "textures",
            "indices and vertices",
            "colour",
            "at 90 Hz",
            "mW",
        ] {
            assert!(text.contains(expected), "{expected}");
        }
        // Unused parts have no legend entry.
        assert!(!text.contains("G-buffer") && !text.contains("primitive lists"));
    }
}
