//! Level of detail of a quad.

use super::LodFormula;
use crate::textrace::{QuadRecord, SUBTEXELS};

/// llvmpipe's base-2 logarithm: the exponent plus the mantissa minus one. It is exact at powers of two and
/// at most 0.086 too low in between.
#[inline]
pub fn fast_log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits >> 23 & 0xff) as f32 - 127.0;
    let mantissa = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000);
    exponent + (mantissa - 1.0)
}

/// Level of detail of a quad in a texture whose level 0 has `size` texels, without bias. Computed from the
/// derivatives of the top-left lane, in f32 with one rounding per operation.
pub fn quad_lod(record: &QuadRecord, extent: [u32; 2], size: [u32; 2], formula: LodFormula) -> f32 {
    let texels = |derivative: [i32; 2]| {
        [0, 1].map(|a| {
            let scale = size[a] as f32 / (SUBTEXELS as f32 * extent[a] as f32);
            derivative[a] as f32 * scale
        })
    };
    let dx = texels(record.dx);
    let dy = texels(record.dy);
    let squared = |d: [f32; 2]| d[0] * d[0] + d[1] * d[1];
    match formula {
        LodFormula::Llvmpipe => 0.5 * fast_log2(squared(dx).max(squared(dy))),
        LodFormula::Exact | LodFormula::PerLane => 0.5 * squared(dx).max(squared(dy)).log2(),
        LodFormula::Softpipe => {
            let largest = |d: [f32; 2]| d[0].abs().max(d[1].abs());
            largest(dx).max(largest(dy)).log2()
        }
    }
}

/// The record with one lane's own derivatives, for [`LodFormula::PerLane`]: the differences along its row
/// and column of the quad. Coordinates must still be taken from the original record.
pub fn lane_record(record: &QuadRecord, lane: u32) -> QuadRecord {
    let own = |derivative: [i32; 2], other: bool| {
        [0, 1].map(|a| derivative[a].wrapping_add(if other { record.cross[a] } else { 0 }))
    };
    QuadRecord {
        dx: own(record.dx, lane >> 1 & 1 == 1),
        dy: own(record.dy, lane & 1 == 1),
        ..*record
    }
}
