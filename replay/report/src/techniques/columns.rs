//! The figures of a technique, one per line.

use crate::columns::{Column, Columns, Show, columns_of};
use crate::lists::unique;
use sim::config::Order;
use sim::model_version::MODEL_VERSION;
use studies::techniques::{CacheFigures, Count, Measured, OrderGain, RATES_HZ};

/// A column of techniques.
pub type TechniqueColumn<'a> = Column<'a, &'a Measured<'a>>;

/// Keys of the table on a terminal; missing columns are skipped.
pub const SHORT: [&str; 20] = [
    "scene",
    "technique",
    "frame_time_ratio",
    "frame_time_ratio_q1",
    "frame_time_ratio_q3",
    "processor_time_ratio",
    "beyond_90hz_pct",
    "cull_tests_ratio",
    "false_negatives",
    "false_positives",
    "draws_ratio",
    "fragments_ratio",
    "memory_bytes_ratio",
    "energy_ratio",
    "flip_mean",
    "flip_worst",
    "flicker",
    "external_mb_per_frame",
    "dominated",
    "dominated_in",
];

/// Keys of the table of pacing.
pub(super) fn pacing_keys() -> Vec<String> {
    let rates = |name: &'static str| RATES_HZ.map(|hz| format!("{name}_{hz}hz"));
    let start = ["scene", "technique", "frame_ms"].map(str::to_owned);
    (start.into_iter())
        .chain(rates("missed_pct"))
        .chain(rates("steps"))
        .collect()
}

/// Mean of a count over the frames.
fn mean<'a>(key: &'static str, name: &'static str, of: Count) -> TechniqueColumn<'a> {
    TechniqueColumn::real(key, name, "a frame", 0, move |m| {
        Some(m.total(of)? as f64 / m.row.frames.len().max(1) as f64)
    })
}

fn ratio<'a>(key: &'static str, name: &'static str, of: Count) -> TechniqueColumn<'a> {
    TechniqueColumn::real(key, name, "\u{d7} baseline", 3, move |m| {
        m.over_baseline(of)
    })
}

/// What a row is about.
#[rustfmt::skip]
fn identity<'a>() -> Vec<TechniqueColumn<'a>> {
    columns_of::<&'a Measured<'a>>()
        .text("scene", "scene", |m| m.scene)
        .text("trace", "trace", |m| m.row.trace.as_deref().map(|file| file.trim_end_matches(".textrace")))
            .about("name of the technique's trace without folder and extension")
        .text("checksum", "checksum", |m| m.row.trace_checksum.as_deref())
            .about("checksum of the trace's content")
        .text("camera", "camera", |m| m.manifest.camera.as_str())
        .text("display", "display", |m| m.manifest.hmd.name.as_str())
        .text("width_px", "width", |m| m.manifest.size_px[0])
            .about("image width per eye in pixels")
        .text("height_px", "height", |m| m.manifest.size_px[1])
            .about("image height per eye in pixels")
        .text("model_version", "model", |_| MODEL_VERSION)
            .about("version of the models; counts of different versions cannot be compared")
        .text("technique", "technique", |m| m.row.technique.as_str())
        .text("title", "name", |m| m.row.title.as_str())
        .text("parts", "combines", |m| m.row.parts.join(" + "))
        .text("lossless", "lossless", |m| m.row.lossless)
            .about("meant to leave every visible pixel unchanged")
        .text("dominated", "dominated", |m| m.dominated)
            .about("another technique has no more error and takes less time (the interquartile ranges do not overlap)")
        .text("dominated_in", "dominated in", |m| m.dominated_in.join(" "))
            .about("counts in which another technique is at least as good, with at most the same error in its worst picture, and better in one of both")
}

