//! The optional columns of a small scene, checked by code that shares nothing with the tracer: brute force over
//! the stored triangles in `f64`, and a walk of the stored tree by the rules of FORMAT.md.

use super::reference_walk::ReferenceWalk;
use super::{SIZE_PX, scene, settings, trace};
use crate::bvh::TreeOptions;
use crate::ray::Ray;
use crate::scene::TraceScene;
use formats::raytrace::{
    ChildKind, ChildOrder, Hierarchy, HierarchyTriangle, Outcome, RayGeometry, RayKind, RayRecord,
    RayTile, Raytrace, TraversalKind, Visit,
};
use formats::view::Eye;
use glam::{DVec3, Vec3};

/// A stored ray with its record and its visits.
struct Stored {
    record: RayRecord,
    geometry: RayGeometry,
    visits: Vec<Visit>,
}

/// All rays of a trace, and its hierarchy.
fn columns(options: TreeOptions) -> (Vec<Stored>, Hierarchy) {
    let scene = TraceScene::with_tree(scene(), options).expect("small");
    let (_, bytes) = trace(&scene, settings(options.kind), SIZE_PX);
    let trace = Raytrace::from_bytes(bytes).expect("opens");
    let (hierarchy, _) = trace.read_hierarchy().expect("reads").expect("is there");
    let (mut rays, mut tile) = (Vec::new(), RayTile::default());
    for eye in [Eye::Left, Eye::Right] {
        for number in 0..trace.tables().tile_count() {
            trace
                .decode_tile_with_geometry(eye, number, &mut tile)
                .expect("decodes");
            let mut visits = tile.visits.iter().copied();
            for (record, geometry) in tile.rays.iter().zip(&tile.geometry) {
                rays.push(Stored {
                    record: *record,
                    geometry: *geometry,
                    visits: (visits.by_ref())
                        .take(record.visit_count() as usize)
                        .collect(),
                });
            }
        }
    }
    (rays, hierarchy)
}

/// Distance to a triangle by Moeller and Trumbore's method in `f64`, and how far inside its edges the line
/// passes (negative outside), as a barycentric weight.
fn intersect(ray: &RayGeometry, triangle: &HierarchyTriangle) -> Option<(f64, f64)> {
    let point = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    let [a, b, c] = triangle.vertices.map(point);
    let (origin, direction) = (point(ray.origin), point(ray.direction));
    let (p, q) = (b - a, c - a);
    let across = direction.cross(q);
    let determinant = p.dot(across);
    if determinant == 0.0 {
        return None;
    }
    let from: DVec3 = (origin - a) / determinant;
    let u = from.dot(across);
    let along = from.cross(p);
    let v = direction.dot(along);
    Some((q.dot(along), u.min(v).min(1.0 - u - v)))
}

/// Weights this close to an edge are decided by rounding.
const EDGE: f64 = 1e-5;
/// Largest difference of a distance, in metres; the scene is 20 m wide.
const NEAR_M: f64 = 1e-5;

#[test]
fn brute_force_over_the_stored_triangles_finds_every_stored_hit() {
    let (rays, hierarchy) = columns(TraversalKind::Bvh2.into());
    let (mut hits, mut misses, mut at_edges) = (0u32, 0u32, 0u32);
    for Stored {
        record, geometry, ..
    } in &rays
    {
        let limit = geometry.hit.map_or(geometry.t_max, |hit| hit.t);
        let mut found = None;
        for (slot, triangle) in (0u32..).zip(&hierarchy.triangles) {
            let Some((t, inside)) = intersect(geometry, triangle) else {
                continue;
            };
            if geometry.hit.is_some_and(|hit| hit.slot == slot) {
                assert!(
                    inside > -EDGE,
                    "{record:?} {geometry:?}: outside by {inside}"
                );
                assert!((t - f64::from(limit)).abs() < NEAR_M, "{geometry:?}: {t} m");
                found = Some(slot);
                continue;
            }
            // A nearer triangle explains itself by its alpha; a shadow ray ends at any triangle.
            let nearer = t > f64::from(geometry.t_min) + NEAR_M && t < f64::from(limit) - NEAR_M;
            if !nearer || triangle.masked || record.outcome == Outcome::Occluded {
                continue;
            }
            assert!(
                inside < EDGE,
                "{record:?} {geometry:?}: {slot} is nearer, at {t} m"
            );
            at_edges += u32::from(inside > -EDGE);
        }
        assert_eq!(found, geometry.hit.map(|hit| hit.slot), "{geometry:?}");
        hits += u32::from(found.is_some());
        misses += u32::from(found.is_none());
    }
    assert!(
        hits > 5000 && misses > 10_000,
        "{hits} hits, {misses} misses"
    );
    assert!(at_edges < hits / 100, "{at_edges} at edges");
}

