//! The record buffer as shaders write it: a counter, then records of one size.

use bytemuck::{Pod, Zeroable};

/// Bytes before the first record. The first word counts records, those beyond the capacity too; the second is the
/// capacity, 0 while nothing is recorded.
pub const COUNTER_BYTES: u64 = 64;

/// Bytes of a record.
pub const RAW_BYTES: u64 = size_of::<RawSample>() as u64;

/// First bit of the lanes in [`RawSample::header`].
pub const FRAGMENT_LANES_SHIFT: u32 = 16;

/// What every record has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RawSample {
    /// Site in the low 16 bits, lanes of the quad in the next four: bit 0 top left, 1 top right, 2 bottom left, 3 bottom
    /// right.
    pub header: u32,
    /// Number of the draw.
    pub draw: u32,
    /// Column and row of the quad in the target, 13 bits each, and the view above them.
    pub place: u32,
    /// Number of the primitive within the draw.
    pub primitive: u32,
    /// Element of the binding's array.
    pub element: u32,
    /// What the site's form says: see [`RawQuad`] and [`RawFragment`].
    pub values: [f32; 11],
}

impl RawSample {
    /// Site in its module.
    #[must_use]
    pub fn site(&self) -> u16 {
        self.header as u16
    }

    /// Lanes of the quad.
    #[must_use]
    pub fn lanes(&self) -> u8 {
        (self.header >> FRAGMENT_LANES_SHIFT & 15) as u8
    }

    /// Column and row of the quad.
    #[must_use]
    pub fn quad(&self) -> [u32; 2] {
        [self.place & 0x1fff, self.place >> 13 & 0x1fff]
    }

    /// View of a pass of several.
    #[must_use]
    pub fn view(&self) -> u32 {
        self.place >> 26
    }

    /// As a record of a quad.
    #[must_use]
    pub fn as_quad(&self) -> RawQuad {
        let v = &self.values;
        RawQuad {
            uv: [v[0], v[1]],
            dx: [v[3], v[4]],
            dy: [v[5], v[6]],
            cross: [v[7], v[8]],
        }
    }

    /// As a record of a fragment.
    #[must_use]
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

/// Coordinates of a quad: of lane (i, j) `uv + i*dx + j*dy + i*j*cross`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RawQuad {
    /// Of the top-left lane.
    pub uv: [f32; 2],
    /// Difference to the lane right of it.
    pub dx: [f32; 2],
    /// Difference to the lane below it.
    pub dy: [f32; 2],
    /// Change of `dx` from the top row to the bottom row.
    pub cross: [f32; 2],
}

/// Coordinates of a fragment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RawFragment {
    /// Coordinates; the third is a layer or part of a direction.
    pub at: [f32; 3],
    /// Change to the right, or the gradient that the instruction names.
    pub dx: [f32; 3],
    /// Change downwards, likewise.
    pub dy: [f32; 3],
    /// Bias or level, where the instruction names one.
    pub lod: f32,
}
