//! Replacement policies, one per file. A new policy is a file with a [`Policy`] (its `mod` line below) and a row
//! of the table.

mod any_cache;
mod fifo;
mod lru;
mod own;
mod random;
mod rrip;
mod ship;
mod tag_store;
mod tree_plru;

pub use any_cache::AnyCache;
pub(in crate::memory) use any_cache::boxed;
pub use lru::{AnyWays, FourWayLru, Lru, WaysOf};
pub(in crate::memory) use lru::{look_up, take_out, to_front};
pub use own::MakePolicy;
pub use tag_store::Policy;

use crate::registry::{Named, registry};
use fifo::Fifo;
use random::RandomReplacement;
use rrip::{Insertion, Rrip};
use ship::Ship;
use tag_store::TagStore;
use tree_plru::TreePlru;

registry! { PolicyRow, other = own::by_name:
    // constant   name          help                    supported ways                                 constructor
    LRU =       row("lru",       "Least recently used", ANY_WAYS,                                      |g| AnyCache::lru(g.sets, g.ways));
    FIFO =      row("fifo",      "First in, first out", ANY_WAYS,                                      |g| by(Fifo::new(g), g));
    TREE_PLRU = row("tree-plru", "Tree pseudo-LRU",     ("1, 2, 4 ... 64", tree_plru::accepts_ways),   |g| by(TreePlru::new(g), g));
    RANDOM =    row("random",    "Seeded random",       ANY_WAYS,                                      |g| by(RandomReplacement::new(g), g));
    SRRIP =     row("srrip",     "Static re-reference interval prediction",  ANY_WAYS,                 |g| by(Rrip::new(g, Insertion::Static), g));
    BRRIP =     row("brrip",     "Bimodal re-reference interval prediction", ANY_WAYS,                 |g| by(Rrip::new(g, Insertion::Bimodal), g));
    DRRIP =     row("drrip",     "SRRIP or BRRIP, by set dueling",           ANY_WAYS,                 |g| by(Rrip::new(g, Insertion::Dueling), g));
    SHIP =      row("ship",      "Signature-based hit prediction by memory region", ANY_WAYS,          |g| by(Ship::new(g), g));
}

/// A named replacement policy.
pub type Replacement = Named<PolicyRow>;

impl Default for Replacement {
    fn default() -> Self {
        Self::LRU
    }
}

/// A row of the table of replacement policies.
#[derive(Debug)]
pub struct PolicyRow {
    name: &'static str,
    help: &'static str,
    ways: WaysRule,
    build: Build,
}

/// Where a policy's cache comes from.
enum Build {
    /// The table.
    Table(fn(Geometry) -> AnyCache),
    /// The caller of this library.
    Own(&'static MakePolicy),
}

impl std::fmt::Debug for Build {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Table(_) => "Table",
            Self::Own(_) => "Own",
        })
    }
}

/// The associativities that a policy supports, as text and as a test.
pub(crate) type WaysRule = (&'static str, fn(u32) -> bool);

/// Ways are stored in a byte.
const ANY_WAYS: WaysRule = ("1 to 255", |ways| (1..=255).contains(&ways));

const fn row(
    name: &'static str,
    help: &'static str,
    ways: WaysRule,
    build: fn(Geometry) -> AnyCache,
) -> PolicyRow {
    PolicyRow {
        name,
        help,
        ways,
        build: Build::Table(build),
    }
}

impl Replacement {
    /// An empty cache.
    pub(in crate::memory) fn build(self, geometry: Geometry) -> AnyCache {
        match &self.row().build {
            Build::Table(build) => build(geometry),
            Build::Own(make) => {
                let Geometry { sets, ways, .. } = geometry;
                // The policy may count hits, so every repeat is simulated.
                boxed(TagStore::new(sets, ways, make(sets, ways), 0))
            }
        }
    }

    /// The associativities that the policy supports.
    pub(crate) fn ways_rule(self) -> WaysRule {
        self.row().ways
    }
}

/// Parameters of a policy.
#[derive(Clone, Copy, Debug)]
pub(in crate::memory) struct Geometry {
    /// A power of two.
    pub(in crate::memory) sets: u32,
    pub(in crate::memory) ways: u32,
    pub(in crate::memory) seed: u64,
}

impl Geometry {
    fn lines(self) -> usize {
        self.sets as usize * self.ways as usize
    }
}

/// A cache with a policy of this folder, for which a repeated look-up of a line changes nothing.
fn by(policy: impl Policy + 'static, geometry: Geometry) -> AnyCache {
    boxed(TagStore::new(geometry.sets, geometry.ways, policy, 1))
}
