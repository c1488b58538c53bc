//! A file's animation: moving nodes, and the vertices of skinned and morphed meshes.
//!
//! A pose is computed on the CPU in double precision, rounded once at the end, and written into the
//! plain meshes and instances of the [`Scene`]. Renderers, rays, culling and shadow cascades therefore
//! need no code for animations.

mod curve;
mod morph;
mod shape;
mod skeleton;
mod skin;

pub(crate) use curve::{Channel, Curve, Interpolation, Joint, WeightCurve};
pub(crate) use morph::Target;
pub(crate) use shape::{Movers, Shape};
pub(crate) use skeleton::{Skeleton, Tree};
pub(crate) use skin::{Influences, PosedSkin, Skin};

use crate::cameras::look_of_node;
use crate::files::Origin;
use crate::origin::{corners, relative_transform};
use crate::{Light, Mesh, Scene, SceneError};
use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};
use std::path::PathBuf;

/// Largest coordinate of a moving vertex, metres. A scene's extent has the same limit.
const MAX_COORDINATE_M: f64 = 1e12;

/// The moving parts of a scene.
#[derive(Clone, Debug)]
pub struct Animation {
    /// The file, named in errors.
    pub(crate) file: PathBuf,
    pub(crate) name: String,
    /// The last key's time.
    pub(crate) duration_s: f64,
    pub(crate) skeleton: Skeleton,
    pub(crate) skins: Vec<Skin>,
    pub(crate) meshes: Vec<MovingMesh>,
    pub(crate) instances: Vec<MovingInstance>,
    /// Indices of cameras and of their nodes.
    pub(crate) cameras: Vec<(usize, usize)>,
    /// Indices of lights and of their nodes.
    pub(crate) lights: Vec<(usize, usize)>,
    /// The point that the scene's coordinates are relative to.
    pub(crate) origin: DVec3,
}

/// A mesh whose vertices move.
#[derive(Clone, Debug)]
pub(crate) struct MovingMesh {
    /// Index into the scene's meshes.
    pub mesh: usize,
    pub shape: Shape,
    /// Weights of the morph targets if no curve animates them.
    pub weights: Vec<f64>,
    pub curve: Option<WeightCurve>,
    /// Index into the animation's skins.
    pub skin: Option<usize>,
    /// The point that its positions are relative to.
    pub own: DVec3,
    /// True if it changes over time.
    pub moves: bool,
}

/// The object that places an instance.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Follows {
    /// A node.
    Node {
        node: usize,
        /// Transform from the instance to the node.
        offset: DAffine3,
    },
    /// A skin, by index.
    Skin(usize),
}

/// An instance that moves, or whose mesh moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingInstance {
    /// Index into the scene's instances.
    pub instance: usize,
    pub follows: Follows,
    /// The point that its mesh's positions are relative to.
    pub own: DVec3,
    /// True if it or its mesh changes over time.
    pub moves: bool,
}

impl Scene {
    /// Poses the meshes, instances, cameras and lights of the scene at a time. The animation repeats
    /// after its last key. A scene without animation does not change.
    ///
    /// # Errors
    /// A coordinate exceeds the supported range.
    pub fn animate(&mut self, time_s: f64) -> Result<(), SceneError> {
        let Some(animation) = self.animation.take() else {
            return Ok(());
        };
        let posed = animation.pose(self, time_s);
        self.animation = Some(animation);
        posed
    }
}

