//! The node graph: transforms of meshes, cameras and lights to the world.

use super::accessors::Buffers;
use super::transforms::Local;
use crate::files::Origin;
use crate::warnings::Warnings;
use crate::{Camera, Light, SceneError};
use glam::{Affine3A, DAffine3, Vec3};
use gltf::json::Root;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type as LightType};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;

/// Far plane of a camera whose projection is infinite, metres.
const DEFAULT_FAR_M: f32 = 1000.0;

/// Distance from zero beyond which one step of single precision, relative to a target one metre
/// ahead, visibly changes a camera's direction.
const FAR_OUT: f32 = 1024.0;

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
pub(super) fn walk(
    root: &Root,
    transforms: &[Local],
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
        let transform = parent * transforms[index].transform();
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

/// The transforms of a node's mesh: one, or one per instance (EXT_mesh_gpu_instancing).
pub(super) fn mesh_transforms(
    index: usize,
    local: &Local,
    transform: DAffine3,
    buffers: &Buffers<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<DAffine3>, SceneError> {
    let mut transforms = match local.instancing() {
        None => vec![transform],
        Some(instancing) => {
            let relative = instancing.transforms(index, buffers)?;
            (relative.into_iter())
                .map(|instance| transform * instance)
                .collect()
        }
    };
    // The determinant must be neither 0 nor too small or large to transform normals.
    let has_scale = |t: &DAffine3| t.as_affine3a().matrix3.determinant().is_normal();
    transforms.retain(|transform| {
        let keeps = has_scale(transform);
        if !keeps {
            warnings.count("no scale", || {
                format!("nodes[{index}] is scaled to nothing or beyond measure; skipped")
            });
        }
        keeps
    });
    Ok(transforms)
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

/// A camera node looks along its -z. The target is one metre ahead, or further for an eye so far
/// from zero that single precision has few steps in a metre.
pub(super) fn camera(
    root: &Root,
    index: usize,
    transform: Affine3A,
    warnings: &mut Warnings,
) -> Option<Camera> {
    let node = &root.nodes[index];
    let camera = root.cameras.get(node.camera?.value())?;
    let name = camera_name(node, camera, index);
    let Some(perspective) = &camera.perspective else {
        warnings.count("orthographic", || {
            format!("camera '{name}' is orthographic; skipped")
        });
        return None;
    };
    let eye = Vec3::from(transform.translation);
    let forward = Vec3::from(-transform.matrix3.z_axis).normalize_or_zero();
    let up = Vec3::from(transform.matrix3.y_axis).normalize_or_zero();
    if forward.cross(up).length() < 1e-4 {
        warnings.count("no direction", || {
            format!("camera '{name}' has no direction; skipped")
        });
        return None;
    }
    let out = eye.abs().max_element();
    let ahead = if out > FAR_OUT { out } else { 1.0 };
    let (mut near, mut far) = (perspective.znear, perspective.zfar.unwrap_or(DEFAULT_FAR_M));
    if !(near > 0.0 && far > near && far.is_finite()) {
        warnings.count("planes", || {
            format!(
                "camera '{name}' has planes {near} and {far}; 0.05 and {DEFAULT_FAR_M} are used"
            )
        });
        (near, far) = (0.05, DEFAULT_FAR_M);
    }
    Some(Camera {
        name,
        eye,
        target: eye + forward * ahead,
        up,
        vfov_deg: perspective.yfov.to_degrees(),
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
