//! The tables' rows and their columns, a line each.

use crate::config::LevelConfig;
use crate::locality::{
    ByOrigin, CacheHits, Figures, MissSplit, Origin, Sequence, Stream, WorkingSet,
};
use crate::report::columns::{Column, Show};

/// What a row is about.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// Label of the trace.
    pub trace: &'a str,
    /// What puts the accesses one after another.
    pub order: Sequence,
    /// The stream.
    pub stream: Stream,
    /// Bytes of a line.
    pub line_bytes: u32,
}

/// A stream and the cache that it goes to.
#[derive(Clone, Copy, Debug)]
pub struct Summary<'a> {
    /// Whose.
    pub of: Subject<'a>,
    /// The configured cache.
    pub cache: &'a LevelConfig,
    /// What was found.
    pub figures: &'a Figures,
}

/// A cache of a curve.
#[derive(Clone, Copy, Debug)]
pub struct CurvePoint<'a> {
    /// Whose.
    pub of: Subject<'a>,
    /// `lru` or `opt`.
    pub policy: &'static str,
    /// Size and hits.
    pub cache: CacheHits,
    /// Lines asked for.
    pub accesses: u64,
}

/// Reuses at some distances.
#[derive(Clone, Copy, Debug)]
pub struct Reuses<'a> {
    /// Whose.
    pub of: Subject<'a>,
    /// First and last distance.
    pub distances: (u64, u64),
    /// By where the use before was.
    pub reuses: ByOrigin,
}

/// The working set of a stretch length.
#[derive(Clone, Copy, Debug)]
pub struct Window<'a> {
    /// Whose.
    pub of: Subject<'a>,
    /// Sums over stretches.
    pub set: WorkingSet,
}

fn pct(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| 100.0 * part as f64 / whole as f64)
}

/// Share of one origin, percent of all.
fn share(counts: &ByOrigin, origin: Origin) -> Option<f64> {
    pct(counts[origin.index()], counts.iter().sum())
}

impl Summary<'_> {
    fn split(&self) -> &MissSplit {
        &self.figures.split
    }

    /// A count, percent of the lines asked for.
    #[must_use]
    pub fn share_pct(&self, count: u64) -> Option<f64> {
        pct(count, self.figures.accesses)
    }

    /// Misses of a fully associative cache of the size under OPT.
    #[must_use]
    pub fn opt_misses(&self) -> u64 {
        self.figures.misses(&self.figures.opt_of_size())
    }

    /// Misses of the geometry under OPT.
    #[must_use]
    pub fn opt_ways_misses(&self) -> u64 {
        self.figures.misses(&self.figures.opt_of_geometry)
    }
}

/// The columns that say what a row is about.
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

/// Columns of counts by where the use before was.
fn origin_columns<'a, R: 'a>(of: fn(&R) -> &ByOrigin) -> Vec<Column<'a, R>> {
    let column = |origin: Origin| {
        let name = origin.key().replace('_', " ");
        Column::new(origin.key(), name, "", Show::Whole, move |r: &R| {
            of(r)[origin.index()]
        })
    };
    Origin::ALL.into_iter().map(column).collect()
}

/// Keys of the summary for a terminal.
pub const SHORT: [&str; 15] = [
    "trace",
    "order",
    "stream",
    "accesses",
    "unique_lines",
    "miss_pct",
    "compulsory_pct",
    "capacity_pct",
    "conflict_pct",
    "spared_pct",
    "fully_associative_miss_pct",
    "opt_miss_pct",
    "hits.other_eye_pct",
    "hits.earlier_frame_pct",
    "tile_lines",
];

