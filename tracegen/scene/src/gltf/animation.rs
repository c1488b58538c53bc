//! Animations that move a camera: the channels of its node and of the nodes above it.
//!
//! Channels of all animations are combined, because exporters write one animation per object. A
//! property with two channels is an error, because the file does not say which animation plays.

use super::accessors::{Buffers, at};
use super::{Parsed, nodes, parse, read_buffers};
use crate::SceneError;
use crate::files::{Origin, read_file, shown};
use crate::paths::{CameraTrack, Channel, Curve, Interpolation, Joint};
use crate::warnings::Warnings;
use glam::{DVec3, DVec4};
use gltf::json::Root;
use gltf::json::animation::{Interpolation as JsonInterpolation, Property, Sampler};
use gltf::json::validation::Checked;
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
    let bytes = read_file(path, "path", u64::MAX)?;
    let mut warnings = Warnings::default();
    // The scene loader's warnings do not concern the path.
    let Parsed {
        document,
        transforms,
        blob,
        ..
    } = parse(&origin, &bytes, &mut Warnings::default())?;
    let root = document.as_json();
    let buffers = read_buffers(&origin, root, blob, &mut warnings)?;
    let buffers = Buffers::new(root, buffers, &origin, bytes.len());
    let mut targets = targets(root, &origin)?;
    let parents = parents(root, &origin)?;
    let cameras = cameras(root);
    let moved = moved(root, &parents, &origin, |node| targets.contains_key(&node))?;
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
    let mut nodes: Vec<usize> = chain(&parents, *node).collect();
    nodes.reverse();
    let mut curves = Curves::new();
    for &node in &nodes {
        for (channel, place, sampler) in targets.remove(&node).unwrap_or_default() {
            let curve = curve(&buffers, &place, channel, sampler)?;
            curves.entry(node).or_default().push((channel, curve));
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
            let node = &root.nodes[index];
            let curves = curves.remove(&index).unwrap_or_default();
            if node.matrix.is_some() && !curves.is_empty() {
                return Err(origin.invalid(
                    format!("nodes[{index}]"),
                    "translation, rotation and scale in a node that an animation moves",
                    "a matrix",
                ));
            }
            Ok(Joint {
                rest: transforms[index].transform(),
                parts: transforms[index].parts(),
                curves,
            })
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

/// Nodes with a camera, and its name.
fn cameras(root: &Root) -> Vec<(usize, String)> {
    let named = |(index, node): (usize, &gltf::json::scene::Node)| {
        let camera = root.cameras.get(at(node.camera.as_ref()?))?;
        Some((index, nodes::camera_name(node, camera, index)))
    };
    root.nodes.iter().enumerate().filter_map(named).collect()
}

/// The parent of each node.
fn parents(root: &Root, origin: &Origin) -> Result<Vec<Option<usize>>, SceneError> {
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
    Ok(parents)
}

/// Whether an animation moves each node or one above it.
fn moved(
    root: &Root,
    parents: &[Option<usize>],
    origin: &Origin,
    is_target: impl Fn(usize) -> bool,
) -> Result<Vec<bool>, SceneError> {
    let mut moved: Vec<Option<bool>> = vec![None; parents.len()];
    let roots = (0..parents.len()).filter(|&node| parents[node].is_none());
    let mut stack: Vec<(usize, bool)> = roots.map(|node| (node, false)).collect();
    while let Some((node, above)) = stack.pop() {
        let here = above || is_target(node);
        moved[node] = Some(here);
        let children = root.nodes[node].children.iter().flatten();
        stack.extend(children.map(|child| (at(child), here)));
    }
    // Every node has one parent, so a node that no root reaches is part of a cycle.
    let reached = |(node, moved): (usize, Option<bool>)| {
        moved.ok_or_else(|| origin.invalid(format!("nodes[{node}]"), "a tree", "a cycle"))
    };
    moved.into_iter().enumerate().map(reached).collect()
}

/// A node and its ancestors.
fn chain(parents: &[Option<usize>], node: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(node), |&node| parents[node])
}

/// The animated properties of each node, with the channel's place in the file and its sampler.
type Targets<'a> = HashMap<usize, Vec<(Channel, String, &'a Sampler)>>;

