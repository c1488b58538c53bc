//! Positions of the objects and of the eyes.

/// Position, texture coordinates and direction of a vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    place: [f32; 3],
    uv: [f32; 2],
    direction: [f32; 3],
}

/// Triangles of the object at a position of `count` positions. The first object is a floor. The others are
/// boxes, which stand on it in two rows and overlap.
pub fn triangles(position: usize, count: usize) -> Vec<Vertex> {
    if position == 0 {
        let corner = |x: f32, z: f32| Vertex {
            place: [8.0 * x, -1.0, -1.0 - 14.0 * z],
            uv: [6.0 * x, 9.0 * z],
            direction: [x, -1.0, z],
        };
        let [a, b, c, d] =
            [(-1.0, 0.0), (1.0, 0.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, z)| corner(x, z));
        return vec![a, b, c, b, d, c];
    }
    let columns = count.div_ceil(2).max(1) as f32;
    let (column, row) = ((position / 2) as f32, (position % 2) as f32);
    let middle = [
        -1.7 + 3.6 * (column + 0.5 * row) / columns,
        -0.6 + 0.8 * row,
        -2.2 - 0.6 * row,
    ];
    let mut vertices = Vec::new();
    for axis in 0..3 {
        for side in [-1.0_f32, 1.0] {
            let corner = |u: f32, v: f32| {
                let mut at = [0.0; 3];
                at[axis] = side;
                at[(axis + 1) % 3] = u;
                at[(axis + 2) % 3] = v;
                // Rotated, so that three sides are visible.
                let (sin, cos) = 0.6_f32.sin_cos();
                let turned = [at[0] * cos + at[2] * sin, at[1], at[2] * cos - at[0] * sin];
                Vertex {
                    place: [0, 1, 2].map(|i| middle[i] + 0.25 * turned[i]),
                    uv: [0.5 + 0.5 * u + side, 0.5 + 0.5 * v - side],
                    direction: turned,
                }
            };
            let [a, b, c, d] =
                [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(u, v)| corner(u, v));
            vertices.extend([a, b, c, b, d, c]);
        }
    }
    vertices
}

/// World-to-clip matrix of the left and the right eye in a frame, column by column. The head moves a little
/// from frame to frame.
pub fn eyes(frame: u32, aspect: f32) -> [[[f32; 4]; 4]; 2] {
    [-0.1_f32, 0.1].map(|x| {
        let (near, far) = (0.1_f32, 50.0_f32);
        let shift = x + 0.05 * frame as f32;
        let depth = far / (near - far);
        [
            [1.0 / aspect, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, depth, -1.0],
            [-shift / aspect, 0.0, near * depth, 0.0],
        ]
    })
}
