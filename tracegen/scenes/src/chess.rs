//! A full chess set on a reflective board, a few moves into the Italian game: 42 K triangles.

use super::mesh_builder::{Knot, MeshBuilder, curve, lathed, profile, rounded, sharp, smooth};
use super::noise::smoothstep;
use super::row::Row;
use super::scene_builder::SceneBuilder;
use super::scene_text::Code;
use glam::{Affine3A, Quat, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Edge of a square in metres (tournament size).
const SQUARE: f32 = 0.057;
/// Segments around a piece.
const SEGMENTS: usize = 16;

/// The foot shared by all pieces, up to `height`, with radius `r`.
fn foot(r: f32) -> Vec<Knot> {
    vec![
        sharp(0.0, 0.0),
        sharp(0.94 * r, 0.0),
        smooth(r, 0.004),
        sharp(0.97 * r, 0.009),
        sharp(0.88 * r, 0.0105),
        smooth(0.86 * r, 0.014),
        sharp(0.72 * r, 0.018),
    ]
}

fn collar(r: f32, y: f32) -> [Knot; 4] {
    [
        sharp(0.72 * r, y),
        smooth(r, y + 0.0016),
        smooth(r, y + 0.0032),
        sharp(0.7 * r, y + 0.005),
    ]
}

/// The outline of a piece: foot, stem, collar (if it has one) and head.
fn outline(radius: f32, stem: &str, ring: Option<[f32; 2]>, head: &str) -> Vec<Knot> {
    let mut knots = foot(radius);
    knots.extend(profile(stem));
    knots.extend(ring.into_iter().flat_map(|[r, y]| collar(r, y)));
    knots.extend(profile(head));
    curve(&knots, 2)
}

fn pawn() -> MeshBuilder {
    let head = "0.0088,0.0462 0.0108,0.0515 0.0088,0.0575 0,0.0622";
    let collar = Some([0.0105, 0.0395]);
    lathed(
        &outline(0.0165, "0.0085,0.026 0.0062,0.036", collar, head),
        SEGMENTS,
    )
}

fn rook() -> MeshBuilder {
    let head = "0.0118,0.027 0.0102,0.042 0.0104,0.046! 0.0145,0.0485 0.0148,0.052! \
        0.0148,0.0535! 0,0.0535!";
    let mut m = lathed(&outline(0.0195, "", None, head), SEGMENTS);
    // Six merlons: arcs of a ring.
    for i in 0..6 {
        let (from, span) = (TAU * i as f32 / 6.0, TAU / 6.0 * 0.68);
        let wall = |s: f32, r: f32, y: f32| {
            let (sin, cos) = (from + span * s).sin_cos();
            vec3(r * cos, y, -r * sin)
        };
        let (r0, r1, y0, y1) = (0.0098, 0.0148, 0.0535, 0.0608);
        m.surface(5, 1, |s, t| {
            (wall(s, r1, y0 + t * (y1 - y0)), vec2(s, -t) * 0.01)
        });
        m.surface(5, 1, |s, t| {
            (wall(1.0 - s, r0, y0 + t * (y1 - y0)), vec2(s, -t) * 0.01)
        });
        m.surface(5, 1, |s, t| {
            (wall(s, r1 + t * (r0 - r1), y1), vec2(s, -t) * 0.01)
        });
        for (s, turn) in [(0.0, 1.0f32), (1.0, -1.0)] {
            m.surface(1, 1, |a, t| {
                let a = if turn > 0.0 { a } else { 1.0 - a };
                (
                    wall(s, r0 + a * (r1 - r0), y0 + t * (y1 - y0)),
                    vec2(a, -t) * 0.01,
                )
            });
        }
    }
    m
}

fn bishop() -> MeshBuilder {
    let head = "0.0085,0.0575 0.0118,0.0645 0.0088,0.0735 0.0032,0.08 0.0018,0.0818! \
        0.0034,0.0842 0,0.0872";
    let collar = Some([0.0125, 0.0495]);
    let knots = outline(0.0185, "0.0095,0.028 0.0066,0.044", collar, head);
    let mut m = MeshBuilder::new();
    // The mitre's cut: a notch that rises along one side.
    m.lathe_shaped(&knots, SEGMENTS + 5, |angle, y| {
        let turn = (angle + PI).rem_euclid(TAU) - PI;
        let cut = (-((y - 0.0700 - 0.004 * turn) / 0.0016).powi(2)).exp();
        1.0 - 0.34 * cut * smoothstep(1.1, 0.5, turn.abs())
    });
    m
}

fn queen() -> MeshBuilder {
    let head = "0.0085,0.0695 0.0112,0.0775 0.0148,0.0835! 0.0118,0.0832! 0.0072,0.0852 \
        0.003,0.087! 0.0042,0.0892 0,0.0925";
    let collar = Some([0.0142, 0.0615]);
    let knots = outline(0.0212, "0.0108,0.032 0.0074,0.056", collar, head);
    let mut m = MeshBuilder::new();
    m.lathe_shaped(&knots, 27, |angle, y| {
        let crown = smoothstep(0.0785, 0.0825, y) * smoothstep(0.0845, 0.0838, y);
        1.0 + 0.10 * crown * (9.0 * angle).cos()
    });
    m
}

fn king() -> MeshBuilder {
    let head = "0.0088,0.0735 0.0112,0.082 0.0142,0.0885! 0.0105,0.0905 0.0034,0.0928! 0,0.093!";
    let collar = Some([0.0148, 0.0655]);
    let knots = outline(0.0218, "0.0112,0.033 0.0078,0.06", collar, head);
    let mut m = lathed(&knots, SEGMENTS);
    // A cross whose arms widen outwards: half widths, depths and heights.
    for [x, z, low, high] in [
        [0.0014, 0.0014, 0.0925, 0.1055],
        [0.0046, 0.0013, 0.0975, 0.1005],
        [0.0021, 0.0016, 0.1040, 0.1062],
    ] {
        m.block(vec3(-x, low, -z), vec3(x, high, z), 0.0005);
    }
    m
}

/// Catmull-Rom through evenly spaced values.
fn spline<const N: usize>(values: &[[f32; 4]; N], t: f32) -> [f32; 4] {
    let x = t.clamp(0.0, 1.0) * (N - 1) as f32;
    let i = (x as usize).min(N - 2);
    let f = x - i as f32;
    let at = |k: isize| values[(i as isize + k).clamp(0, N as isize - 1) as usize];
    let (a, b, c, d) = (at(-1), at(0), at(1), at(2));
    std::array::from_fn(|k| {
        0.5 * (2.0 * b[k]
            + (c[k] - a[k]) * f
            + (2.0 * a[k] - 5.0 * b[k] + 4.0 * c[k] - d[k]) * f * f
            + (3.0 * b[k] - a[k] - 3.0 * c[k] + d[k]) * f * f * f)
    })
}

/// The knight: an oval swept from the chest over the poll down to the muzzle.
fn knight() -> MeshBuilder {
    let head = "0.0145,0.0195 0.015,0.0215! 0,0.0225!";
    let mut m = lathed(&outline(0.0195, "", None, head), SEGMENTS);
    // Forward, height, half depth in the plane, half width, all in millimetres.
    let spine: [[f32; 4]; 10] = [
        [-0.5, 20.0, 12.8, 11.0],
        [-1.5, 28.0, 12.2, 9.4],
        [-3.4, 37.0, 11.4, 8.0],
        [-4.6, 46.0, 10.6, 7.2],
        [-3.6, 54.0, 9.8, 6.6],
        [1.2, 58.6, 9.0, 6.4],
        [7.0, 56.6, 7.8, 6.0],
        [12.6, 51.0, 6.0, 4.6],
        [17.2, 45.0, 5.4, 4.3],
        [20.4, 41.6, 4.2, 3.6],
    ];
    let shape = |s: f32, t: f32| {
        let [x, y, depth, width] = spline(&spine, t);
        let ahead = spline(&spine, (t + 0.01).min(1.0));
        let behind = spline(&spine, (t - 0.01).max(0.0));
        let along = vec2(ahead[0] - behind[0], ahead[1] - behind[1]).normalize_or_zero();
        let out = vec2(along.y, -along.x);
        let (sin, cos) = (TAU * s).sin_cos();
        // The mane rises along the back in waves. Jaw and cheek bulge at the head.
        let back =
            smoothstep(0.55, 1.0, -cos) * smoothstep(0.04, 0.2, t) * smoothstep(0.72, 0.55, t);
        let mane = back * (1.6 + 0.9 * (t * 62.0).sin());
        let cheek = 1.0 + 0.16 * (-((t - 0.62) / 0.09).powi(2)).exp() * smoothstep(-0.6, 0.3, cos);
        let socket = 1.0
            - 0.14
                * (-((t - 0.73) / 0.04).powi(2)).exp()
                * smoothstep(0.3, 0.9, sin.abs())
                * smoothstep(0.3, -0.2, cos);
        let end = (1.0 - ((t - 0.94) / 0.06).max(0.0).powi(2)).max(0.0).sqrt();
        let radial = (depth * cos * cheek - mane) * end;
        let side = width * sin * cheek * socket * end * (1.0 - 0.25 * back);
        let p = vec3(x + out.x * radial, y + out.y * radial, side);
        (p * 1e-3, vec2(s * 0.05, -t * 0.08))
    };
    let mut head = MeshBuilder::new();
    head.surface(16, 26, shape);
    head.orient(|p| vec3(0.0, 0.0, p.z.signum()));
    m.merge(&head, Affine3A::IDENTITY);
    for side in [-1.0f32, 1.0] {
        let ear = rounded("0.0026,0! 0.0022,0.003 0,0.0078", 2, 8);
        let tilt = Quat::from_rotation_z(0.25) * Quat::from_rotation_x(side * 0.3);
        m.merge(
            &ear,
            Affine3A::from_rotation_translation(tilt, vec3(0.0005, 0.0655, side * 0.0035)),
        );
        let eye = rounded("0,-0.0016 0.0016,0 0,0.0016", 3, 8);
        m.merge(
            &eye,
            Affine3A::from_translation(vec3(0.0078, 0.0578, side * 0.0050)),
        );
    }
    m
}

/// The squares of one colour, whose ranks and files add up to an even (0) or odd (1) number.
fn squares(m: &mut MeshBuilder, color: usize) {
    for rank in 0..8 {
        for file in (0..8).filter(|file| (rank + file) % 2 == color) {
            let (x, z) = ((file as f32 - 4.0) * SQUARE, (rank as f32 - 4.0) * SQUARE);
            let gap = 0.0003;
            m.block(
                vec3(x + gap, -0.006, z + gap),
                vec3(x + SQUARE - gap, 0.0, z + SQUARE - gap),
                0.0006,
            );
        }
    }
}

/// The pieces of a colour with their squares: those of the first rank, then the pawns.
fn pieces(scene: &mut SceneBuilder, row: &mut Row) {
    let material = row.word();
    let (color, forward) = match material {
        "ivory" => (0, FRAC_PI_2),
        _ => (1, -FRAC_PI_2),
    };
    for (name, piece) in [
        ("pawn", pawn()),
        ("rook", rook()),
        ("knight", knight()),
        ("bishop", bishop()),
        ("queen", queen()),
        ("king", king()),
    ] {
        scene.mesh(name, piece, material);
    }
    for number in 0..16 {
        let mesh = scene.numbers(row.word()).get(color).copied();
        let mesh = mesh.unwrap_or_else(|| row.fail("a piece, ivory first"));
        let &[file, rank] = row.word().as_bytes() else {
            row.fail("a square");
        };
        let (x, z) = (f32::from(file) - 100.5, 52.5 - f32::from(rank));
        let turn = match number {
            0..8 => forward + 0.06 * ((number * 7 + color * 3) as f32).sin(),
            _ => 0.0,
        };
        let turn = Quat::from_rotation_y(turn);
        let at = vec3(x * SQUARE, 0.0, z * SQUARE);
        scene.place(mesh, Affine3A::from_rotation_translation(turn, at));
    }
}

/// What the scene's text names.
pub const CODE: Code = Code {
    shapes: &[("squares", |m, row| squares(m, row.number()))],
    steps: &[("pieces", pieces)],
};
