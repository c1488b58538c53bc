//! Relations between the optional columns of a trace, which `replay validate` checks. No reader relies on them.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::hierarchy::{Hierarchy, Parents};
use super::{RayGeometry, RayRecord, RayTile, Visit};
use crate::error::{Broken, ensure};
use std::collections::HashSet;

/// Checks the rays of a decoded tile. With visits and the hierarchy: a ray starts at the root, and each node
/// and triangle that it visits belongs to a node visited before. With geometry and visits: a hit triangle is
/// visited. With geometry and the hierarchy: a primary ray hits the triangle and at the distance that the
/// sample says.
///
/// # Errors
/// The first relation that does not hold; it names the ray.
pub fn check_relations(
    tile: &RayTile,
    hierarchy: Option<&(Hierarchy, Parents)>,
) -> Result<(), Broken> {
    let mut visits = tile.visits.as_slice();
    let mut geometry = tile.geometry.iter();
    for (number, pixel) in tile.pixels.iter().enumerate() {
        for (index, ray) in tile.rays_of(pixel).iter().enumerate() {
            let (own, rest) = split(visits, ray);
            visits = rest;
            let segment = geometry.next();
            let named = |broken: Broken| Broken {
                what: format!("ray {index} of sample {number}: {}", broken.what),
                ..broken
            };
            if let Some((_, parents)) = hierarchy {
                check_visits(own, parents).map_err(named)?;
            }
            if let Some(hit) = segment.and_then(|segment| segment.hit)
                && !tile.visits.is_empty()
            {
                let found = format_args!("slot {}", hit.slot);
                let is_visited = own.contains(&Visit::Triangle(hit.slot));
                ensure(is_visited, "hit", "a triangle that the ray visits", found)
                    .map_err(named)?;
            }
            if let (0, Some(segment), Some((hierarchy, _))) = (index, segment, hierarchy) {
                check_primary(pixel.hit.as_ref(), segment, hierarchy).map_err(named)?;
            }
        }
    }
    Ok(())
}

fn split<'a>(visits: &'a [Visit], ray: &RayRecord) -> (&'a [Visit], &'a [Visit]) {
    let count = usize::try_from(ray.visit_count()).unwrap_or(usize::MAX);
    visits.split_at_checked(count).unwrap_or_default()
}

fn check_visits(visits: &[Visit], parents: &Parents) -> Result<(), Broken> {
    let mut seen = HashSet::new();
    for (number, visit) in visits.iter().enumerate() {
        let parent = match *visit {
            Visit::Node(node) => {
                let parent = parents.of_nodes.get(node as usize).copied();
                let found = format_args!("{visit:?} again");
                ensure(seen.insert(node), "visits", "each node at most once", found)?;
                if number == 0 && node == 0 {
                    continue;
                }
                parent
            }
            Visit::Triangle(slot) => parents.of_slots.get(slot as usize).copied(),
        };
        ensure(
            parent.is_some_and(|parent| seen.contains(&parent)),
            "visits",
            "the root, then children of nodes visited before",
            format_args!("{visit:?} as number {number}"),
        )?;
    }
    Ok(())
}

fn check_primary(
    hit: Option<&super::Hit>,
    segment: &RayGeometry,
    hierarchy: &Hierarchy,
) -> Result<(), Broken> {
    let found = segment.hit.and_then(|hit| {
        let triangle = hierarchy.triangles.get(hit.slot as usize)?;
        Some((triangle.primitive, hit.t.to_bits()))
    });
    let expected = hit.map(|hit| (hit.primitive, hit.t.to_bits()));
    if found == expected {
        return Ok(());
    }
    let text = |hit: Option<(u32, u32)>| match hit {
        Some((primitive, t)) => format!("primitive {primitive} at {} m", f32::from_bits(t)),
        None => "a miss".to_owned(),
    };
    Err(Broken::new("hit", text(expected), text(found)))
}
