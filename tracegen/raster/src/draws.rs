//! The draws of a scene in submission order, and their entries in the trace's tables.

pub use super::cascades::SHADOW_SIZE;
use super::error::RasterError;
use super::groups::MaterialGroups;
use super::view::{Fragments, View};
use formats::textrace::{Draw, Sample, Surfaces, UvGroup};
use formats::texture::{ColorSpace, Sampler, TexelFormat, Texture};
use glam::{Affine3A, Mat4, Vec3};
use record::{DepthReplay, Region};
use scene::geometry::transformed_box;
use scene::{AlphaMode, Animation, Instance, Material, Mesh, Scene, TextureSlot};
use std::collections::{HashMap, HashSet};
use textures::TextureSet;
use visibility::{Hierarchy, frustum};

/// Texel offsets of the four bilinear taps of the shadow lookup. Two texels apart, their 2x2
/// footprints tile a 4x4 neighbourhood without overlap.
pub const SHADOW_TAPS: [[i8; 2]; 4] = [[-1, -1], [1, -1], [-1, 1], [1, 1]];

/// How a draw treats alpha. A constant alpha is tested once here instead of at every pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DrawMode {
    /// Every fragment is kept.
    Opaque,
    /// Fragments are discarded by their texture's alpha.
    Masked,
    /// Blended over earlier draws, depth not written.
    Blended,
}

impl DrawMode {
    /// The mode of a material, or `None` if it is invisible.
    fn new(material: &Material) -> Option<Self> {
        match material.alpha {
            AlphaMode::Opaque => Some(Self::Opaque),
            AlphaMode::Blend => Some(Self::Blended),
            AlphaMode::Mask(_) if material.textures[TextureSlot::BaseColor].is_some() => {
                Some(Self::Masked)
            }
            AlphaMode::Mask(cutoff) => (material.base_color.w >= cutoff).then_some(Self::Opaque),
        }
    }
}

/// Properties shared by all draws of a mesh.
struct ShownMesh {
    mode: DrawMode,
    object_box: [Vec3; 2],
}

impl ShownMesh {
    /// Checks a mesh; `None` if it is invisible.
    fn new(scene: &Scene, mesh: &Mesh) -> Result<Option<Self>, RasterError> {
        let material = scene.materials.get(mesh.material).ok_or_else(|| {
            RasterError::Scene(format!(
                "mesh {} uses material {} of {}",
                mesh.name,
                mesh.material,
                scene.materials.len()
            ))
        })?;
        let beyond = |&&index: &&u32| index as usize >= mesh.positions.len();
        if let Some(index) = mesh.indices.iter().find(beyond) {
            return Err(RasterError::Scene(format!(
                "mesh {}: index {index} beyond its {} vertices",
                mesh.name,
                mesh.positions.len()
            )));
        }
        let mode = DrawMode::new(material).filter(|_| mesh.triangles() > 0);
        Ok(mode.map(|mode| Self {
            mode,
            object_box: mesh.bounds(),
        }))
    }

    fn bounds(&self, scene: &Scene, instance: &Instance) -> [Vec3; 2] {
        let positions = &scene.meshes[instance.mesh].positions;
        world_box(positions, self.object_box, &instance.transform)
    }
}

/// One draw call: one instance of one mesh.
#[derive(Clone, Copy, Debug)]
pub struct DrawCall {
    /// Index into the scene's instances.
    pub instance: usize,
    /// Index into the scene's meshes.
    pub mesh: usize,
    /// Index into the scene's materials.
    pub material: usize,
    /// How the draw treats alpha.
    pub mode: DrawMode,
    /// Object to world.
    pub transform: Affine3A,
    /// The transform mirrors, so front faces have reversed winding.
    pub mirrored: bool,
    /// Number of its first primitive.
    pub first_primitive: u32,
    /// The vertices have colours.
    pub colored: bool,
    /// World-space bounds of the instance.
    pub bounds: [Vec3; 2],
}

