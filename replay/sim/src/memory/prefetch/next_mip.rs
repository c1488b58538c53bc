//! A miss in a mip level fetches the lines at the same place of the coarser levels, which are
//! needed next if a surface recedes or its slope grows.

use super::{Demand, Prefetcher};
use formats::layout::Layout;
use std::sync::Arc;

/// Fetches lines of this many coarser levels.
pub(super) struct NextMip {
    pub levels: u32,
    /// None if lines do not belong to textures.
    pub layout: Option<Arc<Layout>>,
    pub line_bytes: u64,
}

impl Prefetcher for NextMip {
    fn needs_layout(&self) -> bool {
        true
    }

    fn observe(&mut self, line: u32, demand: Demand, lines: &mut Vec<u32>) {
        let Some(layout) = &self.layout else { return };
        if demand != Demand::Miss {
            return;
        }
        let Some(at) = layout.block_at(u64::from(line) * self.line_bytes) else {
            return;
        };
        let texture = &layout.textures()[at.texture as usize];
        for (steps, level) in (1..=self.levels).zip(at.level + 1..) {
            let Some(size) = texture.levels.get(level as usize).map(|level| level.size) else {
                return;
            };
            // The middle of the block, so that rounding finds the right block in levels with odd sizes.
            let texel = [0, 1].map(|axis: usize| {
                let edge = texture.block.texels[axis];
                let middle = (at.block[axis] * edge + edge / 2) >> steps;
                middle.min(size[axis].saturating_sub(1))
            });
            let address = texture.address(at.layer, level, texel);
            lines.extend(address.map(|address| (address / self.line_bytes) as u32));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::layout::LayoutConfig;
    use formats::texture::Texture;

    /// A miss at a texel prefetches the lines of that texel halved, quartered, ... on the existing coarser levels.
    #[test]
    fn a_miss_prefetches_the_same_place_in_coarser_levels() {
        let texture = Texture {
            size: [64, 32],
            levels: 7,
            layers: 1,
            ..Texture::default()
        };
        let layout = Layout::new(&[texture], &LayoutConfig::default()).unwrap();
        let line = |level, texel| (layout.address(0, 0, level, texel).unwrap() / 16) as u32;
        let mut prefetcher = NextMip {
            levels: 3,
            layout: Some(Arc::new(layout.clone())),
            line_bytes: 16,
        };
        let mut found = |at, demand| {
            let mut lines = Vec::new();
            prefetcher.observe(at, demand, &mut lines);
            lines
        };
        let expected = [(1, [20, 10]), (2, [10, 5]), (3, [5, 2])].map(|(l, at)| line(l, at));
        assert_eq!(found(line(0, [40, 20]), Demand::Miss), expected);
        assert_eq!(found(line(0, [40, 20]), Demand::Hit), [0; 0]);
        // Fewer coarser levels exist than configured.
        let last = [line(5, [1, 0]), line(6, [0, 0])];
        assert_eq!(found(line(4, [3, 1]), Demand::Miss), last);
        assert_eq!(found(line(6, [0, 0]), Demand::Miss), [0; 0]);
        assert_eq!(found(1 << 20, Demand::Miss), [0; 0]);
    }
}
