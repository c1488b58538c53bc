//! Assembles materials, meshes, instances, cameras and lights into a scene.

use super::mesh_builder::MeshBuilder;
use super::texture_synth::{Map, Recipe, Rgb, linear};
use glam::{Affine3A, Vec3};
use scene::{
    Camera, Instance, Light, Material, Motion, Movement, Scene, TextureRef, TextureSlot, Textures,
};

/// A material's index and properties for meshes.
#[derive(Clone, Copy, Debug)]
pub struct MaterialId {
    index: usize,
    tile_m: f32,
}

/// A scene under construction.
pub struct SceneBuilder {
    scene: Scene,
    tile_m: Vec<f32>,
}

impl SceneBuilder {
    /// An empty scene.
    pub fn new(name: &str) -> Self {
        Self {
            scene: Scene {
                name: name.to_owned(),
                ..Scene::default()
            },
            tile_m: Vec::new(),
        }
    }

    /// Adds a material.
    pub fn material(&mut self, material: Material, tile_m: f32) -> MaterialId {
        self.scene.materials.push(material);
        self.tile_m.push(tile_m);
        MaterialId {
            index: self.scene.materials.len() - 1,
            tile_m,
        }
    }

    /// Adds an untextured material with an sRGB colour and a roughness. `adjust` can change the
    /// rest.
    pub fn plain(
        &mut self,
        name: &str,
        color: Rgb,
        roughness: f32,
        adjust: impl FnOnce(&mut Material),
    ) -> MaterialId {
        let mut material = Material {
            name: name.to_owned(),
            base_color: linear(color).extend(1.0),
            roughness,
            ..Material::default()
        };
        adjust(&mut material);
        self.material(material, 1.0)
    }

    /// Adds a material with its textures. `adjust` can change the rest.
    pub fn textured(&mut self, recipe: Recipe, adjust: impl FnOnce(&mut Material)) -> MaterialId {
        let (name, tile_m, maps) = (recipe.name, recipe.tile_m, recipe.maps);
        let source = recipe.into_source(&self.scene.name);
        let images = &mut self.scene.images;
        let mut add = |map: Map| {
            maps.contains(map).then(|| {
                images.push(map.image(&source));
                TextureRef::new(images.len() - 1)
            })
        };
        let base_color = add(Map::Color);
        let normal = add(Map::Normal);
        let metallic_roughness = add(Map::Roughness);
        let occlusion = add(Map::Occlusion);
        // The texture multiplies the factors, as in glTF.
        let factor = |plain| {
            if metallic_roughness.is_some() {
                1.0
            } else {
                plain
            }
        };
        let mut material = Material {
            name: name.to_owned(),
            textures: Textures::from([
                (TextureSlot::BaseColor, base_color),
                (TextureSlot::Normal, normal),
                (TextureSlot::MetallicRoughness, metallic_roughness),
                (TextureSlot::Occlusion, occlusion),
            ]),
            metallic: factor(0.0),
            roughness: factor(0.8),
            ..Material::default()
        };
        adjust(&mut material);
        self.material(material, tile_m)
    }

    /// Adds a mesh that is not placed yet; returns its index.
    pub fn mesh(&mut self, name: &str, mesh: MeshBuilder, material: MaterialId) -> usize {
        self.scene
            .meshes
            .push(mesh.finish(name, material.index, material.tile_m));
        self.scene.meshes.len() - 1
    }

    /// Places a mesh.
    pub fn place(&mut self, mesh: usize, transform: Affine3A) {
        self.scene.instances.push(Instance { mesh, transform });
    }

    /// Makes instances move. They are numbered in the order in which they were placed.
    pub fn motion(&mut self, instances: Vec<usize>, movements: Vec<Movement>) {
        self.scene.motions.push(Motion {
            instances,
            movements,
        });
    }

    /// Adds a mesh and places it without a transform.
    pub fn add(&mut self, name: &str, mesh: MeshBuilder, material: MaterialId) {
        let mesh = self.mesh(name, mesh, material);
        self.place(mesh, Affine3A::IDENTITY);
    }

    /// Adds a camera; the first is the default one.
    pub fn camera(&mut self, name: &str, eye: Vec3, target: Vec3, near: f32, far: f32) {
        self.scene.cameras.push(Camera {
            name: name.to_owned(),
            eye,
            target,
            up: Vec3::Y,
            vfov_deg: 60.0,
            near,
            far,
        });
    }

    /// Adds parallel light that travels along `direction`.
    pub fn sun(&mut self, direction: Vec3, color: Vec3) {
        self.scene.lights.push(Light::Directional {
            direction: direction.normalize(),
            color,
        });
    }

    /// Adds a point light.
    pub fn lamp(&mut self, position: Vec3, color: Vec3) {
        self.scene.lights.push(Light::Point { position, color });
    }

    /// The finished scene under a sky of the given radiance.
    pub fn finish(mut self, sky: Vec3, shadow_cascades: u32) -> Scene {
        self.scene.sky = sky;
        self.scene.shadow_cascades = shadow_cascades;
        self.scene
    }

    /// Triangles placed so far.
    pub fn triangles(&self) -> u64 {
        self.scene.triangle_count()
    }
}
