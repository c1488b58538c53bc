//! The record buffer as shaders write it: a counter, then records that consist of 16-byte units.
//!
//! The first unit of a record has its header, the number of the draw, the place of the quad and the number of
//! the primitive. In the record of a quad, two units follow for each coordinate group: u and v of the four
//! lanes. In the record of a fragment, three units follow: see [`RawFragment`]. In a record of depths, each of
//! these four words is followed by the depth of a lane.

use bytemuck::{Pod, Zeroable};

/// Bytes before the first record. The first word is the number of appended units, including those beyond the
/// capacity. The second word is the capacity, or 0 while recording is off.
pub const COUNTER_BYTES: u64 = 64;

/// Unit of the buffer.
pub type Unit = [u32; 4];

/// Size of a unit.
pub const UNIT_BYTES: u64 = size_of::<Unit>() as u64;

/// Lowest bit of the lanes in a header, above the number of the coordinate group.
pub const LANES_SHIFT: u32 = 16;
/// Lowest bit of the number of coordinate groups.
pub const GROUPS_SHIFT: u32 = 20;
/// Maximum number of coordinate groups in a record.
pub const MOST_GROUPS: usize = 8;
/// Header bit of a record of a fragment.
pub const FRAGMENT: u32 = 1 << 24;
/// Number of units of a record of a fragment.
pub const FRAGMENT_UNITS: u32 = 4;
/// Header bit of a record of a vertex, which has the units of a fragment's.
pub const VERTEX: u32 = 1 << 26;
/// Number of instances of a draw, from 0 on, that records of vertices tell apart.
pub const MOST_INSTANCES: u32 = 1 << 26;
/// Header bit of a record of depths.
pub const DEPTH: u32 = 1 << 25;
/// Number of units of a record of depths.
pub const DEPTH_UNITS: u32 = 2;

/// The part of a record for one coordinate group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RawSample {
    /// Number of the coordinate group in the low 16 bits; above it, four bits for the lanes of the quad: bit
    /// 0 top left, 1 top right, 2 bottom left, 3 bottom right.
    pub header: u32,
    /// Number of the draw.
    pub draw: u32,
    /// Column and row of the quad in the target, 13 bits each, or the instance of a vertex; and the view in the
    /// bits above.
    pub place: u32,
    /// Number of the primitive within the draw, or of the vertex, with the first vertex of the draw.
    pub primitive: u32,
    /// Element of the binding's array.
    pub element: u32,
    /// Data of a quad or of a fragment: see [`RawQuad`] and [`RawFragment`].
    pub values: [f32; 11],
}

impl RawSample {
    /// Number of the coordinate group in its shader.
    pub fn group(&self) -> u16 {
        self.header as u16
    }

    /// Whether a vertex shader made the record.
    pub fn is_vertex(&self) -> bool {
        self.header & VERTEX != 0
    }

    /// Instance of a vertex, with the first instance of the draw.
    pub fn instance(&self) -> u32 {
        self.place & (MOST_INSTANCES - 1)
    }

    /// Lanes of the quad, one bit each.
    pub fn lanes(&self) -> u8 {
        (self.header >> LANES_SHIFT & 15) as u8
    }

    /// Column and row of the quad.
    pub fn quad(&self) -> [u32; 2] {
        [self.place & 0x1fff, self.place >> 13 & 0x1fff]
    }

    /// View in a multiview pass.
    pub fn view(&self) -> u32 {
        self.place >> 26
    }

    /// Interprets the data as those of a quad.
    pub fn as_quad(&self) -> RawQuad {
        let lane = |number: usize| [self.values[2 * number], self.values[2 * number + 1]];
        RawQuad::of([0, 1, 2, 3].map(lane))
    }

    /// Interprets the data as those of a fragment.
    pub fn as_fragment(&self) -> RawFragment {
        let v = &self.values;
        RawFragment {
            at: [v[0], v[1], v[2]],
            dx: [v[3], v[4], v[5]],
            dy: [v[6], v[7], v[8]],
            lod: v[9],
        }
    }
}

/// Coordinates of a quad. Those of lane (i, j) are `uv + i*dx + j*dy + i*j*cross`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RawQuad {
    /// Coordinates of the top-left lane.
    pub uv: [f32; 2],
    /// Difference to the lane on its right.
    pub dx: [f32; 2],
    /// Difference to the lane below.
    pub dy: [f32; 2],
    /// Change of `dx` from the top row to the bottom row.
    pub cross: [f32; 2],
}

impl RawQuad {
    /// Computes the differences from the coordinates of four lanes.
    pub fn of([a, b, c, d]: [[f32; 2]; 4]) -> Self {
        let pair = |of: &dyn Fn(usize) -> f32| [of(0), of(1)];
        Self {
            uv: a,
            dx: pair(&|axis| b[axis] - a[axis]),
            dy: pair(&|axis| c[axis] - a[axis]),
            cross: pair(&|axis| d[axis] - c[axis] - (b[axis] - a[axis])),
        }
    }
}

/// Coordinates of a fragment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RawFragment {
    /// Coordinates; the third one is a layer or part of a direction.
    pub at: [f32; 3],
    /// Change to the right, or the instruction's explicit gradient.
    pub dx: [f32; 3],
    /// Change downwards, or the instruction's explicit gradient.
    pub dy: [f32; 3],
    /// The instruction's bias or level, if any.
    pub lod: f32,
}