/// Every draw of a scene, the same for all views and frames.
#[derive(Clone, Debug)]
pub struct DrawList {
    /// Draws in submission order.
    pub calls: Vec<DrawCall>,
    /// Draws that move, ascending.
    pub moving: Vec<u32>,
    /// Texture groups by material.
    pub groups: Vec<MaterialGroups>,
    /// Shadow cascades that lit draws sample, 0 to 4.
    pub cascades: u32,
    /// Format in which they sample them: R32F, D16 or BC4.
    pub shadow_format: TexelFormat,
    /// Hierarchy of the draws' bounds.
    pub hierarchy: Hierarchy,
}

impl DrawList {
    /// The trace's record of which draws hide what is behind them, for these fragments.
    pub fn surfaces(&self, fragments: Fragments) -> Surfaces {
        Surfaces {
            depth_tested: fragments == Fragments::DepthTested,
            not_opaque: Surfaces::ranges(self.calls.iter().map(|c| c.mode == DrawMode::Opaque)),
        }
    }

    /// Orders the scene's instances: opaque and masked ones in the scene's order, then blended ones
    /// in the scene's order. Invisible instances are left out.
    ///
    /// # Errors
    /// More primitives than 32 bits number, or an index out of range.
    pub fn new(scene: &Scene, cascades: u32) -> Result<Self, RasterError> {
        let shown = (scene.meshes.iter())
            .map(|mesh| ShownMesh::new(scene, mesh))
            .collect::<Result<Vec<_>, _>>()?;
        let mut calls = Vec::with_capacity(scene.instances.len());
        let mut next_primitive = 0_u32;
        for blended in [false, true] {
            for (number, instance) in scene.instances.iter().enumerate() {
                let shown = shown.get(instance.mesh).ok_or_else(|| {
                    RasterError::Scene(format!(
                        "instance of mesh {} of {}",
                        instance.mesh,
                        scene.meshes.len()
                    ))
                })?;
                let Some(shown) = shown else { continue };
                if (shown.mode == DrawMode::Blended) != blended {
                    continue;
                }
                let mesh = &scene.meshes[instance.mesh];
                calls.push(DrawCall {
                    instance: number,
                    mesh: instance.mesh,
                    material: mesh.material,
                    mode: shown.mode,
                    transform: instance.transform,
                    mirrored: instance.mirrored(),
                    first_primitive: next_primitive,
                    colored: !mesh.colors.is_empty(),
                    bounds: shown.bounds(scene, instance),
                });
                next_primitive = u32::try_from(mesh.triangles())
                    .ok()
                    .and_then(|n| next_primitive.checked_add(n))
                    .ok_or_else(|| RasterError::TooLarge {
                        what: "primitives".into(),
                        found: scene.triangle_count(),
                        limit: u64::from(u32::MAX),
                    })?;
            }
        }
        let bounds: Vec<[Vec3; 2]> = calls.iter().map(|call| call.bounds).collect();
        let moving = moving(scene, &calls);
        Ok(Self {
            hierarchy: Hierarchy::new(&bounds),
            calls,
            moving,
            groups: scene.materials.iter().map(MaterialGroups::new).collect(),
            cascades,
            shadow_format: TexelFormat::R32f,
        })
    }

    /// Moves the transforms and bounds of moving draws to a time. `scene` is the one from which the
    /// list was created; its instances are unchanged or posed by its animation at that time.
    pub fn pose(&mut self, scene: &Scene, time_s: f32) {
        if self.moving.is_empty() {
            return;
        }
        let moved: HashMap<usize, Affine3A> = scene.moved(time_s).collect();
        for &draw in &self.moving {
            let call = &mut self.calls[draw as usize];
            let animated = || scene.instances.get(call.instance).map(|i| i.transform);
            if let Some(transform) = moved.get(&call.instance).copied().or_else(animated) {
                let mesh = &scene.meshes[call.mesh];
                call.transform = transform;
                call.mirrored = transform.matrix3.determinant() < 0.0;
                call.bounds = world_box(&mesh.positions, mesh.bounds(), &transform);
            }
        }
        let bounds = |&draw: &u32| (draw, self.calls[draw as usize].bounds);
        self.hierarchy.refit(self.moving.iter().map(bounds));
    }

