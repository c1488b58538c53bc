//! Memory layout of the trees.

/// Triangles in a block.
pub const BLOCK: usize = 4;

/// A child: an inner node's index, or a leaf.
///
/// A leaf has bit 31 set, its triangle count minus 1 in bits 27 to 30, and its first block below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Child(pub u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const COUNT_SHIFT: u32 = 27;
    /// Most triangles in a leaf.
    pub const MAX_LEAF: u32 = 16;
    /// Most blocks in a tree.
    pub const MAX_BLOCKS: u32 = 1 << Self::COUNT_SHIFT;
    /// No child.
    pub const NONE: Self = Self(u32::MAX);

    /// A leaf of `count` triangles, starting at `block`.
    pub fn leaf(block: u32, count: u32) -> Self {
        debug_assert!(block < Self::MAX_BLOCKS && (1..=Self::MAX_LEAF).contains(&count));
        Self(Self::LEAF | (count - 1) << Self::COUNT_SHIFT | block)
    }

    /// True for a leaf.
    #[inline]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// First block and number of triangles of a leaf.
    #[inline]
    pub fn leaf_range(self) -> (u32, u32) {
        (
            self.0 & (Self::MAX_BLOCKS - 1),
            ((self.0 & !Self::LEAF) >> Self::COUNT_SHIFT) + 1,
        )
    }
}

/// An inner node of the binary tree. It holds both children's boxes, so that one step reads one
/// node.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node2 {
    /// By axis: left minimum, right minimum, left maximum, right maximum.
    pub bounds: [[f32; 4]; 3],
    /// Left and right child.
    pub children: [Child; 2],
}

/// An inner node of the eight-wide tree.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Node8 {
    /// By axis: minimum, then maximum, of each child. A missing child's box is inverted.
    pub bounds: [[[f32; 8]; 2]; 3],
    /// Children, [`Child::NONE`] where missing.
    pub children: [Child; 8],
}

/// Bytes of a four-wide node in a ray-tracing unit's memory: four boxes of 24 bytes and four
/// references, padded to two cache lines.
pub const NODE4_BYTES: usize = 128;

/// Four triangles of a leaf, in structure-of-arrays layout.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Block {
    /// By vertex and axis, one value per triangle. Unused lanes hold a NaN, which fails every test.
    pub vertices: [[[f32; BLOCK]; 3]; 3],
    /// Primitive number with [`MASKED`] in the top bit.
    pub primitives: [u32; BLOCK],
}

/// Marks a primitive whose material has an alpha mask.
pub const MASKED: u32 = 1 << 31;

impl Block {
    /// No triangles.
    pub const EMPTY: Self = Self {
        vertices: [[[f32::NAN; BLOCK]; 3]; 3],
        primitives: [u32::MAX; BLOCK],
    };

    /// The vertices of a triangle.
    #[inline]
    pub fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        std::array::from_fn(|v| std::array::from_fn(|a| self.vertices[v][a][lane]))
    }
}

/// Bytes of a triangle in a ray-tracing unit's memory: nine coordinates and its number.
pub const TRIANGLE_BYTES: u32 = 40;
