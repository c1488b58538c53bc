//! The node graph: where meshes, cameras and lights are in the world.

use crate::files::Origin;
use crate::warnings::Warnings;
use crate::{Camera, Light, SceneError};
use glam::{Affine3A, Mat4, Quat, Vec3};
use gltf::json::Root;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type as LightType};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;

/// Far plane of a camera whose projection is infinite, metres.
const DEFAULT_FAR_M: f32 = 1000.0;

/// What the nodes place, in depth-first order.
#[derive(Default)]
pub(super) struct Placed {
    /// glTF mesh and object-to-world transform.
    pub meshes: Vec<(usize, Affine3A)>,
    pub cameras: Vec<Camera>,
    pub lights: Vec<Light>,
}

/// Visits the default scene (the first one, or every root node, where the file names none).
pub(super) fn walk(
    root: &Root,
    origin: &Origin,
    warnings: &mut Warnings,
) -> Result<Placed, SceneError> {
    let scene = root.scene.map_or(0, |s| s.value());
    let roots: Vec<usize> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(super::accessors::at).collect(),
        None => parentless(root),
    };
    let mut placed = Placed::default();
    let mut seen = vec![false; root.nodes.len()];
    // An explicit stack: a long chain of nodes must not overflow ours.
    let mut stack: Vec<(usize, Affine3A)> = roots
        .into_iter()
        .rev()
        .map(|node| (node, Affine3A::IDENTITY))
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
        let transform = parent * local_transform(node);
        if !transform.is_finite() {
            return Err(origin.invalid(
                format!("nodes[{index}]"),
                "a finite transform",
                "NaN or infinity",
            ));
        }
        if let Some(mesh) = &node.mesh {
            // Neither 0 nor so small or large that normals could not be transformed.
            if !transform.matrix3.determinant().is_normal() {
                warnings.count("no scale", || {
                    format!("nodes[{index}] is scaled to nothing or beyond measure; skipped")
                });
            } else {
                placed.meshes.push((mesh.value(), transform));
            }
        }
        if let Some(camera) = camera(root, node, index, transform, warnings) {
            placed.cameras.push(camera);
        }
        if let Some(light) = light(root, node, index, transform, warnings) {
            placed.lights.push(light);
        }
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), transform)));
    }
    Ok(placed)
}

fn parentless(root: &Root) -> Vec<usize> {
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        is_child[child.value()] = true;
    }
    (0..root.nodes.len()).filter(|&n| !is_child[n]).collect()
}

pub(super) fn local_transform(node: &Node) -> Affine3A {
    if let Some(matrix) = &node.matrix {
        return Affine3A::from_mat4(Mat4::from_cols_array(matrix));
    }
    let (translation, rotation, scale) = parts(node);
    Affine3A::from_scale_rotation_translation(scale, rotation, translation)
}

/// Translation, rotation and scale of a node without a matrix.
pub(super) fn parts(node: &Node) -> (Vec3, Quat, Vec3) {
    let rotation = node.rotation.map_or(Quat::IDENTITY, |q| {
        let q = Quat::from_array(q.0);
        if q.length_squared() > 0.0 {
            q.normalize()
        } else {
            Quat::IDENTITY
        }
    });
    (
        node.translation.map_or(Vec3::ZERO, Vec3::from),
        rotation,
        node.scale.map_or(Vec3::ONE, Vec3::from),
    )
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

/// A camera node looks along its -z; the target is one metre ahead.
fn camera(
    root: &Root,
    node: &Node,
    index: usize,
    transform: Affine3A,
    warnings: &mut Warnings,
) -> Option<Camera> {
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
        target: eye + forward,
        up,
        vfov_deg: perspective.yfov.to_degrees(),
        near,
        far,
    })
}

/// Punctual lights with their photometric intensity as it stands; a spot light lights all round.
fn light(
    root: &Root,
    node: &Node,
    index: usize,
    transform: Affine3A,
    warnings: &mut Warnings,
) -> Option<Light> {
    let reference = node.extensions.as_ref()?.khr_lights_punctual.as_ref()?;
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
