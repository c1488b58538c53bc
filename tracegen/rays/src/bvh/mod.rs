//! The bounding volume hierarchy: built by a library, traversed and counted here.
//!
//! One build gives two trees over the same leaves. A step in the binary tree tests both children's
//! boxes; this is the unit in which T&I unit 2.0 works and in which traces count. The eight-wide
//! tree is faster. A tree on demand, four-wide or of compressed nodes, is built if asked for. All find
//! bit-identical hits.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod build;
mod collapse;
mod compress;
mod contents;
pub mod count;
mod instances;
mod kernel;
mod leaf;
pub mod node;
mod on_demand;
mod pages;
mod refit;
mod stacks;
mod traverse;
mod treelets;
mod widen;

#[cfg(test)]
mod tests;

use crate::ray::{LARGEST_COORDINATE, Ray};
use collapse::MAX_TRIANGLES;
use count::Counter;
use formats::raytrace::{BvhSummary, ChildOrder, InstanceNodes, TraversalKind};
use glam::Vec3;
use instances::Below;
pub use instances::Placement;
use kernel::{NodeOrder, Scalar};
pub use leaf::{AllOpaque, AlphaTest, RayHit};
use node::{Block, Child, MASKED, Node2, Node8, TRIANGLE_BYTES};
pub use on_demand::TreeOptions;
use on_demand::{OnDemandTree, node_bytes};
use pages::in_large_pages;
pub(crate) use refit::Objects;
use stacks::Stacks;
pub use traverse::TraversalStack;
use traverse::{Two, Wide, Width, search, search_below};
use treelets::in_treelets;
use widen::MAX_WIDTH;

/// A set of triangles for which no hierarchy can be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BvhError {
    /// More triangles than node references can number.
    #[error("the scene has {found} triangles; a hierarchy holds at most {limit}")]
    TooManyTriangles {
        /// Triangles given.
        found: usize,
        /// Most that fit.
        limit: usize,
    },
    /// A part of the scene that a tree built for another time cannot follow.
    #[error(
        "{what} {number} cannot be refitted: expected finite coordinates and a matrix with an inverse at every time"
    )]
    NotRefitted {
        /// Triangle or instance.
        what: &'static str,
        /// Its number.
        number: u32,
    },
}

/// Instruction set of the traversal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// Plain Rust.
    Scalar,
    /// AVX2 and FMA.
    Avx2,
}

impl Instructions {
    /// The fastest that this processor supports.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if avx2::Avx2::available() {
            return Self::Avx2;
        }
        Self::Scalar
    }
}

/// The trees over a set of triangles.
pub struct Bvh {
    nodes2: Vec<Node2>,
    nodes8: Vec<Node8>,
    blocks: Vec<Block>,
    /// By block, the number of its first triangle in leaf order. Apart from the blocks, which are
    /// read more often.
    first_slots: Vec<u32>,
    bounds: (Vec3, Vec3),
    triangles: u64,
    leaves: u64,
    depth2: u32,
    depth8: u32,
    on_demand: OnDemandTree,
    treelet_bytes: Option<u32>,
    child_order: ChildOrder,
    /// Entries that a traversal stack needs.
    stack_size: usize,
    sah_cost: f64,
    instructions: Instructions,
    /// What the leaves are if they are not triangles.
    below: Option<Box<Below>>,
}

impl Bvh {
    /// Builds the binary and the eight-wide tree. Triangles with a coordinate that is not finite or exceeds
    /// [`LARGEST_COORDINATE`] are left out and can't be hit. `masked` returns whether the material
    /// of a triangle number has an alpha mask.
    ///
    /// # Errors
    /// There are more triangles than node references can number.
    pub fn build(
        triangles: &[[[f32; 3]; 3]],
        masked: impl Fn(u32) -> bool,
    ) -> Result<Self, BvhError> {
        Self::build_for(TraversalKind::Bvh2.into(), triangles, masked)
    }

