//! The brute-force rasteriser.

use glam::{DVec2, DVec4, Vec4};
use raster::backend::{Fragments, View};
use raster::draws::{DrawCall, DrawList, DrawMode};
use scene::{Scene, TextureRef};

/// Steps per pixel to which llvmpipe snaps vertices.
const SNAP: f64 = 256.0;

/// A fragment that is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Column and row of the pixel.
    pub pixel: [u32; 2],
    /// Global primitive number.
    pub primitive: u32,
    /// Coordinates of uv group 0 at the pixel's centre.
    pub uv: DVec2,
    /// Horizontal derivative in the top row of the pixel's quad.
    pub dx: DVec2,
    /// Vertical derivative in the left column of the pixel's quad.
    pub dy: DVec2,
}

/// Vertex in clip space.
#[derive(Clone, Copy)]
struct Vertex {
    clip: DVec4,
    uv: DVec2,
}

/// Vertex on the screen.
#[derive(Clone, Copy)]
struct Projected {
    /// Pixels, y down.
    at: DVec2,
    /// 1/256 pixels.
    snapped: [i64; 2],
    depth: f64,
    inverse_w: f64,
    uv_over_w: DVec2,
}

/// Renders a view of `draws`; `alpha_passes` decides the alpha test of masked draws from the
/// draw and the coordinates. The `recorded` fragments come in submission order.
pub fn render(
    scene: &Scene,
    draws: &DrawList,
    view: &View<'_>,
    size_px: [u32; 2],
    alpha_passes: &dyn Fn(&DrawCall, DVec2) -> bool,
    recorded: Fragments,
) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    let mut depth_buffer = vec![1.0_f32; size_px[0] as usize * size_px[1] as usize];
    for call in &draws.calls {
        let mesh = &scene.meshes[call.mesh];
        let material = &scene.materials[call.material];
        let leader = draws.groups[call.material]
            .groups
            .first()
            .and_then(|g| material.textures()[g[0]]);
        let vertex = |index: u32| -> Vertex {
            let position = mesh.positions[index as usize].extend(1.0);
            let world: Vec4 = glam::Mat4::from(call.transform) * position;
            Vertex {
                clip: (view.clip_from_world() * world).as_dvec4(),
                uv: coordinates(leader.as_ref(), mesh, index as usize),
            }
        };
        for (number, triangle) in mesh.indices.chunks_exact(3).enumerate() {
            let corners = clip_to_depth_range(&[
                vertex(triangle[0]),
                vertex(triangle[1]),
                vertex(triangle[2]),
            ]);
            let projected: Vec<Projected> = corners.iter().map(|v| project(v, size_px)).collect();
            for fan in 2..projected.len() {
                let mut part = [projected[0], projected[fan - 1], projected[fan]];
                // Counter-clockwise with y up is clockwise with y down: a negative area here.
                let front = (area(&part) < 0) != call.mirrored;
                if area(&part) == 0 || !(front || material.double_sided) {
                    continue;
                }
                if area(&part) < 0 {
                    part.swap(1, 2);
                }
                rasterise(
                    &part,
                    size_px,
                    |pixel, depth, at: &dyn Fn(DVec2) -> DVec2| {
                        let slot = &mut depth_buffer
                            [pixel[1] as usize * size_px[0] as usize + pixel[0] as usize];
                        if depth >= *slot {
                            return;
                        }
                        let center = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5;
                        let quad =
                            DVec2::new(f64::from(pixel[0] & !1), f64::from(pixel[1] & !1)) + 0.5;
                        let uv = at(center);
                        let writes = match call.mode {
                            DrawMode::Opaque => true,
                            DrawMode::Masked => alpha_passes(call, uv),
                            DrawMode::Blended => false,
                        };
                        if writes && recorded == Fragments::DepthTested {
                            *slot = depth;
                        }
                        let top_left = at(quad);
                        fragments.push(Fragment {
                            pixel,
                            primitive: call.first_primitive + number as u32,
                            uv,
                            dx: at(quad + DVec2::X) - top_left,
                            dy: at(quad + DVec2::Y) - top_left,
                        });
                    },
                );
            }
        }
    }
    fragments
}

fn coordinates(texture: Option<&TextureRef>, mesh: &scene::Mesh, index: usize) -> DVec2 {
    let Some(texture) = texture else {
        return DVec2::ZERO;
    };
    let set = if texture.uv_set == 1 {
        &mesh.uv1
    } else {
        &mesh.uv0
    };
    let uv = set
        .get(index)
        .copied()
        .unwrap_or_default()
        .as_dvec2()
        .extend(1.0);
    let row = |r: [f32; 3]| glam::DVec3::new(r[0].into(), r[1].into(), r[2].into()).dot(uv);
    DVec2::new(row(texture.uv_transform[0]), row(texture.uv_transform[1]))
}

