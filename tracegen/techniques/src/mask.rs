//! Pixels of a layer that may be drawn.

/// A bit for each pixel of a layer: nothing may be drawn where it is not set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    size_px: [u32; 2],
    /// Row by row.
    drawn: Vec<bool>,
}

impl Mask {
    /// The pixels of a layer of `size_px` for which `drawn(x, y)` holds.
    #[must_use]
    pub fn new(size_px: [u32; 2], drawn: impl Fn(u32, u32) -> bool) -> Self {
        let rows = (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| (x, y)));
        Self {
            size_px,
            drawn: rows.map(|(x, y)| drawn(x, y)).collect(),
        }
    }

    /// Width and height of the layer.
    #[must_use]
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// Whether a pixel may be drawn; none outside the layer may.
    #[must_use]
    pub fn get(&self, x: u32, y: u32) -> bool {
        x < self.size_px[0]
            && y < self.size_px[1]
            && self.drawn[y as usize * self.size_px[0] as usize + x as usize]
    }

    /// Row by row, a flag a pixel.
    #[must_use]
    pub fn flags(&self) -> &[bool] {
        &self.drawn
    }

    /// Pixels that may be drawn.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.drawn.iter().filter(|drawn| **drawn).count() as u64
    }
}
