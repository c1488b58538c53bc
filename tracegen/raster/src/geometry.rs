//! A trace's geometry: the meshes of its draws, and the primitives that enter each tile of each view.

use crate::draws::{DrawList, DrawMode, SHADOW_SIZE};
use crate::frame::Frame;
use crate::vertices::{COLOR_STRIDE, VERTEX_STRIDE};
use formats::textrace::geometry::{Geometry, GeometryView, MeshGeometry, TileLists, ViewTarget};
use glam::Mat4;
use rayon::prelude::*;
use scene::{Mesh, Scene};
use std::collections::HashMap;
use visibility::binning::{BinnedDraw, BinnedView, bin};

/// Index format of both drivers.
const INDEX_BYTES: u16 = 4;

/// The meshes of a scene's draws as the drivers store them.
pub fn geometry(scene: &Scene, draws: &DrawList) -> Geometry {
    let mut geometry = Geometry::default();
    let mut known: HashMap<usize, u32> = HashMap::new();
    for call in &draws.calls {
        let mesh = *known.entry(call.mesh).or_insert_with(|| {
            geometry.meshes.push(stored(&scene.meshes[call.mesh]));
            geometry.meshes.len() as u32 - 1
        });
        geometry.draw_meshes.push(mesh);
    }
    geometry
}

fn stored(mesh: &Mesh) -> MeshGeometry {
    let colors = if mesh.colors.is_empty() {
        0
    } else {
        COLOR_STRIDE
    };
    MeshGeometry {
        vertices: mesh.positions.len() as u32,
        vertex_bytes: (VERTEX_STRIDE + colors) as u16,
        index_bytes: INDEX_BYTES,
        indices: mesh.indices[..mesh.triangles() * 3].to_vec(),
    }
}

/// The views of a frame in the order in which they are rendered, each with its lists: shadow maps,
/// then layers. The first layer is render pass `first_pass` of the trace.
pub(crate) fn views<'a>(
    scene: &'a Scene,
    draws: &'a DrawList,
    frame: &'a Frame,
    number: u32,
    first_pass: usize,
) -> impl Iterator<Item = (GeometryView, TileLists)> + 'a {
    let cascades = (0..).zip(&frame.lighting.cascades).zip(&frame.casters);
    let seen = frame.cascades_seen.iter();
    let shadow_maps = cascades
        .zip(seen)
        .filter_map(move |(((cascade, shape), casters), seen)| {
            let view = GeometryView {
                frame: number,
                target: ViewTarget::ShadowMap(cascade),
                size_px: [SHADOW_SIZE; 2],
            };
            let casts = |draw: &&u32| draws.calls[**draw as usize].mode != DrawMode::Blended;
            let casters: Vec<u32> = casters.iter().filter(casts).copied().collect();
            seen.then(|| {
                (
                    view,
                    lists(scene, draws, &view, shape.clip_from_world, &casters, true),
                )
            })
        });
    let layers = (first_pass as u32..)
        .zip(frame.views())
        .map(move |(pass, layer)| {
            let view = GeometryView {
                frame: number,
                target: ViewTarget::Pass(pass),
                size_px: layer.layer.size_px,
            };
            (
                view,
                lists(
                    scene,
                    draws,
                    &view,
                    layer.clip_from_world(),
                    layer.visible,
                    false,
                ),
            )
        });
    shadow_maps.chain(layers)
}

/// Sorts the primitives of the given draws into the tiles of a view. Back faces are kept for
/// double-sided materials, and if all faces are requested.
fn lists(
    scene: &Scene,
    draws: &DrawList,
    view: &GeometryView,
    clip_from_world: Mat4,
    visible: &[u32],
    all_faces: bool,
) -> TileLists {
    let binned = BinnedView {
        clip_from_world,
        size_px: view.size_px,
    };
    let entries: Vec<(u32, u32)> = (visible.par_iter())
        .map(|&draw| {
            let call = &draws.calls[draw as usize];
            let mesh = &scene.meshes[call.mesh];
            let mut entries = Vec::new();
            let triangles = BinnedDraw {
                positions: &mesh.positions,
                indices: &mesh.indices,
                world_from_object: call.transform,
                double_sided: all_faces || scene.materials[call.material].double_sided,
                mirrored: call.mirrored,
                first_primitive: call.first_primitive,
            };
            bin(&binned, &triangles, &mut entries);
            entries
        })
        .flatten_iter()
        .collect();
    by_tile(view.tile_count(), visible, &entries)
}

/// Lists by tile of entries whose primitives ascend.
fn by_tile(tiles: usize, draws: &[u32], entries: &[(u32, u32)]) -> TileLists {
    let mut starts = vec![0_u32; tiles + 1];
    for (tile, _) in entries {
        starts[*tile as usize + 1] += 1;
    }
    for tile in 0..tiles {
        starts[tile + 1] += starts[tile];
    }
    let mut next = starts.clone();
    let mut primitives = vec![0; entries.len()];
    for (tile, primitive) in entries {
        let place = &mut next[*tile as usize];
        primitives[*place as usize] = *primitive;
        *place += 1;
    }
    TileLists {
        draws: draws.to_vec(),
        starts,
        primitives,
    }
}
