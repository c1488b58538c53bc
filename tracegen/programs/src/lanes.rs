//! Combines records of single fragments into records of quads.

use formats::footprint::fast_log2;
use spool::{RawFragment, RawQuad};

/// Coordinates and operands of one lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaneSample {
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Level of detail or bias.
    pub lod: f32,
    /// Array layer or face.
    pub layer: f32,
    /// Changes of the coordinates to the right and downwards, from which coordinates of missing lanes are
    /// extrapolated.
    pub slope: [[f32; 2]; 2],
}

/// Lanes of a quad that execute a site together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Visit {
    /// Mask of the lanes.
    pub mask: u8,
    /// Coordinates of all lanes.
    pub uv: RawQuad,
    /// Level and layer of all lanes.
    pub operands: RawQuad,
}

/// Which lanes of a quad may be in one visit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joins {
    /// All.
    All,
    /// Those with the same layer.
    Layer,
    /// None: each lane has changes of its own.
    None,
}

/// Groups the fragments of a quad, in recording order, into visits. Within a visit the lanes ascend.
pub fn visits(lanes: &[(u8, LaneSample)], joins: Joins) -> Vec<Visit> {
    let mut open: Vec<(u8, LaneSample)> = Vec::with_capacity(4);
    let mut found = Vec::new();
    for &(lane, sample) in lanes {
        if open.last().is_some_and(|(last, _)| lane <= *last) {
            close(&mut open, joins, &mut found);
        }
        open.push((lane, sample));
    }
    close(&mut open, joins, &mut found);
    found
}

fn close(open: &mut Vec<(u8, LaneSample)>, joins: Joins, found: &mut Vec<Visit>) {
    while let Some((lane, first)) = open.first().copied() {
        let same = |(other, sample): &&(u8, LaneSample)| match joins {
            Joins::All => true,
            Joins::Layer => sample.layer == first.layer,
            Joins::None => *other == lane,
        };
        found.push(visit(open.iter().filter(same)));
        open.retain(|of| !same(&of));
    }
}

/// A visit of one or more lanes.
fn visit<'a>(lanes: impl Iterator<Item = &'a (u8, LaneSample)>) -> Visit {
    let mut of = [None; 4];
    for (lane, sample) in lanes {
        of[usize::from(*lane & 3)] = Some(*sample);
    }
    let mask = (0..4)
        .filter(|lane| of[*lane].is_some())
        .map(|lane| 1 << lane)
        .sum();
    let first = (of.iter().position(Option::is_some)).unwrap_or(0);
    let known = of[first].unwrap_or_default();
    // The coordinates of a missing lane are extrapolated from those of the first lane. Its operands are those
    // of the first lane.
    let at = |lane: usize| {
        of[lane].unwrap_or_else(|| {
            let [right, down] =
                [0, 1].map(|bit| f32::from((lane >> bit & 1) as i8 - (first >> bit & 1) as i8));
            let uv = [0, 1].map(|axis| {
                known.uv[axis] + right * known.slope[0][axis] + down * known.slope[1][axis]
            });
            LaneSample { uv, ..known }
        })
    };
    let lanes = [0, 1, 2, 3].map(at);
    Visit {
        mask,
        uv: RawQuad::of(lanes.map(|lane| lane.uv)),
        operands: RawQuad::of(lanes.map(|lane| [lane.lod, lane.layer])),
    }
}

/// Face of a cube map, the coordinates on it, and their changes.
pub fn on_cube(fragment: &RawFragment) -> (u32, [f32; 2], [[f32; 2]; 2]) {
    let [x, y, z] = fragment.at;
    let [ax, ay, az] = fragment.at.map(f32::abs);
    // Axes of s and t and the major axis, with their signs (Vulkan 1.3, "Cube Map Face Selection").
    let (face, [s, t, major]) = if az >= ax && az >= ay {
        if z >= 0.0 {
            (4, [(0, 1.0), (1, -1.0), (2, 1.0)])
        } else {
            (5, [(0, -1.0), (1, -1.0), (2, -1.0)])
        }
    } else if ay >= ax {
        if y >= 0.0 {
            (2, [(0, 1.0), (2, 1.0), (1, 1.0)])
        } else {
            (3, [(0, 1.0), (2, -1.0), (1, -1.0)])
        }
    } else if x >= 0.0 {
        (0, [(2, -1.0), (1, -1.0), (0, 1.0)])
    } else {
        (1, [(2, 1.0), (1, -1.0), (0, -1.0)])
    };
    let part = |of: [f32; 3], (axis, sign): (usize, f32)| sign * of[axis];
    let m = part(fragment.at, major);
    let at = [s, t].map(|axis| part(fragment.at, axis) / (2.0 * m) + 0.5);
    let slope = |d: [f32; 3]| {
        let dm = part(d, major);
        [s, t].map(|axis| {
            let (v, dv) = (part(fragment.at, axis), part(d, axis));
            (dv * m - v * dm) / (2.0 * m * m)
        })
    };
    (face, at, [slope(fragment.dx), slope(fragment.dy)])
}