/// Times relative to the baseline, and frame times.
#[rustfmt::skip]
fn times<'a>() -> Vec<TechniqueColumn<'a>> {
    columns_of::<&'a Measured<'a>>()
        .real("frame_time_ratio", "time", "\u{d7} baseline", 3, |m| m.timing.ratio.median)
            .about("frame time over that of the baseline measured next to it: median over all frames and repeats")
        .real("frame_time_ratio_q1", "lower quartile", "\u{d7} baseline", 3, |m| m.timing.ratio.q1)
        .real("frame_time_ratio_q3", "upper quartile", "\u{d7} baseline", 3, |m| m.timing.ratio.q3)
        .real("frame_time_ratio_p1", "1 %", "\u{d7} baseline", 3, |m| m.timing.ratio.p1)
        .real("frame_time_ratio_p99", "99 %", "\u{d7} baseline", 3, |m| m.timing.ratio.p99)
        .real("processor_time_ratio", "processors", "\u{d7} baseline", 3, |m| m.timing.processor_ratio)
            .about("processor time over the baseline's, all frames; each frame counts with its fastest repeat. Other load on the machine affects it less than the frame time")
        .real("processor_time_ratio_q1", "lower quartile", "\u{d7} baseline", 3, |m| m.timing.processor_ratios.map(|r| r.q1))
        .real("processor_time_ratio_q3", "upper quartile", "\u{d7} baseline", 3, |m| m.timing.processor_ratios.map(|r| r.q3))
        .real("frame_ms", "frame", "ms", 2, |m| m.timing.frame_ms.median)
            .about("median frame time without capture")
        .real("frame_ms_p1", "1 %", "ms", 2, |m| m.timing.frame_ms.p1)
        .real("frame_ms_p99", "99 %", "ms", 2, |m| m.timing.frame_ms.p99)
        .real("beyond_90hz_pct", "late at 90 Hz", "%", 1, |m| m.timing.beyond_pct[0])
            .about("frames longer than 11.1 ms, with times scaled to a median of 11.1 ms for the baseline")
        .real("beyond_72hz_pct", "late at 72 Hz", "%", 1, |m| m.timing.beyond_pct[1])
            .about("frames longer than 13.9 ms, with times scaled to a median of 11.1 ms for the baseline")
        .real("cull_ms", "culling", "ms", 3, |m| m.timing.cull_ms)
            .about("median culling time per frame")
}

/// Frames that miss a display's refresh, by rate.
#[rustfmt::skip]
fn pacing<'a>() -> Vec<TechniqueColumn<'a>> {
    let mut columns: Vec<TechniqueColumn<'a>> = Vec::new();
    columns.extend((0..RATES_HZ.len()).map(|at| {
        let hz = RATES_HZ[at];
        TechniqueColumn::real(format!("missed_pct_{hz}hz"), format!("missed at {hz} Hz"), "%", 1, move |m| Some(m.timing.pacing.get(at)?.missed_pct))
            .about("frames that take longer than a refresh interval, by measured times")
    }));
    columns.extend((0..RATES_HZ.len()).map(|at| {
        let hz = RATES_HZ[at];
        TechniqueColumn::real(format!("steps_{hz}hz"), format!("steps at {hz} Hz"), "refreshes", 2, move |m| Some(m.timing.pacing.get(at)?.steps))
            .about("mean number of refresh intervals per frame, 1 if no frame is late; the display rate divided by it is the frame rate")
    }));
    columns
}

/// A figure for each of these names: key and title by name, and the value of a technique.
fn by_name<'a>(
    names: Vec<&str>,
    (prefix, unit): (&str, &'static str),
    title: fn(&str) -> String,
    about: &'static str,
    value: fn(&Measured, &str) -> Option<f64>,
) -> Vec<TechniqueColumn<'a>> {
    let column = |name: &str| {
        let (key, title, name) = (format!("{prefix}.{name}"), title(name), name.to_owned());
        TechniqueColumn::real(key, title, unit, 3, move |m| value(m, &name)).about(about)
    };
    names.into_iter().map(column).collect()
}

/// Times of the stages, under the names that the captures give them.
fn stages<'a>(rows: &[&'a Measured<'a>]) -> Vec<TechniqueColumn<'a>> {
    let all = rows.iter().flat_map(|m| &m.timing.stages_ms);
    let stages = unique(all.map(|(stage, _)| stage.as_str()));
    let about = "median time of the stage";
    by_name(
        stages,
        ("stages_ms", "ms"),
        str::to_owned,
        about,
        |m, stage| {
            let found = m.timing.stages_ms.iter().find(|(name, _)| name == stage);
            found.map(|(_, ms)| *ms)
        },
    )
}