    /// [`Self::build`], with the tree that the options describe.
    ///
    /// # Errors
    /// There are more triangles than node references can number.
    pub fn build_for(
        options: TreeOptions,
        triangles: &[[[f32; 3]; 3]],
        masked: impl Fn(u32) -> bool,
    ) -> Result<Self, BvhError> {
        let number = |n| if masked(n) { n | MASKED } else { n };
        Self::build_with(options, triangles, number, MAX_TRIANGLES)
    }

    /// [`Self::build_for`], with the number and mask flag of each triangle, ascending, and the most
    /// triangles of a leaf.
    fn build_with(
        options: TreeOptions,
        triangles: &[[[f32; 3]; 3]],
        number: impl Fn(u32) -> u32,
        most: u32,
    ) -> Result<Self, BvhError> {
        let limit = Child::MAX_BLOCKS as usize;
        if triangles.len() > limit {
            return Err(BvhError::TooManyTriangles {
                found: triangles.len(),
                limit,
            });
        }
        let (kept, numbers): (Vec<_>, Vec<u32>) = triangles
            .iter()
            .zip(0u32..)
            .filter(|(t, _)| {
                t.as_flattened()
                    .iter()
                    .all(|x| x.abs() <= LARGEST_COORDINATE)
            })
            .map(|(t, n)| (*t, number(n)))
            .unzip();
        let points = || kept.iter().flatten().map(|p| Vec3::from(*p));
        let bounds = points()
            .map(|p| (p, p))
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            .unwrap_or_default();
        let stacks = Stacks::find(&kept, &numbers, most as usize, options.refit);
        let built: Vec<_> = stacks.built.iter().map(|at| kept[*at as usize]).collect();
        let mut tree = build::build_binary(&built, most);
        stacks.expand(&mut tree, &kept);
        let mut layout = build::lay_out(&tree, &kept, &numbers);
        let (mut nodes8, depth8) = build::emit_wide(&tree, &layout.children, MAX_WIDTH);
        let on_demand = OnDemandTree::new(options, &tree, &layout, (&nodes8, depth8));
        if let Some(most) = options.treelet_nodes() {
            match options.kind {
                TraversalKind::Bvh2 => layout.nodes2 = in_treelets(&layout.nodes2, most),
                TraversalKind::Bvh8 => nodes8 = in_treelets(&nodes8, most),
                TraversalKind::Bvh4 | TraversalKind::Cwbvh8 => {}
            }
        }
        let most_stacked = [
            layout.depth2,
            depth8 * (MAX_WIDTH as u32 - 1),
            on_demand.depth * (MAX_WIDTH as u32 - 1),
        ];
        Ok(Self {
            nodes2: in_large_pages(layout.nodes2),
            nodes8: in_large_pages(nodes8),
            blocks: in_large_pages(layout.blocks),
            first_slots: layout.first_slots,
            bounds,
            triangles: tree.primitive_indices.len() as u64,
            leaves: layout.leaves,
            depth2: layout.depth2,
            depth8,
            on_demand,
            treelet_bytes: options.treelet_bytes,
            child_order: options.child_order,
            stack_size: most_stacked.into_iter().max().unwrap_or(0) as usize + MAX_WIDTH,
            sah_cost: layout.sah_cost,
            instructions: Instructions::best(),
            below: None,
        })
    }

    /// Selects the instructions. A processor without AVX2 keeps plain Rust.
    #[must_use]
    pub fn with_instructions(mut self, instructions: Instructions) -> Self {
        if instructions == Instructions::Scalar || Instructions::best() == instructions {
            self.instructions = instructions;
        }
        self
    }

    /// Whether the tree of a kind was built.
    pub fn has(&self, kind: TraversalKind) -> bool {
        match kind {
            TraversalKind::Bvh2 | TraversalKind::Bvh8 => true,
            TraversalKind::Bvh4 | TraversalKind::Cwbvh8 => self.on_demand.kind == Some(kind),
        }
    }

    /// Whether the leaves are instances.
    pub(crate) fn has_instances(&self) -> bool {
        self.below.is_some()
    }