    /// The depth test between the primitives of each draw, which a recorder of `fragments` repeats.
    pub fn replays(&self, fragments: Fragments) -> Vec<DepthReplay> {
        let replay = |call: &DrawCall| match (fragments, call.mode) {
            (Fragments::DepthTested, DrawMode::Masked) => DepthReplay::Greater,
            _ => DepthReplay::None,
        };
        self.calls.iter().map(replay).collect()
    }

    /// Indices of the draws that may be visible in a view or shadow cascade, ascending.
    pub fn visible(&self, clip_from_world: Mat4) -> Vec<u32> {
        self.hierarchy.entering(clip_from_world)
    }

    /// The draws of `list` that may be visible in a view.
    pub(crate) fn visible_of(&self, list: &[u32], clip_from_world: Mat4) -> Vec<u32> {
        let bounds = list.iter().map(|&draw| self.calls[draw as usize].bounds);
        (frustum::visible(bounds, clip_from_world).into_iter())
            .map(|position| list[position as usize])
            .collect()
    }

    /// The draws of a layer that may touch a region of it, ascending.
    pub(crate) fn touching(&self, view: &View<'_>, region: Region) -> Vec<u32> {
        let size_px = view.layer.size_px;
        if region.size_px == size_px {
            return view.visible.to_vec();
        }
        let clip =
            frustum::crop(region.origin_px, region.size_px, size_px) * view.clip_from_world();
        self.visible_of(view.visible, clip)
    }

    /// Texture table of the trace: the scene's textures in their order, then the shadow maps.
    pub fn textures(&self, set: &TextureSet) -> Vec<Texture> {
        let mut textures: Vec<Texture> = set.textures.iter().map(|t| t.texture.clone()).collect();
        if self.cascades > 0 {
            textures.push(Texture {
                name: "shadow cascades".into(),
                size: [SHADOW_SIZE; 2],
                levels: 1,
                layers: self.cascades,
                format: self.shadow_format,
                color_space: ColorSpace::Linear,
                part: None,
            });
        }
        textures
    }

    /// Sampler and draw tables of the trace. `textures` is the result of [`DrawList::textures`] for
    /// the same `set`.
    pub fn tables(
        &self,
        scene: &Scene,
        set: &TextureSet,
        textures: &[Texture],
    ) -> (Vec<Sampler>, Vec<Draw>) {
        let mut samplers = Vec::new();
        let material_groups: Vec<Vec<UvGroup>> = scene
            .materials
            .iter()
            .zip(&self.groups)
            .map(|(material, groups)| {
                let of_slots = &material.textures;
                let mut result: Vec<UvGroup> = groups
                    .groups
                    .iter()
                    .map(|group| {
                        let samples = group
                            .iter()
                            .filter_map(|&slot| of_slots[slot])
                            .filter_map(|t| {
                                // Images that only unplaced materials use have no texture.
                                let texture = (*set.of_image.get(t.image)?)?;
                                Some(Sample {
                                    texture: texture as u32,
                                    sampler: intern(&mut samplers, t.sampler),
                                    ..Sample::default()
                                })
                            })
                            .collect();
                        uv_group(samples, textures)
                    })
                    .collect();
                for layer in 0..self.cascades {
                    let sampler = intern(&mut samplers, Sampler::SHADOW);
                    let samples = SHADOW_TAPS
                        .iter()
                        .map(|&offset| Sample {
                            texture: set.textures.len() as u32,
                            sampler,
                            layer: layer as u16,
                            offset,
                            level: Default::default(),
                        })
                        .collect();
                    result.push(uv_group(samples, textures));
                }
                result
            })
            .collect();
        let draws = self
            .calls
            .iter()
            .map(|call| Draw {
                material: scene.materials[call.material].name.clone(),
                first_primitive: call.first_primitive,
                primitives: scene.meshes[call.mesh].triangles() as u32,
                groups: material_groups[call.material].clone(),
            })
            .collect();
        (samplers, draws)
    }
}