/// Finds the animated properties of each node.
fn targets<'a>(root: &'a Root, origin: &Origin) -> Result<Targets<'a>, SceneError> {
    let mut targets = Targets::new();
    for (a, animation) in root.animations.iter().enumerate() {
        for (c, channel) in animation.channels.iter().enumerate() {
            let place = format!("animations[{a}].channels[{c}]");
            let property = match channel.target.path {
                Checked::Valid(Property::Translation) => Channel::Translation,
                Checked::Valid(Property::Rotation) => Channel::Rotation,
                Checked::Valid(Property::Scale) => Channel::Scale,
                Checked::Valid(Property::MorphTargetWeights) | Checked::Invalid => continue,
            };
            let node = at(&channel.target.node);
            // The crate checks a channel's sampler but not its target.
            let (Some(sampler), true) = (
                animation.samplers.get(at(&channel.sampler)),
                node < root.nodes.len(),
            ) else {
                return Err(origin.invalid(
                    format!("{place}.target.node"),
                    format!("one of {} nodes", root.nodes.len()),
                    node.to_string(),
                ));
            };
            let others = targets.entry(node).or_default();
            if others.iter().any(|(other, ..)| *other == property) {
                return Err(origin.invalid(
                    place,
                    format!("one channel for the {property:?} of nodes[{node}]").to_lowercase(),
                    "a second one",
                ));
            }
            others.push((property, place, sampler));
        }
    }
    Ok(targets)
}

fn curve(
    buffers: &Buffers<'_>,
    place: &str,
    channel: Channel,
    sampler: &Sampler,
) -> Result<Curve, SceneError> {
    let invalid = |expected: String, found: String| {
        let place = format!("{place}, its sampler");
        Err(buffers.origin.invalid(place, expected, found))
    };
    let interpolation = match sampler.interpolation {
        Checked::Valid(JsonInterpolation::Linear) => Interpolation::Linear,
        Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
        Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::Cubic,
        Checked::Invalid => {
            let expected = "LINEAR, STEP or CUBICSPLINE interpolation".to_owned();
            return invalid(expected, "another".to_owned());
        }
    };
    let times = buffers.floats::<1>(at(&sampler.input), "times: scalar floats")?;
    let times_s: Vec<f64> = times.iter().map(|[time]| f64::from(*time)).collect();
    let ascending = times_s.is_sorted_by(|a, b| a < b) && times_s.iter().all(|t| t.is_finite());
    if times_s.is_empty() || !ascending {
        return invalid(
            "at least one time, finite and ascending".to_owned(),
            format!("{} times that are not", times_s.len()),
        );
    }
    let values: Vec<DVec4> = if channel == Channel::Rotation {
        let values = buffers.floats::<4>(at(&sampler.output), "rotations: vectors of 4 floats")?;
        values
            .into_iter()
            .map(|q| DVec4::from_array(q.map(f64::from)))
            .collect()
    } else {
        let values = buffers.floats::<3>(at(&sampler.output), "vectors of 3 floats")?;
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from)).extend(0.0);
        values.into_iter().map(wide).collect()
    };
    let a_key = if interpolation == Interpolation::Cubic {
        3
    } else {
        1
    };
    if values.len() != times_s.len() * a_key {
        return invalid(
            format!(
                "{} values for {} times",
                times_s.len() * a_key,
                times_s.len()
            ),
            values.len().to_string(),
        );
    }
    if let Some(key) = values.iter().position(|value| !value.is_finite()) {
        return invalid(
            "finite values".to_owned(),
            format!("{} at {key}", values[key]),
        );
    }
    // Each value of a cubic curve is stored between its two tangents.
    let keys = || values.iter().skip(a_key / 2).step_by(a_key);
    let unit = |q: &&DVec4| (q.length() - 1.0).abs() <= 1e-2;
    if channel == Channel::Rotation && keys().count() != keys().filter(unit).count() {
        return invalid(
            "unit quaternions (a length of 1, to 0.01)".to_owned(),
            "another length".to_owned(),
        );
    }
    Ok(Curve {
        interpolation,
        times_s,
        values,
    })
}
