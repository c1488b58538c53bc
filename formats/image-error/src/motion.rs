//! Motion between two pictures: block matching from coarse to fine.
//!
//! Errors of consecutive frames are compared along these vectors. An error that moves with an object then
//! counts as constant.

use crate::Picture;
use rayon::prelude::*;

/// Edge of a block with its own vector.
pub const BLOCK_PX: usize = 8;

/// Margin around a block that is also compared, because a block alone is often ambiguous.
const MARGIN_PX: isize = 4;

/// Search distance in each direction at every level.
const REACH: isize = 2;

/// Pictures are halved until the shorter edge has fewer pixels. Each additional level doubles the fastest
/// motion that is found.
const COARSEST_PX: usize = 16;

/// A level of the luma pyramid.
struct Level {
    width: usize,
    height: usize,
    luma: Vec<f32>,
}

impl Level {
    fn of(picture: &Picture) -> Self {
        let luma = |[r, g, b]: &[u8; 3]| {
            0.2126 * f32::from(*r) + 0.7152 * f32::from(*g) + 0.0722 * f32::from(*b)
        };
        Self {
            width: picture.width(),
            height: picture.height(),
            luma: picture.pixels.iter().map(luma).collect(),
        }
    }

    fn at(&self, x: isize, y: isize) -> f32 {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self.luma[y * self.width + x]
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut luma = Vec::with_capacity(width * height);
        for y in 0..height as isize {
            for x in 0..width as isize {
                let sum: f32 = [(0, 0), (1, 0), (0, 1), (1, 1)]
                    .iter()
                    .map(|(dx, dy)| self.at(2 * x + dx, 2 * y + dy))
                    .sum();
                luma.push(sum / 4.0);
            }
        }
        Self {
            width,
            height,
            luma,
        }
    }

    fn blocks(&self) -> [usize; 2] {
        [self.width, self.height].map(|size| size.div_ceil(BLOCK_PX))
    }
}

/// One vector per block, from a pixel to the previous position of its content.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    columns: usize,
    vectors: Vec<[f32; 2]>,
}

impl Motion {
    /// Finds the motion between two pictures of the same size.
    pub fn between(before: &Picture, now: &Picture) -> Self {
        let mut levels = vec![[Level::of(before), Level::of(now)]];
        while let Some([a, b]) = levels.last()
            && a.width.min(a.height) >= 2 * COARSEST_PX
        {
            levels.push([a.halved(), b.halved()]);
        }
        let mut found: Option<(Vec<[isize; 2]>, [usize; 2])> = None;
        for [before, now] in levels.iter().rev() {
            let [columns, rows] = now.blocks();
            let vectors = (0..columns * rows)
                .into_par_iter()
                .map(|block| {
                    let at = [block % columns, block / columns];
                    best(before, now, at, &candidates(found.as_ref(), at))
                })
                .collect();
            found = Some((vectors, [columns, rows]));
        }
        let [before, now] = &levels[0];
        let (vectors, [columns, _]) = found.unwrap_or_default();
        let refined = |(block, vector): (usize, &[isize; 2])| {
            between_pixels(before, now, [block % columns, block / columns], *vector)
        };
        Self {
            columns,
            vectors: vectors.par_iter().enumerate().map(refined).collect(),
        }
    }

    /// Vector from a pixel to the previous position of its content.
    pub fn vector(&self, [x, y]: [usize; 2]) -> [f32; 2] {
        let block = y / BLOCK_PX * self.columns + x / BLOCK_PX;
        self.vectors.get(block).copied().unwrap_or_default()
    }
}

/// Start vectors of a search: zero, the coarser level's median, and the vectors of its block and
/// neighbours.
fn candidates(coarser: Option<&(Vec<[isize; 2]>, [usize; 2])>, at: [usize; 2]) -> Vec<[isize; 2]> {
    let mut all = vec![[0, 0]];
    if let Some((vectors, [columns, rows])) = coarser {
        all.push(median(vectors).map(|along| 2 * along));
        let [x, y] = at.map(|place| place / 2);
        for y in y.saturating_sub(1)..(y + 2).min(*rows) {
            for x in x.saturating_sub(1)..(x + 2).min(*columns) {
                let doubled = vectors[y * columns + x].map(|along| 2 * along);
                if !all.contains(&doubled) {
                    all.push(doubled);
                }
            }
        }
    }
    all
}

