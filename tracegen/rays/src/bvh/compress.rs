//! The eight-wide tree in compressed nodes of 80 bytes (Ylitie, Karras and Laine, "Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3).
//!
//! A node has room for only one reference to inner nodes and one to triangles, so nodes and slots
//! are numbered anew: inner children are adjacent, and so are the triangles of all leaves of a
//! node. Traversal reads nodes whose boxes are decoded beforehand.

use super::node::{BLOCK, Child, Node8};

/// A compressed node.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct CompressedNode {
    /// Corner of all children's boxes with the smallest coordinates.
    origin: [f32; 3],
    /// By axis, the biased exponent of the size of a quantisation step.
    exponents: [u8; 3],
    /// A bit for each child that is an inner node.
    inner: u8,
    /// Number of the first inner child; the others follow it.
    first_child: u32,
    /// Slot of the first triangle of the first leaf; those of the other leaves follow.
    first_slot: u32,
    /// Triangles of each leaf; 1 for an inner node, 0 where there is no child. The paper has counts
    /// and offsets of up to 3 triangles here.
    counts: [u8; 8],
    /// By axis: minimum, then maximum, of each child in quantisation steps from the origin.
    planes: [[[u8; 8]; 2]; 3],
}

const _: () = assert!(size_of::<CompressedNode>() == 80);

/// What a compressed node refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reference {
    None,
    Node(u32),
    /// First slot and number of triangles.
    Leaf(u32, u32),
}

impl CompressedNode {
    fn references(&self) -> [Reference; 8] {
        let (mut child, mut slot) = (self.first_child, self.first_slot);
        std::array::from_fn(|side| match u32::from(self.counts[side]) {
            0 => Reference::None,
            _ if self.inner >> side & 1 == 1 => {
                child += 1;
                Reference::Node(child - 1)
            }
            count => {
                slot += count;
                Reference::Leaf(slot - count, count)
            }
        })
    }

    /// Boxes of the children, in the layout of [`Node8::bounds`].
    fn bounds(&self) -> [[[f32; 8]; 2]; 3] {
        let mut out = [[[f32::MAX; 8], [f32::MIN; 8]]; 3];
        for (axis, planes) in out.iter_mut().enumerate() {
            for (far, values) in planes.iter_mut().enumerate() {
                for side in (0..8).filter(|side| self.counts[*side] > 0) {
                    let code = self.planes[axis][far][side];
                    values[side] = plane(self.origin[axis], self.exponents[axis], code);
                }
            }
        }
        out
    }
}

/// The plane that a code stands for. Rounding to the nearest keeps a plane on its side of every
/// `f32`, because rounding is monotonic.
fn plane(origin: f32, exponent: u8, code: u8) -> f32 {
    (f64::from(origin) + f64::from(code) * step(exponent)) as f32
}

/// Size of a quantisation step.
fn step(exponent: u8) -> f64 {
    2f64.powi(i32::from(exponent) - 127)
}

/// Smallest step with which 255 steps reach from the origin to a coordinate.
fn exponent(origin: f32, max: f32) -> u8 {
    let reaches = |exponent: &u8| plane(origin, *exponent, u8::MAX) >= max;
    (1..u8::MAX).find(reaches).unwrap_or(u8::MAX)
}

/// Codes of the tightest box around an interval.
fn quantised(origin: f32, exponent: u8, [min, max]: [f32; 2]) -> [u8; 2] {
    let steps = |x: f32| (f64::from(x) - f64::from(origin)) / step(exponent);
    let mut codes = [steps(min).floor() as u8, steps(max).ceil() as u8];
    while plane(origin, exponent, codes[0]) > min {
        codes[0] -= 1;
    }
    while plane(origin, exponent, codes[1]) < max {
        codes[1] += 1;
    }
    codes
}

/// Compresses all nodes of a tree, in which every node is behind its parent. The results are the
/// compressed nodes, each with the number of its node in the tree, and the first slot of every
/// block.
fn compress(nodes: &[Node8], blocks: usize) -> (Vec<(CompressedNode, u32)>, Vec<u32>) {
    let (mut slots, mut slot) = (vec![0; blocks], 0);
    // By node, its number among the compressed nodes.
    let (mut numbers, mut numbered) = (vec![0; nodes.len()], 1);
    let mut out = Vec::with_capacity(nodes.len());
    for (from, node) in (0u32..).zip(nodes) {
        let mut compressed = with_boxes(node);
        (compressed.first_child, compressed.first_slot) = (numbered, slot);
        for (side, child) in node.children.iter().enumerate() {
            if *child == Child::NONE {
                continue;
            }
            if !child.is_leaf() {
                compressed.inner |= 1 << side;
                compressed.counts[side] = 1;
                numbers[child.0 as usize] = numbered;
                numbered += 1;
                continue;
            }
            let (block, count) = child.leaf_range();
            compressed.counts[side] = count as u8;
            for number in 0..count.div_ceil(BLOCK as u32) {
                slots[(block + number) as usize] = slot + number * BLOCK as u32;
            }
            slot += count;
        }
        out.push((compressed, from));
    }
    out.sort_unstable_by_key(|(_, from)| numbers[*from as usize]);
    (out, slots)
}

