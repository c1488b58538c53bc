//! Channels of uncompressed texels, and how a texture shows them.

/// Source of a shown channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// A stored one: red, green, blue or alpha by its number.
    Stored(u8),
    /// Nothing.
    Zero,
    /// The largest value.
    One,
}

/// How a texture shows its texels: which channels as which, and from which corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct View {
    /// Sources of red, green, blue and alpha.
    pub swizzle: [Channel; 4],
    /// Whether columns run from the right, and rows from the bottom.
    pub flipped: [bool; 2],
}

impl Default for View {
    fn default() -> Self {
        Self {
            swizzle: [0, 1, 2, 3].map(Channel::Stored),
            flipped: [false; 2],
        }
    }
}

impl View {
    /// RGBA8 texels of this size as they are shown.
    pub fn shown(&self, mut rgba: Vec<u8>, size: [u32; 2]) -> Vec<u8> {
        if self.swizzle != Self::default().swizzle {
            for texel in rgba.chunks_exact_mut(4) {
                let shown = self.swizzle.map(|channel| match channel {
                    Channel::Stored(number) => texel[usize::from(number & 3)],
                    Channel::Zero => 0,
                    Channel::One => 255,
                });
                texel.copy_from_slice(&shown);
            }
        }
        let row_bytes = size[0] as usize * 4;
        if self.flipped[0] {
            for row in rgba.chunks_exact_mut(row_bytes.max(4)) {
                let (texels, _) = row.as_chunks_mut::<4>();
                texels.reverse();
            }
        }
        if self.flipped[1] {
            rgba = (rgba.chunks_exact(row_bytes.max(4)).rev())
                .flatten()
                .copied()
                .collect();
        }
        rgba
    }
}

/// The layout of an uncompressed texel of at most 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Packed {
    /// Bytes of a texel.
    pub bytes: u32,
    /// Bits of red, green, blue and alpha in the little-endian word; none for a channel that is absent.
    pub masks: [u32; 4],
}

impl Packed {
    /// A layout of whole bytes, in the order of the channels with these numbers.
    pub const fn of_bytes(order: &[u8]) -> Self {
        let (mut masks, mut at) = ([0; 4], 0);
        while at < order.len() {
            masks[order[at] as usize] = 0xff << (8 * at);
            at += 1;
        }
        Self {
            bytes: order.len() as u32,
            masks,
        }
    }

    /// RGBA8 texels. An absent colour is 0 and an absent alpha 255, as texture units read them.
    pub fn decode(&self, bytes: &[u8]) -> Vec<u8> {
        let channels = [0, 1, 2, 3].map(|channel| {
            let mask = self.masks[channel];
            let shift = mask.trailing_zeros() & 31;
            (mask, shift, u64::from(mask >> shift))
        });
        let mut rgba = Vec::with_capacity(bytes.len() / self.bytes.max(1) as usize * 4);
        for texel in bytes.chunks_exact(self.bytes.max(1) as usize) {
            let word = (texel.iter().rev()).fold(0_u32, |word, byte| word << 8 | u32::from(*byte));
            for (channel, (mask, shift, most)) in channels.into_iter().enumerate() {
                rgba.push(match most {
                    0 if channel == 3 => 255,
                    0 => 0,
                    _ => ((u64::from((word & mask) >> shift) * 255 + most / 2) / most) as u8,
                });
            }
        }
        rgba
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_texels_are_scaled_to_bytes() {
        let of = |bytes, masks, texels: &[u8]| Packed { bytes, masks }.decode(texels);
        assert_eq!(
            of(1, [0xff, 0, 0, 0], &[7, 9]),
            [7, 0, 0, 255, 9, 0, 0, 255]
        );
        assert_eq!(
            of(2, [0xf800, 0x7e0, 0x1f, 0], &[0x1f, 0xfc]),
            [255, 130, 255, 255]
        );
        assert_eq!(
            of(2, [0x7c00, 0x3e0, 0x1f, 0x8000], &[0, 0x80]),
            [0, 0, 0, 255]
        );
        assert_eq!(
            Packed::of_bytes(&[2, 1, 0]).decode(&[1, 2, 3]),
            [3, 2, 1, 255]
        );
        assert_eq!(
            Packed::of_bytes(&[2, 1, 0, 3]).decode(&[1, 2, 3, 4]),
            [3, 2, 1, 4]
        );
        let wide = of(4, [u32::MAX, 0, 0, 0], &[0xff; 4]);
        assert_eq!(wide, [255, 0, 0, 255]);
    }

    #[test]
    fn a_view_selects_channels_and_turns_rows_and_columns() {
        let view = View {
            swizzle: [
                Channel::Stored(0),
                Channel::Stored(0),
                Channel::One,
                Channel::Zero,
            ],
            flipped: [true, true],
        };
        let texels: Vec<u8> = (0..4).flat_map(|i| [i, 9, 9, 9]).collect();
        let reds: Vec<u8> = view
            .shown(texels.clone(), [2, 2])
            .chunks(4)
            .map(|t| t[1])
            .collect();
        assert_eq!(reds, [3, 2, 1, 0]);
        assert_eq!(view.shown(texels.clone(), [2, 2])[2..4], [255, 0]);
        assert_eq!(View::default().shown(texels.clone(), [2, 2]), texels);
        let rows = View {
            flipped: [false, true],
            ..View::default()
        };
        assert_eq!(rows.shown(texels.clone(), [4, 1]), texels);
    }
}
