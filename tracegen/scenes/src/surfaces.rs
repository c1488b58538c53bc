//! Surfaces of textures by their names in a scene's text.

use super::masonry::{
    brick, carved_band, carved_stone, checker, dressed_stone, octagon_tiles, plaster, roof_tiles,
    slabs,
};
use super::organic::{
    LeafShape, bark, damask, leaf, metal, paper_label, planks, polished_wood, rock, skin, soil,
    turf, upright,
};
use super::plant::materials::{
    cardboard, cladding, concrete, control_panel, galvanised, grating_bars, hazard_stripes,
    lagging, machine_paint, painted, perforated, warning_sign,
};
use super::row::Row;
use super::texture_synth::Surface;

/// The surface that the next words of a row name, with its colours and numbers.
///
/// # Panics
/// If no surface has that name.
pub fn surface(row: &mut Row) -> Surface {
    match row.word() {
        "bark" => bark(row.tones(), row.number()),
        "brick" => brick(row.tones()),
        "cardboard" => cardboard(),
        "carved-band" => carved_band(row.tones()),
        "carved-stone" => carved_stone(row.tones(), row.number(), row.number(), row.number()),
        "checker" => checker(row.tones(), row.number()),
        "cladding" => cladding(row.color()),
        "concrete" => concrete(),
        "control-panel" => control_panel(),
        "damask" => damask(row.color(), row.color(), row.number()),
        "dressed-stone" => dressed_stone(row.tones(), row.number(), row.number(), row.number()),
        "galvanised" => galvanised(),
        "grating-bars" => grating_bars(),
        "hazard-stripes" => hazard_stripes(),
        "lagging" => lagging(),
        "leaf-blade" => leaf(LeafShape::Blade, row.tones()),
        "leaf-frond" => leaf(LeafShape::Frond, row.tones()),
        "leaf-grass" => leaf(LeafShape::Grass, row.tones()),
        "leaf-ivy" => leaf(LeafShape::Ivy, row.tones()),
        "leaf-palm" => leaf(LeafShape::Palm, row.tones()),
        "leaf-spray" => leaf(LeafShape::Spray, row.tones()),
        "littered-soil" => {
            let (colors, litter) = (row.tones(), row.color());
            soil(colors, Some(litter), row.number())
        }
        "machine-paint" => machine_paint(row.color()),
        "metal" => metal(row.color(), row.color(), row.number(), row.number()),
        "octagon-tiles" => octagon_tiles(row.tones(), row.color(), row.number()),
        "painted" => painted(row.color(), row.number()),
        "paper-label" => paper_label(row.color(), row.color()),
        "perforated" => perforated(row.color()),
        "planks" => planks(row.tones(), row.number(), row.number()),
        "plaster" => plaster(row.color(), row.color(), row.number()),
        "polished-wood" => polished_wood(row.tones(), row.number()),
        "rock" => rock(row.tones(), row.number()),
        "roof-tiles" => roof_tiles(row.tones()),
        "skin" => skin(row.tones()),
        "slabs" => slabs(row.tones(), row.number(), row.number(), row.number()),
        "soil" => soil(row.tones(), None, row.number()),
        "turf" => turf(row.tones(), row.color()),
        "upright" => upright(surface(row)),
        "warning-sign" => warning_sign(),
        unknown => row.fail(&format!("a surface instead of '{unknown}'")),
    }
}