    /// By block, the slot of its first triangle in a tree.
    fn slots_of(&self, tree: TraversalKind) -> &[u32] {
        debug_assert!(self.has(tree));
        match tree {
            TraversalKind::Bvh2 | TraversalKind::Bvh8 => &self.first_slots,
            TraversalKind::Bvh4 | TraversalKind::Cwbvh8 => &self.on_demand.first_slots,
        }
    }

    /// Nodes of a tree without what is below, and its depth.
    fn size(&self, kind: TraversalKind) -> (u64, u32) {
        let (nodes, depth) = match kind {
            TraversalKind::Bvh2 => (self.nodes2.len(), self.depth2),
            TraversalKind::Bvh8 => (self.nodes8.len(), self.depth8),
            TraversalKind::Bvh4 | TraversalKind::Cwbvh8 => {
                (self.on_demand.nodes.len(), self.on_demand.depth)
            }
        };
        (nodes as u64, depth)
    }

    /// Bytes of the hierarchy in this process, with all its trees.
    pub fn host_bytes(&self) -> usize {
        fn bytes<T>(of: &[T]) -> usize {
            size_of_val(of)
        }
        let slots = bytes(&self.first_slots) + bytes(&self.on_demand.first_slots);
        let wide = bytes(&self.nodes8) + bytes(&self.on_demand.nodes);
        let below = self.below.as_ref().map_or(0, |below| {
            let trees: usize = below.trees.iter().map(|tree| tree.bvh.host_bytes()).sum();
            trees + bytes(&below.instances)
        });
        bytes(&self.nodes2) + wide + bytes(&self.blocks) + slots + below
    }

    /// Summary of the tree for a trace.
    pub fn summary(&self, traversal: TraversalKind) -> BvhSummary {
        let mut summary = self.own_summary(traversal);
        let Some(below) = &self.below else {
            return summary;
        };
        let instances = summary.triangles;
        let trees: Vec<_> = (below.trees.iter())
            .map(|tree| tree.bvh.own_summary(traversal))
            .collect();
        let sum = |of: fn(&BvhSummary) -> u64| trees.iter().map(of).sum::<u64>();
        summary
            .settings
            .push(("trees".to_owned(), trees.len().to_string()));
        summary.instances = Some(InstanceNodes {
            first: summary.nodes as u32,
            count: instances as u32,
        });
        summary.nodes += instances + sum(|tree| tree.nodes);
        summary.triangles = sum(|tree| tree.triangles);
        summary.leaves = sum(|tree| tree.leaves);
        summary.depth += 1 + trees.iter().map(|tree| tree.depth).max().unwrap_or(0);
        summary.sah_cost += below.sah_cost;
        summary
    }

    /// [`Self::summary`] without what is below.
    fn own_summary(&self, traversal: TraversalKind) -> BvhSummary {
        let (nodes, depth) = self.size(traversal);
        let mut settings = build::settings();
        let treelets = self
            .treelet_bytes
            .map(|bytes| ("treelet_bytes".to_owned(), bytes.to_string()));
        settings.extend(treelets);
        let child_order = self.child_order.setting();
        settings.extend(child_order.map(|(name, value)| (name.to_owned(), value.to_owned())));
        BvhSummary {
            builder: "obvhs 0.4 ploc+reinsertion, leaves by blocks".to_owned(),
            settings,
            traversal,
            triangles: self.triangles,
            nodes,
            leaves: self.leaves,
            depth,
            sah_cost: self.sah_cost,
            bytes_per_node: node_bytes(traversal) as u32,
            bytes_per_triangle: TRIANGLE_BYTES,
            instances: None,
            update: None,
        }
    }

    /// The nearest triangle that a ray hits. Of equally near ones, the lowest number.
    ///
    /// # Panics
    /// The tree was not built.
    pub fn closest<C: Counter, A: AlphaTest>(
        &self,
        tree: TraversalKind,
        ray: &Ray,
        stack: &mut TraversalStack,
        counter: &mut C,
        alpha: &A,
    ) -> Option<RayHit> {
        self.search::<false, C, A>(tree, ray, stack, counter, alpha)
    }

