//! Scene data for ray tracing, prepared once and shared by all threads.

use super::bvh::{AlphaTest, Bvh, BvhError, TreeOptions};
use super::material::Materials;
use super::soup::Soup;
use formats::raytrace::{RayLight, TraversalKind};
use glam::{DVec3, Vec3};
use scene::light::Sky;
use scene::{Light, Scene, SceneError};
use std::cell::RefCell;

/// A scene prepared for tracing.
pub struct TraceScene {
    /// The scene without its images.
    pub scene: Scene,
    /// Its triangles.
    pub soup: Soup,
    /// The hierarchy over them.
    pub bvh: Bvh,
    /// Its materials with their textures.
    pub materials: Materials,
    /// Its lights, relative to the soup's origin.
    pub lights: Vec<RayLight>,
    /// Background and ambient light.
    pub sky: Sky,
}

/// The reason why a scene cannot be traced.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The hierarchy cannot be built.
    #[error(transparent)]
    Bvh(#[from] BvhError),
    /// Textures cannot be read.
    #[error(transparent)]
    Images(#[from] SceneError),
}

impl TraceScene {
    /// Prepares a scene.
    ///
    /// # Errors
    /// The scene has too many triangles, or images that cannot be read.
    pub fn new(scene: Scene) -> Result<Self, PrepareError> {
        Self::with_tree(scene, TraversalKind::Bvh2.into())
    }

    /// [`Self::new`], with the tree that the options describe.
    ///
    /// # Errors
    /// The scene has too many triangles, or images that cannot be read.
    pub fn with_tree(mut scene: Scene, tree: TreeOptions) -> Result<Self, PrepareError> {
        let soup = soup(&scene, tree.instances);
        let (bvh, materials) = rayon::join(
            || {
                let masked: Vec<bool> = scene
                    .materials
                    .iter()
                    .map(super::material::needs_alpha_test)
                    .collect();
                let masked = |p| masked.get(soup.material(&scene, p)) == Some(&true);
                if !tree.instances {
                    return Bvh::build_for(tree, &soup.triangles, masked);
                }
                let meshes = meshes(&scene);
                Bvh::build_instanced(tree, soup.origin, &meshes, &soup.placements, masked)
            },
            || Materials::new(&scene),
        );
        let (bvh, materials) = (bvh?, materials?);
        scene.images = Vec::new();
        Ok(Self {
            lights: lights(&scene, soup.origin),
            sky: Sky::new(&scene),
            scene,
            soup,
            bvh,
            materials,
        })
    }

    /// Poses the scene anew. The tree, which must have been built to be refitted, keeps its topology.
    ///
    /// # Errors
    /// The pose is invalid, or the tree cannot follow it.
    pub fn refit(
        &mut self,
        pose: impl FnOnce(&mut Scene) -> Result<(), SceneError>,
    ) -> Result<(), PrepareError> {
        pose(&mut self.scene)?;
        let (scene, instances) = (&self.scene, self.bvh.has_instances());
        self.soup = soup(scene, instances);
        let Soup {
            origin, placements, ..
        } = &self.soup;
        if instances {
            let meshes = meshes(scene);
            self.bvh.refit_instanced(*origin, &meshes, placements)?;
        } else {
            self.bvh.refit(&self.soup.triangles)?;
        }
        self.lights = lights(scene, *origin);
        self.sky = Sky::new(scene);
        Ok(())
    }

    /// The alpha test of closest-hit rays.
    pub fn stopping(&self) -> Stopping<'_> {
        Stopping(self)
    }

    /// The alpha test of shadow rays.
    pub fn shading(&self) -> Shading<'_> {
        Shading(self)
    }
}

fn soup(scene: &Scene, instances: bool) -> Soup {
    if instances {
        Soup::of_instances(scene)
    } else {
        Soup::new(scene)
    }
}

/// The triangles of every mesh, in its own space.
fn meshes(scene: &Scene) -> Vec<Vec<[[f32; 3]; 3]>> {
    let triangles = scene.meshes.iter().map(|mesh| {
        let corners = mesh.indices.chunks_exact(3);
        let at = |i: u32| mesh.positions[i as usize].to_array();
        corners.map(|t| [at(t[0]), at(t[1]), at(t[2])]).collect()
    });
    triangles.collect()
}

fn lights(scene: &Scene, origin: DVec3) -> Vec<RayLight> {
    let lights = scene.lights.iter().map(|light| match *light {
        Light::Directional { direction, color } => RayLight::Directional {
            direction: direction.normalize_or(-Vec3::Y).to_array(),
            color: color.to_array(),
        },
        Light::Point { position, color } => RayLight::Point {
            position: (position.as_dvec3() - origin).as_vec3().to_array(),
            color: color.to_array(),
        },
    });
    lights.collect()
}

/// Alpha test that lets rays through masked-out texels.
#[derive(Clone, Copy)]
pub struct Stopping<'a>(&'a TraceScene);

impl AlphaTest for Stopping<'_> {
    fn opaque(&self, primitive: u32, bary: [f32; 2]) -> bool {
        let s = self.0;
        s.materials.stops(&s.scene, &s.soup, primitive, bary)
    }
}

/// Alpha test of a shadow ray that collects the colours of glass and blended surfaces.
pub(crate) struct Colouring<'a> {
    scene: &'a TraceScene,
    direction: Vec3,
    /// What passes each primitive. Trees test them in different orders.
    passed: RefCell<Vec<(u32, Vec3)>>,
}

impl<'a> Colouring<'a> {
    pub fn new(scene: &'a TraceScene, direction: Vec3) -> Self {
        Self {
            scene,
            direction,
            passed: RefCell::default(),
        }
    }

    /// The light that passes all surfaces on the way.
    pub fn light(self) -> Vec3 {
        let mut passed = self.passed.into_inner();
        passed.sort_unstable_by_key(|(primitive, _)| *primitive);
        passed.into_iter().map(|(_, light)| light).product()
    }
}

impl AlphaTest for Colouring<'_> {
    fn opaque(&self, primitive: u32, bary: [f32; 2]) -> bool {
        let s = self.scene;
        let [a, b, c] = s.soup.triangle(&s.scene, primitive).map(Vec3::from);
        // Light travels against its shadow ray.
        let enters = (b - a).cross(c - a).dot(self.direction) >= 0.0;
        let light = s
            .materials
            .passes(&s.scene, &s.soup, (primitive, bary), enters);
        if light != Vec3::ZERO {
            self.passed.borrow_mut().push((primitive, light));
        }
        light == Vec3::ZERO
    }
}

/// Alpha test that lets light through masked-out texels and glass.
#[derive(Clone, Copy)]
pub struct Shading<'a>(&'a TraceScene);

impl AlphaTest for Shading<'_> {
    fn opaque(&self, primitive: u32, bary: [f32; 2]) -> bool {
        let s = self.0;
        s.materials.shades(&s.scene, &s.soup, primitive, bary)
    }
}
