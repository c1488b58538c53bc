//! Columns that identify a row in any file: trace, image size, and every configuration key. Rows of several
//! files can be joined by them.

use super::columns::{Cell, Columns, PointColumn, Value, columns_of, name};
use formats::texture::Sampler;
use serde_json::Value as Json;
use sim::config::{FrameConfig, Key, LevelConfig, RunConfig, TmuConfig};
use sim::memory::dram::DramConfig;
use sim::model_version::MODEL_VERSION;
use studies::experiment::{ResultRow, plain, scene_label};

/// The trace.
pub fn trace<'a>() -> Vec<PointColumn<'a>> {
    columns_of::<ResultRow>()
        .text("label", "scene", |r| r.subject.label.clone())
        .about("short name in this file; it depends on the other traces in the file")
        .text("trace", "trace", |r| r.subject.id.name.clone())
        .about("name of the trace's file without folder and extension")
        .text("checksum", "checksum", |r| r.subject.id.checksum.clone())
        .about("checksum of the trace's content")
        .text("scene", "scene", |r| scene_label(r.subject.source.tables()))
        .text("camera", "camera", |r| r.subject.id.camera.clone())
        .text("display", "display", |r| r.subject.id.display.clone())
        .text("width_px", "width", |r| {
            u64::from(r.subject.id.eye_size_px[0])
        })
        .about("image width per eye in pixels")
        .text("height_px", "height", |r| {
            u64::from(r.subject.id.eye_size_px[1])
        })
        .about("image height per eye in pixels")
        .text("model_version", "model", |_| MODEL_VERSION)
        .about("version of the models; counts of different versions cannot be compared")
}

/// Largest anisotropy of all samples of a row; none if the recorded samplers decide and differ from 1.
fn max_anisotropy(row: &ResultRow) -> Option<u64> {
    let chosen = row.point.config.sampling.max_anisotropy;
    let recorded = &row.subject.source.tables().samplers;
    let isotropic = !recorded.iter().any(Sampler::is_anisotropic);
    chosen.or(isotropic.then_some(1)).map(u64::from)
}

/// The column of a key. `default` gives its type.
fn cell<'a>(
    key: &'static str,
    default: &Json,
    value: impl Fn(&RunConfig) -> Option<Json> + 'static,
) -> PointColumn<'a> {
    let of = move |r: &ResultRow| value(&r.point.config);
    match default {
        Json::Bool(_) => PointColumn::text(key, key, move |r| of(r)?.as_bool()),
        Json::Number(_) => PointColumn::text(key, key, move |r| of(r)?.as_u64()),
        _ => PointColumn::text(key, key, move |r| of(r)?.as_str().map(str::to_owned)),
    }
}

/// The columns of a table of the configuration.
fn table<'a, T: Default + 'static>(
    keys: &'static [Key<T>],
    of: fn(&RunConfig) -> Option<T>,
) -> Vec<PointColumn<'a>> {
    let columns = keys
        .iter()
        .map(|&(key, value)| cell(key, &value(&T::default()), move |c| Some(value(&of(c)?))));
    columns.collect()
}

fn key<'a, V: Cell + 'static>(key: &'static str, value: fn(&RunConfig) -> V) -> PointColumn<'a> {
    PointColumn::text(key, key, move |r: &ResultRow| value(&r.point.config))
}

/// The columns of the levels: keys of the L1 and the L2, and a text for those below.
#[rustfmt::skip]
fn levels<'a>() -> Vec<PointColumn<'a>> {
    fn cache<'a>(keys: [&'static str; 5], level: fn(&RunConfig) -> &LevelConfig) -> [PointColumn<'a>; 5] {
        let [size_bytes, ways, replacement, sectors, victim_lines] = keys;
        let of = move |r: &ResultRow| *level(&r.point.config);
        [
            PointColumn::text(size_bytes, size_bytes, move |r: &ResultRow| of(r).size_bytes),
            PointColumn::text(ways, ways, move |r: &ResultRow| of(r).ways),
            PointColumn::text(replacement, replacement, move |r: &ResultRow| of(r).replacement.name()),
            PointColumn::text(sectors, sectors, move |r: &ResultRow| of(r).sectors),
            PointColumn::text(victim_lines, victim_lines, move |r: &ResultRow| of(r).victim_lines),
        ]
    }
    let mut columns = Vec::new();
    columns.extend(cache(["l1.size_bytes", "l1.ways", "l1.replacement", "l1.sectors", "l1.victim_lines"], |c| &c.level.l1));
    columns.extend(cache(["l2.size_bytes", "l2.ways", "l2.replacement", "l2.sectors", "l2.victim_lines"], |c| &c.level.l2));
    columns.extend([
        key("l2.inclusion", |c| c.level.l2.inclusion.name()),
        key("l2.shared", |c| c.level.l2.shared),
        key("l2.hit_cycles", |c| c.level.l2.hit_cycles),
        key("level", |c| c.level.lower_text(c.line_bytes)),
    ]);
    columns
}

