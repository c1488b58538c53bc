//! A second evaluator of poses, in plain arrays of doubles. It shares no code with the loader, and it
//! evaluates the test's own data, not the data that the loader read.

pub type Vector = [f64; 3];
pub type Matrix = [[f64; 4]; 4];

/// Interpolation between keys.
#[derive(Clone, Copy, PartialEq)]
pub enum Between {
    Linear,
    Step,
    Cubic,
}

/// Values by time; with [`Between::Cubic`] each key has a tangent, a value and a tangent.
#[derive(Clone)]
pub struct Keys<const N: usize> {
    pub between: Between,
    pub times: Vec<f32>,
    pub values: Vec<[f32; N]>,
}

/// A node: its parent, its rest transform, and its curves.
#[derive(Clone, Default)]
pub struct Node {
    pub parent: Option<usize>,
    pub translation: [f32; 3],
    pub rotation: Option<[f32; 4]>,
    pub scale: Option<[f32; 3]>,
    pub translations: Option<Keys<3>>,
    pub rotations: Option<Keys<4>>,
    pub scales: Option<Keys<3>>,
}

impl<const N: usize> Keys<N> {
    pub fn at(&self, time: f64, turns: bool) -> [f64; N] {
        let times: Vec<f64> = self.times.iter().map(|t| f64::from(*t)).collect();
        let count = times.len();
        let row = |i: usize| self.values[i].map(f64::from);
        let value = |key: usize| match self.between {
            Between::Cubic => row(key * 3 + 1),
            _ => row(key),
        };
        if time <= times[0] {
            return value(0);
        }
        if time >= times[count - 1] {
            return value(count - 1);
        }
        let mut key = 0;
        while times[key + 1] <= time {
            key += 1;
        }
        let length = times[key + 1] - times[key];
        let t = (time - times[key]) / length;
        let mut result = [0.0; N];
        match self.between {
            Between::Step => value(key),
            Between::Linear if turns => {
                let (a, b) = (row(key), row(key + 1));
                let dot: f64 = (0..N).map(|i| a[i] * b[i]).sum();
                let angle = dot.abs().min(1.0).acos();
                let (mut from, mut to) = (1.0 - t, t);
                if angle > 1e-9 {
                    from = ((1.0 - t) * angle).sin() / angle.sin();
                    to = (t * angle).sin() / angle.sin() * dot.signum();
                }
                for i in 0..N {
                    result[i] = from * a[i] + to * b[i];
                }
                result
            }
            Between::Linear => {
                let (a, b) = (row(key), row(key + 1));
                for i in 0..N {
                    result[i] = (1.0 - t) * a[i] + t * b[i];
                }
                result
            }
            Between::Cubic => {
                let (p0, m0) = (row(key * 3 + 1), row(key * 3 + 2));
                let (m1, p1) = (row(key * 3 + 3), row(key * 3 + 4));
                for i in 0..N {
                    result[i] = (1.0 + 2.0 * t) * (1.0 - t) * (1.0 - t) * p0[i]
                        + t * (1.0 - t) * (1.0 - t) * length * m0[i]
                        + t * t * (3.0 - 2.0 * t) * p1[i]
                        + t * t * (t - 1.0) * length * m1[i];
                }
                result
            }
        }
    }
}

pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut result = [[0.0; 4]; 4];
    for row in 0..4 {
        for column in 0..4 {
            for k in 0..4 {
                result[row][column] += a[row][k] * b[k][column];
            }
        }
    }
    result
}

/// A matrix from the columns of a file.
pub fn matrix(columns: [f32; 16]) -> Matrix {
    let mut result = [[0.0; 4]; 4];
    for (i, value) in columns.iter().enumerate() {
        result[i % 4][i / 4] = f64::from(*value);
    }
    result
}

pub fn point(m: &Matrix, p: Vector) -> Vector {
    let mut result = [0.0; 3];
    for (row, value) in result.iter_mut().enumerate() {
        *value = m[row][0] * p[0] + m[row][1] * p[1] + m[row][2] * p[2] + m[row][3];
    }
    result
}

/// The inverse transpose of the upper left part, by a vector, of unit length.
pub fn normal(m: &Matrix, n: Vector) -> Vector {
    let minor = |r: usize, c: usize| {
        let [r1, r2, c1, c2] = [(r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3];
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * minor(0, c)).sum();
    let mut result = [0.0; 3];
    for (row, value) in result.iter_mut().enumerate() {
        *value = (0..3).map(|c| minor(row, c) / determinant * n[c]).sum();
    }
    unit(result)
}

pub fn unit(v: Vector) -> Vector {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}

/// Translation times rotation times scale.
fn local(node: &Node, time: f64) -> Matrix {
    let translation = match &node.translations {
        Some(keys) => keys.at(time, false),
        None => node.translation.map(f64::from),
    };
    let rotation = match &node.rotations {
        Some(keys) => keys.at(time, true),
        None => node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]).map(f64::from),
    };
    let scale = match &node.scales {
        Some(keys) => keys.at(time, false),
        None => node.scale.unwrap_or([1.0; 3]).map(f64::from),
    };
    let length = rotation.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z, w] = rotation.map(|v| v / length);
    let turn = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    let mut result = [[0.0; 4]; 4];
    for row in 0..3 {
        for column in 0..3 {
            result[row][column] = turn[row][column] * scale[column];
        }
        result[row][3] = translation[row];
    }
    result[3][3] = 1.0;
    result
}

/// The transform of a node to the world.
pub fn world(nodes: &[Node], node: usize, time: f64) -> Matrix {
    let own = local(&nodes[node], time);
    match nodes[node].parent {
        Some(parent) => product(&world(nodes, parent, time), &own),
        None => own,
    }
}

/// The weighted sum of the joints' matrices, with weights that add up to 1. Without weights, the matrix of
/// the first joint.
pub fn blend(joints: &[Matrix], of_vertex: &[(usize, f64)]) -> Matrix {
    let sum: f64 = of_vertex.iter().map(|(_, weight)| weight).sum();
    if sum == 0.0 {
        return joints[of_vertex[0].0];
    }
    let mut result = [[0.0; 4]; 4];
    for (joint, weight) in of_vertex {
        for row in 0..4 {
            for column in 0..4 {
                result[row][column] += joints[*joint][row][column] * weight / sum;
            }
        }
    }
    result
}
