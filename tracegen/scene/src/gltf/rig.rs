//! The nodes of a file and the animation that plays.

use super::accessors::Buffers;
use super::channels::{self, Moved};
use super::transforms::Local;
use super::{morphs, tree};
use crate::SceneError;
use crate::animation::{Channel, Curve, Joint, Skeleton, WeightCurve};
use crate::files::{Origin, shown};
use crate::suggest::did_you_mean;
use crate::warnings::Warnings;
use gltf::json::Root;
use std::collections::HashMap;

/// Nodes and the curves that move them.
pub(super) struct Rig {
    pub skeleton: Skeleton,
    /// True for each node that an animation moves.
    pub moved: Vec<bool>,
    /// Curves of the weights of morph targets, by node.
    pub weights: HashMap<usize, WeightCurve>,
    /// Display name of the animation that plays.
    pub name: String,
    /// The last key's time.
    pub duration_s: f64,
}

/// The names of a file's animations.
pub(super) fn names(root: &Root) -> Vec<String> {
    let name = |(index, animation): (usize, &gltf::json::Animation)| {
        let named = animation.name.clone().filter(|name| !name.is_empty());
        named.unwrap_or_else(|| format!("animation-{index}"))
    };
    root.animations.iter().enumerate().map(name).collect()
}

/// The animations that play: the one with a name or an index, `all`, `none`, or the first one.
fn chosen(
    names: &[String],
    wanted: Option<&str>,
    origin: &Origin,
    warnings: &mut Warnings,
) -> Result<Vec<usize>, SceneError> {
    let all = 0..names.len();
    let Some(wanted) = wanted else {
        if let [first, _, ..] = names {
            warnings.say(&format!(
                "the first of {} animations plays, '{first}': --animation NAME plays another one, --animation all plays all",
                names.len()
            ));
        }
        return Ok(all.take(1).collect());
    };
    let by_name = names.iter().position(|name| name == wanted);
    let by_index = || wanted.parse().ok().filter(|index| all.contains(index));
    match by_name.or_else(by_index) {
        Some(index) => Ok(vec![index]),
        None if wanted == "all" => Ok(all.collect()),
        None if wanted == "none" => Ok(Vec::new()),
        None => {
            let expected = match names {
                [] => "a file with animations".to_owned(),
                names => format!(
                    "one of {}, a number below {}, all or none",
                    names.join(", "),
                    names.len()
                ),
            };
            let suggestion = did_you_mean(wanted, names.iter().map(String::as_str));
            Err(origin.invalid("animations", expected, format!("'{wanted}'{suggestion}")))
        }
    }
}

/// Reads the nodes and the curves of the animations that play. Returns `None` for a file without
/// moving nodes, skins and morph targets.
pub(super) fn read(
    root: &Root,
    transforms: &[Local],
    buffers: &Buffers<'_>,
    wanted: Option<&str>,
    warnings: &mut Warnings,
) -> Result<Option<Rig>, SceneError> {
    let names = names(root);
    let playing = chosen(&names, wanted, buffers.origin, warnings)?;
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let is_morphed = primitives.any(|primitive| primitive.targets.is_some());
    if playing.is_empty() && root.skins.is_empty() && !is_morphed {
        return Ok(None);
    }
    let name = match playing.as_slice() {
        [] => "nodes at rest".to_owned(),
        [index] => format!("animations[{index}] '{}'", shown(&names[*index])),
        _ => "animations".to_owned(),
    };
    let tree = tree::read(root, buffers.origin)?;
    let mut targets = channels::targets(root, playing, buffers.origin)?;
    let mut weights = HashMap::new();
    let mut joints = Vec::with_capacity(root.nodes.len());
    for (node, local) in transforms.iter().enumerate() {
        let mut curves = Vec::new();
        for target in targets.remove(&node).unwrap_or_default() {
            let keys = target.keys(buffers);
            match target.moved {
                Moved::Joint(channel) => {
                    curves.push((channel, keys.curve(channel, warnings)?));
                }
                Moved::Weights => match morphs::count_of_node(root, node) {
                    0 => warnings.count("weights of nothing", || {
                        format!(
                            "{} moves morph targets of nodes[{node}], which has none; left out",
                            target.place
                        )
                    }),
                    count => {
                        weights.insert(node, keys.weights(count, warnings)?);
                    }
                },
            }
        }
        joints.push(joint(root, node, local, curves, buffers.origin)?);
    }
    let of_joints = (joints.iter())
        .flat_map(|joint: &Joint| &joint.curves)
        .map(|(_, curve)| &curve.times_s);
    let times = of_joints.chain(weights.values().map(|curve: &WeightCurve| &curve.times_s));
    let duration_s = times
        .filter_map(|times| times.last())
        .fold(0.0, |a, b| f64::max(a, *b));
    let moved = tree.below(|node| !joints[node].curves.is_empty());
    Ok(Some(Rig {
        skeleton: Skeleton { joints, tree },
        moved,
        weights,
        name,
        duration_s,
    }))
}

/// A node with its curves.
pub(super) fn joint(
    root: &Root,
    index: usize,
    local: &Local,
    curves: Vec<(Channel, Curve)>,
    origin: &Origin,
) -> Result<Joint, SceneError> {
    if root.nodes[index].matrix.is_some() && !curves.is_empty() {
        return Err(origin.invalid(
            format!("nodes[{index}]"),
            "translation, rotation and scale in a node that an animation moves",
            "a matrix",
        ));
    }
    Ok(Joint {
        rest: local.transform(),
        parts: local.parts(),
        curves,
    })
}
