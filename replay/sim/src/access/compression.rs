//! Lossless compression of colour tiles, measured for a rendered picture.
//!
//! Blocks of 4x4 pixels are stored as a minimum per channel and the differences from it, in as many bits as
//! the largest difference needs (Rasmusson, Hasselgren and Akenine-Möller, Graphics Hardware 2007, section
//! 3, without their prediction). A tile has a 16-byte header and whole lines of blocks. A tile that would
//! not shrink is stored uncompressed.

/// Width and height of a block.
const BLOCK_PX: usize = 4;
/// Header of a tile with the locations of its blocks.
const HEADER_BYTES: usize = 16;
/// Bits per block for its minima and for the 4-bit widths of its four channels.
const BLOCK_BASE_BITS: usize = 4 * (8 + 4);

/// Compressed size of a picture's tiles, in thousandths of the uncompressed size. `rgb` has three bytes per
/// pixel, row by row; memory has a constant fourth one.
pub fn permille(rgb: &[u8], width: usize, tile_px: u32, line_bytes: u32) -> u32 {
    let height = rgb.len() / (3 * width.max(1));
    let (tile, line) = (tile_px as usize, line_bytes as usize);
    let (mut before, mut after) = (0, 0);
    for top in (0..height).step_by(tile) {
        for left in (0..width).step_by(tile) {
            let (right, bottom) = ((left + tile).min(width), (top + tile).min(height));
            let raw = (4 * (right - left) * (bottom - top)).next_multiple_of(line);
            let mut bits = 0;
            for y in (top..bottom).step_by(BLOCK_PX) {
                for x in (left..right).step_by(BLOCK_PX) {
                    let end = [(x + BLOCK_PX).min(right), (y + BLOCK_PX).min(bottom)];
                    bits += block_bits(rgb, width, [x, y], end);
                }
            }
            let packed = (HEADER_BYTES + bits.div_ceil(8)).next_multiple_of(line);
            before += raw;
            after += packed.min(raw);
        }
    }
    match before {
        0 => 1000,
        _ => (1000 * after).div_ceil(before) as u32,
    }
}

fn block_bits(
    rgb: &[u8],
    width: usize,
    [left, top]: [usize; 2],
    [right, bottom]: [usize; 2],
) -> usize {
    let of_channel = |channel: usize| {
        let rows = (top..bottom).flat_map(|y| (left..right).map(move |x| 3 * (y * width + x)));
        let (mut least, mut most) = (u8::MAX, 0);
        for at in rows {
            let value = rgb[at + channel];
            (least, most) = (least.min(value), most.max(value));
        }
        (u8::BITS - (most - least).leading_zeros()) as usize
    };
    let pixels = (right - left) * (bottom - top);
    BLOCK_BASE_BITS + pixels * (0..3).map(of_channel).sum::<usize>()
}

#[cfg(test)]
mod tests {
    use super::permille;

    #[test]
    fn one_colour_shrinks_to_header_and_minima_and_noise_to_three_channels() {
        // 16 blocks of 6 bytes and the header: 112 bytes in two lines of 64, of 1024.
        assert_eq!(permille(&[90; 3 * 32 * 16], 32, 16, 64), 125);
        let noise: Vec<u8> = (0..3 * 32 * 16_u32)
            .map(|i| {
                let mixed = (i ^ (i >> 7)).wrapping_mul(2_654_435_761);
                ((mixed ^ (mixed >> 15)).wrapping_mul(0x846c_a68b) >> 24) as u8
            })
            .collect();
        // 16 blocks of 48 bits and 16 x 3 x 8 bits, and the header: 880 bytes in 14 lines. The fourth channel is constant.
        assert_eq!(permille(&noise, 32, 16, 64), 875);
        // Compression would need two lines instead of one, so the block is stored uncompressed.
        assert_eq!(permille(&noise[..3 * 4 * 4], 4, 16, 64), 1000);
    }

    #[test]
    fn a_ramp_takes_the_bits_of_its_range_within_a_block() {
        // Red grows by one per pixel. Values 0 to 3 take two bits: 16 x 2 bits per block in addition to the
        // 48 of its minima.
        let ramp: Vec<u8> = (0..16_u8)
            .flat_map(|_| (0..16_u8).flat_map(|x| [x, 7, 7]))
            .collect();
        let bytes = (16 + 16 * (48 + 32) / 8_u32).next_multiple_of(64);
        assert_eq!(permille(&ramp, 16, 16, 64), (1000 * bytes).div_ceil(1024));
        // Only the part inside the picture counts.
        assert_eq!(permille(&[0; 3 * 8 * 4], 8, 16, 64), 500);
    }
}
