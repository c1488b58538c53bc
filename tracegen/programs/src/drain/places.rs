//! Maps pixels of a target to pixels of an eye's picture.

use crate::views::View;

/// Position of an eye's picture in its target. It starts at an even column and row, because quads do. If the
/// view starts at an odd column or row, the picture has one more column or row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// First column and row of quads.
    first: [i32; 2],
    /// Width and height in pixels.
    size: [u32; 2],
    /// Left and top edge of the visible part.
    seen: [i32; 2],
}

impl Placement {
    /// The placement of a view.
    pub fn new(view: View) -> Self {
        let first = view.origin.map(|at| at.div_euclid(2));
        let odd = view.origin.map(|at| at.rem_euclid(2) as u32);
        Self {
            first,
            size: [0, 1].map(|axis| view.size[axis] + odd[axis]),
            seen: view.origin,
        }
    }

    /// Column and row of a quad in the picture, and the lanes that are inside.
    pub fn quad(&self, quad: [u32; 2], lanes: u8) -> Option<([u32; 2], u8)> {
        let at = [0, 1].map(|axis| i64::from(quad[axis]) - i64::from(self.first[axis]));
        let is_seen = |lane: u8| {
            (0..2).all(|axis| {
                let pixel = 2 * i64::from(quad[axis]) + i64::from(lane >> axis & 1);
                let from = pixel - i64::from(self.seen[axis]);
                let end = 2 * i64::from(self.first[axis]) + i64::from(self.size[axis]);
                from >= 0 && pixel < end
            })
        };
        let kept = (0..4).filter(|lane| lanes >> lane & 1 == 1 && is_seen(*lane));
        let mask: u8 = kept.map(|lane| 1 << lane).sum();
        let inside = at.iter().all(|at| (0..4096).contains(at));
        (mask != 0 && inside).then(|| (at.map(|at| at as u32), mask))
    }
}

/// Size of a picture that can hold either eye.
pub fn both(placements: [Placement; 2]) -> [u32; 2] {
    let [a, b] = placements.map(|placement| placement.size);
    [0, 1].map(|axis: usize| a[axis].max(b[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(origin: [i32; 2]) -> Placement {
        Placement::new(View {
            origin,
            size: [10, 6],
        })
    }

    #[test]
    fn quads_of_a_right_half_are_numbered_from_its_edge() {
        let right = at([20, 0]);
        assert_eq!(right.quad([10, 0], 15), Some(([0, 0], 15)));
        assert_eq!(right.quad([14, 2], 15), Some(([4, 2], 15)));
        for outside in [[9, 0], [15, 0], [10, 3]] {
            assert_eq!(right.quad(outside, 15), None);
        }
    }

    #[test]
    fn a_view_at_an_odd_pixel_has_a_wider_picture_that_starts_with_half_a_quad() {
        let odd = at([5, 1]);
        assert_eq!(both([odd, at([0, 0])]), [11, 7]);
        assert_eq!(odd.quad([2, 0], 15), Some(([0, 0], 0b1000)));
        assert_eq!(odd.quad([7, 3], 15), Some(([5, 3], 0b0001)));
    }
}