fn uv_group(samples: Vec<Sample>, textures: &[Texture]) -> UvGroup {
    let extent = |axis: usize| {
        samples
            .iter()
            .map(|s| textures[s.texture as usize].size[axis])
            .max()
            .unwrap_or(1)
    };
    UvGroup {
        extent: [extent(0), extent(1)],
        samples,
    }
}

fn intern(samplers: &mut Vec<Sampler>, sampler: Sampler) -> u16 {
    let index = samplers
        .iter()
        .position(|s| *s == sampler)
        .unwrap_or_else(|| {
            samplers.push(sampler);
            samplers.len() - 1
        });
    index as u16
}

/// World-space bounds of a mesh, including the rounding of its vertices in any driver. `object_box`
/// is its box in object space.
fn world_box(positions: &[Vec3], object_box: [Vec3; 2], transform: &Affine3A) -> [Vec3; 2] {
    // Relative to the magnitude of the sums from which a coordinate is computed: 8 units in the
    // last place.
    const ROUNDING: f32 = 8.0 * f32::EPSILON / 2.0;
    let m = &transform.matrix3;
    let p = object_box[0].abs().max(object_box[1].abs());
    let axes = [m.x_axis, m.y_axis, m.z_axis].map(|axis| Vec3::from(axis.abs()));
    let start = Vec3::from(transform.translation.abs());
    let margin = (axes[0] * p.x + axes[1] * p.y + axes[2] * p.z + start) * ROUNDING;
    let [low, high] = transformed_box(positions, object_box, transform);
    [low - margin, high + margin]
}

