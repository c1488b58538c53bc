//! The plainest implementation of each figure.

use super::Access;
use crate::{ByOrigin, MissSplit, Origin, Rows, StreamCache, WorkingSet};
use formats::view::Eye;
use sim::memory::AnyCache;
use std::collections::{HashMap, HashSet};

/// Location of the previous use, for every access.
pub fn origins(stream: &[Access]) -> Vec<Option<Origin>> {
    let mut last: HashMap<u32, Access> = HashMap::new();
    let origin = |access: &Access| {
        let before = last.insert(access.line, *access)?;
        let eyes = [before.place.eye, access.place.eye];
        Some(if before.frame != access.frame {
            Origin::EarlierFrame
        } else if eyes == [Some(Eye::Left), Some(Eye::Right)]
            || eyes == [Some(Eye::Right), Some(Eye::Left)]
        {
            Origin::OtherEye
        } else if (before.place.tile, eyes[0]) != (access.place.tile, eyes[1]) {
            Origin::OtherTile
        } else {
            Origin::SameTile
        })
    };
    stream.iter().map(origin).collect()
}

/// The accesses marked in `which`, by location of the previous use.
pub(crate) fn by_origin(origins: &[Option<Origin>], which: &[bool]) -> ByOrigin {
    let mut counts = ByOrigin::default();
    for (origin, _) in origins.iter().zip(which).filter(|(_, which)| **which) {
        counts[origin.expect("a first use cannot hit").index()] += 1;
    }
    counts
}

/// Stack distances, from a list in order of last use.
pub fn distances(lines: &[u32]) -> Vec<Option<u64>> {
    let mut stack: Vec<u32> = Vec::new();
    let distance = |line: &u32| {
        let depth = stack.iter().position(|other| other == line);
        if let Some(depth) = depth {
            stack.remove(depth);
        }
        stack.insert(0, *line);
        depth.map(|depth| depth as u64)
    };
    lines.iter().map(distance).collect()
}

/// Hits of an LRU cache.
pub fn lru(lines: &[u32], sets: u32, ways: u32) -> Vec<bool> {
    let mut cache: Vec<Vec<u32>> = vec![Vec::new(); sets as usize];
    let access = |line: &u32| {
        let set = &mut cache[(line % sets) as usize];
        let found = set.iter().position(|other| other == line);
        if let Some(at) = found {
            set.remove(at);
        } else if set.len() == ways as usize {
            set.pop();
        }
        set.insert(0, *line);
        found.is_some()
    };
    lines.iter().map(access).collect()
}

/// Hits of Belady's cache: a miss evicts the line whose next use is furthest in the future.
pub fn opt(lines: &[u32], sets: u32, ways: u32) -> Vec<bool> {
    let mut cache: Vec<Vec<u32>> = vec![Vec::new(); sets as usize];
    let access = |(now, line): (usize, &u32)| {
        let set = &mut cache[(line % sets) as usize];
        if set.contains(line) {
            return true;
        }
        if set.len() == ways as usize {
            let next = |line: &u32| lines[now..].iter().position(|other| other == line);
            let furthest = set
                .iter()
                .enumerate()
                .max_by_key(|(_, line)| next(line).unwrap_or(usize::MAX));
            let (furthest, _) = furthest.unwrap();
            set.remove(furthest);
        }
        set.push(*line);
        false
    };
    lines.iter().enumerate().map(access).collect()
}

/// Hits of the configured cache.
pub fn policy(lines: &[u32], of: StreamCache) -> Vec<bool> {
    let cache = AnyCache::build(&of.cache, of.level, of.line_bytes, of.seed);
    let mut cache = cache.unwrap().into_box();
    lines.iter().map(|&line| cache.access(line)).collect()
}