/// Clips a triangle to `0 <= z <= w` (Sutherland and Hodgman 1974).
fn clip_to_depth_range(triangle: &[Vertex; 3]) -> Vec<Vertex> {
    let near = |v: &Vertex| v.clip.z;
    let far = |v: &Vertex| v.clip.w - v.clip.z;
    let mut polygon = triangle.to_vec();
    for distance in [&near as &dyn Fn(&Vertex) -> f64, &far] {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, current) in polygon.iter().enumerate() {
            let previous = &polygon[(i + polygon.len() - 1) % polygon.len()];
            let (dp, dc) = (distance(previous), distance(current));
            if (dp < 0.0) != (dc < 0.0) {
                let t = dp / (dp - dc);
                kept.push(Vertex {
                    clip: previous.clip.lerp(current.clip, t),
                    uv: previous.uv.lerp(current.uv, t),
                });
            }
            if dc >= 0.0 {
                kept.push(*current);
            }
        }
        polygon = kept;
    }
    polygon
}

fn project(vertex: &Vertex, size_px: [u32; 2]) -> Projected {
    let inverse_w = 1.0 / vertex.clip.w;
    let ndc = vertex.clip * inverse_w;
    let at = DVec2::new(
        (ndc.x * 0.5 + 0.5) * f64::from(size_px[0]),
        (0.5 - ndc.y * 0.5) * f64::from(size_px[1]),
    );
    Projected {
        at,
        snapped: [
            (at.x * SNAP).round_ties_even() as i64,
            (at.y * SNAP).round_ties_even() as i64,
        ],
        depth: ndc.z,
        inverse_w,
        uv_over_w: vertex.uv * inverse_w,
    }
}

/// Twice the area of the snapped triangle, positive for clockwise on a screen with y down.
fn area(t: &[Projected; 3]) -> i128 {
    edge(t[0].snapped, t[1].snapped, t[2].snapped)
}

fn edge(a: [i64; 2], b: [i64; 2], p: [i64; 2]) -> i128 {
    let wide = |v: i64| i128::from(v);
    wide(b[0] - a[0]) * wide(p[1] - a[1]) - wide(b[1] - a[1]) * wide(p[0] - a[0])
}

/// Visits the covered pixels of a clockwise triangle with their depth and a function that gives
/// the coordinates at any point of its plane.
fn rasterise(
    t: &[Projected; 3],
    size_px: [u32; 2],
    mut visit: impl FnMut([u32; 2], f32, &dyn Fn(DVec2) -> DVec2),
) {
    let span = |axis: usize| {
        let values = t.map(|v| v.snapped[axis]);
        let lo = values.iter().min().copied().unwrap_or(0).div_euclid(256);
        let hi = values.iter().max().copied().unwrap_or(0).div_euclid(256);
        lo.max(0)..=hi.min(i64::from(size_px[axis]) - 1)
    };
    let weights = |p: DVec2| {
        let cross = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a);
        let [a, b, c] = t.map(|v| v.at);
        let total = (b - a).perp_dot(c - a);
        [
            cross(b, c) / total,
            cross(c, a) / total,
            cross(a, b) / total,
        ]
    };
    let blend = |p: DVec2, value: &dyn Fn(&Projected) -> f64| -> f64 {
        weights(p).iter().zip(t).map(|(w, v)| w * value(v)).sum()
    };
    let uv_at = |p: DVec2| {
        let w = blend(p, &|v| v.inverse_w);
        DVec2::new(
            blend(p, &|v| v.uv_over_w.x) / w,
            blend(p, &|v| v.uv_over_w.y) / w,
        )
    };
    for y in span(1) {
        for x in span(0) {
            let center = [x * 256 + 128, y * 256 + 128];
            let inside = (0..3).all(|i| {
                let (a, b) = (t[i].snapped, t[(i + 1) % 3].snapped);
                let e = edge(a, b, center);
                let top = a[1] == b[1] && b[0] > a[0];
                let left = b[1] < a[1];
                e > 0 || (e == 0 && (top || left))
            });
            if inside {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                visit([x as u32, y as u32], blend(p, &|v| v.depth) as f32, &uv_at);
            }
        }
    }
}