/// Level of detail for a texture of this size, computed from the changes of the coordinates as lavapipe does.
pub fn lod(slopes: [[f32; 2]; 2], size: [u32; 2]) -> f32 {
    let squared = |d: [f32; 2]| {
        let [u, v] = [0, 1].map(|axis| d[axis] * size[axis] as f32);
        u * u + v * v
    };
    0.5 * fast_log2(squared(slopes[0]).max(squared(slopes[1])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(u: f32, layer: f32) -> LaneSample {
        LaneSample {
            uv: [u, 0.0],
            layer,
            slope: [[0.25, 0.0], [0.5, 0.0]],
            ..LaneSample::default()
        }
    }

    fn us(quad: &RawQuad) -> [f32; 4] {
        let [u, dx, dy, cross] = [quad.uv, quad.dx, quad.dy, quad.cross].map(|v| v[0]);
        [u, u + dx, u + dy, u + dx + dy + cross]
    }

    #[test]
    fn ascending_lanes_of_a_quad_are_one_visit() {
        let lanes = [
            (0, sample(0.0, 0.0)),
            (1, sample(3.0, 1.0)),
            (2, sample(-1.0, 2.0)),
            (3, sample(7.0, 3.0)),
        ];
        let [visit] = &visits(&lanes, Joins::All)[..] else {
            panic!("one visit");
        };
        assert_eq!((visit.mask, us(&visit.uv)), (15, [0.0, 3.0, -1.0, 7.0]));
        assert_eq!(visit.operands.uv[1] + visit.operands.dx[1], 1.0);
    }

    #[test]
    fn missing_lanes_are_extrapolated_from_the_first_lane() {
        let [visit] = &visits(&[(3, sample(1.0, 2.0))], Joins::All)[..] else {
            panic!("one visit");
        };
        assert_eq!((visit.mask, us(&visit.uv)), (8, [0.25, 0.5, 0.75, 1.0]));
        assert_eq!((visit.operands.uv[1], visit.operands.dx[1]), (2.0, 0.0));
    }

    #[test]
    fn a_repeated_lane_and_another_face_start_another_visit() {
        let lanes = [0, 2, 1, 3, 3].map(|lane| (lane, sample(0.0, 0.0)));
        let masks = |lanes: &[(u8, LaneSample)], joins| -> Vec<u8> {
            visits(lanes, joins)
                .iter()
                .map(|visit| visit.mask)
                .collect()
        };
        assert_eq!(masks(&lanes, Joins::All), [0b0101, 0b1010, 0b1000]);
        let faces = [
            (0, sample(0.0, 1.0)),
            (1, sample(0.0, 4.0)),
            (2, sample(0.0, 1.0)),
        ];
        assert_eq!(masks(&faces, Joins::Layer), [0b0101, 0b0010]);
        assert_eq!(masks(&faces, Joins::None), [0b0001, 0b0010, 0b0100]);
    }

    #[test]
    fn directions_select_their_face_with_its_centre_on_the_axis() {
        let axes = [
            [2.0, 0.0, 0.0],
            [-2.0, 0.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, -3.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ];
        for (face, at) in (0..).zip(axes) {
            let fragment = RawFragment {
                at,
                ..RawFragment::default()
            };
            assert_eq!(on_cube(&fragment).0, face);
            assert_eq!(on_cube(&fragment).1, [0.5; 2]);
        }
    }

    #[test]
    fn changes_on_a_face_are_those_of_its_coordinates() {
        let at = |step: f32| RawFragment {
            at: [1.0 + 0.3 * step, 0.4 - 0.1 * step, -2.0 + 0.2 * step],
            dx: [0.3, -0.1, 0.2],
            ..RawFragment::default()
        };
        let (_, _, [slope, _]) = on_cube(&at(0.0));
        let step = 1e-3;
        let [before, after] = [on_cube(&at(-step)).1, on_cube(&at(step)).1];
        for axis in 0..2 {
            let measured = (after[axis] - before[axis]) / (2.0 * step);
            assert!(
                (slope[axis] - measured).abs() < 1e-3,
                "{slope:?} {measured}"
            );
        }
        assert_eq!(lod([[0.25, 0.0], [0.0, 0.0]], [16, 16]), 2.0);
    }
}
