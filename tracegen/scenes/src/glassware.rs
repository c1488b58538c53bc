//! Laboratory glass, each piece a closed shell: outer skin, rim, inner skin.

use super::mesh_builder::{Knot, MeshBuilder, SweepFrame, curve, scaled_profile, sharp, smooth};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// The profile of a vessel: `outer` from the axis at the bottom to the rim, then back down inside
/// at a distance of `wall` metres.
pub fn shell(outer: &[Knot], wall: f32) -> Vec<Knot> {
    let mut knots = outer.to_vec();
    let normal = |i: usize| {
        let (a, b) = (
            outer[i.saturating_sub(1)].at,
            outer[(i + 1).min(outer.len() - 1)].at,
        );
        let d = (b - a).normalize_or(Vec2::Y);
        vec2(d.y, -d.x)
    };
    for i in (0..outer.len()).rev() {
        let mut p = outer[i].at - normal(i) * wall;
        if outer[i].at.x <= 0.0 {
            p = vec2(0.0, outer[i].at.y + wall);
        }
        if i + 1 == outer.len() {
            p.y = outer[i].at.y;
            if let Some(rim) = knots.last_mut() {
                rim.sharp = true;
            }
        }
        knots.push(Knot {
            at: vec2(p.x.max(0.0), p.y),
            sharp: i + 1 == outer.len() || outer[i].sharp,
        });
    }
    knots
}

/// The contents of a vessel up to `level`: its inner skin reduced by `gap`, so that glass and
/// liquid do not share a surface, closed on top with a meniscus.
pub fn filling(outer: &[Knot], wall: f32, gap: f32, level: f32) -> Vec<Knot> {
    let full = shell(outer, wall + gap);
    let mut inside: Vec<Knot> = full[outer.len()..].iter().rev().copied().collect();
    // Keep the part below the level and cut the last segment there.
    let cut = inside
        .iter()
        .position(|k| k.at.y > level)
        .unwrap_or(inside.len());
    let rim = match (
        cut.checked_sub(1).and_then(|i| inside.get(i)),
        inside.get(cut),
    ) {
        (Some(a), Some(b)) => {
            let t = (level - a.at.y) / (b.at.y - a.at.y).max(1e-9);
            a.at.lerp(b.at, t)
        }
        (Some(a), None) => a.at,
        _ => vec2(0.0, level),
    };
    inside.truncate(cut);
    inside.push(sharp(rim.x, level));
    inside.push(smooth(rim.x * 0.9, level - 0.0006));
    inside.push(smooth(rim.x * 0.5, level - 0.0012));
    inside.push(smooth(0.0, level - 0.0013));
    inside
}

/// A conical flask of height `h`.
pub fn erlenmeyer(h: f32, steps: usize) -> Vec<Knot> {
    curve(
        &scaled_profile(
            "0,0! 0.26,0.002 0.345,0.03 0.355,0.09 0.25,0.42 \
             0.135,0.7 0.115,0.8 0.115,0.94 0.125,0.97 0.145,1!",
            Vec2::splat(h),
        ),
        steps,
    )
}

/// A round-bottomed flask: sphere and neck.
pub fn round_flask(radius: f32, neck: f32, steps: usize) -> Vec<Knot> {
    let mut knots = Vec::new();
    for i in 0..=10 {
        let a = -std::f32::consts::FRAC_PI_2 + 2.72 * i as f32 / 10.0;
        knots.push(smooth(radius * a.cos(), radius * (1.0 + a.sin())));
    }
    let (x, y) = (0.27 * radius, 2.0 * radius);
    knots.extend([
        smooth(x, y + 0.08 * radius),
        smooth(x, y + 0.5 * neck),
        smooth(x, y + 0.92 * neck),
        sharp(1.25 * x, y + neck),
    ]);
    knots[0].at.x = 0.0;
    curve(&knots, steps)
}

/// A beaker.
pub fn beaker(radius: f32, height: f32, steps: usize) -> Vec<Knot> {
    curve(
        &scaled_profile(
            "0,0! 0.82,0 0.97,0.03 1,0.1 \
             1,0.5 1,0.93 1.08,1!",
            vec2(radius, height),
        ),
        steps,
    )
}

/// A test tube.
pub fn test_tube(radius: f32, height: f32, steps: usize) -> Vec<Knot> {
    curve(
        &[
            smooth(0.0, 0.0),
            smooth(0.7 * radius, 0.3 * radius),
            smooth(radius, radius),
            smooth(radius, 0.35 * height),
            smooth(radius, 0.7 * height),
            smooth(radius, 0.96 * height),
            sharp(1.2 * radius, height),
        ],
        steps,
    )
}

/// A reagent bottle with a shoulder.
pub fn bottle(radius: f32, height: f32, steps: usize) -> Vec<Knot> {
    curve(
        &scaled_profile(
            "0,0! 0.9,0 1,0.04 1,0.3 1,0.58 \
             0.88,0.69 0.42,0.8 0.38,0.92 0.5,0.97 0.5,1!",
            vec2(radius, height),
        ),
        steps,
    )
}

/// A ground-glass stopper that sits on y = 0.
pub fn stopper(radius: f32) -> Vec<Knot> {
    curve(
        &scaled_profile(
            "0,-1.1! 0.72,-1.1! 0.8,0! 1.25,0.25 \
             1.35,0.8 0.9,1.5 0,1.7",
            Vec2::splat(radius),
        ),
        3,
    )
}

/// A glass tube along a path: outer and inner skin, rings at both ends.
pub fn glass_tube(points: &[(Vec3, f32)], bore: f32, sides: usize) -> MeshBuilder {
    let mut m = MeshBuilder::new();
    m.tube(points, sides);
    let inner: Vec<(Vec3, f32)> = points.iter().map(|(p, r)| (*p, r * bore)).collect();
    let mut inside = MeshBuilder::new();
    inside.tube(&inner, sides);
    inside.flip();
    m.merge(&inside, glam::Affine3A::IDENTITY);
    let frames = SweepFrame::along(points);
    for (end, frame) in [(0, frames.first()), (1, frames.last())] {
        let Some(f) = frame else { continue };
        let travel = f.right.cross(f.up);
        let outward = if end == 0 { -travel } else { travel };
        let mut ring = MeshBuilder::new();
        ring.surface(sides, 1, |s, t| {
            let (sin, cos) = (TAU * (s - s.floor())).sin_cos();
            let r = f.scale * (bore + (1.0 - bore) * t);
            (
                f.origin + (f.right * cos + f.up * sin) * r,
                vec2(s, t) * 0.01,
            )
        });
        ring.orient(|_| outward);
        m.merge(&ring, glam::Affine3A::IDENTITY);
    }
    m
}

/// A helix about the y axis from y = 0 upwards.
pub fn helix(
    radius: f32,
    pitch: f32,
    turns: f32,
    tube: f32,
    steps_a_turn: usize,
) -> Vec<(Vec3, f32)> {
    let steps = (turns * steps_a_turn as f32) as usize;
    (0..=steps)
        .map(|i| {
            let a = TAU * i as f32 / steps_a_turn as f32;
            let (sin, cos) = a.sin_cos();
            (vec3(radius * cos, pitch * a / TAU, -radius * sin), tube)
        })
        .collect()
}
