//! Assembles materials, meshes, instances, cameras and lights into a scene.

use super::mesh_builder::MeshBuilder;
use super::texture_synth::{Map, Recipe, Rgb, linear};
use glam::{Affine3A, Vec3};
use scene::{
    Camera, Instance, Light, Material, Motion, Movement, Scene, TextureRef, TextureSlot, Textures,
};
use std::collections::HashMap;

/// A scene under construction.
pub struct SceneBuilder {
    scene: Scene,
    tile_m: Vec<f32>,
    /// Materials by their other names.
    roles: HashMap<&'static str, &'static str>,
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
            roles: HashMap::new(),
        }
    }

    /// Adds a material. Meshes refer to it by its name.
    fn material(&mut self, material: Material, tile_m: f32) {
        self.scene.materials.push(material);
        self.tile_m.push(tile_m);
    }

    /// Adds an untextured material with an sRGB colour and a roughness. `adjust` can change the
    /// rest.
    pub fn plain(
        &mut self,
        name: &str,
        color: Rgb,
        roughness: f32,
        adjust: impl FnOnce(&mut Material),
    ) {
        let mut material = Material {
            name: name.to_owned(),
            base_color: linear(color).extend(1.0),
            roughness,
            ..Material::default()
        };
        adjust(&mut material);
        self.material(material, 1.0);
    }

    /// Adds a material with its textures. `adjust` can change the rest.
    pub fn textured(&mut self, recipe: Recipe, adjust: impl FnOnce(&mut Material)) {
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
        self.material(material, tile_m);
    }

    /// The scene's name.
    pub fn name(&self) -> &str {
        &self.scene.name
    }

    /// Gives a material another name.
    pub fn role(&mut self, role: &'static str, material: &'static str) {
        self.roles.insert(role, material);
    }

    /// Adds a mesh that is not placed yet; returns its index.
    ///
    /// # Panics
    /// If no material has that name.
    pub fn mesh(&mut self, name: &str, mesh: MeshBuilder, material: &str) -> usize {
        let material = self.roles.get(material).copied().unwrap_or(material);
        let mut materials = self.scene.materials.iter();
        let Some(material) = materials.position(|known| known.name == material) else {
            panic!("{}/{name}: no material {material}", self.scene.name);
        };
        let mesh = mesh.finish(name, material, self.tile_m[material]);
        self.scene.meshes.push(mesh);
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

    /// Adds a mesh and places it once.
    pub fn put(&mut self, name: &str, mesh: MeshBuilder, material: &str, place: Affine3A) {
        let mesh = self.mesh(name, mesh, material);
        self.place(mesh, place);
    }

    /// Adds a mesh and places it without a transform.
    pub fn add(&mut self, name: &str, mesh: MeshBuilder, material: &str) {
        self.put(name, mesh, material, Affine3A::IDENTITY);
    }

    /// Adds a camera; the first is the default one.
    pub fn camera(&mut self, name: &str, near: f32, far: f32, eye: Vec3, target: Vec3) {
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

    /// Sets the sky's radiance.
    pub fn sky(&mut self, sky: Vec3) {
        self.scene.sky = sky;
    }

    /// Sets the number of shadow maps.
    pub fn shadow_cascades(&mut self, cascades: u32) {
        self.scene.shadow_cascades = cascades;
    }

    /// The finished scene.
    pub fn finish(self) -> Scene {
        self.scene
    }

    /// Numbers of the meshes of a name.
    pub fn numbers(&self, name: &str) -> Vec<usize> {
        let meshes = self.scene.meshes.iter().enumerate();
        let named = meshes.filter(|(_, mesh)| mesh.name == name);
        named.map(|(number, _)| number).collect()
    }

    /// Mesh numbers by name.
    pub fn mesh_numbers(&self) -> HashMap<String, usize> {
        let meshes = self.scene.meshes.iter().zip(0..);
        meshes
            .map(|(mesh, number)| (mesh.name.clone(), number))
            .collect()
    }

    /// Triangles placed so far.
    pub fn triangles(&self) -> u64 {
        self.scene.triangle_count()
    }
}
