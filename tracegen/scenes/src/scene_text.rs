//! Scenes as text: a row for each material, mesh, solid, placement, camera and light.
//!
//! A scene's file in `data/` is read from top to bottom. `#` starts a comment. Lengths are metres,
//! vectors `x,y,z`, colours `RRGGBB` or linear `r,g,b`, outlines as in
//! [`profile`](super::mesh_builder::profile).
//!
//! ```text
//! texture NAME SIZE MAPS TILE SURFACE... [KEY=VALUE]...   a material with images
//! plain NAME COLOUR ROUGHNESS [KEY=VALUE]...              a material without images
//! role NAME MATERIAL                                      another name of a material
//! mesh NAME MATERIAL [PLACE]                              a mesh of the indented rows below it
//!   block LOW HIGH [bevel M] [mirror AXIS] [at OFFSET] [repeat FIRST..END STEP] [PLACE]
//!   lathe SEGMENTS OUTLINE [PLACE]
//!   rounded STEPS SEGMENTS OUTLINE [PLACE]
//!   tube SIDES x,y,z,radius... [PLACE]
//!   ring CELLS SIDES RADIUS CENTRE SINE COSINE            a closed tube about a centre
//!   bar WIDTH FROM TO
//!   prism LENGTH OUTLINE [PLACE]                          along z
//!   beam LENGTH WIDTH HEIGHT THICKNESS [PLACE]            an I-beam along z
//!   quad CORNER RIGHT UP
//!   panel CORNER RIGHT UP COLUMNS ROWS
//!   face DIRECTION                                        turns the mesh so far to a side
//!   patch-turned 16 POINTS                                a Bezier patch and its copies; also
//!                                                         patch-turned-back, patch-mirrored
//!   SHAPE... [PLACE]                                      a shape of `Code`
//! place NAME PLACE                                        the last mesh of a name, once more
//! STEP...                                                 a step of `Code`
//! camera NAME NEAR FAR EYE TARGET
//! sun DIRECTION COLOUR
//! lamp POSITION COLOUR
//! sky COLOUR
//! shadow-maps COUNT
//! ```
//!
//! A PLACE is `here` or any of `at VECTOR`, `scale VECTOR`, `turn AXIS ANGLE` (quaternions,
//! multiplied in their order) and `spin AXIS ANGLE` (matrices instead). Angles are radians, or
//! multiples of pi with the suffix `pi`.

use super::mesh_builder::{MeshBuilder, curve};
use super::row::Row;
use super::scene_builder::SceneBuilder;
use super::surfaces::surface;
use super::teapot::{self, Copies};
use super::texture_synth::Recipe;
use glam::{Vec2, Vec3};

/// A shape that is computed.
pub type Shape = fn(&mut MeshBuilder, &mut Row);
/// A step that computes meshes and placements.
pub type Step = fn(&mut SceneBuilder, &mut Row);

/// The functions that a scene's text names. Each reads what it needs from the rest of its row.
#[derive(Clone, Copy, Debug)]
pub struct Code {
    /// Shapes by name.
    pub shapes: &'static [(&'static str, Shape)],
    /// Steps by name.
    pub steps: &'static [(&'static str, Step)],
}

impl Code {
    /// For a scene of rows only.
    pub const NONE: Self = Self {
        shapes: &[],
        steps: &[],
    };
}

