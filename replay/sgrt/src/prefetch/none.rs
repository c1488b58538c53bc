//! Fetches nothing ahead.

use super::PrefetchRow;

pub(super) const ROW: PrefetchRow = PrefetchRow {
    name: "none",
    help: "Nothing is fetched ahead",
    build: None,
};
