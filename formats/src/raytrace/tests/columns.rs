//! Tests of the optional columns: round trip, damage, and data that must not be written.

use super::super::*;
use super::{eyes_and_tiles, tables, tile};
use crate::error::FormatError;
use crate::random::Random;
use proptest::prelude::*;

/// A tile with geometry that obeys the format: some of it as predicted, some of it arbitrary.
fn with_geometry(tables: &RaytraceTables, eye: Eye, number: u32, seed: u64) -> RayTile {
    let mut tile = tile(tables, eye, number, seed);
    let mut random = Random(seed ^ 0x5EED);
    let camera = tables.camera(eye);
    for (index, record) in tile.rays.iter().enumerate() {
        let mut unit = || {
            let [x, y, z] = [0; 3].map(|_| random.below(2001) as f32 / 1000.0 - 1.0);
            (Vec3::new(x, y, z) + Vec3::splat(1e-3))
                .normalize()
                .to_array()
        };
        let direction = match index % 4 {
            0 => [-0.0, 1.0, 0.0],
            1 => [0.0, 1.0, -0.0],
            _ => unit(),
        };
        let origin = match (record.kind, random.below(3)) {
            (RayKind::Primary, 0) => camera.position,
            (_, 1) => [1.5, -1e18, 3e-40],
            _ => [0; 3].map(|_| random.below(4000) as f32 / 7.0 - 200.0),
        };
        let t_max = match random.below(3) {
            0 => 7.0,
            _ => f32::MAX,
        };
        let hits = record.outcome != Outcome::Miss;
        tile.geometry.push(RayGeometry {
            origin,
            direction,
            t_min: random.below(2) as f32 * 1e-3,
            t_max,
            hit: hits.then(|| SlotHit {
                t: 1e-3 + random.below(6000) as f32 / 1000.0,
                slot: random.below(40),
            }),
            stack_depth: random.below(300),
        });
    }
    tile
}

/// A random tree of the summary's counts: each node gets an inner node and leaves, or leaves alone.
fn hierarchy(tables: &RaytraceTables, seed: u64) -> Hierarchy {
    let mut random = Random(seed);
    let width = tables.bvh.traversal.width();
    let nodes = u32::try_from(tables.bvh.nodes).unwrap();
    let (mut children, mut slot) = (Vec::new(), 0);
    let corner = |random: &mut Random| [0; 3].map(|_| random.below(900) as f32 / 9.0 - 50.0);
    for node in 0..nodes {
        let mut own = vec![None; width];
        let min = corner(&mut random);
        let max = min.map(|x| x + random.below(4) as f32);
        let last = node + 1 == nodes;
        for (side, child) in own.iter_mut().take(2).enumerate() {
            let kind = match (side, last) {
                (0, false) => ChildKind::Node(node + 1),
                _ => {
                    let count = if slot == 0 { 40 - nodes } else { 1 };
                    slot += count;
                    ChildKind::Leaf(slot - count, count)
                }
            };
            *child = Some(HierarchyChild { kind, min, max });
        }
        own.rotate_right(node as usize % width);
        children.extend(own);
    }
    assert_eq!(slot, 40);
    let vertices: Vec<[f32; 3]> = (0..60).map(|_| corner(&mut random)).collect();
    let triangle = |number: u32| HierarchyTriangle {
        primitive: number * 7919 % 41,
        masked: number.is_multiple_of(5),
        vertices: [0; 3].map(|_| vertices[random.below(60) as usize]),
    };
    Hierarchy {
        children,
        triangles: (0..40).map(triangle).collect(),
    }
}

fn file(tables: &RaytraceTables, seed: u64) -> Vec<u8> {
    let writer = RaytraceWriter::in_memory().expect("in memory");
    let mut writer = writer.with_hierarchy(hierarchy(tables, seed));
    for (eye, number) in eyes_and_tiles(tables) {
        let tile = with_geometry(tables, eye, number, seed + u64::from(number));
        let encoded = encode_ray_tile_with_geometry(tables, tables.camera(eye), &tile);
        writer.tile(&encoded.expect("encodes")).expect("appends");
    }
    writer.into_bytes(tables).expect("writes")
}

fn tables_of(has_visits: bool, traversal: TraversalKind) -> RaytraceTables {
    let mut tables = tables(has_visits);
    tables.bvh.traversal = traversal;
    tables
}

fn read_all(bytes: Vec<u8>) -> crate::Result<()> {
    let trace = Raytrace::from_bytes(bytes)?;
    let mut tile = RayTile::default();
    for (eye, number) in eyes_and_tiles(trace.tables()) {
        trace.decode_tile_with_geometry(eye, number, &mut tile)?;
    }
    trace.read_hierarchy().map(|_| ())
}