/// Adds everything in a text to the scene.
///
/// # Panics
/// If a row has another form, with its place and what was expected.
pub fn read(scene: &mut SceneBuilder, text: &'static str, code: Code) {
    let rows = (1..).zip(text.lines()).filter_map(|(number, line)| {
        let row = Row::new(line, || format!("{}, line {number}", scene.name()));
        Some((line.starts_with(' '), row?))
    });
    let mut rows: Vec<(bool, Row)> = rows.collect();
    let mut rows = rows.iter_mut().peekable();
    while let Some((_, row)) = rows.next() {
        match row.word() {
            "texture" => {
                let (name, size, maps) = (row.word(), row.number(), row.maps());
                let (tile_m, surface) = (row.number(), surface(row));
                let recipe = Recipe::new(name, size, maps, tile_m, surface);
                scene.textured(recipe, |m| row.factors(m));
            }
            "plain" => {
                let (name, color, roughness) = (row.word(), row.color(), row.number());
                scene.plain(name, color, roughness, |m| row.factors(m));
            }
            "role" => scene.role(row.word(), row.word()),
            "mesh" => {
                let (name, material, place) = (row.word(), row.word(), row.placement());
                let mut mesh = MeshBuilder::new();
                while let Some((_, row)) = rows.next_if(|(indented, _)| *indented) {
                    solid(&mut mesh, row, code);
                    row.end();
                }
                let mesh = scene.mesh(name, mesh, material);
                if let Some(place) = place {
                    scene.place(mesh, place);
                }
            }
            "place" => {
                let mesh = scene.numbers(row.word()).last().copied();
                let mesh = mesh.unwrap_or_else(|| row.fail("a mesh above this row"));
                let place = row.placement();
                scene.place(mesh, place.unwrap_or_else(|| row.fail("a place")));
            }
            "camera" => {
                let (name, near, far) = (row.word(), row.number(), row.number());
                scene.camera(name, near, far, row.vector(), row.vector());
            }
            "sun" => scene.sun(row.vector(), row.vector()),
            "lamp" => scene.lamp(row.vector(), row.vector()),
            "sky" => scene.sky(row.vector()),
            "shadow-maps" => scene.shadow_cascades(row.number()),
            word => row.function(word, code.steps)(scene, row),
        }
        row.end();
    }
}

/// Adds the solid of a row.
fn solid(mesh: &mut MeshBuilder, row: &mut Row, code: Code) {
    let mut m = MeshBuilder::new();
    match row.word() {
        "block" => blocks(&mut m, row),
        "face" => {
            let direction = row.vector();
            return mesh.orient(|_| direction);
        }
        "lathe" => {
            let segments = row.number();
            m.lathe(&row.outline(), segments);
        }
        "rounded" => {
            let (steps, segments) = (row.number(), row.number());
            m.lathe(&curve(&row.outline(), steps), segments);
        }
        "tube" => {
            let sides = row.number();
            m.tube(&row.path(), sides);
        }
        "ring" => {
            let (cells, sides, radius) = (row.number(), row.number(), row.number());
            let [center, sine, cosine] = [row.vector(), row.vector(), row.vector()];
            m.ring([cells, sides], radius, |sin, cos| {
                center + (sine * sin + cosine * cos)
            });
        }
        "bar" => {
            let width = row.number();
            m.bar(row.vector(), row.vector(), width);
        }
        "prism" => {
            let length = row.number();
            m.prism(&row.outline(), length);
        }
        "beam" => m.beam(row.number(), [row.number(), row.number(), row.number()]),
        "quad" => m.quad(row.vector(), row.vector(), row.vector(), Vec2::ZERO),
        "panel" => {
            let [corner, right, up] = [row.vector(), row.vector(), row.vector()];
            m.panel(corner, right, up, row.number(), row.number());
        }
        "patch-turned" => teapot::patches(&mut m, Copies::Turned, row.array()),
        "patch-turned-back" => teapot::patches(&mut m, Copies::TurnedBack, row.array()),
        "patch-mirrored" => teapot::patches(&mut m, Copies::Mirrored, row.array()),
        word => row.function(word, code.shapes)(&mut m, row),
    }
    match row.placement() {
        Some(place) => mesh.merge(&m, place),
        None => mesh.append(m),
    }
}

/// The boxes of a row: the one given and its copies.
fn blocks(m: &mut MeshBuilder, row: &mut Row) {
    let (low, high) = (row.vector(), row.vector());
    let (mut bevel, mut mirror, mut at) = (0.0, None, Vec3::ZERO);
    let (mut copies, mut step) = (0..1, Vec3::ZERO);
    let words = ["bevel", "mirror", "at", "repeat"];
    while let Some(word) = row.one_of(&words) {
        match word {
            "bevel" => bevel = row.number(),
            "mirror" => mirror = Some(Vec3::ONE - 2.0 * row.axis()),
            "at" => at = row.vector(),
            _ => (copies, step) = (row.range(), row.vector()),
        }
    }
    for offset in copies.map(|k| at + step * k as f32) {
        let (low, high) = (low + offset, high + offset);
        if let Some(sign) = mirror {
            m.block(low * sign, high * sign, bevel);
        }
        m.block(low, high, bevel);
    }
}
