//! The figure of the tests: a skinned and morphed leg, a morphed face on a moving node, and a rigid
//! hat.

use super::naive::{
    Between, Keys, Matrix, Node, Vector, blend, matrix, normal, point, product, unit, world,
};
use crate::conformance::files::File;
use serde_json::{Value, json};

pub const VERTICES: usize = 6;
const INDICES: [u16; 12] = [0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5];

/// Node indices of the root, hip, knee and foot, and of the three meshes.
pub const ROOT: usize = 0;
pub const HIP: usize = 1;
pub const KNEE: usize = 2;
pub const FOOT: usize = 3;
pub const LEG: usize = 4;
pub const FACE: usize = 5;
pub const HAT: usize = 6;
/// The joints of the skin, in another order than the nodes.
const JOINTS: [usize; 3] = [KNEE, FOOT, HIP];

/// Displacements of positions and of normals.
type Displacements = (Vec<[f32; 3]>, Vec<[f32; 3]>);

/// The figure. Both the file and the expected result are derived from it.
#[derive(Clone)]
pub struct Figure {
    pub nodes: Vec<Node>,
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    /// By target.
    pub targets: Vec<Displacements>,
    pub inverse_binds: Vec<[f32; 16]>,
    /// Two sets of joints and weights.
    pub joints: [Vec<[u8; 4]>; 2],
    pub weights: [Vec<[f32; 4]>; 2],
    /// Weights of the morph targets of the leg (by its node) and of the face.
    pub leg_weights: [f32; 2],
    pub face_weights: Keys<2>,
}

/// Deterministic pseudo-random numbers.
fn noise(seed: usize) -> f32 {
    let mixed = (seed as u32).wrapping_mul(2_654_435_761) >> 8;
    (mixed % 2000) as f32 / 1000.0 - 1.0
}

fn rows<const N: usize>(count: usize, seed: usize) -> Vec<[f32; N]> {
    (0..count)
        .map(|row| std::array::from_fn(|i| noise(seed + 31 * row + 7 * i)))
        .collect()
}

fn quaternions(count: usize, seed: usize) -> Vec<[f32; 4]> {
    let unit = |q: [f32; 4]| {
        let length = q.iter().map(|v| v * v).sum::<f32>().sqrt();
        q.map(|v| v / length)
    };
    rows(count, seed).into_iter().map(unit).collect()
}

fn keys<const N: usize>(between: Between, times: &[f32], values: Vec<[f32; N]>) -> Keys<N> {
    Keys {
        between,
        times: times.to_vec(),
        values,
    }
}

impl Figure {
    pub fn new() -> Self {
        let turned = |seed| Some(quaternions(1, seed)[0]);
        let mut nodes = vec![Node::default(); 7];
        nodes[ROOT] = Node {
            translation: [0.5, -0.25, 2.0],
            rotation: turned(3),
            scale: Some([1.5, 0.5, 2.0]),
            ..Node::default()
        };
        nodes[HIP] = Node {
            parent: Some(ROOT),
            rotation: turned(5),
            translations: Some(keys(Between::Linear, &[0.0, 1.0, 2.5], rows(3, 11))),
            scales: Some(keys(
                Between::Step,
                &[0.5, 1.5],
                vec![[1.0, 2.0, 0.75], [0.5, 1.25, 1.0]],
            )),
            ..Node::default()
        };
        nodes[KNEE] = Node {
            parent: Some(HIP),
            translation: [0.0, -1.0, 0.25],
            scale: Some([1.0, 1.5, 1.0]),
            rotations: Some(keys(
                Between::Linear,
                &[0.25, 0.75, 1.5, 3.0],
                quaternions(4, 17),
            )),
            ..Node::default()
        };
        nodes[FOOT] = Node {
            parent: Some(KNEE),
            translation: [0.125, -1.0, 0.0],
            rotations: Some(keys(Between::Cubic, &[0.0, 1.25, 2.0], quaternions(9, 23))),
            ..Node::default()
        };
        // The transform of a skinned mesh's own node has no effect.
        nodes[LEG] = Node {
            translation: [100.0, 200.0, 300.0],
            scale: Some([7.0, 8.0, 9.0]),
            ..Node::default()
        };
        nodes[FACE] = Node {
            parent: Some(HIP),
            translation: [0.0, 1.0, 0.0],
            ..Node::default()
        };
        nodes[HAT] = Node {
            parent: Some(FACE),
            translations: Some(keys(Between::Cubic, &[0.0, 2.0], rows(6, 29))),
            ..Node::default()
        };
        let weights = rows::<4>(VERTICES, 41);
        Self {
            nodes,
            positions: rows(VERTICES, 1),
            normals: rows::<3>(VERTICES, 2)
                .into_iter()
                .map(|n| unit(n.map(f64::from)).map(|v| v as f32))
                .collect(),
            targets: (0..2)
                .map(|i| (rows(VERTICES, 60 + i), rows(VERTICES, 70 + i)))
                .collect(),
            inverse_binds: (0..3)
                .map(|joint| {
                    let mut columns = [0.0; 16];
                    for (i, value) in columns.iter_mut().enumerate() {
                        let one = if i % 5 == 0 { 1.0 } else { 0.0 };
                        *value = if i % 4 == 3 {
                            one
                        } else {
                            one + 0.25 * noise(80 + 16 * joint + i)
                        };
                    }
                    columns
                })
                .collect(),
            joints: [
                (0..VERTICES)
                    .map(|v| [v as u8 % 3, (v as u8 + 1) % 3, 0, 0])
                    .collect(),
                (0..VERTICES)
                    .map(|v| [(v as u8 + 2) % 3, 0, 0, 0])
                    .collect(),
            ],
            weights: [
                weights
                    .iter()
                    .map(|w| [w[0].abs(), w[1].abs(), 0.0, 0.0])
                    .collect(),
                // As bytes of 255.
                (0..VERTICES)
                    .map(|v| [(v * 40) as f32, 0.0, 0.0, 0.0])
                    .collect(),
            ],
            leg_weights: [0.5, -0.25],
            face_weights: keys(Between::Cubic, &[0.5, 1.0, 2.75], rows(9, 90)),
        }
    }

