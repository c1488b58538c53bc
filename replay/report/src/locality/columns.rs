//! Row types of the tables, and their columns.

use crate::columns::{Column, Columns, Show};
use locality::{ByOrigin, CacheHits, Figures, MissSplit, Origin, Sequence, Stream, WorkingSet};
use sim::config::LevelConfig;

/// The stream that a row describes.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// Label of the trace.
    pub trace: &'a str,
    /// The sequence of the accesses.
    pub order: Sequence,
    /// The stream.
    pub stream: Stream,
    /// Line size in bytes.
    pub line_bytes: u32,
}

/// A stream and the cache that it goes to.
#[derive(Clone, Copy, Debug)]
pub struct Summary<'a> {
    /// The stream.
    pub of: Subject<'a>,
    /// The configured cache.
    pub cache: &'a LevelConfig,
    /// The figures.
    pub figures: &'a Figures,
}

/// A point of a miss-ratio curve.
#[derive(Clone, Copy, Debug)]
pub struct CurvePoint<'a> {
    /// The stream.
    pub of: Subject<'a>,
    /// `lru` or `opt`.
    pub policy: &'static str,
    /// Size and hits.
    pub cache: CacheHits,
    /// Number of line accesses.
    pub accesses: u64,
}

/// Reuses within a range of distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reuses<'a> {
    /// The stream.
    pub of: Subject<'a>,
    /// First and last distance.
    pub distances: (u64, u64),
    /// Reuses by the origin of the previous use.
    pub reuses: ByOrigin,
}

/// The working sets of stretches of one length.
#[derive(Clone, Copy, Debug)]
pub struct Window<'a> {
    /// The stream.
    pub of: Subject<'a>,
    /// Sums over stretches.
    pub set: WorkingSet,
}

fn pct(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| 100.0 * part as f64 / whole as f64)
}

/// Share of one origin in percent.
fn share(counts: &ByOrigin, origin: Origin) -> Option<f64> {
    pct(counts[origin.index()], counts.iter().sum())
}

impl Summary<'_> {
    fn split(&self) -> &MissSplit {
        &self.figures.split
    }

    /// A count as a percentage of the line accesses.
    pub fn share_pct(&self, count: u64) -> Option<f64> {
        pct(count, self.figures.accesses)
    }

    /// Bytes of lines.
    fn bytes(&self, lines: f64) -> f64 {
        lines * f64::from(self.of.line_bytes)
    }

    /// Misses of a fully associative cache of this size under OPT.
    pub fn opt_misses(&self) -> u64 {
        self.figures.misses(&self.figures.opt_of_size())
    }

    /// Misses of the configured geometry under OPT.
    pub fn opt_ways_misses(&self) -> u64 {
        self.figures.misses(&self.figures.opt_of_geometry)
    }
}

/// Columns that identify the stream of a row.
fn subject_columns<'a, R>(of: fn(&R) -> &Subject<'a>) -> Vec<Column<'a, R>>
where
    R: 'a,
{
    vec![
        Column::text("trace", "trace", move |r| of(r).trace),
        Column::text("order", "order", move |r| of(r).order.key()),
        Column::text("stream", "stream", move |r| of(r).stream.key()),
    ]
}

/// Columns of counts by the origin of the previous use.
fn origin_columns<'a, R: 'a>(of: fn(&R) -> &ByOrigin) -> Vec<Column<'a, R>> {
    let column = |origin: Origin| {
        let name = origin.key().replace('_', " ");
        Column::new(origin.key(), name, "", Show::Whole, move |r: &R| {
            of(r)[origin.index()]
        })
    };
    Origin::ALL.into_iter().map(column).collect()
}

/// Keys of the misses of the configured cache and of a fully associative one.
pub(super) const MISSES: [&str; 7] = [
    "line_miss_pct",
    "compulsory_pct",
    "capacity_pct",
    "conflict_pct",
    "avoided_pct",
    "fully_associative_line_miss_pct",
    "opt_line_miss_pct",
];

/// Keys of the summary that fit a terminal.
pub(super) const TERMINAL: [&str; 8] = [
    "trace",
    "order",
    "stream",
    "line_miss_pct",
    "compulsory_pct",
    "opt_line_miss_pct",
    "hits_other_eye_pct",
    "hits_earlier_frame_pct",
];

/// Keys of the summary with details.
pub(super) fn short() -> Vec<&'static str> {
    let stream = ["trace", "order", "stream", "accesses", "unique_lines"];
    let hits = ["hits_other_eye_pct", "hits_earlier_frame_pct", "tile_lines"];
    [&stream[..], &MISSES, &hits].concat()
}

