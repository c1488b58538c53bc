//! Small generated ray traces with all optional columns.

use crate::traces::{Random, ray_tables, ray_tile};
use formats::raytrace::{
    ChildKind, Hierarchy, HierarchyChild, HierarchyTriangle, Outcome, RayGeometry, RayTile,
    RaytraceTables, RaytraceWriter, SlotHit, TraversalKind, Visit, encode_ray_tile_with_geometry,
};
use formats::view::Eye;

/// Inner nodes of the generated tree.
const NODES: u32 = 60;
/// Triangles of the generated tree.
const TRIANGLES: u32 = 200;

/// Tables of a trace with a small tree.
pub fn column_tables(samples_per_px: u32, traversal: TraversalKind) -> RaytraceTables {
    let mut tables = ray_tables(samples_per_px, true);
    tables.bvh.traversal = traversal;
    tables.bvh.nodes = NODES.into();
    tables.bvh.triangles = TRIANGLES.into();
    tables.bvh.leaves = (NODES + 1).into();
    tables
}

fn corner(random: &mut Random) -> [f32; 3] {
    [0; 3].map(|_| random.below(900) as f32 / 9.0 - 50.0)
}

/// A random tree in which every node has two children, in any of its places.
fn hierarchy(traversal: TraversalKind, random: &mut Random) -> Hierarchy {
    let width = traversal.width();
    let (mut children, mut slot) = (vec![None; width * NODES as usize], 0);
    // Free places for children, each with the node that has it.
    let mut free: Vec<(u32, usize)> = Vec::new();
    for node in 0..NODES {
        let side = random.below(width);
        for place in [side, (side + 1) % width] {
            free.push((node, place));
        }
        if node + 1 == NODES {
            break;
        }
        let at = random.below(free.len());
        let (parent, place) = free.swap_remove(at);
        let kind = ChildKind::Node(node + 1);
        children[parent as usize * width + place] = Some(child(kind, random));
    }
    let leaves = free.len() as u32;
    for (number, (parent, place)) in (0..).zip(free) {
        let count = if number + 1 == leaves {
            TRIANGLES - slot
        } else {
            1 + random.below(3)
        };
        let kind = ChildKind::Leaf(slot, count);
        children[parent as usize * width + place] = Some(child(kind, random));
        slot += count;
    }
    let vertices: Vec<[f32; 3]> = (0..60).map(|_| corner(random)).collect();
    let mut triangle = |number: u32| HierarchyTriangle {
        primitive: number * 7919 % (1 << 20),
        masked: number.is_multiple_of(5),
        vertices: [0; 3].map(|_| vertices[random.below(60_usize)]),
    };
    Hierarchy {
        children,
        triangles: (0..TRIANGLES).map(&mut triangle).collect(),
    }
}

fn child(kind: ChildKind, random: &mut Random) -> HierarchyChild {
    let min = corner(random);
    HierarchyChild {
        kind,
        min,
        max: min.map(|x| x + random.below(4) as f32),
    }
}

/// Gives the rays of a tile geometry, and keeps its visits within the small tree.
fn add_geometry(tile: &mut RayTile, random: &mut Random) {
    for visit in &mut tile.visits {
        *visit = match *visit {
            Visit::Node(node) => Visit::Node(node % NODES),
            Visit::Triangle(slot) => Visit::Triangle(slot % TRIANGLES),
        };
    }
    let mut origin = [0.0; 3];
    for record in &tile.rays {
        // Some origins are shared by siblings.
        if random.below(3) > 0 {
            origin = corner(random);
        }
        let angle = random.below(63) as f32 / 10.0;
        let direction = match random.below(4) {
            0 => [0.0, 1.0, -0.0],
            _ => [0.6 * angle.sin(), 0.6 * angle.cos(), -0.8],
        };
        let hits = record.outcome != Outcome::Miss;
        tile.geometry.push(RayGeometry {
            origin,
            direction,
            t_min: random.below(2) as f32 * 1e-3,
            t_max: [7.0, f32::MAX][random.below(2_usize)],
            hit: hits.then(|| SlotHit {
                t: 1e-3 + random.below(6000) as f32 / 1000.0,
                slot: random.below(TRIANGLES),
            }),
            stack_depth: random.below(300),
        });
    }
}

/// A ray trace with visits, geometry and the content of its hierarchy. Its columns are valid each by itself; they
/// do not belong to one scene.
pub fn column_trace(traversal: TraversalKind, seed: u64) -> Vec<u8> {
    column_trace_of(&column_tables(1, traversal), seed)
}

/// The same with these tables, which must have a small tree.
///
/// # Panics
/// The tables have another tree.
pub fn column_trace_of(tables: &RaytraceTables, seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    let writer = RaytraceWriter::in_memory().expect("in memory");
    let tree = hierarchy(tables.bvh.traversal, &mut random);
    let mut writer = writer.with_hierarchy(tree);
    for eye in [Eye::Left, Eye::Right] {
        for number in 0..tables.tile_count() {
            let mut tile = ray_tile(tables, eye, number, &mut random);
            add_geometry(&mut tile, &mut random);
            let encoded = encode_ray_tile_with_geometry(tables, tables.camera(eye), &tile);
            writer
                .tile(&encoded.expect("a sound tile"))
                .expect("in memory");
        }
    }
    writer.into_bytes(tables).expect("sound tables")
}