const TREES: [TraversalKind; 4] = TraversalKind::ALL;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn columns_are_read_as_written(seed in any::<u64>(), visits in any::<bool>(), tree in 0usize..4) {
        let tables = tables_of(visits, TREES[tree]);
        let seed = seed >> 8;
        let trace = Raytrace::from_bytes(file(&tables, seed)).expect("opens");
        let minor = if visits || tree % 2 == 1 { 4 } else { 3 };
        prop_assert_eq!(trace.container().version(), (1, minor));
        let mut read = RayTile::default();
        for (eye, number) in eyes_and_tiles(&tables) {
            trace.decode_tile_with_geometry(eye, number, &mut read).expect("decodes");
            let written = with_geometry(&tables, eye, number, seed + u64::from(number));
            prop_assert_eq!(&read, &written);
        }
        let (found, _) = trace.read_hierarchy().expect("decodes").expect("is there");
        prop_assert_eq!(found, hierarchy(&tables, seed));
    }

    #[test]
    fn a_flipped_bit_is_found(at in 0.0f64..1.0, bit in 0u8..8) {
        let mut bytes = file(&tables(false), 3);
        let at = (at * bytes.len() as f64) as usize;
        bytes[at] ^= 1 << bit;
        prop_assert!(read_all(bytes).is_err(), "byte {}", at);
    }

    #[test]
    fn damage_behind_a_valid_checksum_never_panics(
        at in 0.0f64..1.0,
        value in any::<u8>(),
        tree in 0usize..2,
    ) {
        let tables = tables_of(true, TREES[tree]);
        let first = with_geometry(&tables, Eye::Left, 0, 5);
        let hierarchy = hierarchy(&tables, 5);
        let (eye, bvh) = (tables.camera(Eye::Left), &tables.bvh);
        let damaged = |mut bytes: Vec<u8>| {
            let at = (at * bytes.len() as f64) as usize;
            bytes[at] = value;
            bytes
        };
        let geometry = geometry_codec::encode(&tables, eye, &first).expect("obeys the format");
        // Either result is fine, as long as it neither panics nor loops endlessly.
        let _ = geometry_codec::decode(&tables, eye, &damaged(geometry), &first);
        let nodes = hierarchy_codec::encode_nodes(bvh, &hierarchy);
        if let Ok((_, children)) = hierarchy_codec::decode_nodes(bvh, &damaged(nodes)) {
            let _ = Hierarchy { children, ..hierarchy.clone() }.check(bvh);
        }
        let triangles = hierarchy_codec::encode_triangles(&hierarchy.triangles);
        let _ = hierarchy_codec::decode_triangles(bvh, &damaged(triangles));
    }
}

#[test]
fn a_trace_without_columns_has_none_and_the_old_version() {
    let tables = tables(false);
    let mut writer = RaytraceWriter::in_memory().expect("in memory");
    for (eye, number) in eyes_and_tiles(&tables) {
        let encoded = encode_ray_tile(&tile(&tables, eye, number, 1), false);
        writer.tile(&encoded.expect("encodes")).expect("appends");
    }
    let trace = Raytrace::from_bytes(writer.into_bytes(&tables).expect("writes")).expect("opens");
    assert_eq!(trace.container().version(), (1, 0));
    assert!(!trace.has_geometry() && !trace.has_hierarchy());
    assert!(trace.read_hierarchy().expect("reads").is_none());
    let mut tile = RayTile::default();
    trace
        .decode_tile_with_geometry(Eye::Left, 0, &mut tile)
        .expect("decodes");
    assert!(tile.geometry.is_empty());
}

#[test]
fn geometry_that_violates_the_format_is_not_written() {
    let tables = tables(false);
    let good = with_geometry(&tables, Eye::Left, 0, 9);
    let hit = good
        .geometry
        .iter()
        .position(|ray| ray.hit.is_some())
        .expect("a hit");
    let text = |change: &dyn Fn(&mut RayGeometry)| {
        let mut bad = good.clone();
        change(&mut bad.geometry[hit]);
        match encode_ray_tile_with_geometry(&tables, tables.camera(Eye::Left), &bad) {
            Err(FormatError::Unwritable { expected, .. }) => expected,
            other => panic!("written: {other:?}"),
        }
    };
    assert_eq!(
        text(&|ray| ray.origin[1] = f32::NAN),
        "an origin within 1e18 m"
    );
    assert_eq!(
        text(&|ray| ray.direction[1] = 1.5),
        "a direction of unit length"
    );
    let limits = "finite limits, the first at least 0 and at most the second";
    assert_eq!(text(&|ray| ray.t_max = f32::INFINITY), limits);
    assert_eq!(text(&|ray| ray.t_min = -1.0), limits);
    assert_eq!(text(&|ray| ray.hit = None), "a hit unless the ray missed");
    let slot = |ray: &mut RayGeometry| ray.hit = ray.hit.map(|hit| SlotHit { slot: 40, ..hit });
    assert_eq!(text(&slot), "a slot below 40");
}