/// Walks the stored tree. The distance of the hit triangle is the stored one, because FORMAT.md does not
/// define the rounding of others; `None` if the order depends on another triangle's distance.
fn walk(
    ray: &Stored,
    hierarchy: &Hierarchy,
    boxes: &ReferenceWalk<'_>,
) -> Option<(Vec<Visit>, u32)> {
    let geometry = &ray.geometry;
    let line = Ray {
        origin: geometry.origin.into(),
        direction: geometry.direction.into(),
        t_min: geometry.t_min,
        t_max: geometry.t_max,
    };
    let axes = boxes.axes(&line);
    let (mut visits, mut stack) = (Vec::new(), Vec::new());
    let (mut limit, mut deepest, mut next) = (geometry.t_max, 0, Some(ChildKind::Node(0)));
    loop {
        let kind = match next.take() {
            Some(kind) => kind,
            None => match stack.pop() {
                Some((enter, kind)) if enter <= limit => kind,
                Some(_) => continue,
                None => return Some((visits, deepest)),
            },
        };
        match kind {
            ChildKind::Node(node) => {
                visits.push(Visit::Node(node));
                let mut hit = boxes.hit_children(&line, &axes, node, limit).into_iter();
                next = hit.next().map(|(_, kind)| kind);
                stack.extend(hit.rev());
                deepest = deepest.max(stack.len() as u32);
            }
            ChildKind::Leaf(first, count) => {
                for slot in first..first + count {
                    visits.push(Visit::Triangle(slot));
                    if let Some(hit) = geometry.hit.filter(|hit| hit.slot == slot) {
                        limit = hit.t;
                        if ray.record.outcome == Outcome::Occluded {
                            return Some((visits, deepest));
                        }
                    } else if let Some((t, inside)) =
                        intersect(geometry, &hierarchy.triangles[slot as usize])
                        && inside > -EDGE
                        && t > 0.0
                        && t < f64::from(limit) + NEAR_M
                    {
                        return None;
                    }
                }
            }
        }
    }
}

#[test]
fn a_walk_of_the_stored_tree_makes_the_stored_visits() {
    for kind in [TraversalKind::Bvh2, TraversalKind::Bvh8] {
        for child_order in [
            ChildOrder::Nearest,
            ChildOrder::Node,
            ChildOrder::InnerFirst,
        ] {
            walks_make_the_stored_visits(TreeOptions {
                child_order,
                ..kind.into()
            });
        }
    }
}

fn walks_make_the_stored_visits(options: TreeOptions) {
    let (rays, hierarchy) = columns(options);
    let mut boxes = ReferenceWalk::new(&hierarchy, options.kind.width());
    boxes.child_order = options.child_order;
    let mut walked = [0u32; 4];
    for ray in &rays {
        let Some((visits, deepest)) = walk(ray, &hierarchy, &boxes) else {
            continue;
        };
        assert_eq!(visits, ray.visits, "{:?} {:?}", ray.record, ray.geometry);
        assert_eq!(deepest, ray.geometry.stack_depth, "{:?}", ray.geometry);
        walked[ray.record.kind as usize] += 1;
    }
    let all: u32 = walked.iter().sum();
    assert!(walked.iter().all(|count| *count > 200), "{walked:?}");
    assert!(all as usize > rays.len() / 2, "{all} of {}", rays.len());
}

#[test]
fn the_lines_of_rays_follow_from_their_parents_and_lights() {
    let (rays, _) = columns(TraversalKind::Bvh8.into());
    let mut primary: Option<&Stored> = None;
    let mut shadows = [0u32; 2];
    for ray in &rays {
        let g = &ray.geometry;
        let length = Vec3::from(g.direction).length();
        assert!((length - 1.0).abs() < 1e-6, "{length}");
        match ray.record.kind {
            RayKind::Primary => primary = Some(ray),
            _ if ray.record.parent == 0 => {
                let parent = &primary.expect("it comes first").geometry;
                let t = parent.hit.expect("it has children").t;
                let point = Vec3::from(parent.origin) + t * Vec3::from(parent.direction);
                assert!(point.distance(Vec3::from(g.origin)) < 1e-3, "{g:?}");
            }
            _ => {}
        }
        if ray.record.kind == RayKind::Shadow {
            // The scene has a directional light and a point light.
            shadows[usize::from(g.t_max < f32::MAX)] += 1;
        } else {
            assert_eq!(g.t_max, f32::MAX);
        }
    }
    assert!(shadows.iter().all(|count| *count > 500), "{shadows:?}");
}
