//! Compares a trace's meshes and views with the scene.

use super::faults::Faults;
use formats::textrace::geometry::{Geometry, MeshGeometry, ViewTarget};
use scene::{Mesh, Scene};
use std::collections::HashMap;

/// Bytes of a vertex: position, normal, tangent and two sets of coordinates.
const VERTEX_BYTES: usize = 4 * (3 + 3 + 4 + 4);
/// Bytes of a vertex's colour.
const COLOUR_BYTES: usize = 2 * 4;
/// Bytes of an index.
const INDEX_BYTES: u16 = 4;
/// Edge of a shadow cascade, texels.
const SHADOW_SIZE: u32 = 2048;

/// Compares the meshes of the draws, whose meshes of the scene are `drawn`, and the shadow maps among the
/// views.
pub(super) fn hold(
    scene: &Scene,
    drawn: &[usize],
    cascades: usize,
    found: &Geometry,
    faults: &mut Faults,
) {
    // Each mesh is stored once.
    let mut stored: HashMap<usize, u32> = HashMap::new();
    let mut owners: HashMap<u32, usize> = HashMap::new();
    for (draw, (mesh, &number)) in drawn.iter().zip(&found.draw_meshes).enumerate() {
        let expected = *stored.entry(*mesh).or_insert(number);
        faults.hold(&format!("draw {draw}: mesh"), &expected, &number);
        // Meshes with the same triangles are stored apart, as the scene has them.
        let owner = *owners.entry(number).or_insert(*mesh);
        if owner != *mesh {
            let expected = format!("another one than that of {}", scene.meshes[owner].name);
            faults.add(
                &format!("draw {draw}: mesh"),
                &expected,
                &number.to_string(),
            );
        }
    }
    faults.hold("number of meshes", &stored.len(), &found.meshes.len());
    let mut stored: Vec<(usize, u32)> = stored.into_iter().collect();
    stored.sort_unstable_by_key(|(_, number)| *number);
    for (mesh, number) in stored {
        if let Some(found) = found.meshes.get(number as usize) {
            hold_mesh(number, &scene.meshes[mesh], found, faults);
        }
    }
    for (number, view) in found.views.iter().enumerate() {
        let ViewTarget::ShadowMap(cascade) = view.target else {
            continue;
        };
        let place = format!("view {number}, shadow map {cascade}");
        faults.hold(&format!("{place}: size"), &[SHADOW_SIZE; 2], &view.size_px);
        if cascade as usize >= cascades {
            let expected = format!("one of {cascades} cascades");
            faults.add(&place, &expected, "another one");
        }
    }
}

fn hold_mesh(number: u32, mesh: &Mesh, found: &MeshGeometry, faults: &mut Faults) {
    let place = |field: &str| format!("mesh {number} ({}): {field}", mesh.name);
    let vertices = mesh.positions.len() as u32;
    faults.hold(&place("vertices"), &vertices, &found.vertices);
    let colour = if mesh.colors.is_empty() {
        0
    } else {
        COLOUR_BYTES
    };
    let vertex_bytes = VERTEX_BYTES + colour;
    let found_bytes = usize::from(found.vertex_bytes);
    faults.hold(&place("bytes of a vertex"), &vertex_bytes, &found_bytes);
    faults.hold(
        &place("bytes of an index"),
        &INDEX_BYTES,
        &found.index_bytes,
    );
    let differ = mesh
        .indices
        .iter()
        .zip(&found.indices)
        .position(|(a, b)| a != b);
    if let Some(at) = differ {
        let place = place(&format!("index {at}"));
        faults.hold(&place, &mesh.indices[at], &found.indices[at]);
    }
}