/// Every configuration key, as listed in docs/use/configuration.md.
pub fn config<'a>() -> Vec<PointColumn<'a>> {
    let defaults = RunConfig::default();
    let columns = RunConfig::KEYS.iter().map(|&(of_run, value)| match of_run {
        "order" => vec![PointColumn::text("order", "order", |r| {
            let order = r.point.config.order;
            Value::Named(order.name(), order.title())
        })],
        "level" => levels(),
        "sampling" => vec![
            key("sampling.filter", |c| name(&c.sampling.filter)),
            key("sampling.lod_bias", |c| c.sampling.lod_bias),
            key("sampling.lod", |c| name(&c.sampling.lod)),
            key("sampling.helper_lanes", |c| c.sampling.helper_lanes),
            PointColumn::text(
                "sampling.max_anisotropy",
                "sampling.max_anisotropy",
                max_anisotropy,
            ),
            key("sampling.anisotropy", |c| name(&c.sampling.anisotropy)),
        ],
        "layout" => vec![
            key("layout.texel_format", |c| {
                c.layout.texel_format.as_ref().map(name)
            }),
            key("layout.block_order", |c| name(&c.layout.block_order)),
            key("layout.shadow_map_order", |c| {
                name(&c.layout.shadow_map_order)
            }),
            key("layout.base_align_bytes", |c| c.layout.base_align_bytes),
            key("layout.texture_order", |c| name(&c.layout.texture_order)),
        ],
        "tmu" => table(TmuConfig::KEYS, |c| Some(c.tmu)),
        "prefetch" => vec![
            key("prefetch.prefetcher", |c| {
                c.prefetch.map(|p| p.prefetcher.name())
            }),
            key("prefetch.lines", |c| c.prefetch.map(|p| p.lines())),
        ],
        "dram" => table(DramConfig::KEYS, |c| c.dram),
        "frame" => table(FrameConfig::KEYS, |c| c.frame),
        // No keys of configuration files.
        "timeline" | "l2_changes" => Vec::new(),
        _ => vec![cell(of_run, &value(&defaults), move |c| Some(value(c)))],
    });
    columns.flatten().collect()
}

/// The key that this row changes, if any.
pub fn change<'a>() -> Vec<PointColumn<'a>> {
    columns_of::<ResultRow>()
        .text("change.key", "change", |r| {
            let (key, _) = r.point.change.as_ref()?;
            Some(key.clone())
        })
        .about("configuration key that only this row changes")
        .text("change.value", "to", |r| {
            let (_, value) = r.point.change.as_ref()?;
            Some(plain(value))
        })
        .about("value of the changed key")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_the_configuration_is_a_column() {
        let page = include_str!("../../../docs/use/configuration.md");
        let documented = page.lines().filter_map(|line| {
            let key = line.strip_prefix("| `")?;
            Some(key.split_once('`')?.0)
        });
        // All levels' keys are columns of the L1 and the L2; one more column describes the levels below.
        let column = |key: &'static str| {
            if key.starts_with("level.") {
                "level"
            } else {
                key
            }
        };
        let mut documented: Vec<&str> = documented.map(column).collect();
        documented.dedup();
        let columns = config();
        let keys = columns.iter().map(|c| c.heading.key.as_ref());
        let keys: Vec<&str> = keys
            .filter(|key| !key.starts_with("l1.") && !key.starts_with("l2."))
            .collect();
        assert!(keys.len() > 30);
        assert_eq!(keys, documented);
    }
}
