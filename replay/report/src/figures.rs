//! The figures of a replayed point, one per line. Every table, file and chart takes them from here.

use super::columns::{Column, Columns, PointColumn, Row, Show, columns_of, over, pick};
use super::{config_columns, memory_columns};
use formats::texture::TexelFormat;
use sim::result::ClientTraffic;
use sim::result::{Part, RunResult};
use sim::tmu::closed_form;
use studies::experiment::ResultRow;

/// Columns that identify a point: the trace, the axes of the Z2 paper's experiment, and the whole
/// configuration.
fn identity<'a>() -> Vec<PointColumn<'a>> {
    let mut columns = config_columns::trace();
    columns = columns
        .text("twin", "stands for", |r| r.subject.stand_in_for)
        .real("caches", "L1/L2", "KiB", 0, ResultRow::caches_title)
        .real("l1_kib", "L1", "KiB", 0, |r| r.caches_kib().0)
        .real("l2_kib", "L2", "KiB", 0, |r| r.caches_kib().1);
    columns.extend(config_columns::config());
    columns
}

/// Counts and derived figures.
#[rustfmt::skip]
pub fn figures<'a>() -> Vec<PointColumn<'a>> {
    let mut figures = columns_of::<ResultRow>()
        .real("l1_footprint_miss_pct", "L1 miss", "% of footprints", 2, |r| 100.0 * r.result.l1.footprint_miss_rate)
            .about("footprints with a missing line")
        .real("l2_line_miss_pct", "L2 miss", "% of lines", 2, |r| 100.0 * r.result.l2.line_miss_rate)
            .about("line look-ups of the L2 that miss")
        .real("tmu_util_pct", "TMU", "%", 2, |r| tmu_util_pct(r.result))
            .about("cycles in which the texture unit filters a footprint")
        .real("tmu_ratio", "TMU", "\u{d7} Morton", 3, |r| Some(utilization(r.result)? / utilization(r.morton?)?))
            .about("utilisation over the utilisation in Morton order")
        .real("reduction_pct", "saved", "% of Morton", 1, |r| r.saved_pct(r.morton))
            .about("external traffic saved against Morton order with all other settings equal")
        .real("external_bytes", "external", "bytes", 0, |r| r.result.external_bytes)
            .about("lines from memory times the line size of the last level, all frames")
        .real("external_mb_per_frame", "external", "MB/frame", 2, |r| r.mb_per_frame(r.result.external_bytes))
            .about("external texture traffic")
        .real("bound_mb_per_frame", "bound", "MB/frame", 2, |r| r.mb_per_frame(r.bound_bytes()))
            .about("external traffic of an infinite cache")
        .real("over_bound", "external", "\u{d7} bound", 2, |r| over(r.result.external_bytes, r.bound_bytes()))
            .about("external traffic over the bound")
        .real("over_base", "external", "\u{d7} base", 3, |r| over(r.result.external_bytes, r.unchanged?.external_bytes))
            .about("external traffic over that of the settings without the change")
        .real("static_footprints_per_pixel", "static", "footprints/pixel", 2, |r| complexity(r, false))
            .about("footprints of loaded textures per covered pixel")
        .real("dynamic_footprints_per_pixel", "dynamic", "footprints/pixel", 2, |r| complexity(r, true))
            .about("footprints of shadow maps per covered pixel")
        .real("first_l1_footprint_miss_pct", "first L1", "% of footprints", 2, |r| first_l1_pct(r.result))
            .about("footprints whose first look-up found a line absent or in flight")
        .real("first_l2_line_miss_pct", "first L2", "% of lines", 2, |r| first_l2_pct(r.result))
            .about("lines of these look-ups that were absent from the L2, merged requests counted")
        .real("closed_form_util_pct", "TMU fit", "%", 2, |r| closed_form_pct(r.result))
            .about("utilisation that the Z2 paper's table implies for the rates of first look-ups")
        .real("closed_form_deviation_points", "TMU \u{2212} fit", "points", 2, |r| deviation_points(r.result))
            .about("simulated utilisation minus the utilisation that the Z2 paper's table implies for the rates of first look-ups")
        .real("prefetch_coverage_pct", "covered", "% of L2 misses", 1, |r| { let useful = r.result.memory.prefetch?.useful_lines; Some(100.0 * over(useful, useful + r.result.l2.counters.line_misses)?) })
            .about("useful prefetches as a share of useful prefetches and L2 line misses")
        .real("l2_stalled_misses_pct", "stalled", "% of L2 misses", 2, |r| { let stalled = r.result.memory.l2_mshrs?.stalled_misses; Some(100.0 * over(stalled, r.result.l2.counters.line_misses)?) })
            .about("L2 misses that were delayed because all MSHRs were in use");
    let memory = memory_columns::columns().into_iter();
    figures.extend(memory.map(|column| column.on(|r: &ResultRow| &r.result.memory)));
    figures = figures
        .real("frame_read_bytes", "all reads", "bytes", 0, |r| whole(r.result, |c| c.read_bytes))
            .about("bytes that all memory clients read, all frames")
        .real("frame_write_bytes", "all writes", "bytes", 0, |r| whole(r.result, |c| c.write_bytes))
            .about("bytes that all memory clients write, all frames")
        .real("frame_mb_per_frame", "all traffic", "MB/frame", 2, |r| Some(r.mb_per_frame(whole(r.result, ClientTraffic::bytes)?)))
            .about("traffic of all memory clients")
        .real("frame_energy_mj_per_frame", "all traffic", "mJ/frame", 3, |r| Some(r.per_frame(whole_mj(r.result)?)))
            .about("DRAM energy of the traffic of all clients, at a constant energy per byte")
        .real("texture_share_pct", "texture", "% of all", 1, |r| Some(100.0 * r.result.external_bytes as f64 / whole(r.result, ClientTraffic::bytes)? as f64))
            .about("texture reads as a share of the traffic of all clients")
        .real("frame_reduction_pct", "saved of all", "% of Morton", 1, |r| whole_saved_pct(r))
            .about("traffic of all clients saved against Morton order with all other settings equal")
        .real("cycles", "cycles", "", 0, |r| r.result.cycles)
            .about("cycles until the last core finishes");
    figures
}

