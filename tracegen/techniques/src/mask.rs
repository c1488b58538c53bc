//! Masks of the pixels of a layer that may be drawn.

use formats::view::TILE_SIZE_PX;

/// One bit per pixel of a layer; only pixels with a set bit may be drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    size_px: [u32; 2],
    /// Row by row.
    drawn: Vec<bool>,
    /// Summed-area table of the tiles with a pixel that may be drawn: for each corner, the number of such
    /// tiles above and to the left. It has one more column and row than there are tiles.
    tiles: Vec<u32>,
}

impl Mask {
    /// The pixels of a layer of `size_px` for which `drawn(x, y)` holds.
    pub fn new(size_px: [u32; 2], drawn: impl Fn(u32, u32) -> bool) -> Self {
        let rows = (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| (x, y)));
        Self::of(size_px, rows.map(|(x, y)| drawn(x, y)).collect())
    }

    fn of(size_px: [u32; 2], drawn: Vec<bool>) -> Self {
        let [columns, rows] = size_px.map(|size| size.div_ceil(TILE_SIZE_PX) as usize);
        let mut any = vec![false; columns * rows];
        for (at, _) in drawn.iter().enumerate().filter(|(_, drawn)| **drawn) {
            let (x, y) = (at % size_px[0] as usize, at / size_px[0] as usize);
            let tile = TILE_SIZE_PX as usize;
            any[y / tile * columns + x / tile] = true;
        }
        let stride = columns + 1;
        let mut tiles = vec![0; stride * (rows + 1)];
        for y in 0..rows {
            for x in 0..columns {
                tiles[(y + 1) * stride + x + 1] = u32::from(any[y * columns + x])
                    + tiles[y * stride + x + 1]
                    + tiles[(y + 1) * stride + x]
                    - tiles[y * stride + x];
            }
        }
        Self {
            size_px,
            drawn,
            tiles,
        }
    }

    /// The mask extended by all pixels at a distance of at most `by` columns and rows.
    pub fn grown(&self, by: [u32; 2]) -> Self {
        let [width, height] = self.size_px;
        let near = |at: u32, by: u32, size: u32| at.saturating_sub(by)..(at + by + 1).min(size);
        let wide = Self::new(self.size_px, |x, y| {
            near(x, by[0], width).any(|x| self.get(x, y))
        });
        Self::new(self.size_px, |x, y| {
            near(y, by[1], height).any(|y| wide.get(x, y))
        })
    }

    /// Width and height of the layer.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// Whether a pixel may be drawn; false outside the layer.
    pub fn get(&self, x: u32, y: u32) -> bool {
        x < self.size_px[0]
            && y < self.size_px[1]
            && self.drawn[y as usize * self.size_px[0] as usize + x as usize]
    }

    /// One flag per pixel, row by row.
    pub fn flags(&self) -> &[bool] {
        &self.drawn
    }

    /// The first pixel that may be drawn, row by row.
    pub fn first(&self) -> Option<[u32; 2]> {
        let at = self.drawn.iter().position(|drawn| *drawn)? as u32;
        Some([at % self.size_px[0], at / self.size_px[0]])
    }

    /// Number of pixels that may be drawn.
    pub fn count(&self) -> u64 {
        self.drawn.iter().filter(|drawn| **drawn).count() as u64
    }

    /// Whether a tile (16x16 pixels) that touches a rectangle has a pixel that may be drawn; the end of the
    /// rectangle is exclusive.
    pub fn any_in(&self, [left, top]: [u32; 2], [right, bottom]: [u32; 2]) -> bool {
        self.tiles_in([left, top], [right, bottom]) > 0
    }

    /// Number of tiles with a pixel that may be drawn.
    pub fn tile_count(&self) -> u32 {
        self.tiles_in([0, 0], self.size_px)
    }

    fn tiles_in(&self, low: [u32; 2], high: [u32; 2]) -> u32 {
        let tiles = self.size_px.map(|size| size.div_ceil(TILE_SIZE_PX));
        let low = [0, 1].map(|axis| (low[axis] / TILE_SIZE_PX).min(tiles[axis]));
        let high = [0, 1].map(|axis| high[axis].div_ceil(TILE_SIZE_PX).min(tiles[axis]));
        if low[0] >= high[0] || low[1] >= high[1] {
            return 0;
        }
        let sum = |x: u32, y: u32| self.tiles[(y * (tiles[0] + 1) + x) as usize];
        sum(high[0], high[1]) + sum(low[0], low[1]) - sum(low[0], high[1]) - sum(high[0], low[1])
    }

    /// Origin and size of the smallest rectangle of whole tiles, clipped at the edge, that contains all
    /// pixels that may be drawn; `None` if there are none.
    pub fn bounds_px(&self) -> Option<[[u32; 2]; 2]> {
        if self.tile_count() == 0 {
            return None;
        }
        let tiles = self.size_px.map(|size| size.div_ceil(TILE_SIZE_PX));
        let edges = [0, 1].map(|axis: usize| {
            let any = |tile: &u32| {
                let (mut low, mut high) = ([0, 0], self.size_px);
                (low[axis], high[axis]) = (tile * TILE_SIZE_PX, (tile + 1) * TILE_SIZE_PX);
                self.any_in(low, high)
            };
            let first = (0..tiles[axis]).find(any).unwrap_or(0);
            let last = (0..tiles[axis]).rev().find(any).unwrap_or(0);
            let end = ((last + 1) * TILE_SIZE_PX).min(self.size_px[axis]);
            (first * TILE_SIZE_PX, end - first * TILE_SIZE_PX)
        });
        Some([[edges[0].0, edges[1].0], [edges[0].1, edges[1].1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_counted_in_any_rectangle_as_pixel_by_pixel() {
        let mask = Mask::new([70, 50], |x, y| (x * 7 + y * 13) % 401 == 0);
        let brute = |low: [u32; 2], high: [u32; 2]| {
            let touches = |at: u32, axis: usize| {
                let tile = at / 16;
                low[axis] < high[axis] && tile >= low[axis] / 16 && tile * 16 < high[axis]
            };
            (0..50).any(|y| (0..70).any(|x| touches(x, 0) && touches(y, 1) && mask.get(x, y)))
        };
        for low in [[0, 0], [3, 20], [16, 16], [69, 49], [64, 0]] {
            for high in [[70, 50], [17, 21], [32, 32], [100, 100], [3, 3]] {
                assert_eq!(mask.any_in(low, high), brute(low, high), "{low:?} {high:?}");
            }
        }
    }

    #[test]
    fn bounds_contain_exactly_the_drawn_tiles() {
        let mask = Mask::new([70, 50], |x, y| (x, y) == (20, 33) || (x, y) == (69, 40));
        assert_eq!(mask.bounds_px(), Some([[16, 32], [54, 16]]));
        assert_eq!(mask.tile_count(), 2);
        assert_eq!(mask.first(), Some([20, 33]));
        assert_eq!(Mask::new([70, 50], |_, _| false).bounds_px(), None);
    }

    #[test]
    fn a_grown_mask_includes_the_neighbours() {
        let mask = Mask::new([9, 9], |x, y| (x, y) == (0, 4)).grown([2, 1]);
        let expected = Mask::new([9, 9], |x, y| x <= 2 && (3..=5).contains(&y));
        assert_eq!(mask, expected);
    }
}