    /// The file: the leg has sparse displacements, and weights of both floats and bytes.
    pub fn file(&self) -> File {
        let mut file = File::empty();
        let attributes = self.attributes(&mut file);
        let indices = file.indices(&INDICES);
        let targets: Vec<Value> = (self.targets.iter().enumerate())
            .map(|(number, (positions, normals))| {
                let positions = match number {
                    0 => sparse(&mut file, positions),
                    _ => file.floats("VEC3", positions),
                };
                json!({"POSITION": positions, "NORMAL": file.floats("VEC3", normals)})
            })
            .collect();
        let primitive = |attributes: &Value, targets: &[Value]| json!({"primitives": [{"attributes": attributes, "indices": indices, "targets": targets}]});
        let plain = json!({"POSITION": attributes["POSITION"], "NORMAL": attributes["NORMAL"]});
        let mut hat = primitive(&plain, &[]);
        hat["primitives"][0]
            .as_object_mut()
            .unwrap()
            .remove("targets");
        let mut leg = primitive(&attributes, &targets);
        leg["weights"] = json!([9.0, 9.0]);
        file.json["meshes"] = json!([leg, primitive(&plain, &targets), hat]);
        let inverse_binds = file.floats("MAT4", &self.inverse_binds);
        file.json["skins"] = json!([{"joints": JOINTS, "inverseBindMatrices": inverse_binds}]);
        file.json["nodes"] = self
            .nodes
            .iter()
            .enumerate()
            .map(|(i, _)| self.node(i))
            .collect();
        file.json["scenes"] = json!([{"nodes": [ROOT, LEG]}]);
        let mut animation = json!({"name": "walk", "channels": [], "samplers": []});
        for (number, node) in self.nodes.iter().enumerate() {
            channel(
                &mut file,
                &mut animation,
                number,
                "translation",
                "VEC3",
                &node.translations,
            );
            channel(
                &mut file,
                &mut animation,
                number,
                "rotation",
                "VEC4",
                &node.rotations,
            );
            channel(
                &mut file,
                &mut animation,
                number,
                "scale",
                "VEC3",
                &node.scales,
            );
        }
        let weights = Some(self.face_weights.clone());
        channel(
            &mut file,
            &mut animation,
            FACE,
            "weights",
            "SCALAR",
            &weights,
        );
        file.json["animations"] = json!([animation]);
        file
    }

    fn attributes(&self, file: &mut File) -> Value {
        let mut attributes = json!({
            "POSITION": file.floats("VEC3", &self.positions),
            "NORMAL": file.floats("VEC3", &self.normals),
            "WEIGHTS_0": file.floats("VEC4", &self.weights[0])
        });
        let view = file.view(self.joints[0].as_flattened());
        attributes["JOINTS_0"] = file.accessor(view, 5121, "VEC4", VERTICES).into();
        let wide: Vec<u8> = (self.joints[1].as_flattened().iter())
            .flat_map(|&joint| u16::from(joint).to_le_bytes())
            .collect();
        let view = file.view(&wide);
        attributes["JOINTS_1"] = file.accessor(view, 5123, "VEC4", VERTICES).into();
        let bytes: Vec<u8> = self.weights[1]
            .as_flattened()
            .iter()
            .map(|&w| w as u8)
            .collect();
        let view = file.view(&bytes);
        let weights = file.accessor(view, 5121, "VEC4", VERTICES);
        file.json["accessors"][weights]["normalized"] = json!(true);
        attributes["WEIGHTS_1"] = weights.into();
        attributes
    }

