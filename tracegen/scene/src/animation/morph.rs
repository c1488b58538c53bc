//! Morph targets (glTF 2.0, 3.7.2.2): weighted displacements of a mesh's vertices.

use glam::{DVec3, Vec3};

/// A morph target: one displacement per vertex, or none at all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Target {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec3>,
}

impl Target {
    /// Drops the vertices that are not `used`.
    pub fn keep(&mut self, used: &[bool]) {
        for values in [&mut self.positions, &mut self.normals, &mut self.tangents] {
            let mut flags = used.iter();
            values.retain(|_| flags.next().is_some_and(|&used| used));
        }
    }
}

/// One attribute of a vertex, displaced by the weighted targets.
pub(crate) fn morphed(
    rest: DVec3,
    targets: &[Target],
    weights: &[f64],
    vertex: usize,
    of: impl Fn(&Target) -> &[Vec3],
) -> DVec3 {
    let shifts = (targets.iter().zip(weights))
        .filter(|(_, weight)| **weight != 0.0)
        .filter_map(|(target, weight)| Some(of(target).get(vertex)?.as_dvec3() * *weight));
    shifts.fold(rest, |sum, shift| sum + shift)
}
