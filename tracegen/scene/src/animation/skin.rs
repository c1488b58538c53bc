//! Linear-blend skinning (glTF 2.0, 3.7.3): a vertex follows the weighted mean of its joints' matrices.

use glam::{DAffine3, DMat3, DVec3};

/// The joints of a skin.
#[derive(Clone, Debug)]
pub(crate) struct Skin {
    /// Their nodes.
    pub joints: Vec<usize>,
    /// The transforms from the mesh's space to each joint's; same length as `joints`.
    pub inverse_binds: Vec<DAffine3>,
}

/// A skin at a time.
#[derive(Clone, Debug)]
pub(crate) struct PosedSkin {
    /// The transforms from the mesh's space to its instance's, by joint.
    matrices: Vec<DAffine3>,
    /// True if the joints mirror the mesh. Then the instance mirrors instead of the matrices, because
    /// renderers derive the front side of a triangle from the instance.
    pub mirrored: bool,
}

impl Skin {
    /// The joints' matrices relative to `origin`. `worlds` holds the nodes' transforms to the world.
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
    /// Negates x, which is exact.
    const MIRROR: DAffine3 = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
        translation: DVec3::ZERO,
    };

    /// The transform of the skinned instance, whose vertices are already in the world's space.
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
    /// Influences per vertex: four per set.
    pub per_vertex: usize,
    /// Indices into the skin's list of joints.
    pub joints: Vec<u16>,
    /// Same length as `joints`. The sum need not be 1.
    pub weights: Vec<f32>,
}

impl Influences {
    /// Drops the vertices that are not `used`.
    pub fn keep(&mut self, used: &[bool]) {
        fn kept<T: Copy>(values: &[T], per_vertex: usize, used: &[bool]) -> Vec<T> {
            let vertices = values.chunks_exact(per_vertex).zip(used);
            vertices
                .filter(|(_, used)| **used)
                .flat_map(|(values, _)| values)
                .copied()
                .collect()
        }
        self.joints = kept(&self.joints, self.per_vertex, used);
        self.weights = kept(&self.weights, self.per_vertex, used);
    }

    /// The joint indices and weights of a vertex, and the sum of the weights.
    pub fn of(&self, vertex: usize) -> (impl Iterator<Item = (u16, f64)>, f64) {
        let of_vertex = vertex * self.per_vertex..(vertex + 1) * self.per_vertex;
        let weights = &self.weights[of_vertex.clone()];
        let pairs = self.joints[of_vertex]
            .iter()
            .copied()
            .zip(weights.iter().map(|&w| f64::from(w)));
        (pairs, weights.iter().map(|&w| f64::from(w)).sum())
    }

    /// The weighted mean of a vertex's joints. No triangle uses a vertex without weights;
    /// such a vertex follows the skin's first joint.
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

/// The cofactor matrix. It transforms normals to the same direction as the inverse transpose, and it
/// exists for every matrix.
pub(crate) fn normal_matrix(m: &DMat3) -> DMat3 {
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}
