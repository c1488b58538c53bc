//! Depths in blocks of BC4.
//!
//! A stored depth is never below the one that it stands for. What an exact map leaves in the light stays
//! lit, so that the error of a block is light where there was shadow, and surfaces do not shade themselves.

/// Units of a 16-bit value in one unit of an endpoint.
const UNIT: u16 = 257;

/// The value of each code, rounded up to 16 bits.
fn levels([first, second]: [u8; 2]) -> [u16; 8] {
    let steps = if first > second { 7 } else { 5 };
    std::array::from_fn(|code| {
        let part = match code as u32 {
            0 => 0,
            1 => steps,
            code if code <= steps => code - 1,
            6 => return 0,
            _ => return u16::MAX,
        };
        let sum = u32::from(first) * (steps - part) + u32::from(second) * part;
        (u32::from(UNIT) * sum).div_ceil(steps) as u16
    })
}

/// The block with these endpoints and the sum of its squared errors; `None` if no level reaches a depth.
fn block(ends: [u8; 2], depths: &[u16; 16]) -> Option<(u64, [u8; 8])> {
    let levels = levels(ends);
    let (mut error, mut bits) = (0, u64::from(u16::from_le_bytes(ends)));
    for (texel, &depth) in depths.iter().enumerate() {
        let not_below = (levels.iter().enumerate()).filter(|&(_, &level)| level >= depth);
        let (code, level) = not_below.min_by_key(|&(_, &level)| level)?;
        error += u64::from(level - depth).pow(2);
        bits |= (code as u64) << (16 + 3 * texel);
    }
    Some((error, bits.to_le_bytes()))
}

/// Encodes 4x4 depths. The endpoints enclose the depths; where two surfaces meet, every pair of levels is also
/// tried for the farthest depths of the two.
pub fn encode(depths: &[u16; 16]) -> [u8; 8] {
    let mut sorted = *depths;
    sorted.sort_unstable();
    // The farthest depth, where nothing was drawn, has a code of its own.
    let drawn = &sorted[..sorted.partition_point(|&depth| depth < u16::MAX)];
    let (Some(&nearest), Some(&farthest)) = (drawn.first(), drawn.last()) else {
        return [u8::MAX; 8];
    };
    let mut best = block([u8::MAX, (nearest / UNIT) as u8], depths);
    let mut place = |near: u16, levels: [u8; 2], steps: u8| {
        let step = f32::from(farthest - near) / f32::from(UNIT) / f32::from(levels[1] - levels[0]);
        let first = f32::from(near) / f32::from(UNIT) - f32::from(levels[0]) * step;
        let last = (first + f32::from(steps) * step).ceil() as u8;
        for first in [first.floor(), first.ceil()].map(|first| first as u8) {
            let ends = if steps == 7 {
                [last, first]
            } else {
                [first, last]
            };
            let found = block(ends, depths);
            best = best
                .into_iter()
                .chain(found)
                .min_by_key(|&(error, _)| error);
        }
    };
    let gap = (drawn.windows(2)).max_by_key(|pair| pair[1] - pair[0]);
    let gap = gap.filter(|gap| gap[1] - gap[0] > (farthest - nearest) / 4);
    for steps in [7, 5] {
        place(nearest, [0, steps], steps);
        for pair in (1..=steps).flat_map(|far| (0..far).map(move |near| [near, far])) {
            if let Some(gap) = gap {
                place(gap[0], pair, steps);
            }
        }
    }
    // The first block reaches every depth.
    best.map_or([u8::MAX; 8], |(_, block)| block)
}

/// The 4x4 depths of a block, rounded up to 16 bits.
pub fn decode(block: [u8; 8]) -> [u16; 16] {
    let levels = levels([block[0], block[1]]);
    let codes = u64::from_le_bytes(block) >> 16;
    std::array::from_fn(|texel| levels[(codes >> (3 * texel) & 7) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers below 2^32 of a linear congruential generator.
    fn numbers(mut state: u64) -> impl FnMut(u32) -> u32 {
        move |end| {
            state = (state.wrapping_mul(6_364_136_223_846_793_005))
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) % u64::from(end)) as u32
        }
    }

    #[test]
    fn blocks_decode_as_the_format_says() {
        let mut number = numbers(1);
        for _ in 0..2000 {
            let block: [u8; 8] = std::array::from_fn(|_| number(256) as u8);
            let mut expected = [0.0; 16];
            bcdec_rs::bc4_float(&block, &mut expected, 4, false);
            for (found, expected) in decode(block).into_iter().zip(expected) {
                let above = f64::from(found) - 65535.0 * f64::from(expected);
                assert!((-0.01..1.01).contains(&above), "{block:?}: {above}");
            }
        }
    }

    #[test]
    fn a_plane_across_the_sun_is_at_most_a_seventh_of_an_endpoint_too_far() {
        for depth in (0..=u16::MAX).step_by(7).chain([u16::MAX]) {
            let found = decode(encode(&[depth; 16]));
            assert!(
                found
                    .iter()
                    .all(|&found| (depth..=depth.saturating_add(37)).contains(&found))
            );
        }
    }

    #[test]
    fn no_depth_is_too_near_and_few_blocks_have_much_better_endpoints() {
        let mut number = numbers(2);
        let (mut own, mut best) = (0.0, 0.0);
        for round in 0..60 {
            let (near, slope) = (number(50_000), [number(200), number(200)]);
            let step = [0, 5000, 15_000][round % 3];
            let depths: [u16; 16] = std::array::from_fn(|texel| {
                let [x, y] = [texel as u32 % 4, texel as u32 / 4];
                let behind = if x + y > 3 { step } else { 0 };
                let cleared = round % 5 == 0 && x == 3;
                let depth = near + slope[0] * x + slope[1] * y + behind;
                if cleared { u16::MAX } else { depth as u16 }
            });
            let found = encode(&depths);
            assert!(
                decode(found)
                    .iter()
                    .zip(&depths)
                    .all(|(found, depth)| found >= depth)
            );
            let error = |(error, _)| error;
            let all =
                (0..=u16::MAX).filter_map(|ends| block(ends.to_le_bytes(), &depths).map(error));
            let least = all.min().unwrap();
            let [a, b, ..] = found;
            let chosen = block([a, b], &depths).map(error).unwrap();
            assert!(chosen >= least);
            own += (chosen as f64).sqrt();
            best += (least as f64).sqrt();
        }
        assert!(own <= 1.02 * best, "root of the squares {own}, best {best}");
    }
}
