//! Raw records of a capturer.

/// Size of a raw record in bytes.
pub const RECORD_BYTES: u64 = size_of::<RawRecord>() as u64;

/// Size of a raw depth in bytes.
pub const DEPTH_BYTES: u64 = size_of::<RawDepth>() as u64;

/// One covered quad in one uv group as the instrumented shader writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct RawRecord {
    /// `qx:12 | qy:12 << 12 | mask:4 << 24 | group:4 << 28`; the position is in quads of the whole view.
    pub header: u32,
    /// Global primitive number.
    pub primitive: u32,
    /// Index into the draw table.
    pub draw: u32,
    /// Covered lanes whose alpha passes the test, in the form of [`Self::mask`]; only used for masked draws.
    /// The bits above are flags of records that are passed to a [`crate::Recorder`]: [`Self::HAS_DEPTH`] and
    /// [`Self::OPERANDS`].
    pub passing: u32,
    /// Coordinates of the top-left lane, covered or not.
    pub uv: [f32; 2],
    /// Horizontal derivative of the top row.
    pub dx: [f32; 2],
    /// Vertical derivative of the left column.
    pub dy: [f32; 2],
    /// Change of the horizontal derivative from the top row to the bottom row.
    pub cross: [f32; 2],
}

impl RawRecord {
    /// Flag of [`Self::passing`]: the depths next to the record are those of its quad (see
    /// [`crate::DepthReplay`]).
    pub const HAS_DEPTH: u32 = 1 << 31;
    /// Flag of [`Self::passing`]: the coordinates are operands of the next record, which belongs to the next
    /// group.
    pub const OPERANDS: u32 = 1 << 30;

    /// Whether the coordinates are operands of the next record.
    pub fn is_operands(&self) -> bool {
        self.passing & Self::OPERANDS != 0
    }

    /// Quad column in the view.
    pub fn qx(&self) -> u32 {
        self.header & 0xfff
    }

    /// Quad row in the view.
    pub fn qy(&self) -> u32 {
        self.header >> 12 & 0xfff
    }

    /// Covered lanes: bit 0 top left, 1 top right, 2 bottom left, 3 bottom right.
    pub fn mask(&self) -> u8 {
        (self.header >> 24 & 15) as u8
    }

    /// Uv group or `NO_GROUP`.
    pub fn group(&self) -> u8 {
        (self.header >> 28) as u8
    }

    /// Packs position, mask and group.
    pub fn pack(qx: u32, qy: u32, mask: u8, group: u8) -> u32 {
        qx & 0xfff | (qy & 0xfff) << 12 | u32::from(mask & 15) << 24 | u32::from(group) << 28
    }
}

/// Depths of a quad, for the repeated depth test of a masked draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct RawDepth {
    /// Depth of each lane.
    pub depth: [f32; 4],
}

/// The raw records of one region, in no particular order.
#[derive(Clone, Copy, Debug)]
pub struct RawRecords<'a> {
    /// One record per quad and uv group.
    pub quads: &'a [RawRecord],
    /// `depths[i]` belongs to `quads[i]` if that record is in group 0 of a masked draw or has
    /// [`RawRecord::HAS_DEPTH`]; otherwise it is unused. Empty if no draw is masked.
    pub depths: &'a [RawDepth],
}
