//! Linear-blend skinning (glTF 2.0, 3.7.3): a vertex follows the weighted mean of its joints' matrices.

use glam::{DAffine3, DMat3, DVec3};

/// The joints of a skin.
#[derive(Clone, Debug)]
pub(crate) struct Skin {
    /// Their nodes.
    pub joints: Vec<usize>,
    /// From the mesh's space to each joint's, as long as `joints`.
    pub inverse_binds: Vec<DAffine3>,
}

/// A skin at a time.
#[derive(Clone, Debug)]
pub(crate) struct PosedSkin {
    /// From the mesh's space to its instance's, by joint.
    matrices: Vec<DAffine3>,
    /// The joints turn triangles inside out. The instance mirrors then and the matrices do not, because
    /// renderers tell the front of a triangle by the instance.
    pub mirrored: bool,
}

impl Skin {
    /// The joints' matrices relative to `origin`; the nodes' transforms to the world are `worlds`.
    pub fn pose(&self, worlds: &[DAffine3], origin: DVec3) -> PosedSkin {
        let mut matrices: Vec<DAffine3> = (self.joints.iter().zip(&self.inverse_binds))
            .map(|(&joint, inverse_bind)| {
                let mut matrix = worlds[joint] * *inverse_bind;
                matrix.translation -= origin;
                matrix
            })
            .collect();
        let mirrored = (matrices.first()).is_some_and(|m| m.matrix3.determinant() < 0.0);
        if mirrored {
            for matrix in &mut matrices {
                *matrix = PosedSkin::MIRROR * *matrix;
            }
        }
        PosedSkin { matrices, mirrored }
    }
}

impl PosedSkin {
    /// Negates x, which rounds nothing.
    const MIRROR: DAffine3 = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
        translation: DVec3::ZERO,
    };

    /// The transform of the skinned instance: its vertices are in the world already.
    pub fn instance(&self) -> DAffine3 {
        if self.mirrored {
            Self::MIRROR
        } else {
            DAffine3::IDENTITY
        }
    }
}

/// The joints of each vertex and their weights.
#[derive(Clone, Debug)]
pub(crate) struct Influences {
    /// Of a vertex: four a set.
    pub a_vertex: usize,
    /// Numbers in the skin's list.
    pub joints: Vec<u16>,
    /// As long as `joints`. They need not add up to 1.
    pub weights: Vec<f32>,
}

impl Influences {
    /// Drops the vertices without a flag.
    pub fn keep(&mut self, used: &[bool]) {
        fn kept<T: Copy>(values: &[T], a_vertex: usize, used: &[bool]) -> Vec<T> {
            let vertices = values.chunks_exact(a_vertex).zip(used);
            vertices
                .filter(|(_, used)| **used)
                .flat_map(|(values, _)| values)
                .copied()
                .collect()
        }
        self.joints = kept(&self.joints, self.a_vertex, used);
        self.weights = kept(&self.weights, self.a_vertex, used);
    }

    /// The joint numbers and weights of a vertex, and the sum of the weights.
    pub fn of(&self, vertex: usize) -> (impl Iterator<Item = (u16, f64)>, f64) {
        let of_vertex = vertex * self.a_vertex..(vertex + 1) * self.a_vertex;
        let weights = &self.weights[of_vertex.clone()];
        let pairs = self.joints[of_vertex]
            .iter()
            .copied()
            .zip(weights.iter().map(|&w| f64::from(w)));
        (pairs, weights.iter().map(|&w| f64::from(w)).sum())
    }

    /// The weighted mean of a vertex's joints. A vertex without weights, which no triangle has, follows the
    /// first joint.
    pub fn blend(&self, vertex: usize, skin: &PosedSkin) -> DAffine3 {
        let (pairs, sum) = self.of(vertex);
        if sum == 0.0 {
            return skin.matrices[0];
        }
        let mut blend = DAffine3 {
            matrix3: DMat3::ZERO,
            translation: DVec3::ZERO,
        };
        for (joint, weight) in pairs.filter(|(_, weight)| *weight != 0.0) {
            let matrix = &skin.matrices[usize::from(joint)];
            blend.matrix3 += matrix.matrix3 * (weight / sum);
            blend.translation += matrix.translation * (weight / sum);
        }
        blend
    }
}

/// The cofactor matrix: the direction of its product with a normal is that of the inverse transpose's, and it
/// exists for every matrix.
pub(crate) fn normal_matrix(m: &DMat3) -> DMat3 {
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}