/// The split of a cache's misses, given its hits and those of the fully associative cache.
pub fn split(origins: &[Option<Origin>], own: &[bool], all: &[bool]) -> MissSplit {
    let pairs = || own.iter().zip(all).zip(origins);
    let count = |of_own: bool, of_all: bool| {
        let which: Vec<bool> = pairs()
            .map(|((own, all), origin)| (*own, *all) == (of_own, of_all) && origin.is_some())
            .collect();
        by_origin(origins, &which)
    };
    MissSplit {
        compulsory: origins.iter().filter(|origin| origin.is_none()).count() as u64,
        capacity: count(false, false),
        conflict: count(false, true),
        avoided: count(true, false),
        hits_of_both: count(true, true),
    }
}

/// Distinct lines of all windows of tiles, enumerated.
pub fn working_sets(stream: &[Access]) -> Vec<WorkingSet> {
    // The accesses of the item at each tile's time.
    let mut clock: Vec<&[Access]> = Vec::new();
    let new_item = |a: &Access, b: &Access| (a.frame, a.place.item) == (b.frame, b.place.item);
    for item in stream.chunk_by(new_item) {
        for _ in 0..item[0].place.tiles {
            clock.push(item);
        }
    }
    let mut curve = Vec::new();
    let mut length = 1;
    while length <= clock.len() {
        let mut point = WorkingSet {
            tiles: length as u64,
            ..WorkingSet::default()
        };
        for stretch in clock.windows(length) {
            let lines = |wanted: &dyn Fn(Option<Eye>) -> bool| {
                let accesses = stretch.iter().flat_map(|item| item.iter());
                let wanted = accesses.filter(|access| wanted(access.place.eye));
                wanted.map(|a| a.line).collect::<HashSet<u32>>().len() as u64
            };
            point.stretches += 1;
            point.lines += lines(&|_| true);
            point.lines_of_eye[0] += lines(&|eye| eye == Some(Eye::Left));
            point.lines_of_eye[1] += lines(&|eye| eye == Some(Eye::Right));
            point.lines_of_either += lines(&|eye| eye.is_some());
        }
        curve.push(point);
        length *= 2;
    }
    curve
}

/// Distinct lines per frame, of both eyes in a frame, and of earlier frames as well.
pub fn frame_lines(stream: &[Access]) -> [u64; 3] {
    let (mut counts, mut earlier) = ([0; 3], HashSet::new());
    for frame in stream.chunk_by(|a, b| a.frame == b.frame) {
        let lines = |eye: Option<Eye>| -> HashSet<u32> {
            let of_eye = frame.iter().filter(|a| eye.is_none() || a.place.eye == eye);
            of_eye.map(|access| access.line).collect()
        };
        let [all, left, right] = [None, Some(Eye::Left), Some(Eye::Right)].map(lines);
        counts[0] += all.len() as u64;
        counts[1] += left.intersection(&right).count() as u64;
        counts[2] += all.intersection(&earlier).count() as u64;
        earlier.extend(all);
    }
    counts
}

/// Rows with look-ups, distinct lines of each row, and the reuses from another row of the frame, by distance.
pub fn rows(stream: &[Access]) -> Rows {
    let lines: Vec<u32> = stream.iter().map(|access| access.line).collect();
    let in_rows = || {
        stream
            .iter()
            .filter_map(|a| Some((a.frame, a.place.row?, a.line)))
    };
    let seen: HashSet<(u32, u32)> = in_rows().map(|(frame, row, _)| (frame, row)).collect();
    let lines_of_rows: HashSet<(u32, u32, u32)> = in_rows().collect();
    let mut distances_of_rows: Vec<u64> = Vec::new();
    let mut last: HashMap<u32, Access> = HashMap::new();
    for (access, distance) in stream.iter().zip(distances(&lines)) {
        let before = last.insert(access.line, *access);
        let (Some(before), Some(distance)) = (before, distance) else {
            continue;
        };
        let rows = before.place.row.zip(access.place.row);
        if before.frame == access.frame && rows.is_some_and(|(a, b)| a != b) {
            let distance = distance as usize;
            if distances_of_rows.len() <= distance {
                distances_of_rows.resize(distance + 1, 0);
            }
            distances_of_rows[distance] += 1;
        }
    }
    Rows {
        rows: seen.len() as u64,
        row_lines: lines_of_rows.len() as u64,
        distances: distances_of_rows,
    }
}
