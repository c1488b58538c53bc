//! What moved in a scene from one time to another.

use crate::bvh::Objects;
use glam::{Affine3A, Vec3};
use scene::Scene;

/// A scene's pose: where its instances are, and the vertices of meshes that can move.
pub struct Pose {
    transforms: Vec<Affine3A>,
    meshes: Vec<(usize, Vec<Vec3>)>,
}

impl Pose {
    /// The pose that a scene has.
    pub fn of(scene: &Scene) -> Self {
        let moving = scene
            .animation
            .iter()
            .flat_map(|animation| animation.moving_meshes());
        Self {
            transforms: scene
                .instances
                .iter()
                .map(|instance| instance.transform)
                .collect(),
            meshes: moving
                .map(|mesh| (mesh, scene.meshes[mesh].positions.clone()))
                .collect(),
        }
    }
}

/// What moved.
#[derive(Debug)]
pub struct Moved {
    pub(crate) objects: Objects,
    pub(crate) mesh_of: Vec<usize>,
    /// By object, whether its transform changed.
    pub(crate) placed: Vec<bool>,
    /// By mesh, whether a vertex of each triangle moved; empty if none did.
    pub(crate) triangles: Vec<Vec<bool>>,
}

impl Moved {
    /// What moved since a pose; everything if there was none.
    pub fn since(pose: Option<&Pose>, scene: &Scene) -> Self {
        let counts = scene.meshes.iter().map(scene::Mesh::triangles);
        let mut triangles: Vec<Vec<bool>> = match pose {
            Some(_) => vec![Vec::new(); scene.meshes.len()],
            None => counts.map(|count| vec![true; count]).collect(),
        };
        for (mesh, before) in pose.iter().flat_map(|pose| &pose.meshes) {
            let now = &scene.meshes[*mesh];
            let is_moved =
                |corner: &u32| before[*corner as usize] != now.positions[*corner as usize];
            let corners = now.indices.chunks_exact(3);
            triangles[*mesh] = corners
                .map(|corners| corners.iter().any(is_moved))
                .collect();
        }
        let instances = scene.instances.iter();
        let placed = instances.enumerate().map(|(object, instance)| {
            pose.is_none_or(|pose| pose.transforms[object] != instance.transform)
        });
        Self {
            placed: placed.collect(),
            objects: Objects::new(
                scene
                    .instances
                    .iter()
                    .map(|of| scene.meshes[of.mesh].triangles()),
            ),
            mesh_of: scene.instances.iter().map(|of| of.mesh).collect(),
            triangles,
        }
    }

    /// Whether a primitive moved in the world.
    pub(crate) fn triangle(&self, primitive: u32) -> bool {
        let (object, number) = self.objects.within(primitive);
        self.placed[object] || self.in_mesh_of(object, number)
    }

    /// Whether a triangle moved in the mesh of an object.
    pub(crate) fn in_mesh_of(&self, object: usize, number: u32) -> bool {
        self.triangles[self.mesh_of[object]].get(number as usize) == Some(&true)
    }
}