/// Footprints of shadow maps, or of all other textures, per covered pixel; `None` if counts are by draw.
fn complexity(row: &ResultRow, of_shadow_maps: bool) -> Option<f64> {
    let parts = &row.result.by_texture;
    let textures = row.subject.source.tables().textures.iter();
    let wanted = textures
        .zip(parts)
        .filter(|(texture, _)| (texture.format == TexelFormat::R32f) == of_shadow_maps);
    let footprints: u64 = wanted.map(|(_, part)| part.l1.footprints).sum();
    let is_counted = !parts.is_empty() && row.result.lanes > 0;
    is_counted.then(|| footprints as f64 / row.result.lanes as f64)
}

/// A sum over the memory clients, if the whole frame was counted.
fn whole(result: &RunResult, of: impl Fn(&ClientTraffic) -> u64) -> Option<u64> {
    let clients = &result.clients;
    (!clients.is_empty()).then(|| clients.iter().map(of).sum())
}

/// DRAM energy of all clients over all frames, millijoules.
pub(super) fn whole_mj(result: &RunResult) -> Option<f64> {
    let clients = &result.clients;
    (!clients.is_empty()).then(|| clients.iter().map(|c| c.energy_mj).sum())
}

fn whole_saved_pct(row: &ResultRow) -> Option<f64> {
    let [own, morton] = [row.result, row.morton?].map(|result| whole(result, ClientTraffic::bytes));
    Some(100.0 * (1.0 - own? as f64 / morton? as f64))
}

