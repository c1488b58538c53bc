//! Animations that move a camera: the channels of its node and of its ancestors.
//!
//! Channels of all animations are combined, because exporters write one animation per object. A
//! property with two channels is an error, because the file does not say which animation plays.

use super::accessors::{Buffers, at};
use super::channels::{self, Moved};
use super::{Parsed, nodes, parse, read_buffers, rig, tree};
use crate::SceneError;
use crate::animation::{Channel, Curve};
use crate::files::{Origin, shown};
use crate::lookup::Lookup;
use crate::paths::CameraTrack;
use crate::warnings::Warnings;
use glam::DVec3;
use gltf::json::Root;
use std::collections::HashMap;
use std::path::Path;

/// The curves of one file by node.
type Curves = HashMap<usize, Vec<(Channel, Curve)>>;

/// Reads the path of an animated camera: the one with that name (its node's or its own, with or
/// without `cam_`), or else the first one that an animation moves. Also returns warnings.
pub(crate) fn camera_track(
    path: &Path,
    camera: Option<&str>,
) -> Result<(CameraTrack, Vec<String>), SceneError> {
    let origin = Origin::new(path);
    let mut warnings = Warnings::default();
    // The scene loader's warnings do not concern the path.
    let Parsed {
        document,
        transforms,
        blob,
        json_bytes,
        ..
    } = parse(&origin, "path", &mut Warnings::default())?;
    let root = document.as_json();
    let buffers = read_buffers(&origin, root, blob, &mut Lookup::default(), &mut warnings)?;
    let buffers = Buffers::new(root, buffers, &origin, json_bytes);
    let mut targets = channels::targets(root, 0..root.animations.len(), &origin)?;
    let tree = tree::read(root, &origin)?;
    let cameras = cameras(root);
    let is_moved = |of_node: &Vec<channels::Target<'_>>| {
        of_node.iter().any(|target| target.moved != Moved::Weights)
    };
    let moved = tree.below(|node| targets.get(&node).is_some_and(is_moved));
    let chosen = match camera {
        None => cameras.iter().find(|(node, _)| moved[*node]),
        Some(wanted) => {
            let full = |(_, name): &&(usize, String)| name == wanted;
            let short = |(_, name): &&(usize, String)| name.strip_prefix("cam_") == Some(wanted);
            let named = cameras.iter().find(full);
            (named.or_else(|| cameras.iter().find(short))).filter(|(node, _)| moved[*node])
        }
    };
    let Some((node, name)) = chosen else {
        let animated: Vec<&str> = (cameras.iter())
            .filter(|(node, _)| moved[*node])
            .map(|(_, name)| name.as_str())
            .collect();
        let expected = match animated.as_slice() {
            [] => "a camera that an animation moves".to_owned(),
            some => format!("an animated camera: {}", some.join(", ")),
        };
        let found = camera.map_or_else(|| "none".to_owned(), |name| format!("'{name}'"));
        return Err(origin.invalid("animations", expected, found));
    };
    let mut nodes: Vec<usize> = tree.chain(*node).collect();
    nodes.reverse();
    let mut curves = Curves::new();
    for &node in &nodes {
        for target in targets.remove(&node).unwrap_or_default() {
            if let Moved::Joint(channel) = target.moved {
                let curve = target.keys(&buffers).curve(channel, &mut warnings)?;
                curves.entry(node).or_default().push((channel, curve));
            }
        }
    }
    let times = || {
        curves
            .values()
            .flatten()
            .flat_map(|(_, curve)| &curve.times_s)
    };
    let first = times().copied().fold(f64::INFINITY, f64::min);
    let last = times().copied().fold(f64::NEG_INFINITY, f64::max);
    let joints = (nodes.iter())
        .map(|&index| {
            let curves = curves.remove(&index).unwrap_or_default();
            rig::joint(root, index, &transforms[index], curves, &origin)
        })
        .collect::<Result<_, _>>()?;
    let track = CameraTrack {
        file: path.to_owned(),
        camera: shown(name),
        origin: DVec3::ZERO,
        joints,
        span_s: [first, last],
    };
    Ok((track, warnings.into_sentences()))
}

/// The nodes with a camera, and the camera's name.
fn cameras(root: &Root) -> Vec<(usize, String)> {
    let named = |(index, node): (usize, &gltf::json::scene::Node)| {
        let camera = root.cameras.get(at(node.camera.as_ref()?))?;
        Some((index, nodes::camera_name(node, camera, index)))
    };
    root.nodes.iter().enumerate().filter_map(named).collect()
}
