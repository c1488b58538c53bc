//! Materials of the atrium: the rich palette and the plain one.

use crate::masonry::{
    brick, carved_band, carved_stone, dressed_stone, octagon_tiles, plaster, roof_tiles, slabs,
};
use crate::organic::{LeafShape, damask, leaf, metal, planks, soil, upright};
use crate::scene_builder::{MaterialId, SceneBuilder};
use crate::texture_synth::{Maps, Recipe, Surface, rgb};
use scene::AlphaMode;

/// The materials of the architecture.
#[derive(Clone, Copy, Debug)]
pub struct Palette {
    /// Slabs of the open court.
    pub court_floor: MaterialId,
    /// Tiles of the arcades and galleries.
    pub arcade_floor: MaterialId,
    /// Outer wall of the ground floor.
    pub wall_low: MaterialId,
    /// Stone base of the outer wall.
    pub dado: MaterialId,
    /// Outer wall of the upper floor.
    pub wall_high: MaterialId,
    /// Wall above the arches.
    pub spandrel: MaterialId,
    /// Lower columns.
    pub shaft: MaterialId,
    /// Upper columns.
    pub shaft_high: MaterialId,
    /// Capitals.
    pub capital: MaterialId,
    /// Voussoirs.
    pub arch: MaterialId,
    /// Vaults.
    pub vault: MaterialId,
    /// Ribs and pilasters.
    pub rib: MaterialId,
    /// Cornices.
    pub cornice: MaterialId,
    /// Balustrades.
    pub rail: MaterialId,
    /// Roof.
    pub roof: MaterialId,
    /// Beams and upper ceilings.
    pub beam: MaterialId,
    /// Doors and shutters.
    pub door: MaterialId,
    /// Drapes in three colours.
    pub drapes: [MaterialId; 3],
    /// Leaves in pots.
    pub leaf: MaterialId,
    /// Trailing ivy.
    pub ivy: MaterialId,
    /// Pots.
    pub pot: MaterialId,
    /// Earth in pots.
    pub earth: MaterialId,
    /// Reliefs.
    pub medallion: MaterialId,
    /// Lamps.
    pub lamp: MaterialId,
}

fn recipe(name: &'static str, maps: Maps, tile_m: f32, surface: Surface) -> Recipe {
    Recipe::new(name, 1024, maps, tile_m, surface)
}

/// Texture sets of floors, walls and roofs, in the order of the [`Palette`].
fn masonry_textures() -> Vec<Recipe> {
    use Maps::{Full, FullOcclusion};
    let sand = [rgb(0xcdb894), rgb(0xb39b74)];
    let cream = [rgb(0xd9cbb0), rgb(0xc2ae8c)];
    let grey = [rgb(0xaaa499), rgb(0x8d867b)];
    vec![
        recipe(
            "court-slabs",
            FullOcclusion,
            3.0,
            slabs([rgb(0xb7a88e), rgb(0x94866d)], 4, 6, 0.55),
        ),
        recipe(
            "arcade-tiles",
            Full,
            2.4,
            octagon_tiles([rgb(0xc4a583), rgb(0xa7795a)], rgb(0x4b3c36), 6),
        ),
        recipe(
            "brick",
            FullOcclusion,
            2.4,
            brick([rgb(0xa8674a), rgb(0x8a4f3a)]),
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
            carved_stone([rgb(0xd2c0a0), rgb(0xbda680)], 0.15, 0.8, 0.75),
        ),
        recipe(
            "veined-marble",
            Full,
            1.6,
            carved_stone([rgb(0xdcd3c2), rgb(0xc0ab98)], 0.6, 0.15, 0.35),
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
            dressed_stone([rgb(0xbfae8e), rgb(0xa8946f)], 4, 5, 0.4),
        ),
        recipe("carved-cornice", FullOcclusion, 1.75, carved_band(cream)),
        recipe("rail-stone", Full, 1.8, carved_stone(grey, 0.1, 1.0, 0.8)),
        recipe(
            "roof-tiles",
            Full,
            2.6,
            roof_tiles([rgb(0xb5643e), rgb(0x8f4a30)]),
        ),
    ]
}