impl Animation {
    /// Display name of the animation that plays.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Time of the last key.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Instances that move or whose meshes move.
    pub fn moving_instances(&self) -> impl Iterator<Item = usize> + '_ {
        self.instances.iter().map(|moving| moving.instance)
    }

    /// Meshes whose vertices move.
    pub fn moving_meshes(&self) -> impl Iterator<Item = usize> + '_ {
        self.meshes.iter().map(|moving| moving.mesh)
    }

    /// The time within the animation, which ends at its last key.
    pub(crate) fn within(&self, time_s: f64) -> f64 {
        if time_s > self.duration_s && self.duration_s > 0.0 {
            time_s % self.duration_s
        } else {
            time_s
        }
    }

    pub(crate) fn pose(&self, scene: &mut Scene, time_s: f64) -> Result<(), SceneError> {
        let (asked_s, time_s) = (time_s, self.within(time_s));
        let worlds = self.skeleton.worlds(time_s);
        let skins = self.pose_skins(&worlds);
        self.pose_meshes(&mut scene.meshes, &skins, time_s);
        for moving in &self.instances {
            let transform = self.transform(moving, &worlds, &skins);
            if let Some(instance) = scene.instances.get_mut(moving.instance) {
                instance.transform = transform;
                let mesh = &scene.meshes[instance.mesh];
                self.check(mesh, &transform, asked_s)?;
            }
        }
        let place = |node: usize| relative_transform(worlds[node], self.origin);
        for &(camera, node) in &self.cameras {
            let camera = scene.cameras.get_mut(camera);
            // A camera without a direction keeps its previous one.
            if let (Some(camera), Some(look)) = (camera, look_of_node(&place(node))) {
                (camera.eye, camera.target, camera.up) = look;
            }
        }
        for &(light, node) in &self.lights {
            if let Some(light) = scene.lights.get_mut(light) {
                move_light(light, &place(node));
            }
        }
        Ok(())
    }

    /// Drops the parts that never change. Returns `None` if nothing is left.
    pub(crate) fn moving(mut self) -> Option<Self> {
        self.meshes.retain(|moving| moving.moves);
        self.instances.retain(|moving| moving.moves);
        let parts = [
            self.meshes.len(),
            self.instances.len(),
            self.cameras.len(),
            self.lights.len(),
        ];
        parts.iter().any(|count| *count > 0).then_some(self)
    }

    pub(crate) fn pose_skins(&self, worlds: &[DAffine3]) -> Vec<PosedSkin> {
        (self.skins.iter())
            .map(|skin| skin.pose(worlds, self.origin))
            .collect()
    }

    /// Moves the vertices of meshes. The time must be within the animation.
    pub(crate) fn pose_meshes(&self, meshes: &mut [Mesh], skins: &[PosedSkin], time_s: f64) {
        for moving in &self.meshes {
            let animated = moving.curve.as_ref().map(|curve| curve.at(time_s));
            let weights = animated.as_deref().unwrap_or(&moving.weights);
            let skin = moving.skin.map(|skin| &skins[skin]);
            let mesh = &mut meshes[moving.mesh];
            moving.shape.pose(mesh, weights, skin, moving.own);
        }
    }

    /// The object-to-world transform, relative to the origin.
    pub(crate) fn transform(
        &self,
        moving: &MovingInstance,
        worlds: &[DAffine3],
        skins: &[PosedSkin],
    ) -> Affine3A {
        match moving.follows {
            Follows::Skin(skin) => skins[skin].instance().as_affine3a(),
            Follows::Node { node, offset } => {
                let mut transform = worlds[node] * offset;
                transform.translation += transform.matrix3 * moving.own;
                let rounded = relative_transform(transform, self.origin);
                if has_scale(&rounded) {
                    return rounded;
                }
                // Without a usable scale, the instance covers nothing and needs no normals.
                transform.matrix3 = DMat3::ZERO;
                relative_transform(transform, self.origin)
            }
        }
    }

    /// Checks that a moved instance stays within the supported coordinates.
    fn check(&self, mesh: &Mesh, transform: &Affine3A, time_s: f64) -> Result<(), SceneError> {
        let bounds = mesh.bounds().map(|corner| corner.as_dvec3());
        let transform = DAffine3 {
            matrix3: transform.matrix3.as_dmat3(),
            translation: transform.translation.as_dvec3(),
        };
        let beyond = |at: &f64| at.is_nan() || at.abs() > MAX_COORDINATE_M;
        let mut placed =
            corners(bounds).flat_map(|corner| transform.transform_point3(corner).to_array());
        let found = if mesh.positions.iter().all(|position| position.is_finite()) {
            placed.find(beyond)
        } else {
            Some(f64::NAN)
        };
        let Some(found) = found.filter(|_| !mesh.positions.is_empty()) else {
            return Ok(());
        };
        Err(Origin::new(&self.file).invalid(
            format!("{} at {time_s} s: mesh '{}'", self.name, mesh.name),
            format!("positions of at most {MAX_COORDINATE_M:e} m"),
            format!("{found:e} m"),
        ))
    }
}

/// True if the determinant is neither 0 nor too small or large to transform normals.
pub(crate) fn has_scale(transform: &Affine3A) -> bool {
    transform.matrix3.determinant().is_normal()
}

/// Moves a light to its node. A directional light without a direction keeps its previous one.
fn move_light(light: &mut Light, place: &Affine3A) {
    match light {
        Light::Directional { direction, .. } => {
            *direction = Vec3::from(-place.matrix3.z_axis)
                .try_normalize()
                .unwrap_or(*direction);
        }
        Light::Point { position, .. } => *position = place.translation.into(),
    }
}