/// A compressed node that has its boxes, but no references yet.
fn with_boxes(node: &Node8) -> CompressedNode {
    let least = |[min, _]: [[f32; 8]; 2]| min.into_iter().fold(f32::MAX, f32::min);
    let mut out = CompressedNode {
        origin: node.bounds.map(least),
        exponents: [0; 3],
        inner: 0,
        first_child: 0,
        first_slot: 0,
        counts: [0; 8],
        planes: [[[0; 8]; 2]; 3],
    };
    for (axis, [min, max]) in node.bounds.iter().enumerate() {
        let origin = out.origin[axis];
        let scale = exponent(origin, max.iter().copied().fold(f32::MIN, f32::max));
        out.exponents[axis] = scale;
        for side in (0..8).filter(|side| node.children[*side] != Child::NONE) {
            let codes = quantised(origin, scale, [min[side], max[side]]);
            [out.planes[axis][0][side], out.planes[axis][1][side]] = codes;
        }
    }
    out
}

/// The boxes of a node that are decoded from its compressed form.
pub(super) fn quantised_boxes(node: &Node8) -> [[[f32; 8]; 2]; 3] {
    let mut compressed = with_boxes(node);
    compressed.counts = node.children.map(|child| u8::from(child != Child::NONE));
    compressed.bounds()
}

/// The nodes of the compressed tree as traversal reads them, and the first slot of every block.
pub(super) fn compressed(nodes: &[Node8], blocks: usize) -> (Vec<Node8>, Vec<u32>) {
    let (compressed, slots) = compress(nodes, blocks);
    let decoded = compressed.into_iter().map(|(node, from)| {
        // Leaves keep their blocks, which are the same in all trees.
        let mut children = nodes[from as usize].children;
        for (child, reference) in children.iter_mut().zip(node.references()) {
            if let Reference::Node(number) = reference {
                *child = Child(number);
            }
        }
        Node8 {
            bounds: node.bounds(),
            children,
        }
    });
    (decoded.collect(), slots)
}

#[cfg(test)]
mod tests {
    use super::super::Bvh;
    use super::*;
    use glam::DVec3;
    use lab::traversal::reference::TestMesh;

    /// Trees of regular, far and flat meshes, and of one leaf.
    fn trees() -> Vec<Bvh> {
        let triangle = [[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [1.0, 3.0, 3.0f32]];
        let flat: Vec<_> = (0..100)
            .map(|i| triangle.map(|[x, y, z]| [x + i as f32, y * 1e12, z]))
            .collect();
        [
            TestMesh::torus(160, 80).rounded(DVec3::ZERO),
            TestMesh::sphere(4).rounded(DVec3::splat(1e5)),
            flat,
            vec![triangle],
        ]
        .map(|triangles| Bvh::build(&triangles, |_| false).expect("builds"))
        .into()
    }

    #[test]
    fn boxes_contain_the_exact_ones_and_are_wider_by_at_most_a_step() {
        for node in trees().iter().flat_map(|bvh| &bvh.nodes8) {
            let compressed = with_boxes(node);
            for side in (0..8).filter(|side| node.children[*side] != Child::NONE) {
                for axis in 0..3 {
                    let (o, e) = (compressed.origin[axis], compressed.exponents[axis]);
                    let [min, max] = node.bounds[axis].map(|planes| planes[side]);
                    let [low, high] =
                        compressed.planes[axis].map(|planes| plane(o, e, planes[side]));
                    assert!(low <= min && max <= high, "{min} {max}: {low} {high}");
                    let wider = f64::from(min - low).max(f64::from(high - max));
                    assert!(wider <= step(e), "{wider} of {}", step(e));
                }
            }
        }
    }

    #[test]
    fn references_from_80_bytes_give_every_node_and_triangle_once() {
        for bvh in trees() {
            let (nodes, slots) = compress(&bvh.nodes8, bvh.blocks.len());
            assert_eq!(nodes.len(), bvh.nodes8.len());
            let mut seen_nodes = vec![0; nodes.len()];
            let mut seen_slots = vec![0; bvh.triangles as usize];
            for (node, from) in &nodes {
                let originals = bvh.nodes8[*from as usize].children;
                for (reference, original) in node.references().into_iter().zip(originals) {
                    match reference {
                        Reference::None => assert_eq!(original, Child::NONE),
                        Reference::Node(number) => {
                            assert_eq!(nodes[number as usize].1, original.0);
                            seen_nodes[number as usize] += 1;
                        }
                        Reference::Leaf(slot, count) => {
                            let (block, triangles) = original.leaf_range();
                            assert_eq!((slot, count), (slots[block as usize], triangles));
                            for slot in slot..slot + count {
                                seen_slots[slot as usize] += 1;
                            }
                        }
                    }
                }
            }
            assert!(seen_nodes[1..].iter().all(|times| *times == 1));
            assert!(seen_slots.iter().all(|times| *times == 1));
        }
    }
}
