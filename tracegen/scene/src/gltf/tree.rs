//! The nodes of a file as a tree.

use super::accessors::at;
use crate::SceneError;
use crate::animation::Tree;
use crate::files::Origin;
use gltf::json::Root;

/// Checks that every node has at most one parent and that none is its own ancestor.
pub(super) fn read(root: &Root, origin: &Origin) -> Result<Tree, SceneError> {
    let mut parents = vec![None; root.nodes.len()];
    for (parent, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten().map(at) {
            // The indices were checked on loading.
            if parents[child].replace(parent).is_some() {
                return Err(origin.invalid(
                    format!("nodes[{child}]"),
                    "a tree, every node with one parent",
                    "two parents",
                ));
            }
        }
    }
    let mut order: Vec<usize> = (0..parents.len())
        .filter(|&node| parents[node].is_none())
        .collect();
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        order.extend(root.nodes[node].children.iter().flatten().map(at));
        next += 1;
    }
    // Every node has one parent, so a node that no root reaches is part of a cycle.
    if order.len() < parents.len() {
        let mut reached = vec![false; parents.len()];
        for &node in &order {
            reached[node] = true;
        }
        let node = reached.iter().position(|reached| !reached);
        let place = format!("nodes[{}]", node.unwrap_or_default());
        return Err(origin.invalid(place, "a tree", "a cycle"));
    }
    Ok(Tree { parents, order })
}