/// Texture sets of the furnishing, in the order of the [`Palette`].
fn furnishing_textures() -> Vec<Recipe> {
    use Maps::Full;
    vec![
        recipe(
            "old-beams",
            Full,
            2.0,
            planks([rgb(0x6b4a2e), rgb(0x3f2a1a)], 5, 0.75),
        ),
        recipe(
            "door-oak",
            Full,
            1.6,
            upright(planks([rgb(0x7a4e2a), rgb(0x4b2e18)], 8, 0.6)),
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
            leaf(LeafShape::Blade, [rgb(0x2e5a1e), rgb(0x6f9a3a)]),
        ),
        recipe(
            "ivy-leaf",
            Full,
            1.0,
            leaf(LeafShape::Ivy, [rgb(0x2a5223), rgb(0x5f8f3f)]),
        ),
        recipe(
            "terracotta",
            Full,
            1.2,
            carved_stone([rgb(0xb9683f), rgb(0x9c5333)], 0.0, 0.7, 0.8),
        ),
        recipe(
            "potting-earth",
            Full,
            0.8,
            soil([rgb(0x3b2a1d), rgb(0x57402c)], None, 0.7),
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
pub fn rich(scene: &mut SceneBuilder) -> Palette {
    let mut sets = masonry_textures().into_iter().chain(furnishing_textures());
    let mut next = |leafy: bool| {
        let Some(set) = sets.next() else {
            return scene.plain("missing", rgb(0xff_00ff), 0.8, |_| {});
        };
        scene.textured(set, |m| {
            if leafy {
                m.alpha = AlphaMode::Mask(0.5);
                m.double_sided = true;
            }
            m.double_sided |= m.name.starts_with("drape");
        })
    };
    Palette {
        court_floor: next(false),
        arcade_floor: next(false),
        wall_low: next(false),
        dado: next(false),
        wall_high: next(false),
        spandrel: next(false),
        shaft: next(false),
        shaft_high: next(false),
        capital: next(false),
        arch: next(false),
        vault: next(false),
        rib: next(false),
        cornice: next(false),
        rail: next(false),
        roof: next(false),
        beam: next(false),
        door: next(false),
        drapes: std::array::from_fn(|_| next(false)),
        leaf: next(true),
        ivy: next(true),
        pot: next(false),
        earth: next(false),
        medallion: next(false),
        lamp: next(false),
    }
}

/// The plain palette: eight shared base-colour textures. Only the floor has a normal map.
pub fn plain(scene: &mut SceneBuilder) -> Palette {
    let simple = Recipe::new;
    let sand = [rgb(0xcdb894), rgb(0xb39b74)];
    let mut sets = [
        simple(
            "floor",
            1024,
            Maps::ColorNormal,
            3.0,
            slabs([rgb(0xb7a88e), rgb(0x94866d)], 4, 6, 0.55),
        ),
        simple(
            "wall",
            1024,
            Maps::Color,
            2.4,
            dressed_stone(sand, 3, 7, 0.5),
        ),
        simple(
            "brick",
            512,
            Maps::Color,
            1.6,
            brick([rgb(0xa8674a), rgb(0x8a4f3a)]),
        ),
        simple(
            "column",
            512,
            Maps::Color,
            1.6,
            carved_stone([rgb(0xd2c0a0), rgb(0xbda680)], 0.15, 0.8, 0.75),
        ),
        simple(
            "trim",
            512,
            Maps::Color,
            1.3,
            carved_stone([rgb(0xd9cbb0), rgb(0xc2ae8c)], 0.0, 0.4, 0.7),
        ),
        simple(
            "ceiling",
            512,
            Maps::Color,
            2.0,
            plaster(rgb(0xd8cdb8), rgb(0xb9a27c), 0.5),
        ),
        simple(
            "roof",
            512,
            Maps::Color,
            2.0,
            roof_tiles([rgb(0xb5643e), rgb(0x8f4a30)]),
        ),
        simple(
            "wood",
            512,
            Maps::Color,
            2.0,
            planks([rgb(0x6b4a2e), rgb(0x3f2a1a)], 5, 0.75),
        ),
    ]
    .into_iter()
    .map(|set| scene.textured(set, |_| {}))
    .collect::<Vec<_>>();
    let mut next = || sets.remove(0);
    let (floor, wall, brick, column) = (next(), next(), next(), next());
    let (trim, ceiling, roof, wood) = (next(), next(), next(), next());
    Palette {
        court_floor: floor,
        arcade_floor: floor,
        wall_low: brick,
        dado: wall,
        wall_high: ceiling,
        spandrel: wall,
        shaft: column,
        shaft_high: column,
        capital: trim,
        arch: trim,
        vault: ceiling,
        rib: wall,
        cornice: trim,
        rail: trim,
        roof,
        beam: wood,
        door: wood,
        drapes: [ceiling; 3],
        leaf: trim,
        ivy: trim,
        pot: trim,
        earth: trim,
        medallion: trim,
        lamp: trim,
    }
}