/// Columns of the summary.
#[must_use]
#[rustfmt::skip]
pub fn summary<'a>() -> Vec<Column<'a, Summary<'a>>> {
    type C<'a> = Column<'a, Summary<'a>>;
    let whole = |key: &'static str, name: &'static str, of: fn(&Summary) -> u64| C::new(key, name, "", Show::Whole, of);
    let real = |key: &'static str, name: &'static str, of: fn(&Summary) -> Option<f64>| C::real(key, name, "%", 2, of);
    let mut columns = subject_columns(|r: &Summary| &r.of);
    columns.extend([
        whole("size_bytes", "size", |r| r.cache.size_bytes),
        whole("ways", "ways", |r| r.cache.ways.into()),
        C::text("replacement", "policy", |r| r.cache.replacement.name()),
        whole("line_bytes", "line", |r| r.of.line_bytes.into()),

        whole("accesses", "asked for", |r| r.figures.accesses).about("lines asked for, repeats counted"),
        whole("unique_lines", "distinct", |r| r.figures.unique_lines).about("distinct lines, summed over the caches of the level"),
        whole("frame_lines", "of frames", |r| r.figures.frame_lines).about("distinct lines of each frame, summed over frames"),
        real("both_eyes_pct", "both eyes'", |r| pct(r.figures.frame_lines_of_both_eyes, r.figures.frame_lines))
            .about("of the frames' lines, those that both eyes' tiles use in the frame"),
        real("earlier_frames_pct", "earlier frames'", |r| pct(r.figures.frame_lines_of_earlier_frames, r.figures.frame_lines))
            .about("of the frames' lines, those that an earlier frame used"),

        whole("misses", "misses", |r| r.split().misses()),
        real("miss_pct", "miss rate", |r| r.share_pct(r.split().misses())).about("misses of the configured cache, of the lines asked for"),
        whole("compulsory", "compulsory", |r| r.split().compulsory),
        whole("capacity", "capacity", |r| r.split().capacity.iter().sum()),
        whole("conflict", "conflict", |r| r.split().conflict.iter().sum()),
        whole("spared", "spared", |r| r.split().spared.iter().sum()),
        real("compulsory_pct", "compulsory", |r| r.share_pct(r.split().compulsory)).about("first uses"),
        real("capacity_pct", "capacity", |r| r.share_pct(r.split().capacity.iter().sum()))
            .about("further misses where a fully associative LRU cache of the size misses, too"),
        real("conflict_pct", "conflict", |r| r.share_pct(r.split().conflict.iter().sum()))
            .about("misses where the fully associative cache hits"),
        real("spared_pct", "spared", |r| r.share_pct(r.split().spared.iter().sum()))
            .about("hits where the fully associative cache misses: conflicts that helped"),
        C::real("conflict_net", "conflict, net", "", 0, |r| r.split().misses() as f64 - r.split().fully_associative_misses() as f64)
            .about("conflict less spared: negative where sets help"),
        real("capacity_other_eye_pct", "capacity, other eye's", |r| share(&r.split().capacity, Origin::OtherEye))
            .about("of the capacity misses, those of lines that the other eye used last"),
        real("capacity_earlier_frame_pct", "capacity, earlier frame's", |r| share(&r.split().capacity, Origin::EarlierFrame)),
        real("conflict_other_eye_pct", "conflict, other eye's", |r| share(&r.split().conflict, Origin::OtherEye))
            .about("likewise of the conflict misses"),
        real("conflict_earlier_frame_pct", "conflict, earlier frame's", |r| share(&r.split().conflict, Origin::EarlierFrame)),

        whole("fully_associative_misses", "fully associative", |r| r.split().fully_associative_misses()),
        real("fully_associative_miss_pct", "full LRU", |r| r.share_pct(r.split().fully_associative_misses()))
            .about("misses of a fully associative LRU cache of the size"),
        whole("opt_misses", "OPT", |r| r.opt_misses()),
        real("opt_miss_pct", "full OPT", |r| r.share_pct(r.opt_misses()))
            .about("misses of a fully associative cache of the size under Belady's OPT"),
        whole("opt_ways_misses", "OPT, ways", |r| r.opt_ways_misses()),
        real("opt_ways_miss_pct", "OPT, ways", |r| r.share_pct(r.opt_ways_misses()))
            .about("misses of the configured sets and ways under OPT"),
    ]);
    for origin in Origin::ALL {
        let name = origin.key().replace('_', " ");
        columns.push(C::real(format!("hits.{}_pct", origin.key()), name, "% of hits", 2, move |r| share(&r.split().hits(), origin))
            .about("hits of the configured cache, by where the use before was"));
    }
    for origin in Origin::ALL {
        let name = origin.key().replace('_', " ");
        columns.push(C::real(format!("reuses.{}_pct", origin.key()), name, "% of reuses", 2, move |r| share(&r.figures.reuses(), origin))
            .about("all reuses likewise: hits of a cache that forgets nothing"));
    }
    columns.extend([
        whole("tiles", "tiles", |r| r.figures.tiles).about("tiles in which lines were asked for"),
        C::real("tile_lines", "lines a tile", "", 1, |r| {
            let set = r.figures.working_sets.first()?;
            Some(set.lines as f64 / set.stretches as f64)
        }).about("mean distinct lines while a tile, or a pair of tiles, is worked on"),
    ]);
    columns
}

