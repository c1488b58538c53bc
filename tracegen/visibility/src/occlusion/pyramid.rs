//! A pyramid of the farthest depths of blocks of pixels.

/// The depth of a picture, and the farthest depth of each block of 2x2, 4x4, ... pixels.
#[derive(Clone, Debug)]
pub struct Pyramid {
    /// Finest level first; each level has half the size of the one before, rounded up.
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    size: [usize; 2],
    /// Row by row.
    depth: Vec<f32>,
}

impl Pyramid {
    /// Builds the pyramid from the depth of a picture, row by row from the top; 0 is farthest.
    ///
    /// # Panics
    /// The length of `depth` differs from the number of pixels, or is zero.
    pub fn new(size_px: [u32; 2], depth: Vec<f32>) -> Self {
        let size = size_px.map(|extent| extent as usize);
        assert!(!depth.is_empty() && depth.len() == size[0] * size[1]);
        let mut levels = vec![Level { size, depth }];
        while let Some(above) = levels.last().and_then(Level::halved) {
            levels.push(above);
        }
        Self { levels }
    }

    /// Width and height of the picture.
    pub fn size_px(&self) -> [u32; 2] {
        self.levels[0].size.map(|extent| extent as u32)
    }

    /// Farthest depth of a rectangle of pixels within the picture, given by its first and last column and
    /// row. May include a few pixels around the rectangle.
    pub fn farthest(&self, columns: [u32; 2], rows: [u32; 2]) -> f32 {
        // The finest level in which the rectangle covers at most 4x4 texels.
        let few = |[first, last]: [u32; 2], level: usize| (last >> level) - (first >> level) < 4;
        let level = (0..self.levels.len() - 1)
            .find(|&level| few(columns, level) && few(rows, level))
            .unwrap_or(self.levels.len() - 1);
        let Level { size, depth } = &self.levels[level];
        let [columns, rows] = [columns, rows].map(|ends| ends.map(|at| (at >> level) as usize));
        (rows[0]..=rows[1])
            .flat_map(|row| &depth[row * size[0] + columns[0]..=row * size[0] + columns[1]])
            .fold(f32::INFINITY, |farthest, depth| farthest.min(*depth))
    }
}

impl Level {
    /// The next coarser level; `None` for a level of one texel.
    fn halved(&self) -> Option<Self> {
        if self.size == [1, 1] {
            return None;
        }
        let size = self.size.map(|extent| extent.div_ceil(2));
        let row = |row: usize| {
            let row = row.min(self.size[1] - 1) * self.size[0];
            &self.depth[row..row + self.size[0]]
        };
        let mut depth = Vec::with_capacity(size[0] * size[1]);
        for y in 0..size[1] {
            let rows = row(2 * y).chunks(2).zip(row(2 * y + 1).chunks(2));
            depth.extend(rows.map(|(upper, lower)| {
                (upper.iter().chain(lower)).fold(f32::INFINITY, |far, d| far.min(*d))
            }));
        }
        Some(Self { size, depth })
    }
}
