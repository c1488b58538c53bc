//! The skin of a sports car. One smooth function defines the body and one the cabin. Panels are
//! parts of them, so they meet without gaps.
//!
//! The car points along +x with its middle at x = 0, and z is to its right. Units are metres.

use crate::mesh_builder::{MeshBuilder, profile};
use crate::noise::smoothstep;
use glam::{Vec2, Vec3, vec2, vec3};
use std::sync::LazyLock;

/// Front and rear axle.
pub const AXLES: [f32; 2] = [1.30, -1.28];
/// Radius of a tyre.
pub const TYRE: f32 = 0.335;
/// Ends of the body.
const NOSE: f32 = 2.20;
const TAIL: f32 = -2.18;
/// Ends of the cabin.
const COWL: f32 = 0.98;
const DECK: f32 = -1.72;

/// Smooth curve through (x, value) points with rising x.
fn through(points: &[Vec2], x: f32) -> f32 {
    let last = points.len() - 1;
    let i = points
        .iter()
        .take(last)
        .rposition(|p| p.x <= x)
        .unwrap_or(0);
    let at = |k: isize| points[(i as isize + k).clamp(0, last as isize) as usize];
    let (a, b, c, d) = (at(-1), at(0), at(1), at(2));
    let h = c.x - b.x;
    let t = ((x - b.x) / h).clamp(0.0, 1.0);
    // Hermite interpolation with slopes limited as in a monotone spline, so that it does not
    // overshoot.
    let slope = |p: Vec2, q: Vec2, r: Vec2| {
        let (left, right) = (
            (q.y - p.y) / (q.x - p.x).max(1e-6),
            (r.y - q.y) / (r.x - q.x).max(1e-6),
        );
        if p == q {
            right
        } else if q == r {
            left
        } else if left * right <= 0.0 {
            0.0
        } else {
            2.0 * left * right / (left + right)
        }
    };
    let (m0, m1) = (slope(a, b, c) * h, slope(b, c, d) * h);
    let (t2, t3) = (t * t, t * t * t);
    b.y * (2.0 * t3 - 3.0 * t2 + 1.0)
        + m0 * (t3 - 2.0 * t2 + t)
        + c.y * (3.0 * t2 - 2.0 * t3)
        + m1 * (t3 - t2)
}

/// Lines along the car as points of x and a value: half width, fender line and crown of the body, half width
/// of the cabin.
static LINES: LazyLock<Vec<Vec<Vec2>>> = LazyLock::new(|| {
    let lines = include_str!("../../data/car-lines.txt").lines();
    lines
        .map(|line| profile(line).iter().map(|knot| knot.at).collect())
        .collect()
});

/// Half width of the body at its widest.
fn half_width(x: f32) -> f32 {
    through(&LINES[0], x)
}

/// Height of the fender line.
fn shoulder(x: f32) -> f32 {
    through(&LINES[1], x)
}

/// Height of bonnet and deck on the centre line.
fn crown(x: f32) -> f32 {
    through(&LINES[2], x)
}

/// Lower edge: the sill, rising over the wheels.
fn lower_edge(x: f32) -> f32 {
    let sill = 0.19 + 0.13 * smoothstep(1.85, NOSE, x) + 0.20 * smoothstep(-1.75, TAIL, x);
    AXLES.iter().fold(sill, |y, axle| {
        let r = TYRE + 0.055;
        let d = x - axle;
        if d.abs() < r {
            y.max(TYRE + (r * r - d * d).sqrt())
        } else {
            y
        }
    })
}

/// A point of the body: `x` along, `t` from -1 (left lower edge) over 0 (centre line) to 1.
pub fn body(x: f32, t: f32) -> Vec3 {
    let (w, low, belt, top) = (half_width(x), lower_edge(x), shoulder(x), crown(x));
    let tuck = 0.06 * smoothstep(0.55, 0.19, low);
    let points = [
        vec2(0.0, top),
        vec2(0.34 * w, top + 0.012),
        vec2(0.62 * w, 0.5 * (top + belt) + 0.012),
        vec2(0.84 * w, belt + 0.008),
        vec2(0.955 * w, belt - 0.055),
        vec2(w, belt - 0.5 * (belt - low).min(0.36)),
        vec2(w - 0.4 * tuck, low + 0.35 * (belt - low) * 0.6),
        vec2(w - tuck, low),
    ];
    let s = t.abs().min(1.0) * (points.len() - 1) as f32;
    let i = (s as usize).min(points.len() - 2);
    let f = s - i as f32;
    let mirror = |p: Vec2| vec2(-p.x, p.y);
    let at = |k: isize| {
        let j = i as isize + k;
        if j < 0 {
            mirror(points[(-j) as usize])
        } else {
            points[(j as usize).min(points.len() - 1)]
        }
    };
    // A uniform cubic B-spline: curvature is continuous across panels, as reflections reveal
    // breaks.
    let (a, b, c, d) = (at(-1), at(0), at(1), at(2));
    let g = 1.0 - f;
    let spline = (a * (g * g * g)
        + b * (3.0 * f * f * f - 6.0 * f * f + 4.0)
        + c * (3.0 * g * g * g - 6.0 * g * g + 4.0)
        + d * (f * f * f))
        / 6.0;
    let p = if i + 2 >= points.len() {
        spline.lerp(at(0).lerp(at(1), f), f)
    } else {
        spline
    };
    vec3(x, p.y, p.x * t.signum())
}

