//! Shapes and steps of the chemistry bench: what its text cannot say.

mod still;

use super::glassware::{
    beaker, bottle, erlenmeyer, filling, glass_tube, round_flask, shell, stopper, test_tube,
};
use super::mesh_builder::{Knot, MeshBuilder, curve, lathed, profile, sharp};
use super::noise::smoothstep;
use super::row::Row;
use super::scene_builder::SceneBuilder;
use super::scene_text::Code;
use glam::{Affine3A, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What the scene's text names.
pub const CODE: Code = Code {
    shapes: &[
        ("cylinder-foot", |m, _| cylinder_foot(m)),
        ("funnel", |m, _| funnel(m)),
        ("glass-tube", |m, row| {
            let (bore, sides) = (row.number(), row.number());
            m.append(glass_tube(&row.path(), bore, sides));
        }),
        ("graduation", |m, _| graduation(m)),
        ("hose", |m, _| still::hose(m)),
        ("label", |m, _| label(m)),
        ("plates-with-holes", |m, _| plates_with_holes(m)),
        ("stopper", |m, row| {
            let outline = stopper(row.number());
            m.lathe(&outline, row.number());
        }),
        ("tripod", |m, _| still::tripod(m)),
    ],
    steps: &[
        ("still", |scene, _| still::still(scene)),
        ("stoppers-and-labels", stoppers_and_labels),
        ("test-tubes", |scene, _| test_tubes(scene)),
        ("vessel", |scene, row| {
            let glass = row.word();
            let outer = form(row);
            let ware = Ware {
                outer: &outer,
                wall: row.number(),
                segments: row.number(),
                lip: row.number(),
            };
            let fill = (row.word(), row.number());
            let places: Vec<Affine3A> = row.points().map(place).collect();
            vessel(scene, glass, &ware, fill, &places);
        }),
    ],
};

fn place(at: [f32; 3]) -> Affine3A {
    Affine3A::from_translation(at.into())
}

/// The outline that the next words of a row say: a form, its dimensions and steps.
fn form(row: &mut Row) -> Vec<Knot> {
    match row.word() {
        "beaker" => beaker(row.number(), row.number(), row.number()),
        "bottle" => bottle(row.number(), row.number(), row.number()),
        "erlenmeyer" => erlenmeyer(row.number(), row.number()),
        "round-flask" => round_flask(row.number(), row.number(), row.number()),
        unknown => row.fail(&format!("a form instead of '{unknown}'")),
    }
}

/// Parameters of a vessel.
pub(super) struct Ware<'a> {
    /// Outline of the outer skin from the axis to the rim.
    pub(super) outer: &'a [Knot],
    /// Thickness of the glass, metres.
    pub(super) wall: f32,
    /// Segments around.
    pub(super) segments: usize,
    /// Distance by which the rim is pulled out into a spout, as a fraction of its radius.
    pub(super) lip: f32,
}

/// A turned vessel and its contents (liquid and its level), placed together.
pub(super) fn vessel(
    scene: &mut SceneBuilder,
    glass: &str,
    ware: &Ware<'_>,
    (liquid, level): (&str, f32),
    places: &[Affine3A],
) {
    let &Ware {
        outer,
        wall,
        segments,
        lip,
    } = ware;
    let mut m = MeshBuilder::new();
    let top = outer.last().map_or(0.0, |k| k.at.y);
    // A spout: the rim is pulled out on one side.
    m.lathe_shaped(&shell(outer, wall), segments, |angle, y| {
        let near = smoothstep(0.5, 0.0, ((angle + PI).rem_euclid(TAU) - PI).abs());
        1.0 + lip * near * smoothstep(top * 0.90, top, y)
    });
    let inside = lathed(&filling(outer, wall, 0.0004, level), segments);
    for (name, mesh, material) in [("glass", m, glass), ("liquid", inside, liquid)] {
        let mesh = scene.mesh(name, mesh, material);
        for place in places {
            scene.place(mesh, *place);
        }
    }
}

fn cylinder_foot(m: &mut MeshBuilder) {
    m.lathe_shaped(
        &profile("0,0! 0.033,0! 0.033,0.004! 0.017,0.0058 0,0.0058"),
        36,
        |a, _| 1.0 + 0.05 * (6.0 * a).cos(),
    );
}

