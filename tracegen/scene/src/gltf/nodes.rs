//! The node graph: transforms of meshes, cameras and lights to the world.

use super::accessors::Buffers;
use super::transforms::Local;
use crate::animation::has_scale;
use crate::cameras::look_of_node;
use crate::files::Origin;
use crate::warnings::Warnings;
use crate::{Camera, Light, SceneError};
use glam::{Affine3A, DAffine3, Vec3};
use gltf::json::Root;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type as LightType};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;

/// Near plane of a camera that gives none that can be used, metres.
const DEFAULT_NEAR_M: f32 = 0.05;

/// The placed nodes in depth-first order, with transforms to the world.
#[derive(Default)]
pub(super) struct Placed {
    /// Nodes with a mesh.
    pub meshes: Vec<(usize, DAffine3)>,
    /// Nodes with a camera.
    pub cameras: Vec<(usize, DAffine3)>,
    /// Nodes with a light.
    pub lights: Vec<(usize, DAffine3)>,
}

/// Visits the default scene (the first one, or every root node, where the file names none).
///
/// `local` gives a node's transform to its parent.
pub(super) fn walk(
    root: &Root,
    local: impl Fn(usize) -> DAffine3,
    origin: &Origin,
) -> Result<Placed, SceneError> {
    let scene = root.scene.map_or(0, |s| s.value());
    let roots: Vec<usize> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(super::accessors::at).collect(),
        None => parentless(root),
    };
    let mut placed = Placed::default();
    let mut seen = vec![false; root.nodes.len()];
    // An explicit stack, so that a long chain of nodes does not overflow the call stack.
    let mut stack: Vec<(usize, DAffine3)> = roots
        .into_iter()
        .rev()
        .map(|node| (node, DAffine3::IDENTITY))
        .collect();
    while let Some((index, parent)) = stack.pop() {
        let node = &root.nodes[index];
        if std::mem::replace(&mut seen[index], true) {
            return Err(origin.invalid(
                format!("nodes[{index}]"),
                "a tree, every node reached once",
                "a cycle or a node with two parents",
            ));
        }
        let transform = parent * local(index);
        let rounded = transform.as_affine3a();
        if !rounded.is_finite() {
            return Err(origin.invalid(
                format!("nodes[{index}]"),
                "a finite transform",
                "NaN or infinity",
            ));
        }
        if node.mesh.is_some() {
            placed.meshes.push((index, transform));
        }
        if node.camera.is_some() {
            placed.cameras.push((index, transform));
        }
        if node
            .extensions
            .as_ref()
            .is_some_and(|e| e.khr_lights_punctual.is_some())
        {
            placed.lights.push((index, transform));
        }
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), transform)));
    }
    Ok(placed)
}

/// An instance of a node's mesh.
#[derive(Clone, Copy)]
pub(super) struct NodeInstance {
    /// To the node.
    pub offset: DAffine3,
    /// The transform of a node to the world.
    pub transform: DAffine3,
}

/// The transforms of a node's mesh: one, or one per instance (EXT_mesh_gpu_instancing). An instance
/// without scale is left out unless its node `moves`.
pub(super) fn mesh_transforms(
    index: usize,
    local: &Local,
    (transform, moves): (DAffine3, bool),
    buffers: &Buffers<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<NodeInstance>, SceneError> {
    let mut instances = match local.instancing() {
        None => vec![NodeInstance {
            offset: DAffine3::IDENTITY,
            transform,
        }],
        Some(instancing) => {
            let relative = instancing.transforms(index, buffers)?;
            (relative.into_iter())
                .map(|offset| NodeInstance {
                    offset,
                    transform: transform * offset,
                })
                .collect()
        }
    };
    instances.retain(|instance| {
        let keeps = moves || has_scale(&instance.transform.as_affine3a());
        if !keeps {
            warnings.count("no scale", || {
                format!("nodes[{index}] is scaled to nothing or beyond measure; skipped")
            });
        }
        keeps
    });
    Ok(instances)
}

fn parentless(root: &Root) -> Vec<usize> {
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        is_child[child.value()] = true;
    }
    (0..root.nodes.len()).filter(|&n| !is_child[n]).collect()
}

/// The name of a camera's node, or else the camera's own.
pub(super) fn camera_name(node: &Node, camera: &gltf::json::Camera, index: usize) -> String {
    [&node.name, &camera.name]
        .into_iter()
        .flatten()
        .find(|name| !name.is_empty())
        .cloned()
        .unwrap_or_else(|| format!("camera-{index}"))
}

/// Field of view of an orthographic camera, which has none of its own. Displays choose another one.
const ORTHOGRAPHIC_VFOV_DEG: f32 = 60.0;

/// A camera node looks along its -z. Returns `None` if the node has no direction.
///
/// Eyes see in perspective, so an orthographic camera gives only its place and its planes.
pub(super) fn camera(
    root: &Root,
    index: usize,
    transform: Affine3A,
    warnings: &mut Warnings,
) -> Option<Camera> {
    let node = &root.nodes[index];
    let camera = root.cameras.get(node.camera?.value())?;
    let name = camera_name(node, camera, index);
    let (vfov_deg, mut near, mut far) = match (&camera.perspective, &camera.orthographic) {
        (Some(of), _) => (
            of.yfov.to_degrees(),
            of.znear,
            of.zfar.unwrap_or(f32::INFINITY),
        ),
        (None, Some(of)) => {
            warnings.count("orthographic", || {
                format!(
                    "camera '{name}' is orthographic; the eyes see in perspective from its place"
                )
            });
            (ORTHOGRAPHIC_VFOV_DEG, of.znear, of.zfar)
        }
        (None, None) => return None,
    };
    let Some((eye, target, up)) = look_of_node(&transform) else {
        warnings.count("no direction", || {
            format!("camera '{name}' has no direction; skipped")
        });
        return None;
    };
    if !(near > 0.0 && near.is_finite() && far > near) {
        warnings.count("planes", || {
            format!(
                "camera '{name}' has planes {near} and {far}; {DEFAULT_NEAR_M} m and infinity are used"
            )
        });
        (near, far) = (DEFAULT_NEAR_M, f32::INFINITY);
    }
    Some(Camera {
        name,
        eye,
        target,
        up,
        vfov_deg,
        near,
        far,
    })
}

/// Punctual lights with unchanged photometric intensity. A spot light becomes a point light.
pub(super) fn light(
    root: &Root,
    index: usize,
    transform: Affine3A,
    warnings: &mut Warnings,
) -> Option<Light> {
    let reference = root.nodes[index]
        .extensions
        .as_ref()?
        .khr_lights_punctual
        .as_ref()?;
    let light: &JsonLight = root.get(reference.light)?;
    let color = Vec3::from(light.color) * light.intensity;
    if !color.is_finite() || color.min_element() < 0.0 {
        warnings.count("light colour", || {
            format!("nodes[{index}] has a light of colour {color}; skipped")
        });
        return None;
    }
    match &light.type_ {
        Checked::Valid(LightType::Directional) => {
            let direction = Vec3::from(-transform.matrix3.z_axis).try_normalize()?;
            Some(Light::Directional { direction, color })
        }
        kind => {
            if *kind == Checked::Valid(LightType::Spot) {
                warnings.count("spot light", || {
                    format!("nodes[{index}] has a spot light; taken as a point light")
                });
            }
            let position = Vec3::from(transform.translation);
            Some(Light::Point { position, color })
        }
    }
}