#[test]
fn hierarchies_that_are_no_trees_are_not_written() {
    let tables = tables(false);
    let text = |change: &dyn Fn(&mut Hierarchy)| {
        let mut bad = hierarchy(&tables, 9);
        change(&mut bad);
        bad.check(&tables.bvh).expect_err("refused").expected
    };
    let child = |at: usize, kind: ChildKind| {
        move |hierarchy: &mut Hierarchy| {
            let child = hierarchy.children[at].as_mut().expect("a child");
            child.kind = kind;
        }
    };
    let at_most_once = "a node behind its parent and of no other";
    assert_eq!(text(&child(0, ChildKind::Node(0))), at_most_once);
    assert_eq!(text(&child(1, ChildKind::Node(1))), at_most_once);
    assert_eq!(text(&child(0, ChildKind::Node(17))), at_most_once);
    let leaf = "a leaf of slots of no other leaf";
    assert_eq!(text(&child(1, ChildKind::Leaf(39, 2))), leaf);
    assert_eq!(text(&child(1, ChildKind::Leaf(0, 0))), leaf);
    let lost = |hierarchy: &mut Hierarchy| hierarchy.children[0] = None;
    assert_eq!(text(&lost), "a child of a node before it");
    let lost = |hierarchy: &mut Hierarchy| hierarchy.children[1] = None;
    assert_eq!(text(&lost), "every slot in a leaf");
    let inverted = |hierarchy: &mut Hierarchy| {
        let child = hierarchy.children[0].as_mut().expect("a child");
        child.min[2] = child.max[2] + 1.0;
    };
    assert_eq!(text(&inverted), "boxes within 1e18 m, minimum first");
    let fewer = |hierarchy: &mut Hierarchy| {
        hierarchy.triangles.pop();
    };
    assert_eq!(text(&fewer), "17 nodes and 40 triangles");
}

#[test]
fn relations_between_columns_are_checked() {
    let mut tables = tables(true);
    tables.bvh.nodes = 2;
    let hierarchy = Hierarchy {
        children: [
            ChildKind::Node(1),
            ChildKind::Leaf(0, 2),
            ChildKind::Leaf(2, 1),
            ChildKind::Leaf(3, 1),
        ]
        .map(|kind| {
            let (min, max) = ([0.0; 3], [1.0; 3]);
            Some(HierarchyChild { kind, min, max })
        })
        .to_vec(),
        triangles: vec![HierarchyTriangle::default(); 4],
    };
    tables.bvh.triangles = 4;
    tables.bvh.leaves = 3;
    let parents = hierarchy.check(&tables.bvh).expect("a tree");
    let content = (hierarchy, parents);
    let mut tile = RayTile {
        pixels: vec![PixelRecord {
            ray_count: 1,
            ..PixelRecord::default()
        }],
        rays: vec![RayRecord {
            outcome: Outcome::Hit,
            parent: NO_PARENT,
            steps: 2,
            triangle_tests: 1,
            ..RayRecord::default()
        }],
        visits: vec![Visit::Node(0), Visit::Node(1), Visit::Triangle(3)],
        ..RayTile::default()
    };
    check_relations(&tile, Some(&content)).expect("a walk from the root");
    let fault = |tile: &RayTile| {
        let broken = check_relations(tile, Some(&content)).expect_err("no walk");
        (broken.what, broken.expected)
    };
    let walk = "the root, then children of nodes visited before";
    for visits in [
        vec![Visit::Node(1), Visit::Node(0), Visit::Triangle(3)],
        vec![Visit::Node(0), Visit::Triangle(3), Visit::Node(1)],
    ] {
        let other = RayTile {
            visits,
            ..tile.clone()
        };
        assert_eq!(
            fault(&other),
            ("ray 0 of sample 0: visits".to_owned(), walk.to_owned())
        );
    }
    tile.geometry = vec![RayGeometry {
        hit: Some(SlotHit { t: 1.0, slot: 2 }),
        ..RayGeometry::default()
    }];
    assert_eq!(fault(&tile).1, "a triangle that the ray visits");
    tile.geometry[0].hit = Some(SlotHit { t: 1.0, slot: 3 });
    assert_eq!(fault(&tile).1, "a miss");
}