/// Counts per frame, and memory.
#[rustfmt::skip]
fn counts<'a>() -> Vec<TechniqueColumn<'a>> {
    vec![
        TechniqueColumn::new("cull_tests", "tests", "all frames", Show::Whole, |m| m.total(|f| Some(f.cull_tests)))
            .about("bounds tested against a frustum"),
        ratio("cull_tests_ratio", "tests", |f| Some(f.cull_tests)),
        TechniqueColumn::new("false_negatives", "missed", "draws", Show::Whole, |m| m.total(|f| f.false_negatives))
            .about("draws that were culled although a fragment is visible, all frames"),
        TechniqueColumn::new("false_positives", "needless", "draws", Show::Whole, |m| m.total(|f| f.false_positives))
            .about("draws that were rendered although nothing of them is visible, all frames"),
        mean("draws", "draws", |f| Some(f.draws)),
        ratio("draws_ratio", "draws", |f| Some(f.draws)),
        mean("draw_calls", "calls", |f| Some(f.draw_calls)),
        mean("state_changes", "state changes", |f| Some(f.state_changes)),
        mean("vertices", "vertices", |f| Some(f.vertices)),
        mean("triangles", "triangles", |f| Some(f.triangles)),
        mean("quads", "quads", |f| f.quads),
        mean("fragments", "fragments", |f| f.fragments),
        ratio("fragments_ratio", "fragments", |f| f.fragments),
        mean("bytes_uploaded", "uploaded", |f| Some(f.bytes_uploaded)),
        mean("memory_bytes", "traffic", |f| f.memory_bytes)
            .about("counted memory traffic: texture lines once per tile, vertices, images, uploads"),
        ratio("memory_bytes_ratio", "traffic", |f| f.memory_bytes),
        TechniqueColumn::real("energy_ratio", "energy", "\u{d7} baseline", 3, |m| m.energy_ratio())
            .about("energy of the counted traffic, fragments and vertices, over the baseline's"),
        mean("bytes_reprojected", "reprojected", |f| Some(f.bytes_reprojected)),
        TechniqueColumn::new("target_color_bytes", "colour targets", "MB", Show::Millions(2), |m| m.most(|f| f.target_color_bytes))
            .about("colour targets of all layers and composed images; the frame with the most"),
        TechniqueColumn::new("target_depth_bytes", "depth targets", "MB", Show::Millions(2), |m| m.most(|f| f.target_depth_bytes))
            .about("depth buffers in use at the same time: successive render passes share one, views drawn at once do not"),
        TechniqueColumn::new("texture_bytes", "textures", "MB", Show::Millions(2), |m| m.row.texture_bytes)
            .about("texels of the scene, stored once for both eyes"),
        TechniqueColumn::new("peak_memory_bytes", "memory", "MB", Show::Millions(0), |m| m.row.peak_memory_bytes)
            .about("peak memory of the capturing process"),
    ]
}

/// Differences from the baseline's pictures.
#[rustfmt::skip]
fn image_error<'a>() -> Vec<TechniqueColumn<'a>> {
    columns_of::<&'a Measured<'a>>()
        .real("flip_mean", "FLIP", "", 5, |m| m.pictures.flip_mean)
            .about("mean FLIP inside the visible area of the lens")
        .real("flip_p99", "FLIP 99 %", "", 5, |m| m.pictures.flip_p99)
            .about("mean of the pictures' 99th percentiles of FLIP")
        .real("flip_worst", "worst", "FLIP", 5, |m| m.pictures.flip_worst)
            .about("mean FLIP of the worst picture")
        .whole("worst_frame", "frame", "worst", |m| m.worst_frame)
        .real("psnr_db", "PSNR", "dB", 1, |m| m.pictures.psnr_db)
            .about("mean peak signal-to-noise ratio; 100 means identical")
        .real("psnr_worst_db", "worst", "dB", 1, |m| m.pictures.psnr_worst_db)
        .real("ssim", "SSIM", "", 4, |m| m.pictures.ssim)
            .about("mean structural similarity")
        .real("ssim_worst", "worst", "SSIM", 4, |m| m.pictures.ssim_worst)
        .real("flicker", "flicker", "", 5, |m| m.pictures.flicker)
            .about("temporal change of the picture minus that of the baseline, 0 to 1, along the baseline's motion")
        .real("identical_pct", "identical", "% of pictures", 1, |m| m.pictures.identical_pct)
            .about("pictures whose visible pixels equal the baseline's bit for bit")
}