/// The draws whose instances or vertices move.
fn moving(scene: &Scene, calls: &[DrawCall]) -> Vec<u32> {
    if scene.motions.is_empty() && scene.animation.is_none() {
        return Vec::new();
    }
    let animated = scene.animation.iter().flat_map(Animation::moving_instances);
    let moving: HashSet<usize> = (scene.motions.iter())
        .flat_map(|motion| motion.instances.iter().copied())
        .chain(animated)
        .collect();
    (0_u32..)
        .zip(calls)
        .filter(|(_, call)| moving.contains(&call.instance))
        .map(|(draw, _)| draw)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4;
    use scene::{Motion, Movement, TextureRef};

    /// A scene with one mesh of `triangles[i]` triangles and material i for each entry.
    fn scene(materials: Vec<Material>, triangles: &[usize]) -> Scene {
        let mesh = |(material, &count): (usize, &usize)| Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            indices: [0, 1, 2].repeat(count),
            material,
            ..Mesh::default()
        };
        Scene {
            meshes: triangles.iter().enumerate().map(mesh).collect(),
            instances: (0..triangles.len())
                .map(|mesh| Instance {
                    mesh,
                    transform: Affine3A::IDENTITY,
                })
                .collect(),
            materials,
            ..Scene::default()
        }
    }

    fn material(alpha: AlphaMode, textured: bool) -> Material {
        Material {
            alpha,
            textures: [(TextureSlot::BaseColor, textured.then(|| TextureRef::new(0)))].into(),
            base_color: Vec4::new(1.0, 1.0, 1.0, 0.4),
            ..Material::default()
        }
    }

    #[test]
    fn blended_draws_come_last_and_primitives_are_numbered_consecutively() {
        let materials = vec![
            material(AlphaMode::Blend, true),
            material(AlphaMode::Opaque, true),
            material(AlphaMode::Mask(0.5), true),
        ];
        let draws = DrawList::new(&scene(materials, &[2, 3, 4]), 0).unwrap();
        let rows: Vec<_> = draws
            .calls
            .iter()
            .map(|c| (c.mesh, c.mode, c.first_primitive))
            .collect();
        let expected = [
            (1, DrawMode::Opaque, 0),
            (2, DrawMode::Masked, 3),
            (0, DrawMode::Blended, 7),
        ];
        assert_eq!(rows, expected);
        assert_eq!(draws.surfaces(Fragments::All).not_opaque, [[1, 2]]);
    }

    #[test]
    fn a_constant_alpha_is_tested_once_per_draw() {
        let materials = vec![
            material(AlphaMode::Mask(0.5), false),
            material(AlphaMode::Mask(0.3), false),
        ];
        let draws = DrawList::new(&scene(materials, &[1, 1]), 0).unwrap();
        assert_eq!(draws.calls.len(), 1);
        assert_eq!(
            (draws.calls[0].mesh, draws.calls[0].mode),
            (1, DrawMode::Opaque)
        );
    }

    #[test]
    fn an_index_beyond_the_vertices_is_refused() {
        let mut scene = scene(vec![material(AlphaMode::Opaque, true)], &[1]);
        scene.meshes[0].indices[2] = 3;
        let message = DrawList::new(&scene, 0).unwrap_err().to_string();
        assert!(
            message.contains("index 3 beyond its 3 vertices"),
            "{message}"
        );
    }

    #[test]
    fn bounds_follow_moving_draws_and_return_to_their_start() {
        let mut scene = scene(vec![material(AlphaMode::Opaque, false); 3], &[1, 1, 1]);
        scene.materials[0].alpha = AlphaMode::Blend;
        scene.motions = vec![Motion {
            instances: vec![0, 2],
            movements: vec![Movement::Shuttle {
                by: Vec3::Z * 4.0,
                period_s: 2.0,
                phase: 0.0,
            }],
        }];
        let mut draws = DrawList::new(&scene, 0).unwrap();
        let at_rest: Vec<_> = draws.calls.iter().map(|c| (c.instance, c.bounds)).collect();
        assert_eq!(at_rest.iter().map(|r| r.0).collect::<Vec<_>>(), [1, 2, 0]);
        draws.pose(&scene, 1.0);
        assert_eq!(draws.moving, [1, 2]);
        assert_eq!(draws.calls[0].bounds, at_rest[0].1);
        for call in &draws.calls[1..] {
            let [low, high] = call.bounds;
            assert!((low - Vec3::Z * 4.0).length() < 1e-5, "{low}");
            assert!((high - Vec3::new(1.0, 1.0, 4.0)).length() < 1e-5, "{high}");
        }
        draws.pose(&scene, 0.0);
        let again: Vec<_> = draws.calls.iter().map(|c| (c.instance, c.bounds)).collect();
        assert_eq!(again, at_rest);
    }

    #[test]
    fn each_cascade_is_a_group_of_four_taps_on_its_layer() {
        let scene = scene(vec![material(AlphaMode::Opaque, false)], &[1]);
        let draws = DrawList::new(&scene, 2).unwrap();
        let set = TextureSet::default();
        let textures = draws.textures(&set);
        let (samplers, table) = draws.tables(&scene, &set, &textures);
        assert_eq!(samplers, [Sampler::SHADOW]);
        assert_eq!((textures.len(), textures[0].layers), (1, 2));
        for (layer, group) in table[0].groups.iter().enumerate() {
            assert_eq!(group.extent, [SHADOW_SIZE; 2]);
            let taps: Vec<_> = group.samples.iter().map(|s| (s.layer, s.offset)).collect();
            assert_eq!(taps, SHADOW_TAPS.map(|offset| (layer as u16, offset)));
        }
        assert_eq!(table[0].groups.len(), 2);
    }
}