/// Columns of the curves.
#[must_use]
#[rustfmt::skip]
pub fn curves<'a>() -> Vec<Column<'a, CurvePoint<'a>>> {
    type C<'a> = Column<'a, CurvePoint<'a>>;
    let mut columns = subject_columns(|r: &CurvePoint| &r.of);
    columns.extend([
        C::text("policy", "policy", |r| r.policy),
        C::new("ways", "ways", "", Show::Whole, |r| r.cache.ways.map(u64::from)).about("empty: fully associative"),
        C::new("lines", "lines", "", Show::Whole, |r| r.cache.lines),
        C::new("size_bytes", "size", "bytes", Show::Whole, CurvePoint::size_bytes),
        C::new("misses", "misses", "", Show::Whole, |r| r.accesses - r.cache.hits.iter().sum::<u64>()),
        C::real("miss_pct", "miss rate", "%", 3, CurvePoint::miss_pct),
        C::real("other_eye_pct", "from the other eye", "% of hits", 2, |r| share(&r.cache.hits, Origin::OtherEye)),
        C::real("earlier_frame_pct", "from an earlier frame", "% of hits", 2, |r| share(&r.cache.hits, Origin::EarlierFrame)),
    ]);
    columns.extend(origin_columns(|r: &CurvePoint| &r.cache.hits).into_iter().map(|mut column| {
        column.heading.key = format!("hits.{}", column.heading.key).into();
        column
    }));
    columns
}

impl CurvePoint<'_> {
    /// Size of the cache.
    #[must_use]
    pub fn size_bytes(&self) -> u64 {
        self.cache.lines * u64::from(self.of.line_bytes)
    }

    /// Misses, percent of the lines asked for.
    #[must_use]
    pub fn miss_pct(&self) -> Option<f64> {
        let hits: u64 = self.cache.hits.iter().sum();
        pct(self.accesses - hits, self.accesses)
    }

    /// Hits whose use before was in a tile of the other eye, percent of the lines asked for.
    #[must_use]
    pub fn other_eye_pct(&self) -> Option<f64> {
        pct(self.cache.hits[Origin::OtherEye.index()], self.accesses)
    }
}

/// Columns of reuses by distance.
#[must_use]
pub fn distances<'a>() -> Vec<Column<'a, Reuses<'a>>> {
    let mut columns = subject_columns(|r: &Reuses| &r.of);
    columns.extend([
        Column::new("from", "from", "lines", Show::Whole, |r: &Reuses| {
            r.distances.0
        })
        .about("distinct other lines used in between, from"),
        Column::new("to", "to", "lines", Show::Whole, |r: &Reuses| r.distances.1),
    ]);
    columns.extend(origin_columns(|r: &Reuses| &r.reuses));
    columns
}

/// Columns of working sets.
#[must_use]
#[rustfmt::skip]
pub fn working_sets<'a>() -> Vec<Column<'a, Window<'a>>> {
    type C<'a> = Column<'a, Window<'a>>;
    let mean = |key: &'static str, name: &'static str, of: fn(&WorkingSet) -> u64| {
        C::real(key, name, "lines", 1, move |r: &Window| r.mean(of(&r.set)))
    };
    let mut columns = subject_columns(|r: &Window| &r.of);
    columns.extend([
        C::new("tiles", "tiles", "", Show::Whole, |r| r.set.tiles).about("length of the stretches"),
        C::new("stretches", "stretches", "", Show::Whole, |r| r.set.stretches),
        mean("lines", "lines", |s| s.lines),
        mean("left", "left eye's", |s| s.lines_of_eye[0]),
        mean("right", "right eye's", |s| s.lines_of_eye[1]),
        mean("both", "both eyes'", WorkingSet::lines_of_both),
        C::real("both_pct", "both eyes'", "%", 2, |r| pct(r.set.lines_of_both(), r.set.lines)),
    ]);
    columns
}

impl Window<'_> {
    /// Mean over the stretches.
    #[must_use]
    pub fn mean(&self, sum: u64) -> f64 {
        sum as f64 / self.set.stretches as f64
    }
}