/// The marks of the cylinder.
fn graduation(marks: &mut MeshBuilder) {
    for i in 0..18 {
        let (y, half) = (
            0.03 + 0.0085 * i as f32,
            if i % 5 == 0 { 0.5 } else { 0.28 },
        );
        marks.surface(5, 1, |s, t| {
            let a = FRAC_PI_2 + half * (2.0 * s - 1.0);
            let (sin, cos) = (-a).sin_cos();
            (
                vec3(-0.0157 * cos, y + 0.0007 * t, -0.0157 * sin),
                vec2(s, t) * 0.01,
            )
        });
    }
    marks.orient(|p| vec3(p.x, 0.0, p.z));
}

fn funnel(m: &mut MeshBuilder) {
    let cone = curve(
        &profile("0.0026,0! 0.0034,0.03 0.005,0.048 0.03,0.082 0.031,0.085!"),
        4,
    );
    let mut walls = cone.clone();
    walls.extend(cone.iter().rev().map(|k| Knot {
        at: k.at - vec2(0.0013, -0.0006 * f32::from(k.at.y < 0.08)),
        sharp: k.sharp,
    }));
    walls.push(cone[0]);
    m.lathe(&walls, 32);
}

/// Axis of the tube `i` of the rack.
fn tube_x(i: usize) -> f32 {
    0.235 + 0.0165 + 0.0335 * i as f32
}

/// Height of the rack's middle along z.
const RACK_Z: f32 = 0.045;

fn plates_with_holes(m: &mut MeshBuilder) {
    for i in 0..6 {
        for y in [0.062, 0.104] {
            let center = vec3(tube_x(i), y, RACK_Z);
            plate_with_hole(m, center, vec2(0.01675, 0.028), 0.0098, 0.009);
        }
    }
}

fn test_tubes(scene: &mut SceneBuilder) {
    let liquids = [
        "potassium-chromate",
        "nickel-chloride",
        "copper-sulphate",
        "permanganate",
        "cobalt-chloride",
        "potassium-chromate",
    ];
    for (i, liquid) in liquids.into_iter().enumerate() {
        let ware = Ware {
            outer: &test_tube(0.0085, 0.135, 2),
            wall: 0.0010,
            segments: 17,
            lip: 0.0,
        };
        let level = 0.035 + 0.012 * ((i * 5 % 6) as f32);
        let place = place([tube_x(i), 0.0135, RACK_Z]);
        vessel(scene, "borosilicate", &ware, (liquid, level), &[place]);
    }
}

/// A plate of half extents `half` around a round hole.
fn plate_with_hole(m: &mut MeshBuilder, center: Vec3, half: Vec2, hole: f32, thick: f32) {
    let square = |a: f32| {
        let (sin, cos) = a.sin_cos();
        let k = (half.x / cos.abs().max(1e-6)).min(half.y / sin.abs().max(1e-6));
        vec2(cos, sin) * k
    };
    for (y, up) in [(thick, true), (0.0, false)] {
        let mut face = MeshBuilder::new();
        face.surface(32, 1, |s, t| {
            let a = TAU * (s - s.floor());
            let (sin, cos) = a.sin_cos();
            let p = (vec2(cos, sin) * hole).lerp(square(a), t);
            (center + vec3(p.x, y, p.y), p)
        });
        // The face is flat, so its normals do not depend on derivatives at the corners of its outline.
        let normal = if up { Vec3::Y } else { Vec3::NEG_Y };
        face.orient(|_| normal);
        face.normals.fill(normal);
        m.merge(&face, Affine3A::IDENTITY);
    }
    let mut bore = lathed(&[sharp(hole, 0.0), sharp(hole, thick)], 32);
    bore.flip();
    m.merge(&bore, Affine3A::from_translation(center));
    for side in [-1.0f32, 1.0] {
        let corner = center + vec3(-side * half.x, 0.0, side * half.y);
        m.quad(
            corner,
            Vec3::X * (2.0 * half.x * side),
            Vec3::Y * thick,
            vec2(0.0, 0.0),
        );
    }
}

fn label(m: &mut MeshBuilder) {
    m.surface(12, 1, |s, t| {
        let a = -FRAC_PI_2 + 1.3 * (s - 0.5);
        let (sin, cos) = a.sin_cos();
        (
            vec3(0.0363 * cos, 0.022 + 0.042 * t, -0.0363 * sin),
            vec2(s, 1.0 - t),
        )
    });
}

/// A stopper and a label for the bottle at each place.
fn stoppers_and_labels(scene: &mut SceneBuilder, row: &mut Row) {
    let [stopper, label] = ["glass-stopper", "label"].map(|name| scene.numbers(name)[0]);
    for at in row.points() {
        let bottle = place(at);
        scene.place(stopper, bottle * place([0.0, 0.121, 0.0]));
        scene.place(label, bottle);
    }
}