/// Height of the roof line above the body's shoulder.
fn roof(x: f32) -> f32 {
    let p = [
        vec2(DECK, crown(DECK) - 0.02),
        vec2(-1.3, 1.09),
        vec2(-0.75, 1.235),
        vec2(-0.25, 1.285),
        vec2(0.10, 1.265),
        vec2(0.45, 1.14),
        vec2(COWL, crown(COWL) - 0.02),
    ];
    through(&p, x)
}

/// A point of the cabin: `s` from the cowl (0) to the deck (1), `t` from -1 to 1 across.
pub fn cabin(s: f32, t: f32) -> Vec3 {
    let x = COWL + (DECK - COWL) * s;
    let top = roof(x);
    let base = body(x, 0.47).y.min(shoulder(x)) - 0.02;
    let lift = (top - base).max(0.0);
    let w = through(&LINES[3], x);
    // Tumblehome: a high-order oval, narrower at the roof.
    let a = t.clamp(-1.0, 1.0) * std::f32::consts::FRAC_PI_2;
    let (sin, cos) = a.sin_cos();
    let z = w * sin.abs().powf(0.62) * sin.signum() * (1.0 - 0.16 * cos.max(0.0) * lift / 0.45);
    vec3(x, base + lift * cos.max(0.0).powf(0.55), z)
}

/// The panel to which a point of the cabin belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Panel {
    /// Painted steel.
    Paint,
    /// Glass.
    Glass,
    /// Black trim.
    Trim,
}

fn panel(s: f32, t: f32) -> Panel {
    let a = t.abs();
    let inset = |lo: f32, hi: f32, x: f32| (x - lo).min(hi - x);
    let front = inset(0.03, 0.335, s).min((0.60 - a) * 0.5);
    // The side window's outline narrows to the rear.
    let side = inset(0.25, 0.70, s)
        .min((a - 0.66) * 0.6)
        .min((0.93 - a) * 0.6)
        .min((0.335 + 0.30 * (a - 0.66) / 0.27 + 0.5 - s) * 0.6);
    let rear = inset(0.60, 0.90, s).min((0.50 - a) * 0.5);
    let depth = front.max(side).max(rear);
    if depth > 0.008 {
        Panel::Glass
    } else if depth > 0.0 {
        Panel::Trim
    } else {
        Panel::Paint
    }
}

/// The body's panels as a mesh of `nx` x `nt` cells.
pub fn body_mesh(nx: usize, nt: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.surface(nt, nx, |a, b| {
        let x = TAIL + (NOSE - TAIL) * b;
        let p = body(x, 2.0 * a - 1.0);
        (p, vec2(p.z, -p.x))
    });
    m.orient(|p| p - vec3(p.x, 0.35, 0.0));
    m
}

/// The cabin cut into its panels: paint, glass, trim.
pub fn cabin_meshes(ns: usize, nt: usize) -> [MeshBuilder; 3] {
    let mut whole = MeshBuilder::new();
    whole.surface(ns, nt, |s, t| {
        let p = cabin(s, 2.0 * t - 1.0);
        (p, vec2(p.x, p.z))
    });
    whole.orient(|p| p - vec3(p.x, 0.7, 0.0));
    let mut parts = [whole.clone(), whole.clone(), whole.clone()];
    for part in &mut parts {
        part.indices.clear();
    }
    for (cell, quad) in whole.indices.chunks_exact(6).enumerate() {
        let s = ((cell % ns) as f32 + 0.5) / ns as f32;
        let t = 2.0 * ((cell / ns) as f32 + 0.5) / nt as f32 - 1.0;
        let part = match panel(s, t) {
            Panel::Paint => 0,
            Panel::Glass => 1,
            Panel::Trim => 2,
        };
        parts[part].indices.extend_from_slice(quad);
    }
    for part in &mut parts {
        part.drop_unused();
    }
    parts
}

/// The nose's intake (`front`) or the tail's panel, a shallow dish inside the body's outline.
pub fn end_cap(nt: usize, front: bool) -> MeshBuilder {
    let (x, out) = if front { (NOSE, 1.0f32) } else { (TAIL, -1.0) };
    let middle = 0.5 * (lower_edge(x) + crown(x));
    let mut m = MeshBuilder::new();
    m.surface(nt, 5, |a, b| {
        let rim = body(x, 2.0 * a - 1.0);
        let inner = vec3(x + 0.03 * out, middle, 0.7 * rim.z);
        let p = rim.lerp(inner, b);
        (p, vec2(p.z, -p.y))
    });
    m.orient(|_| Vec3::X * out);
    // Below the middle the outline is open. A curtain closes it.
    let mut under = MeshBuilder::new();
    under.surface(12, 3, |a, b| {
        let z = 0.7 * half_width(x) * (2.0 * a - 1.0);
        let p = vec3(x + 0.03 * out, middle, z).lerp(vec3(x, lower_edge(x), z / 0.7 * 0.97), b);
        (p, vec2(p.z, -p.y))
    });
    under.orient(|_| Vec3::X * out);
    m.merge(&under, glam::Affine3A::IDENTITY);
    m
}
