//! Places meshes at their nodes. A mesh is read once, or once per node if its vertices move.

use super::accessors::{Buffers, at};
use super::materials::Table;
use super::meshes::{self, Moving};
use super::nodes::mesh_transforms;
use super::rig::Rig;
use super::transforms::Local;
use super::{ViewNodes, morphs, skins};
use crate::animation::{Animation, Follows, MovingInstance, MovingMesh, WeightCurve};
use crate::warnings::Warnings;
use crate::{Instance, Mesh, Scene, SceneError, origin};
use glam::{DAffine3, DVec3};
use gltf::json::Root;
use std::collections::HashMap;

/// A rig, and the meshes and instances that it moves.
pub(super) struct PlacedRig {
    animation: Animation,
    /// True for each node that an animation moves.
    moved: Vec<bool>,
    /// Curves of the weights of morph targets, by node.
    weights: HashMap<usize, WeightCurve>,
    /// Seconds, within the animation.
    time_s: f64,
    /// Transforms to the world at that time.
    worlds: Vec<DAffine3>,
    /// Index of each used skin, by its index in the file.
    skins: HashMap<usize, usize>,
}

impl PlacedRig {
    pub fn new(rig: Rig, time_s: f64, buffers: &Buffers<'_>) -> Self {
        let animation = Animation {
            file: buffers.origin.file.clone(),
            name: rig.name,
            duration_s: rig.duration_s,
            skeleton: rig.skeleton,
            skins: Vec::new(),
            meshes: Vec::new(),
            instances: Vec::new(),
            cameras: Vec::new(),
            lights: Vec::new(),
            origin: DVec3::ZERO,
        };
        let time_s = animation.within(time_s);
        Self {
            time_s,
            worlds: animation.skeleton.worlds(time_s),
            moved: rig.moved,
            weights: rig.weights,
            animation,
            skins: HashMap::new(),
        }
    }

    /// A node's transform to its parent.
    pub fn local(&self, node: usize) -> DAffine3 {
        self.animation.skeleton.joints[node].transform(self.time_s)
    }

    /// The animation of a scene with cameras and lights at these nodes, or `None` if nothing moves.
    pub fn into_animation(mut self, of: ViewNodes) -> Option<Animation> {
        let moved = |nodes: Vec<usize>| {
            let numbered = nodes.into_iter().enumerate();
            numbered.filter(|(_, node)| self.moved[*node]).collect()
        };
        (self.animation.cameras, self.animation.lights) = (moved(of.cameras), moved(of.lights));
        self.animation.moving()
    }

    /// True if a skin changes over time.
    fn skin_moves(&self, root: &Root, skin: usize) -> bool {
        (root.skins[skin].joints.iter()).any(|joint| self.moved[at(joint)])
    }

    /// The index of a skin. A skin is read on first use.
    fn skin(&mut self, number: usize, buffers: &Buffers<'_>) -> Result<usize, SceneError> {
        if let Some(&index) = self.skins.get(&number) {
            return Ok(index);
        }
        let index = self.animation.skins.len();
        self.animation.skins.push(skins::read(number, buffers)?);
        self.skins.insert(number, index);
        Ok(index)
    }
}

/// The skin and weights that move the vertices of a node's mesh.
struct Deformation {
    /// Index of its skin, and true if the skin changes over time.
    skin: Option<(usize, bool)>,
    weights: Vec<f64>,
    curve: Option<WeightCurve>,
}

/// A loaded primitive.
#[derive(Clone)]
pub(super) struct Primitive {
    /// Index into the scene's meshes.
    mesh: usize,
    /// Index of its skin.
    skin: Option<usize>,
    /// `Some` if a skin or weights move its vertices: true if they change over time.
    deforms: Option<bool>,
}

/// The meshes read so far.
pub(super) struct Placing<'a> {
    pub buffers: &'a Buffers<'a>,
    pub transforms: &'a [Local],
    /// The material variant to show.
    pub variant: Option<u32>,
    /// The nodes and curves that may move.
    pub rig: Option<PlacedRig>,
    pub meshes: Vec<Mesh>,
    /// Meshes with their transforms to the world.
    pub in_world: Vec<(usize, DAffine3)>,
    /// The primitives of each glTF mesh with fixed vertices, filled on first use.
    pub loaded: HashMap<usize, Vec<Primitive>>,
}

