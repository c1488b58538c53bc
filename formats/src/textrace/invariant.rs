//! The invariants of every tile, independent of writer and encoding.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{Draw, NO_GROUP, QuadRecord, Tile, UvGroup};
use crate::error::{Broken, ensure};

/// Quads along an edge of a tile.
pub const TILE_QUADS: u8 = 8;

/// Position of a quad on the Morton curve of its tile, 0 to 63 (x in the even bits).
pub const fn quad_morton(x: u8, y: u8) -> u8 {
    const fn spread(v: u8) -> u8 {
        (v & 1) | (v & 2) << 1 | (v & 4) << 2
    }
    spread(x) | spread(y) << 1
}

/// Column and row of the quad at each position of the curve.
pub(super) const QUAD_POSITIONS: [(u8, u8); 64] = {
    let mut positions = [(0, 0); 64];
    let mut y = 0;
    while y < 8 {
        let mut x = 0;
        while x < 8 {
            #[allow(clippy::indexing_slicing, reason = "evaluated when compiled")]
            {
                positions[quad_morton(x, y) as usize] = (x, y);
            }
            x += 1;
        }
        y += 1;
    }
    positions
};

/// Checks a tile against the draw table.
pub(super) fn check(draws: &[Draw], tile: &Tile) -> Result<(), Broken> {
    let mut records = tile.records.as_slice();
    let mut first = 0u32;
    let mut previous: Option<u32> = None;
    for (index, run) in tile.runs.iter().enumerate() {
        let broken =
            |expected: String, found: String| Broken::new(format!("run {index}"), expected, found);
        let draw = usize::try_from(run.draw)
            .ok()
            .and_then(|draw| draws.get(draw))
            .ok_or_else(|| {
                broken(
                    format!("a draw below {}", draws.len()),
                    run.draw.to_string(),
                )
            })?;
        let in_draw = run
            .primitive
            .checked_sub(draw.first_primitive)
            .is_some_and(|number| number < draw.primitives);
        if !in_draw {
            let end = draw.first_primitive.wrapping_add(draw.primitives);
            let expected = format!(
                "a primitive of draw {}: {}..{end}",
                run.draw, draw.first_primitive
            );
            return Err(broken(expected, run.primitive.to_string()));
        }
        if let Some(previous) = previous.filter(|previous| run.primitive <= *previous) {
            let expected = format!("a primitive above {previous}");
            return Err(broken(expected, run.primitive.to_string()));
        }
        previous = Some(run.primitive);
        if run.first != first || run.count == 0 {
            let expected = format!("records that start at {first}, at least one");
            return Err(broken(
                expected,
                format!("{} from {}", run.count, run.first),
            ));
        }
        let here = usize::try_from(run.count)
            .ok()
            .and_then(|count| records.split_at_checked(count));
        let Some((of_run, rest)) = here else {
            let expected = format!("at most {} records", records.len());
            return Err(broken(expected, run.count.to_string()));
        };
        check_records(draw, first, of_run)?;
        records = rest;
        first = first.saturating_add(run.count);
    }
    if records.is_empty() {
        return Ok(());
    }
    let expected = format!("{} records in all", tile.records.len());
    Err(Broken::new("runs", expected, first))
}

fn check_records(draw: &Draw, first: u32, records: &[QuadRecord]) -> Result<(), Broken> {
    if draw.groups.iter().any(UvGroup::has_operands) {
        check_operands(draw, first, records)?;
    }
    let mut previous = 0;
    for (index, record) in records.iter().enumerate() {
        let morton = quad_morton(record.x, record.y);
        let holds = record.x < TILE_QUADS
            && record.y < TILE_QUADS
            && (1..=15).contains(&record.mask)
            && (usize::from(record.group) < draw.groups.len() || record.group == NO_GROUP)
            && morton >= previous;
        if !holds {
            let number = u64::from(first) + index as u64;
            return Err(explain(draw, number, record, previous));
        }
        previous = morton;
    }
    Ok(())
}

/// Checks that each record of operands directly precedes its record, with the same position and mask.
fn check_operands(draw: &Draw, first: u32, records: &[QuadRecord]) -> Result<(), Broken> {
    let mut operands: Option<&QuadRecord> = None;
    let paired = |operands: &QuadRecord, record: &QuadRecord| {
        let place = |r: &QuadRecord| (r.x, r.y, r.mask);
        place(operands) == place(record) && operands.group.checked_add(1) == Some(record.group)
    };
    let require = |holds: bool, index: usize| {
        ensure(
            holds,
            format_args!("record {}", u64::from(first) + index as u64),
            "operands right before the record of the next group in the same lanes",
            "one without the other",
        )
    };
    for (index, record) in records.iter().enumerate() {
        let asks = draw
            .groups
            .get(usize::from(record.group))
            .is_some_and(UvGroup::has_operands);
        let holds = match operands {
            Some(operands) => paired(operands, record),
            None => !asks,
        };
        require(holds, index)?;
        operands = draw.is_operands(record.group).then_some(record);
    }
    require(operands.is_none(), records.len())
}

#[cold]
fn explain(draw: &Draw, number: u64, record: &QuadRecord, previous: u8) -> Broken {
    let (expected, found) = if record.x >= TILE_QUADS || record.y >= TILE_QUADS {
        let expected = format!("x and y below {TILE_QUADS}");
        (expected, format!("({}, {})", record.x, record.y))
    } else if !(1..=15).contains(&record.mask) {
        ("a mask of 1 to 15".to_owned(), record.mask.to_string())
    } else if usize::from(record.group) >= draw.groups.len() && record.group != NO_GROUP {
        let expected = format!("a group below {} or {NO_GROUP}", draw.groups.len());
        (expected, record.group.to_string())
    } else {
        let expected = format!("Morton order: at least position {previous}");
        (expected, quad_morton(record.x, record.y).to_string())
    };
    Broken::new(format!("record {number}"), expected, found)
}
