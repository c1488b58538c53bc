//! Bytes that the update of the hierarchy reads and writes, from the counts of the trace.
//!
//! A refit is counted: it reads triangles and nodes once and writes them once, because nodes are behind their parents.
//! A rebuild depends on the builder. Its passes stream arrays, and each counts once for each time it is read or written.

use formats::raytrace::{BvhSummary, UpdateMethod};
use formats::text::name_of;
use serde::{Deserialize, Serialize};

/// A pass of a builder.
struct Pass {
    /// Whether it reads the triangles and instances.
    reads_input: bool,
    /// Bytes read for each triangle and instance besides.
    read: u64,
    /// Bytes written for each triangle and instance.
    written: u64,
}

const fn pass(reads_input: bool, read: u64, written: u64) -> Pass {
    Pass {
        reads_input,
        read,
        written,
    }
}

const BOX: u64 = 24;
const INDEX: u64 = 4;
const BINARY_NODE: u64 = 64;
/// Cluster of PLOC: box and node.
const CLUSTER: u64 = BOX + INDEX;

/// Bytes read and written by a radix sort in which a digit has eight bits: a histogram of all digits, then one pass per digit
/// (Adinets and Merrill, "Onesweep", 2022).
const fn sort(code: u64) -> Pass {
    pass(false, code + code * (code + INDEX), code * (code + INDEX))
}

/// Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG 2012, with codes of 32 bits
/// and the single pass from the leaves to the root of Apetrei, "Fast and Simple Agglomerative LBVH Construction", 2014.
const LBVH: [Pass; 4] = [
    // Codes of the triangles.
    pass(true, 0, 4 + INDEX),
    sort(4),
    // Triangles in the order of the codes.
    pass(true, INDEX, 0),
    // Nodes by the codes of neighbours.
    pass(false, 4, 0),
];

/// Meister and Bittner, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction", TVCG 2018, with
/// codes of 64 bits. An iteration at most halves the clusters, so all iterations together have at least two per triangle.
const PLOC: [Pass; 7] = [
    // Boxes of the triangles.
    pass(true, 0, BOX),
    // Codes within the scene's box.
    pass(false, BOX, 8 + INDEX),
    sort(8),
    // First clusters.
    pass(false, INDEX + BOX, CLUSTER),
    // Search of the nearest neighbours.
    pass(false, 2 * BOX, 2 * INDEX),
    // Merging: binary nodes, and the clusters that remain.
    pass(false, 2 * (INDEX + CLUSTER), BINARY_NODE + CLUSTER),
    // Leaves and wide nodes from the binary tree.
    pass(true, BINARY_NODE + INDEX, 0),
];

/// Bytes read and written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct UpdateBytes {
    /// Read.
    pub read_bytes: u64,
    /// Written.
    pub written_bytes: u64,
}

impl UpdateBytes {
    /// Both.
    pub fn total(&self) -> u64 {
        self.read_bytes + self.written_bytes
    }
}

/// The update of the hierarchy from the frame before, which no other figure contains.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct HierarchyUpdate {
    /// `refit` or `rebuild`.
    pub method: String,
    /// Of a refit; of a rebuild, those of LBVH, which has the fewest passes.
    #[serde(flatten)]
    pub bytes: UpdateBytes,
    /// Of a rebuild by PLOC, with the fewest possible iterations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ploc: Option<UpdateBytes>,
}

impl HierarchyUpdate {
    /// The update of a trace's hierarchy, if the trace states one.
    pub fn of(bvh: &BvhSummary) -> Option<Self> {
        let update = bvh.update?;
        let [node, triangle] = [bvh.bytes_per_node, bvh.bytes_per_triangle].map(u64::from);
        // An instance has the size of a node. Its box follows from its transform and the root below it.
        let input = update.triangles_read * triangle + 2 * update.instances * node;
        let output = update.triangles_written * triangle + (update.instances + update.nodes) * node;
        let by = |passes: &[Pass]| {
            let primitives = update.triangles_read + update.instances;
            let sum = |of: fn(&Pass) -> u64| passes.iter().map(of).sum::<u64>();
            UpdateBytes {
                read_bytes: input * sum(|pass| pass.reads_input.into())
                    + primitives * sum(|pass| pass.read),
                written_bytes: output + primitives * sum(|pass| pass.written),
            }
        };
        let (bytes, ploc) = match update.method {
            UpdateMethod::Rebuild => (by(&LBVH), Some(by(&PLOC))),
            UpdateMethod::Refit => {
                let read_bytes = input + update.nodes * node;
                (
                    UpdateBytes {
                        read_bytes,
                        written_bytes: output,
                    },
                    None,
                )
            }
        };
        let method = name_of(&update.method);
        Some(Self {
            method,
            bytes,
            ploc,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::bvh;
    use formats::raytrace::BvhUpdate;

    fn update(method: UpdateMethod) -> HierarchyUpdate {
        let update = BvhUpdate {
            method,
            triangles_read: 5,
            triangles_written: 3,
            instances: 2,
            nodes: 7,
        };
        let bvh = BvhSummary {
            bytes_per_node: 64,
            bytes_per_triangle: 40,
            update: Some(update),
            ..bvh()
        };
        HierarchyUpdate::of(&bvh).expect("an update")
    }

    #[test]
    fn a_refit_reads_and_writes_what_moved_once() {
        let bytes = UpdateBytes {
            read_bytes: 5 * 40 + 2 * (64 + 64) + 7 * 64,
            written_bytes: 3 * 40 + 2 * 64 + 7 * 64,
        };
        let found = update(UpdateMethod::Refit);
        assert_eq!((found.bytes, found.ploc), (bytes, None));
        assert_eq!(HierarchyUpdate::of(&bvh()), None);
    }

    /// The sums of the tables of passes in docs/models/ray-tracing.md.
    #[test]
    fn a_rebuild_is_the_sum_of_its_passes() {
        let input: u64 = 5 * 40 + 2 * (64 + 64);
        let output: u64 = 3 * 40 + 2 * 64 + 7 * 64;
        let found = update(UpdateMethod::Rebuild);
        let bytes = |inputs: u64, read: u64, written: u64| UpdateBytes {
            read_bytes: inputs * input + 7 * read,
            written_bytes: output + 7 * written,
        };
        assert_eq!(found.bytes, bytes(2, 44, 40));
        assert_eq!(found.ploc, Some(bytes(2, 336, 260)));
    }
}