impl Placing<'_> {
    /// Adds the mesh of a node.
    pub fn add(
        &mut self,
        node: usize,
        transform: DAffine3,
        materials: &mut Table<'_>,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        let Some(mesh) = self.buffers.root.nodes[node].mesh.as_ref().map(at) else {
            return Ok(());
        };
        let primitives = match self.deformation(node, warnings)? {
            Some(deformation) => self.read_moving(mesh, deformation, materials, warnings)?,
            None => self.read_still(mesh, materials, warnings)?,
        };
        let node_moves = self.rig.as_ref().is_some_and(|placed| placed.moved[node]);
        let local = &self.transforms[node];
        let place = (transform, node_moves);
        let instances = match primitives.iter().any(|p| p.skin.is_none()) {
            true => mesh_transforms(node, local, place, self.buffers, warnings)?,
            false => Vec::new(),
        };
        let made = primitives.len() as u64 * instances.len() as u64;
        (self.buffers).spend::<Instance>(made, || format!("instances of meshes[{mesh}]"))?;
        for instance in instances {
            for primitive in primitives.iter().filter(|p| p.skin.is_none()) {
                let follows = Follows::Node {
                    node,
                    offset: instance.offset,
                };
                if primitive.deforms.is_some() || node_moves {
                    self.follow(follows, node_moves || primitive.deforms == Some(true));
                }
                self.in_world.push((primitive.mesh, instance.transform));
            }
        }
        // Only its joints place a skinned mesh, not its node.
        for primitive in &primitives {
            let Some(skin) = primitive.skin else { continue };
            if local.instancing().is_some() {
                warnings.count("instanced skin", || {
                    format!("nodes[{node}] has instances of a skinned mesh; one is shown")
                });
            }
            self.follow(Follows::Skin(skin), primitive.deforms == Some(true));
            self.in_world.push((primitive.mesh, DAffine3::IDENTITY));
        }
        Ok(())
    }

    /// Records the object that places the next instance.
    fn follow(&mut self, follows: Follows, moves: bool) {
        if let Some(placed) = &mut self.rig {
            placed.animation.instances.push(MovingInstance {
                instance: self.in_world.len(),
                follows,
                own: DVec3::ZERO,
                moves,
            });
        }
    }

    /// The skin and weights of a node's mesh, if it has any.
    fn deformation(
        &mut self,
        node: usize,
        warnings: &mut Warnings,
    ) -> Result<Option<Deformation>, SceneError> {
        let Some(placed) = &mut self.rig else {
            return Ok(None);
        };
        let root = self.buffers.root;
        let weights = morphs::weights(root, node, warnings);
        let curve = placed.weights.remove(&node);
        let skin = match root.nodes[node].skin.as_ref().map(at) {
            Some(number) => {
                let moves = placed.skin_moves(root, number);
                Some((placed.skin(number, self.buffers)?, moves))
            }
            None => None,
        };
        let deforms =
            skin.is_some() || curve.is_some() || weights.iter().any(|weight| *weight != 0.0);
        Ok(deforms.then_some(Deformation {
            skin,
            weights,
            curve,
        }))
    }

    /// Reads a mesh with fixed vertices.
    fn read_still(
        &mut self,
        mesh: usize,
        materials: &mut Table<'_>,
        warnings: &mut Warnings,
    ) -> Result<Vec<Primitive>, SceneError> {
        if let Some(known) = self.loaded.get(&mesh) {
            return Ok(known.clone());
        }
        let still = Moving::default();
        let read = meshes::read(mesh, self.variant, still, self.buffers, materials, warnings)?;
        let primitives: Vec<Primitive> = (self.meshes.len()..)
            .zip(&read)
            .map(|(mesh, _)| Primitive {
                mesh,
                skin: None,
                deforms: None,
            })
            .collect();
        self.meshes.extend(read.into_iter().map(|(mesh, _)| mesh));
        self.loaded.insert(mesh, primitives.clone());
        Ok(primitives)
    }

    /// Reads a separate mesh for a node that moves its vertices.
    fn read_moving(
        &mut self,
        mesh: usize,
        deformation: Deformation,
        materials: &mut Table<'_>,
        warnings: &mut Warnings,
    ) -> Result<Vec<Primitive>, SceneError> {
        let Deformation {
            skin,
            weights,
            curve,
        } = deformation;
        let mut primitives = Vec::new();
        let Some(placed) = &mut self.rig else {
            return Ok(primitives);
        };
        let moving = Moving {
            joints: skin.map(|(skin, _)| placed.animation.skins[skin].joints.len()),
            morphs: curve.is_some() || weights.iter().any(|weight| *weight != 0.0),
        };
        for (read, shape) in meshes::read(
            mesh,
            self.variant,
            moving,
            self.buffers,
            materials,
            warnings,
        )? {
            let is_skinned = shape.as_ref().is_some_and(|shape| shape.is_skinned());
            let skin = skin.filter(|_| is_skinned);
            let mut primitive = Primitive {
                mesh: self.meshes.len(),
                skin: skin.map(|(skin, _)| skin),
                deforms: None,
            };
            self.meshes.push(read);
            if let Some(shape) = shape {
                let moves = curve.is_some() || skin.is_some_and(|(_, moves)| moves);
                primitive.deforms = Some(moves);
                placed.animation.meshes.push(MovingMesh {
                    mesh: primitive.mesh,
                    shape,
                    weights: weights.clone(),
                    curve: curve.clone(),
                    skin: primitive.skin,
                    own: DVec3::ZERO,
                    moves,
                });
            }
            primitives.push(primitive);
        }
        Ok(primitives)
    }

    /// Poses the meshes and adds all instances to a scene, relative to its origin.
    pub fn finish(self) -> Result<(Scene, Option<PlacedRig>), SceneError> {
        let Self {
            mut rig,
            mut meshes,
            mut in_world,
            ..
        } = self;
        if let Some(placed) = &rig {
            // The scene's origin depends on the positions of its vertices.
            let skins = placed.animation.pose_skins(&placed.worlds);
            (placed.animation).pose_meshes(&mut meshes, &skins, placed.time_s);
            for moving in &placed.animation.instances {
                if let Follows::Skin(skin) = moving.follows {
                    in_world[moving.instance].1 = skins[skin].instance();
                }
            }
        }
        let places = origin::place(&mut meshes, &in_world);
        let mut scene = Scene {
            origin: places.origin,
            meshes,
            instances: places.instances,
            ..Scene::default()
        };
        if let Some(placed) = &mut rig {
            let animation = &mut placed.animation;
            animation.origin = places.origin;
            for moving in &mut animation.meshes {
                // Skinned vertices are relative to the scene's origin.
                if moving.skin.is_none() {
                    moving.own = places.own[moving.mesh];
                }
            }
            for moving in &mut animation.instances {
                if let Follows::Node { .. } = moving.follows {
                    moving.own = places.own[in_world[moving.instance].0];
                }
            }
            animation.pose(&mut scene, placed.time_s)?;
        }
        Ok((scene, rig))
    }
}