    fn node(&self, number: usize) -> Value {
        let node = &self.nodes[number];
        let children: Vec<usize> = (0..self.nodes.len())
            .filter(|&child| self.nodes[child].parent == Some(number))
            .collect();
        let mut json = json!({"translation": node.translation});
        if !children.is_empty() {
            json["children"] = json!(children);
        }
        if let Some(rotation) = node.rotation {
            json["rotation"] = json!(rotation);
        }
        if let Some(scale) = node.scale {
            json["scale"] = json!(scale);
        }
        match number {
            LEG => {
                json["mesh"] = json!(0);
                json["skin"] = json!(0);
                json["weights"] = json!(self.leg_weights);
            }
            FACE => json["mesh"] = json!(1),
            HAT => json["mesh"] = json!(2),
            _ => {}
        }
        json
    }

    /// Positions and normals of the mesh of a node at a time, in the world.
    pub fn posed(&self, node: usize, time: f64) -> Vec<(Vector, Vector)> {
        let weights = match node {
            LEG => self.leg_weights.map(f64::from),
            FACE => self.face_weights.at(time, false),
            _ => [0.0; 2],
        };
        let joints: Vec<Matrix> = (JOINTS.iter().zip(&self.inverse_binds))
            .map(|(&joint, inverse_bind)| {
                product(&world(&self.nodes, joint, time), &matrix(*inverse_bind))
            })
            .collect();
        (0..VERTICES)
            .map(|vertex| {
                let mut position = self.positions[vertex].map(f64::from);
                let mut direction = self.normals[vertex].map(f64::from);
                for (target, weight) in self.targets.iter().zip(weights) {
                    for axis in 0..3 {
                        position[axis] += weight * f64::from(target.0[vertex][axis]);
                        direction[axis] += weight * f64::from(target.1[vertex][axis]);
                    }
                }
                let matrix = match node {
                    LEG => blend(&joints, &self.influences(vertex)),
                    _ => world(&self.nodes, node, time),
                };
                (point(&matrix, position), normal(&matrix, direction))
            })
            .collect()
    }

    fn influences(&self, vertex: usize) -> Vec<(usize, f64)> {
        let set = |set: usize, one: f64| {
            let joints = self.joints[set][vertex].map(usize::from);
            let weights = self.weights[set][vertex].map(|w| f64::from(w) / one);
            joints.into_iter().zip(weights)
        };
        set(0, 1.0).chain(set(1, 255.0)).collect()
    }
}

/// An accessor without a view whose values all come from its sparse part.
fn sparse(file: &mut File, values: &[[f32; 3]]) -> usize {
    let indices: Vec<u8> = (0..values.len() as u8).collect();
    let indices = file.view(&indices);
    let bytes: Vec<u8> = values
        .as_flattened()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let bytes = file.view(&bytes);
    file.push(
        "accessors",
        json!({"componentType": 5126, "type": "VEC3", "count": values.len(), "sparse": {
            "count": values.len(),
            "indices": {"bufferView": indices, "componentType": 5121},
            "values": {"bufferView": bytes}
        }}),
    )
}

fn channel<const N: usize>(
    file: &mut File,
    animation: &mut Value,
    node: usize,
    path: &str,
    of: &str,
    keys: &Option<Keys<N>>,
) {
    let Some(keys) = keys else { return };
    let input: Vec<[f32; 1]> = keys.times.iter().map(|t| [*t]).collect();
    let input = file.floats("SCALAR", &input);
    let output = if of == "SCALAR" {
        let scalars: Vec<[f32; 1]> = keys.values.as_flattened().iter().map(|v| [*v]).collect();
        file.floats(of, &scalars)
    } else {
        file.floats(of, &keys.values)
    };
    let interpolation = match keys.between {
        Between::Linear => "LINEAR",
        Between::Step => "STEP",
        Between::Cubic => "CUBICSPLINE",
    };
    let samplers = animation["samplers"].as_array_mut().unwrap();
    samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    let sampler = samplers.len() - 1;
    let target = json!({"node": node, "path": path});
    let channels = animation["channels"].as_array_mut().unwrap();
    channels.push(json!({"sampler": sampler, "target": target}));
}