/// Splits records into coordinate groups. Returns false if the last record is incomplete.
pub fn unpack(mut units: &[Unit], mut each: impl FnMut(RawSample)) -> bool {
    while let Some((&first, rest)) = units.split_first() {
        let header = first[0];
        let groups = (header >> GROUPS_SHIFT & 15) as usize;
        let is_fragment = header & FRAGMENT != 0;
        let is_depth = header & DEPTH != 0;
        let length = match (is_depth, is_fragment) {
            (true, _) => 1,
            (_, true) => 3,
            _ => 2 * groups,
        };
        let Some((of, next)) = rest.split_at_checked(length) else {
            return false;
        };
        units = next;
        let words = of.as_flattened();
        let [_, draw, place, primitive] = match words {
            // Every second word of the record is a depth.
            [second, _, third, _] if is_depth => [header, first[2], *second, *third],
            _ => first,
        };
        let mut sample = RawSample {
            header: header & (0x000f_ffff | VERTEX),
            draw,
            place,
            primitive,
            ..RawSample::default()
        };
        if is_depth {
            let depths = [first[1], first[3], words[1], words[3]];
            for (lane, depth) in depths.into_iter().enumerate() {
                sample.values[2 * lane] = f32::from_bits(depth);
            }
            each(sample);
            continue;
        }
        if is_fragment {
            let (element, values) = words.split_at(1);
            sample.element = element[0];
            sample.values.copy_from_slice(bytemuck::cast_slice(values));
            each(sample);
            continue;
        }
        if groups == 0 {
            each(sample);
        }
        for (number, lanes) in (0_u16..).zip(words.chunks_exact(8)) {
            let group = (header as u16).wrapping_add(number);
            sample.header = header & 0x000f_0000 | u32::from(group);
            sample.values[..8].copy_from_slice(bytemuck::cast_slice(lanes));
            each(sample);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn header(group: u32, lanes: u32, groups: u32) -> u32 {
        group | lanes << LANES_SHIFT | groups << GROUPS_SHIFT
    }

    fn all(units: &[Unit]) -> (Vec<RawSample>, bool) {
        let mut found = Vec::new();
        let whole = unpack(units, |sample| found.push(sample));
        (found, whole)
    }

    #[test]
    fn a_record_has_a_sample_for_each_coordinate_group() {
        let floats = |v: [f32; 4]| v.map(f32::to_bits);
        let units = [
            [header(5, 0b1011, 2), 7, 3 | 4 << 13 | 1 << 26, 9],
            floats([1.0, 2.0, 1.5, 2.0]),
            floats([1.0, 2.25, 1.75, 2.25]),
            floats([0.0; 4]),
            floats([0.0; 4]),
            [header(2, 1, 0), 8, 0, 0],
            [header(6, 4, 0) | FRAGMENT | VERTEX, 8, 1 << 26 | 1234, 1],
            [3, 1.0_f32.to_bits(), 2.0_f32.to_bits(), 3.0_f32.to_bits()],
            floats([4.0, 5.0, 6.0, 7.0]),
            floats([8.0, 9.0, 10.0, 0.0]),
            [
                header(7, 5, 0) | DEPTH,
                0.25_f32.to_bits(),
                9,
                0.5_f32.to_bits(),
            ],
            [3 | 4 << 13, 0.75_f32.to_bits(), 11, 1.0_f32.to_bits()],
        ];
        let (found, whole) = all(&units);
        assert!(whole);
        let groups: Vec<_> = found
            .iter()
            .map(|s| (s.group(), s.draw, s.lanes()))
            .collect();
        assert_eq!(
            groups,
            [(5, 7, 11), (6, 7, 11), (2, 8, 1), (6, 8, 4), (7, 9, 5)]
        );
        assert_eq!((found[0].quad(), found[0].view()), ([3, 4], 1));
        let quad = RawQuad {
            uv: [1.0, 2.0],
            dx: [0.5, 0.0],
            dy: [0.0, 0.25],
            cross: [0.25, 0.0],
        };
        assert_eq!(found[0].as_quad(), quad);
        let fragment = RawFragment {
            at: [1.0, 2.0, 3.0],
            dx: [4.0, 5.0, 6.0],
            dy: [7.0, 8.0, 9.0],
            lod: 10.0,
        };
        assert_eq!((found[3].element, found[3].as_fragment()), (3, fragment));
        let vertices = found.iter().map(RawSample::is_vertex);
        assert_eq!(vertices.filter(|is_vertex| *is_vertex).count(), 1);
        assert!(found[3].is_vertex());
        assert_eq!((found[3].instance(), found[3].view()), (1234, 1));
        let depths = found[4].as_quad();
        assert_eq!((found[4].quad(), found[4].primitive), ([3, 4], 11));
        assert_eq!(
            [depths.uv, depths.dx, depths.dy].map(|v| v[0]),
            [0.25, 0.25, 0.5]
        );
        assert!(!all(&units[..4]).1 && !all(&units[..8]).1 && !all(&units[..11]).1);
    }

    proptest! {
        #[test]
        fn arbitrary_units_are_unpacked_without_a_panic(units in proptest::collection::vec(any::<Unit>(), 0..40)) {
            let (found, _) = all(&units);
            prop_assert!(found.len() <= units.len());
        }
    }
}