/// The paper's figures for the same point. Its saving is computed from its two miss rates.
#[rustfmt::skip]
fn published<'a>() -> Vec<PointColumn<'a>> {
    columns_of::<ResultRow>()
        .real("paper.l1_footprint_miss_pct", "paper L1", "%", 2, |r| Some(r.paper?.l1_footprint_miss_pct))
        .real("paper.l2_line_miss_pct", "paper L2", "%", 2, |r| Some(r.paper?.l2_line_miss_pct))
        .real("paper.tmu_util_pct", "paper TMU", "%", 2, |r| Some(r.paper?.tmu_util_pct))
        .real("paper.tmu_ratio", "paper TMU", "\u{d7} Morton", 3, |r| r.paper?.tmu_ratio())
        .real("paper.reduction_pct", "paper saved", "% of Morton", 1, |r| r.paper?.reduction_pct())
        .into_iter().map(Column::published).collect()
}

/// The same point in functional mode.
#[rustfmt::skip]
fn functional<'a>() -> Vec<PointColumn<'a>> {
    columns_of::<ResultRow>()
        .real("functional.l1_footprint_miss_pct", "functional L1", "% of footprints", 2, |r| Some(100.0 * r.functional?.l1.footprint_miss_rate))
        .real("functional.l2_line_miss_pct", "functional L2", "% of lines", 2, |r| Some(100.0 * r.functional?.l2.line_miss_rate))
        .real("functional.external_mb_per_frame", "functional", "MB/frame", 2, |r| Some(r.mb_per_frame(r.functional?.external_bytes)))
        .real("functional.external_difference_pct", "difference", "%", 2, |r| Some(100.0 * (over(r.functional?.external_bytes, r.result.external_bytes).unwrap_or(1.0) - 1.0)))
}

/// The same point on the machine of `--preset z2-paper`: rates of first look-ups, then counts as for other
/// machines.
#[rustfmt::skip]
fn z2_paper<'a>() -> Vec<PointColumn<'a>> {
    columns_of::<ResultRow>()
        .real("z2_paper.l1_footprint_miss_pct", "first L1", "%", 2, |r| first_l1_pct(r.z2_paper?))
            .about("footprints whose first look-up found a line absent or in flight")
        .real("z2_paper.l2_line_miss_pct", "first L2", "%", 2, |r| first_l2_pct(r.z2_paper?))
            .about("lines of these look-ups that were absent from the L2, merged requests counted")
        .real("z2_paper.tmu_util_pct", "TMU", "%", 2, |r| tmu_util_pct(r.z2_paper?))
            .about("cycles in which the texture unit filters a footprint")
        .real("z2_paper.tmu_ratio", "TMU", "\u{d7} Morton", 3, |r| Some(utilization(r.z2_paper?)? / utilization(r.z2_paper_morton?)?))
            .about("utilisation over the utilisation in Morton order")
        .real("z2_paper.closed_form_util_pct", "TMU fit", "%", 2, |r| closed_form_pct(r.z2_paper?))
            .about("utilisation that the Z2 paper's table implies for the rates of first look-ups")
        .real("z2_paper.closed_form_deviation_points", "TMU \u{2212} fit", "points", 2, |r| deviation_points(r.z2_paper?))
            .about("simulated utilisation minus the utilisation that the Z2 paper's table implies for the rates of first look-ups")
        .real("z2_paper.product_reduction_pct", "saved, L1 \u{d7} L2", "% of Morton", 1, |r| product_saved_pct(r))
            .about("traffic saved according to the product of both rates, as in the paper; merged requests count")
        .real("z2_paper.primary_l1_footprint_miss_pct", "primary L1", "% of footprints", 2, |r| Some(100.0 * r.z2_paper?.l1.footprint_miss_rate))
            .about("footprints that fetched a line")
        .real("z2_paper.primary_l2_line_miss_pct", "primary L2", "% of lines", 2, |r| Some(100.0 * r.z2_paper?.l2.line_miss_rate))
            .about("fetched lines that came from memory")
        .real("z2_paper.external_bytes", "external", "bytes", 0, |r| Some(r.z2_paper?.external_bytes))
            .about("bytes read from memory")
        .real("z2_paper.external_mb_per_frame", "external", "MB/frame", 2, |r| Some(r.mb_per_frame(r.z2_paper?.external_bytes)))
            .about("bytes read from memory")
        .real("z2_paper.reduction_pct", "saved", "% of Morton", 1, |r| saved_pct(r.z2_paper?, r.z2_paper_morton?))
            .about("bytes read from memory saved against Morton order")
}