/// The median of each coordinate; a turning head moves nearly all blocks by it.
fn median(vectors: &[[isize; 2]]) -> [isize; 2] {
    [0, 1].map(|axis| {
        let mut along: Vec<isize> = vectors.iter().map(|vector| vector[axis]).collect();
        let middle = along.len() / 2;
        along
            .get_mut(..)
            .filter(|all| !all.is_empty())
            .map_or(0, |all| *all.select_nth_unstable(middle).1)
    })
}

/// Sum of absolute differences of a block and its margin along a vector.
fn difference(before: &Level, now: &Level, block: [usize; 2], [dx, dy]: [isize; 2]) -> f32 {
    let [left, top] = block.map(|place| (place * BLOCK_PX) as isize - MARGIN_PX);
    let size = BLOCK_PX as isize + 2 * MARGIN_PX;
    let mut sum = 0.0;
    for y in top..top + size {
        for x in left..left + size {
            sum += (now.at(x, y) - before.at(x + dx, y + dy)).abs();
        }
    }
    sum
}

/// The vector near one of the candidates with the smallest difference. Of equal ones, the first is taken,
/// so that areas without texture do not move.
fn best(before: &Level, now: &Level, block: [usize; 2], from: &[[isize; 2]]) -> [isize; 2] {
    let score = |vector: [isize; 2]| difference(before, now, block, vector);
    let (mut vector, mut least) = ([0, 0], f32::INFINITY);
    for start in from {
        let found = score(*start);
        if found < least {
            (vector, least) = (*start, found);
        }
    }
    let center = vector;
    for dy in -REACH..=REACH {
        for dx in -REACH..=REACH {
            let near = [center[0] + dx, center[1] + dy];
            let found = score(near);
            if found < least {
                (vector, least) = (near, found);
            }
        }
    }
    vector
}

/// Refines the vector to fractions of a pixel: the intersection of the two lines of equal and opposite
/// slope through three neighbouring sums, because sums of absolute differences are linear near their
/// minimum.
fn between_pixels(before: &Level, now: &Level, block: [usize; 2], vector: [isize; 2]) -> [f32; 2] {
    let score =
        |dx: isize, dy: isize| difference(before, now, block, [vector[0] + dx, vector[1] + dy]);
    let middle = score(0, 0);
    let along = |low: f32, high: f32| {
        let steeper = low.max(high) - middle;
        if middle > 0.0 && steeper > 0.0 {
            ((low - high) / (2.0 * steeper)).clamp(-0.5, 0.5)
        } else {
            0.0
        }
    };
    [
        vector[0] as f32 + along(score(-1, 0), score(1, 0)),
        vector[1] as f32 + along(score(0, -1), score(0, 1)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::panned;

    #[test]
    fn a_panned_picture_moves_by_the_pan_to_half_a_pixel() {
        for pan in [[0.0, 0.0], [3.0, 0.0], [-11.0, 7.0], [19.5, -4.25]] {
            let size_px = [200, 160];
            let before = panned(size_px, [0.0, 0.0]);
            let motion = Motion::between(&before, &panned(size_px, pan));
            let mut off = Vec::new();
            // Content that enters at an edge has no previous position.
            for y in (24..136).step_by(BLOCK_PX) {
                for x in (32..168).step_by(BLOCK_PX) {
                    let [vx, vy] = motion.vector([x, y]);
                    off.push((vx - pan[0]).hypot(vy - pan[1]));
                }
            }
            off.sort_by(f32::total_cmp);
            let most = off[off.len() * 95 / 100];
            assert!(most < 0.5, "{pan:?}: {most}");
        }
    }

    #[test]
    fn areas_without_texture_do_not_move() {
        let grey = Picture::filled([50, 40], [90; 3]);
        let motion = Motion::between(&grey, &grey);
        assert_eq!(motion.vector([49, 39]), [0.0, 0.0]);
    }
}
