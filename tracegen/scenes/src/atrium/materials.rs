//! Materials of the atrium: the rich palette and the plain one.

use crate::masonry::{
    brick, carved_band, carved_stone, dressed_stone, octagon_tiles, plaster, roof_tiles, slabs,
};
use crate::organic::{LeafShape, damask, leaf, metal, planks, soil, upright};
use crate::scene_builder::SceneBuilder;
use crate::texture_synth::{Maps, Recipe, Surface, rgb, tones};
use scene::AlphaMode;

/// The materials of the architecture.
#[derive(Clone, Copy, Debug)]
pub struct Palette {
    /// Slabs of the open court.
    pub court_floor: &'static str,
    /// Tiles of the arcades and galleries.
    pub arcade_floor: &'static str,
    /// Outer wall of the ground floor.
    pub wall_low: &'static str,
    /// Stone base of the outer wall.
    pub dado: &'static str,
    /// Outer wall of the upper floor.
    pub wall_high: &'static str,
    /// Wall above the arches.
    pub spandrel: &'static str,
    /// Lower columns.
    pub shaft: &'static str,
    /// Upper columns.
    pub shaft_high: &'static str,
    /// Capitals.
    pub capital: &'static str,
    /// Voussoirs.
    pub arch: &'static str,
    /// Vaults.
    pub vault: &'static str,
    /// Ribs and pilasters.
    pub rib: &'static str,
    /// Cornices.
    pub cornice: &'static str,
    /// Balustrades.
    pub rail: &'static str,
    /// Roof.
    pub roof: &'static str,
    /// Beams and upper ceilings.
    pub beam: &'static str,
    /// Doors and shutters.
    pub door: &'static str,
    /// Drapes in three colours.
    pub drapes: [&'static str; 3],
    /// Leaves in pots.
    pub leaf: &'static str,
    /// Trailing ivy.
    pub ivy: &'static str,
    /// Pots.
    pub pot: &'static str,
    /// Earth in pots.
    pub earth: &'static str,
    /// Reliefs.
    pub medallion: &'static str,
    /// Lamps.
    pub lamp: &'static str,
}

fn recipe(name: &'static str, maps: Maps, tile_m: f32, surface: Surface) -> Recipe {
    Recipe::new(name, 1024, maps, tile_m, surface)
}

/// Texture sets of floors, walls and roofs.
fn masonry_textures() -> Vec<Recipe> {
    use Maps::{Full, FullOcclusion};
    let sand = tones(0xcdb894, 0xb39b74);
    let cream = tones(0xd9cbb0, 0xc2ae8c);
    let grey = tones(0xaaa499, 0x8d867b);
    vec![
        recipe(
            "court-slabs",
            FullOcclusion,
            3.0,
            slabs(tones(0xb7a88e, 0x94866d), 4, 6, 0.55),
        ),
        recipe(
            "arcade-tiles",
            Full,
            2.4,
            octagon_tiles(tones(0xc4a583, 0xa7795a), rgb(0x4b3c36), 6),
        ),
        recipe(
            "brick",
            FullOcclusion,
            2.4,
            brick(tones(0xa8674a, 0x8a4f3a)),
        ),
        recipe("dado-stone", Full, 2.4, dressed_stone(grey, 3, 4, 0.8)),
        recipe(
            "ochre-plaster",
            Full,
            3.0,
            plaster(rgb(0xd7b37c), rgb(0xa89a84), 0.9),
        ),
        recipe(
            "ashlar",
            FullOcclusion,
            2.5,
            dressed_stone(sand, 3, 7, 0.55),
        ),
        recipe(
            "limestone",
            Full,
            2.1,
            carved_stone(tones(0xd2c0a0, 0xbda680), 0.15, 0.8, 0.75),
        ),
        recipe(
            "veined-marble",
            Full,
            1.6,
            carved_stone(tones(0xdcd3c2, 0xc0ab98), 0.6, 0.15, 0.35),
        ),
        recipe(
            "capital-stone",
            FullOcclusion,
            1.3,
            carved_stone(cream, 0.0, 0.5, 0.7),
        ),
        recipe("voussoirs", Full, 2.0, dressed_stone(cream, 5, 2, 0.5)),
        recipe(
            "vault-plaster",
            Full,
            3.0,
            plaster(rgb(0xd8cdb8), rgb(0xb9a27c), 0.55),
        ),
        recipe(
            "rib-stone",
            Full,
            2.0,
            dressed_stone(tones(0xbfae8e, 0xa8946f), 4, 5, 0.4),
        ),
        recipe("carved-cornice", FullOcclusion, 1.75, carved_band(cream)),
        recipe("rail-stone", Full, 1.8, carved_stone(grey, 0.1, 1.0, 0.8)),
        recipe(
            "roof-tiles",
            Full,
            2.6,
            roof_tiles(tones(0xb5643e, 0x8f4a30)),
        ),
    ]
}

/// Texture sets of the furnishing.
fn furnishing_textures() -> Vec<Recipe> {
    use Maps::Full;
    vec![
        recipe(
            "old-beams",
            Full,
            2.0,
            planks(tones(0x6b4a2e, 0x3f2a1a), 5, 0.75),
        ),
        recipe(
            "door-oak",
            Full,
            1.6,
            upright(planks(tones(0x7a4e2a, 0x4b2e18), 8, 0.6)),
        ),
        recipe(
            "drape-red",
            Full,
            1.2,
            damask(rgb(0x8e1f22), rgb(0xc79a4e), 3.0),
        ),
        recipe(
            "drape-green",
            Full,
            1.2,
            damask(rgb(0x1f5a38), rgb(0xb9a75c), 4.0),
        ),
        recipe(
            "drape-blue",
            Full,
            1.2,
            damask(rgb(0x243f85), rgb(0xc0b27a), 3.0),
        ),
        recipe(
            "palm-leaf",
            Full,
            1.0,
            leaf(LeafShape::Blade, tones(0x2e5a1e, 0x6f9a3a)),
        ),
        recipe(
            "ivy-leaf",
            Full,
            1.0,
            leaf(LeafShape::Ivy, tones(0x2a5223, 0x5f8f3f)),
        ),
        recipe(
            "terracotta",
            Full,
            1.2,
            carved_stone(tones(0xb9683f, 0x9c5333), 0.0, 0.7, 0.8),
        ),
        recipe(
            "potting-earth",
            Full,
            0.8,
            soil(tones(0x3b2a1d, 0x57402c), None, 0.7),
        ),
        recipe(
            "bronze",
            Full,
            1.2,
            metal(rgb(0xa9793f), rgb(0x4d7a62), 0.55, 0.4),
        ),
        recipe(
            "lamp-brass",
            Full,
            0.7,
            metal(rgb(0xd6ac55), rgb(0x6d5a35), 0.3, 0.28),
        ),
    ]
}

/// The rich palette: a separate material for every surface.
pub const RICH: Palette = Palette {
    court_floor: "court-slabs",
    arcade_floor: "arcade-tiles",
    wall_low: "brick",
    dado: "dado-stone",
    wall_high: "ochre-plaster",
    spandrel: "ashlar",
    shaft: "limestone",
    shaft_high: "veined-marble",
    capital: "capital-stone",
    arch: "voussoirs",
    vault: "vault-plaster",
    rib: "rib-stone",
    cornice: "carved-cornice",
    rail: "rail-stone",
    roof: "roof-tiles",
    beam: "old-beams",
    door: "door-oak",
    drapes: ["drape-red", "drape-green", "drape-blue"],
    leaf: "palm-leaf",
    ivy: "ivy-leaf",
    pot: "terracotta",
    earth: "potting-earth",
    medallion: "bronze",
    lamp: "lamp-brass",
};

/// Adds the materials of [`RICH`].
pub fn add_rich(scene: &mut SceneBuilder) {
    for recipe in masonry_textures().into_iter().chain(furnishing_textures()) {
        scene.textured(recipe, |m| {
            if [RICH.leaf, RICH.ivy].contains(&m.name.as_str()) {
                m.alpha = AlphaMode::Mask(0.5);
                m.double_sided = true;
            }
            m.double_sided |= m.name.starts_with("drape");
        });
    }
}

/// The plain palette: eight shared base-colour textures. Only the floor has a normal map.
pub const PLAIN: Palette = Palette {
    court_floor: "floor",
    arcade_floor: "floor",
    wall_low: "brick",
    dado: "wall",
    wall_high: "ceiling",
    spandrel: "wall",
    shaft: "column",
    shaft_high: "column",
    capital: "trim",
    arch: "trim",
    vault: "ceiling",
    rib: "wall",
    cornice: "trim",
    rail: "trim",
    roof: "roof",
    beam: "wood",
    door: "wood",
    drapes: ["ceiling"; 3],
    leaf: "trim",
    ivy: "trim",
    pot: "trim",
    earth: "trim",
    medallion: "trim",
    lamp: "trim",
};

/// Adds the materials of [`PLAIN`].
pub fn add_plain(scene: &mut SceneBuilder) {
    let sand = tones(0xcdb894, 0xb39b74);
    for recipe in [
        Recipe::new(
            "floor",
            1024,
            Maps::ColorNormal,
            3.0,
            slabs(tones(0xb7a88e, 0x94866d), 4, 6, 0.55),
        ),
        Recipe::new(
            "wall",
            1024,
            Maps::Color,
            2.4,
            dressed_stone(sand, 3, 7, 0.5),
        ),
        Recipe::new(
            "brick",
            512,
            Maps::Color,
            1.6,
            brick(tones(0xa8674a, 0x8a4f3a)),
        ),
        Recipe::new(
            "column",
            512,
            Maps::Color,
            1.6,
            carved_stone(tones(0xd2c0a0, 0xbda680), 0.15, 0.8, 0.75),
        ),
        Recipe::new(
            "trim",
            512,
            Maps::Color,
            1.3,
            carved_stone(tones(0xd9cbb0, 0xc2ae8c), 0.0, 0.4, 0.7),
        ),
        Recipe::new(
            "ceiling",
            512,
            Maps::Color,
            2.0,
            plaster(rgb(0xd8cdb8), rgb(0xb9a27c), 0.5),
        ),
        Recipe::new(
            "roof",
            512,
            Maps::Color,
            2.0,
            roof_tiles(tones(0xb5643e, 0x8f4a30)),
        ),
        Recipe::new(
            "wood",
            512,
            Maps::Color,
            2.0,
            planks(tones(0x6b4a2e, 0x3f2a1a), 5, 0.75),
        ),
    ] {
        scene.textured(recipe, |_| {});
    }
}