impl Row for ResultRow<'_> {
    fn columns() -> Vec<Column<'static, Self>> {
        [identity(), figures(), published(), functional(), z2_paper()]
            .into_iter()
            .flatten()
            .collect()
    }
}

/// The figure with this key.
pub fn figure<'a>(key: &str) -> Option<PointColumn<'a>> {
    pick(&[key]).pop()
}

/// A row's figure with this key, if it is a number.
pub fn number(row: &ResultRow, key: &str) -> Option<f64> {
    figure(key)?.value(row).number()
}

impl Row for Part {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        columns_of::<Self>()
            .text("name", "", |p| p.name.clone())
            .shown("footprints", "footprints", "millions", Show::Millions(3), |p| p.l1.footprints)
            .real("l1_footprint_miss_pct", "L1 miss", "% of footprints", 2, |p| Some(100.0 * over(p.l1.footprint_misses, p.l1.footprints)?))
                .about("footprints with a missing line")
            .real("l2_line_miss_pct", "L2 miss", "% of lines", 2, |p| Some(100.0 * over(p.l2.line_misses, p.l2.line_lookups)?))
                .about("line look-ups of the L2 that miss")
            .real("external_lines", "external", "1000 lines", 1, |p| p.l2.line_misses as f64 / 1e3)
                .about("external traffic")
    }
}

fn utilization(result: &RunResult) -> Option<f64> {
    Some(result.tmu.as_ref()?.utilization)
}

fn tmu_util_pct(result: &RunResult) -> Option<f64> {
    Some(100.0 * utilization(result)?)
}

fn first_l1_pct(result: &RunResult) -> Option<f64> {
    Some(100.0 * result.first_lookups?.l1_footprint_miss_rate)
}

fn first_l2_pct(result: &RunResult) -> Option<f64> {
    Some(100.0 * result.first_lookups?.l2_line_miss_rate)
}

/// The closed form relates rates counted as in the paper; primary rates are counted differently.
fn closed_form_pct(result: &RunResult) -> Option<f64> {
    let first = result.first_lookups?;
    Some(100.0 * closed_form(first.l1_footprint_miss_rate, first.l2_line_miss_rate))
}

fn deviation_points(result: &RunResult) -> Option<f64> {
    Some(tmu_util_pct(result)? - closed_form_pct(result)?)
}

fn product_saved_pct(row: &ResultRow) -> Option<f64> {
    let product = |result: &RunResult| Some(first_l1_pct(result)? * first_l2_pct(result)?);
    let morton = product(row.z2_paper_morton?)?;
    (morton > 0.0).then_some(100.0 * (1.0 - product(row.z2_paper?)? / morton))
}

fn saved_pct(result: &RunResult, morton: &RunResult) -> Option<f64> {
    let rest = over(result.external_bytes, morton.external_bytes)?;
    Some(100.0 * (1.0 - rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_has_a_unique_key_and_a_place_in_json() {
        let keys: Vec<String> = ResultRow::columns()
            .iter()
            .map(|c| c.heading.key.to_string())
            .collect();
        for (i, key) in keys.iter().enumerate() {
            assert!(!keys[..i].contains(key), "{key} twice");
        }
        // Keys with the same prefix must be adjacent, because they form one object in JSON.
        let prefixes: Vec<&str> = keys
            .iter()
            .filter_map(|k| Some(k.split_once('.')?.0))
            .collect();
        let mut runs = prefixes.clone();
        runs.dedup();
        assert_eq!(
            runs,
            [
                "l1",
                "l2",
                "sampling",
                "layout",
                "tmu",
                "prefetch",
                "dram",
                "frame",
                "paper",
                "functional",
                "z2_paper"
            ]
        );
    }

    #[test]
    fn every_counted_figure_has_a_definition() {
        assert!(figures().iter().all(|f| !f.heading.about.is_empty()));
    }
}