    /// The first triangle on the ray's segment that the traversal finds, which need not be the nearest.
    ///
    /// # Panics
    /// The tree was not built.
    pub fn blocker<C: Counter, A: AlphaTest>(
        &self,
        tree: TraversalKind,
        ray: &Ray,
        stack: &mut TraversalStack,
        counter: &mut C,
        alpha: &A,
    ) -> Option<RayHit> {
        self.search::<true, C, A>(tree, ray, stack, counter, alpha)
    }

    #[inline]
    fn search<const ANY_HIT: bool, C: Counter, A: AlphaTest>(
        &self,
        tree: TraversalKind,
        ray: &Ray,
        stack: &mut TraversalStack,
        counter: &mut C,
        alpha: &A,
    ) -> Option<RayHit> {
        match tree {
            TraversalKind::Bvh2 => self.search_in::<ANY_HIT, Two, C, A>(ray, stack, counter, alpha),
            TraversalKind::Bvh8 => {
                self.search_in::<ANY_HIT, Wide<false>, C, A>(ray, stack, counter, alpha)
            }
            TraversalKind::Bvh4 | TraversalKind::Cwbvh8 => {
                self.search_in::<ANY_HIT, Wide<true>, C, A>(ray, stack, counter, alpha)
            }
        }
    }

    #[inline]
    fn search_in<const ANY_HIT: bool, W: Width, C: Counter, A: AlphaTest>(
        &self,
        ray: &Ray,
        stack: &mut TraversalStack,
        counter: &mut C,
        alpha: &A,
    ) -> Option<RayHit> {
        if self.nodes2.is_empty() || !ray.is_valid() {
            return None;
        }
        if C::RECORDS && self.child_order != ChildOrder::Nearest {
            debug_assert!(self.below.is_none());
            return match self.child_order {
                ChildOrder::InnerFirst => {
                    search::<ANY_HIT, NodeOrder<true>, W, C, A>(self, ray, stack, counter, alpha)
                }
                _ => search::<ANY_HIT, NodeOrder<false>, W, C, A>(self, ray, stack, counter, alpha),
            };
        }
        match (self.instructions, &self.below) {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `instructions` is Avx2 only if the processor has it.
            (Instructions::Avx2, below) => unsafe {
                match below {
                    None => search_avx2::<ANY_HIT, W, C, A>(self, ray, stack, counter, alpha),
                    Some(below) => {
                        search_below_avx2::<ANY_HIT, W, C>(self, below, ray, stack, counter, alpha)
                    }
                }
            },
            (_, None) => search::<ANY_HIT, Scalar, W, C, A>(self, ray, stack, counter, alpha),
            (_, Some(below)) => {
                search_below::<ANY_HIT, Scalar, W, C>(self, below, ray, stack, counter, alpha)
            }
        }
    }
}

/// [`search_avx2`] for trees of instances.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn search_below_avx2<const ANY_HIT: bool, W: Width, C: Counter>(
    bvh: &Bvh,
    below: &Below,
    ray: &Ray,
    stack: &mut TraversalStack,
    counter: &mut C,
    alpha: &dyn AlphaTest,
) -> Option<RayHit> {
    search_below::<ANY_HIT, avx2::Avx2, W, C>(bvh, below, ray, stack, counter, alpha)
}

/// The traversal compiled for AVX2. Compiled for the baseline instruction set, the kernel runs at
/// an eighth of the speed.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn search_avx2<const ANY_HIT: bool, W: Width, C: Counter, A: AlphaTest>(
    bvh: &Bvh,
    ray: &Ray,
    stack: &mut TraversalStack,
    counter: &mut C,
    alpha: &A,
) -> Option<RayHit> {
    search::<ANY_HIT, avx2::Avx2, W, C, A>(bvh, ray, stack, counter, alpha)
}
