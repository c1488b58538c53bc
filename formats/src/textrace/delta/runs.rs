//! Encodes the runs of a tile as variable-length numbers.

use crate::parse::{Cursor, Parsed};
use crate::textrace::PrimitiveRun;
use crate::varint::put;

/// Writes each run: `(primitive - previous primitive - 1) * 2 + draw changed`, the draw if it changed, and
/// the number of records minus one.
pub(super) fn encode(runs: &[PrimitiveRun], bytes: &mut Vec<u8>) {
    let mut next_primitive = 0u64;
    let mut draw = 0;
    for run in runs {
        let step = u64::from(run.primitive) - next_primitive;
        let changed = run.draw != draw;
        put(step << 1 | u64::from(changed), bytes);
        if changed {
            put(u64::from(run.draw), bytes);
        }
        put(u64::from(run.count - 1), bytes);
        next_primitive = u64::from(run.primitive) + 1;
        draw = run.draw;
    }
}

/// Reads runs that must have `record_count` records in total.
pub(super) fn decode<'a>(
    run_count: u32,
    record_count: u32,
    input: &'a [u8],
    runs: &mut Vec<PrimitiveRun>,
) -> Parsed<'a, ()> {
    let mut input = Cursor::new(input);
    let mut next_primitive = 0u64;
    let mut draw = 0;
    let mut first = 0u32;
    for _ in 0..run_count {
        let at = input;
        let head = input.number("a primitive step", 33)?;
        let primitive = next_primitive + (head >> 1);
        let primitive = u32::try_from(primitive)
            .map_err(|_| at.fault("a primitive number below 2^32", primitive))?;
        if head & 1 == 1 {
            draw = input.number_u32("a draw")?;
        }
        let at = input;
        let count = input.number_u32("a record count")?;
        let count = count
            .checked_add(1)
            .ok_or_else(|| at.fault("a record count below 2^32", count))?;
        let left = record_count - first;
        let expected = format_args!("a run of at most {left} records");
        at.check(count <= left, expected, count)?;
        runs.push(PrimitiveRun {
            primitive,
            draw,
            first,
            count,
        });
        first += count;
        next_primitive = u64::from(primitive) + 1;
    }
    let expected = format_args!("runs of {record_count} records in all");
    input.check(first == record_count, expected, first)?;
    Ok((input.rest(), ()))
}