/// Columns of the summary.
#[rustfmt::skip]
pub fn summary<'a>() -> Vec<Column<'a, Summary<'a>>> {
    type C<'a> = Column<'a, Summary<'a>>;
    let whole = |key: &'static str, name: &'static str, of: fn(&Summary) -> u64| C::new(key, name, "", Show::Whole, of);
    let real = |key: &'static str, name: &'static str, of: fn(&Summary) -> Option<f64>| C::real(key, name, "%", 2, of);
    let of_lines = |key: &'static str, name: &'static str, of: fn(&Summary) -> Option<f64>| C::real(key, name, "% of lines", 2, of);
    let mut columns = subject_columns(|r: &Summary| &r.of);
    columns.extend([
        whole("size_bytes", "size", |r| r.cache.size_bytes),
        whole("ways", "ways", |r| r.cache.ways.into()),
        C::text("replacement", "policy", |r| r.cache.replacement.name()),
        whole("line_bytes", "line", |r| r.of.line_bytes.into()),

        whole("accesses", "accesses", |r| r.figures.accesses).about("line accesses, repeats counted"),
        whole("unique_lines", "distinct", |r| r.figures.unique_lines).about("distinct lines, summed over the caches of the level"),
        whole("frame_lines", "of frames", |r| r.figures.frame_lines).about("distinct lines of each frame, summed over frames"),
        real("both_eyes_pct", "both eyes'", |r| pct(r.figures.frame_lines_of_both_eyes, r.figures.frame_lines))
            .about("percentage of the frames' lines that tiles of both eyes use in the same frame"),
        real("earlier_frames_pct", "earlier frames'", |r| pct(r.figures.frame_lines_of_earlier_frames, r.figures.frame_lines))
            .about("percentage of the frames' lines that an earlier frame used"),

        whole("misses", "misses", |r| r.split().misses()),
        of_lines("line_miss_pct", "miss rate", |r| r.share_pct(r.split().misses())).about("misses of the configured cache, percent of line accesses"),
        whole("compulsory", "compulsory", |r| r.split().compulsory),
        whole("capacity", "capacity", |r| r.split().capacity.iter().sum()),
        whole("conflict", "conflict", |r| r.split().conflict.iter().sum()),
        whole("avoided", "avoided", |r| r.split().avoided.iter().sum()),
        of_lines("compulsory_pct", "compulsory", |r| r.share_pct(r.split().compulsory)).about("first uses"),
        of_lines("capacity_pct", "capacity", |r| r.share_pct(r.split().capacity.iter().sum()))
            .about("misses that a fully associative LRU cache of this size also has, without first uses"),
        of_lines("conflict_pct", "conflict", |r| r.share_pct(r.split().conflict.iter().sum()))
            .about("misses where the fully associative cache hits"),
        of_lines("avoided_pct", "avoided", |r| r.share_pct(r.split().avoided.iter().sum()))
            .about("hits where the fully associative cache misses: limited associativity avoids these misses"),
        C::real("conflict_net", "conflict, net", "", 0, |r| r.split().misses() as f64 - r.split().fully_associative_misses() as f64)
            .about("conflict misses minus avoided misses; negative if limited associativity helps"),
        real("capacity_other_eye_pct", "capacity, other eye's", |r| share(&r.split().capacity, Origin::OtherEye))
            .about("percentage of the capacity misses whose line was last used by the other eye"),
        real("capacity_earlier_frame_pct", "capacity, earlier frame's", |r| share(&r.split().capacity, Origin::EarlierFrame)),
        real("conflict_other_eye_pct", "conflict, other eye's", |r| share(&r.split().conflict, Origin::OtherEye))
            .about("percentage of the conflict misses whose line was last used by the other eye"),
        real("conflict_earlier_frame_pct", "conflict, earlier frame's", |r| share(&r.split().conflict, Origin::EarlierFrame)),

        whole("fully_associative_misses", "fully associative", |r| r.split().fully_associative_misses()),
        of_lines("fully_associative_line_miss_pct", "full LRU", |r| r.share_pct(r.split().fully_associative_misses()))
            .about("misses of a fully associative LRU cache of this size"),
        whole("opt_misses", "OPT", |r| r.opt_misses()),
        of_lines("opt_line_miss_pct", "full OPT", |r| r.share_pct(r.opt_misses()))
            .about("misses of a fully associative cache of this size under Belady's OPT"),
        whole("opt_ways_misses", "OPT, ways", |r| r.opt_ways_misses()),
        of_lines("opt_ways_line_miss_pct", "OPT, ways", |r| r.share_pct(r.opt_ways_misses()))
            .about("misses of the configured sets and ways under OPT"),
    ]);
    for origin in Origin::ALL {
        let name = origin.key().replace('_', " ");
        columns.push(C::real(format!("hits_{}_pct", origin.key()), name, "% of hits", 2, move |r| share(&r.split().hits(), origin))
            .about("hits of the configured cache, by the origin of the previous use"));
    }
    for origin in Origin::ALL {
        let name = origin.key().replace('_', " ");
        columns.push(C::real(format!("reuses_{}_pct", origin.key()), name, "% of reuses", 2, move |r| share(&r.figures.reuses(), origin))
            .about("all reuses, by the origin of the previous use: the hits of an infinite cache"));
    }
    columns.extend([
        C::real("eye_bytes", "lines of an eye", "bytes", 0, |r| r.figures.eye_lines().map(|lines| r.bytes(lines)))
            .about("distinct lines of an eye in a frame: where the closed form has the knee of the other eye's reuses, in orders that render one eye after the other"),
        C::real("eye_knee_bytes", "half of the other eye's", "bytes", 0, |r| r.figures.eye_knee_lines().map(|lines| r.bytes(lines as f64)))
            .about("smallest fully associative LRU cache that hits half of the reuses from the other eye"),
        C::real("row_bytes", "lines of a row", "bytes", 0, |r| r.figures.row_lines().map(|lines| r.bytes(lines)))
            .about("mean distinct lines of a row of tile pairs: where the closed form has the knee of the reuses of rows, in orders that render rows"),
        C::real("row_knee_bytes", "half of the rows'", "bytes", 0, |r| r.figures.row_knee_lines().map(|lines| r.bytes(lines as f64)))
            .about("smallest fully associative LRU cache that hits half of the reuses from another row"),
        whole("tiles", "tiles", |r| r.figures.tiles).about("tiles with line accesses"),
        C::real("tile_lines", "lines per tile", "", 1, |r| {
            let set = r.figures.working_sets.first()?;
            Some(set.lines as f64 / set.stretches as f64)
        }).about("mean number of distinct lines per work item (a tile or a pair of tiles)"),
    ]);
    columns
}