/// Means of the techniques' own predictions.
fn predictions<'a>(rows: &[&'a Measured<'a>]) -> Vec<TechniqueColumn<'a>> {
    let frames = rows.iter().flat_map(|m| &m.row.frames);
    let all = frames.flat_map(|f| &f.predicted);
    let predictions = unique(all.map(|(key, _)| key.as_str()));
    let title = |key: &str| format!("predicted {}", key.replace('_', " "));
    let about = "mean of the technique's own prediction";
    by_name(predictions, ("predicted", ""), title, about, |m, key| {
        m.predicted(key)
    })
}

/// Cache figures in an order.
#[rustfmt::skip]
fn caches<'a>(order: Order) -> Vec<TechniqueColumn<'a>> {
    columns_of::<&'a Measured<'a>>()
        .whole("footprints", "footprints", "", move |m| Some(m.caches_in(order)?.footprints))
            .about("bilinear footprints of the trace")
        .real("l1_footprint_miss_pct", "L1 miss", "% of footprints", 2, move |m| Some(m.caches_in(order)?.l1_footprint_miss_pct))
        .real("l2_line_miss_pct", "L2 miss", "% of lines", 2, move |m| Some(m.caches_in(order)?.l2_line_miss_pct))
        .whole("external_bytes", "external", "bytes", move |m| Some(m.caches_in(order)?.external_bytes))
            .about("line misses of the L2 times the line size, all frames of the trace")
        .real("external_mb_per_frame", "external", "MB/frame", 3, move |m| m.caches_in(order).map(CacheFigures::external_mb_per_frame))
            .about("external texture traffic")
}

/// Every figure of these techniques. Stages and predictions have the names that the captures give them.
/// `order` is the order of the cache figures.
pub fn columns<'a>(rows: &[&'a Measured<'a>], order: Order) -> Vec<TechniqueColumn<'a>> {
    let groups = [
        identity(),
        times(),
        pacing(),
        stages(rows),
        counts(),
        image_error(),
        predictions(rows),
        caches(order),
    ];
    groups.into_iter().flatten().collect()
}

/// A column of an order's saving with a technique.
pub(super) type GainFigure<'a> = Column<'a, OrderGain<'a>>;

/// The table of orders with and without each technique. It shows the saving of `gain` over `against`.
#[rustfmt::skip]
pub(super) fn order_columns<'a>(orders: &[Order], gain: Order, against: Order) -> Vec<GainFigure<'a>> {
    let mut columns = columns_of::<OrderGain<'a>>()
        .text("scene", "scene", |g| g.measured.scene)
        .text("technique", "technique", |g| g.measured.row.technique.as_str());
    columns.extend(orders.iter().map(|&order| {
        let key = format!("external_mb_per_frame.{}", order.name());
        GainFigure::real(key, order.title(), "MB/frame", 3, move |g| {
            g.measured.caches_in(order).map(CacheFigures::external_mb_per_frame)
        })
    }));
    let saved = format!("{} saves", gain.title());
    let of = format!("of {}", against.title());
    columns = columns
        .real("saved_pct", saved, "%", 1, |g| g.own.saved_pct)
        .real("saved_without_pct", "without", "%", 1, |g| g.baseline.saved_pct)
            .about("saving of the order on the baseline's trace")
        .real("shared_pct", "shared", "% of lines", 1, |g| g.own.shared_pct)
            .about("percentage of the touched lines that both eyes touch")
        .real("headroom_pct", "above bound", "%", 1, |g| g.own.headroom_pct)
            .about("traffic above that of an infinite cache: the largest possible saving of any order")
        .text("reason", "why", OrderGain::reason);
    if let Some(column) = columns.iter_mut().find(|c| c.heading.key == "saved_pct") {
        column.heading.about = "external traffic that the order saves";
        column.heading.name = format!("{} {of}", column.heading.name).into();
    }
    columns
}
