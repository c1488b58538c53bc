//! The runs of a tile as variable-length integers (LEB128).

use crate::parse::{Fault, Parsed, ensure};
use crate::textrace::PrimitiveRun;

/// Writes each run: `(primitive - previous primitive - 1) * 2 + draw changed`, the draw if it
/// changed, and the number of records less one.
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

/// Reads runs that must hold `record_count` records together.
pub(super) fn decode<'a>(
    run_count: u32,
    record_count: u32,
    input: &'a [u8],
    runs: &mut Vec<PrimitiveRun>,
) -> Parsed<'a, ()> {
    let mut rest = input;
    let mut next_primitive = 0u64;
    let mut draw = 0;
    let mut first = 0u32;
    for _ in 0..run_count {
        let (after, head) = take(rest)?;
        let narrow = |value: u64| {
            let found = move || nom::Err::Failure(Fault::new(rest, "a 32-bit number", value));
            u32::try_from(value).map_err(|_| found())
        };
        let primitive = narrow(next_primitive + (head >> 1))?;
        let mut after = after;
        if head & 1 == 1 {
            let (next, value) = take(after)?;
            draw = narrow(value)?;
            after = next;
        }
        let (after, count) = take(after)?;
        let count = narrow(count.saturating_add(1))?;
        let left = record_count - first;
        ensure(
            rest,
            count <= left,
            || format!("a run of at most {left} records"),
            count,
        )?;
        runs.push(PrimitiveRun {
            primitive,
            draw,
            first,
            count,
        });
        first += count;
        next_primitive = u64::from(primitive) + 1;
        rest = after;
    }
    ensure(
        rest,
        first == record_count,
        || format!("runs of {record_count} records in all"),
        first,
    )?;
    Ok((rest, ()))
}

fn put(mut value: u64, bytes: &mut Vec<u8>) {
    while value >= 0x80 {
        bytes.push(value.to_le_bytes()[0] | 0x80);
        value >>= 7;
    }
    bytes.push(value.to_le_bytes()[0]);
}

fn take(input: &[u8]) -> Parsed<'_, u64> {
    let mut value = 0u64;
    for (index, byte) in input.iter().take(5).enumerate() {
        value |= u64::from(byte & 0x7f) << (7 * index);
        if byte & 0x80 == 0 {
            return Ok((input.get(index + 1..).unwrap_or_default(), value));
        }
    }
    Err(nom::Err::Failure(Fault::new(
        input,
        "a variable-length number of at most 5 bytes",
        format_args!("{:02x?}", input.get(..5).unwrap_or(input)),
    )))
}