/// Columns of the curves.
#[rustfmt::skip]
pub fn curves<'a>() -> Vec<Column<'a, CurvePoint<'a>>> {
    let mut columns = subject_columns(|r: &CurvePoint| &r.of);
    columns = columns
        .text("policy", "policy", |r| r.policy)
        .whole("ways", "ways", "", |r| r.cache.ways.map(u64::from)).about("empty: fully associative")
        .whole("lines", "lines", "", |r| r.cache.lines)
        .whole("size_bytes", "size", "bytes", CurvePoint::size_bytes)
        .whole("misses", "misses", "", |r| r.accesses - r.cache.hits.iter().sum::<u64>())
        .real("line_miss_pct", "miss rate", "% of lines", 3, CurvePoint::line_miss_pct)
        .real("other_eye_pct", "from the other eye", "% of hits", 2, |r| share(&r.cache.hits, Origin::OtherEye))
        .real("earlier_frame_pct", "from an earlier frame", "% of hits", 2, |r| share(&r.cache.hits, Origin::EarlierFrame));
    columns.extend(origin_columns(|r: &CurvePoint| &r.cache.hits).into_iter().map(|mut column| {
        column.heading.key = format!("hits_{}", column.heading.key).into();
        column
    }));
    columns
}

impl CurvePoint<'_> {
    /// Size of the cache.
    pub fn size_bytes(&self) -> u64 {
        self.cache.lines * u64::from(self.of.line_bytes)
    }

    /// Misses in percent of the line accesses.
    pub fn line_miss_pct(&self) -> Option<f64> {
        let hits: u64 = self.cache.hits.iter().sum();
        pct(self.accesses - hits, self.accesses)
    }

    /// Hits whose previous use was in a tile of the other eye, percent of the line accesses.
    pub fn other_eye_pct(&self) -> Option<f64> {
        pct(self.cache.hits[Origin::OtherEye.index()], self.accesses)
    }
}

/// Columns of reuses by distance.
pub fn distances<'a>() -> Vec<Column<'a, Reuses<'a>>> {
    let mut columns = subject_columns(|r: &Reuses| &r.of);
    columns = columns
        .whole("from", "from", "lines", |r| r.distances.0)
        .about("smallest number of distinct other lines since the previous use")
        .whole("to", "to", "lines", |r| r.distances.1);
    columns.extend(origin_columns(|r: &Reuses| &r.reuses));
    columns
}

/// Columns of working sets.
#[rustfmt::skip]
pub fn working_sets<'a>() -> Vec<Column<'a, Window<'a>>> {
    subject_columns(|r: &Window| &r.of)
        .whole("tiles", "tiles", "", |r| r.set.tiles).about("length of the stretches")
        .whole("stretches", "stretches", "", |r| r.set.stretches)
        .real("lines", "lines", "lines", 1, |r| r.mean(r.set.lines))
        .real("left", "left eye's", "lines", 1, |r| r.mean(r.set.lines_of_eye[0]))
        .real("right", "right eye's", "lines", 1, |r| r.mean(r.set.lines_of_eye[1]))
        .real("both", "both eyes'", "lines", 1, |r| r.mean(r.set.lines_of_both()))
        .real("both_pct", "both eyes'", "%", 2, |r| pct(r.set.lines_of_both(), r.set.lines))
}

impl Window<'_> {
    /// Mean over the stretches.
    pub fn mean(&self, sum: u64) -> f64 {
        sum as f64 / self.set.stretches as f64
    }
}
