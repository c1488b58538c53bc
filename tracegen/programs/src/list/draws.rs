//! The draws of a render pass, each with the pixels that it covers.

use super::Thumbnail;
use crate::views::Role;
use spool::RawSample;

/// Width or height of a picture of covered pixels at most.
const MOST_PX: u32 = 128;

/// A draw of a render pass.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawRow {
    /// Number within the pass.
    pub number: u64,
    /// What it shows, if the eyes were found.
    pub shows: Option<Role>,
    /// Number of fragments.
    pub fragments: u64,
    /// Number of texture samples.
    pub samples: u64,
    /// Number of textures that it can read.
    pub textures: usize,
    /// Opaque where it covers no pixel and transparent where it covers one; `None` without records.
    pub covered: Option<Thumbnail>,
}

/// The pixels of a target that records cover, as a picture for [`DrawRow::covered`].
pub(super) fn covered(records: &[RawSample], target: [u32; 2]) -> Thumbnail {
    let most = target[0].max(target[1]).max(1);
    let scaled = |at: u32| (u64::from(at) * u64::from(MOST_PX.min(most)) / u64::from(most)) as u32;
    let size = target.map(|size| scaled(size).max(1));
    let mut texels = [0, 0, 0, 200].repeat((size[0] * size[1]) as usize);
    for record in records {
        let quad = record.quad();
        for lane in (0..4).filter(|lane| record.lanes() >> lane & 1 != 0) {
            let [x, y] = [2 * quad[0] + lane % 2, 2 * quad[1] + lane / 2].map(scaled);
            if x < size[0] && y < size[1] {
                texels[(4 * (y * size[0] + x) + 3) as usize] = 0;
            }
        }
    }
    Thumbnail { size, texels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covered_pixels_are_transparent() {
        // The quad at column 1 and row 0, its top right and bottom left pixels.
        let record = RawSample {
            header: 0b0110 << 16,
            place: 1,
            ..RawSample::default()
        };
        assert_eq!(record.lanes(), 0b0110);
        let alpha = |picture: &Thumbnail| -> Vec<u8> {
            picture.texels.chunks(4).map(|texel| texel[3]).collect()
        };
        let picture = covered(&[record], [4, 2]);
        assert_eq!(picture.size, [4, 2]);
        assert_eq!(alpha(&picture), [200, 200, 200, 0, 200, 200, 0, 200]);
        // A larger target is scaled, a pixel outside of it is left out.
        assert_eq!(covered(&[], [4096, 1024]).size, [128, 32]);
        assert_eq!(alpha(&covered(&[record], [2, 2])), [200; 4]);
    }
}
