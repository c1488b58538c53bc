//! Texels that hold their own coordinates.

/// Texels along the edge of level 0 of every texture.
pub const EDGE: u32 = 64;
/// Layers of the array.
pub const LAYERS: u32 = 4;
/// Levels of every texture except the volume.
pub const LEVELS: u32 = 7;

/// Colours of the texels of a level of a layer: each holds its column, row, level and layer. Consecutive
/// levels are 30 apart, and consecutive layers 40.
pub fn texels(level: u32, layer: u32) -> Vec<u8> {
    let edge = (EDGE >> level).max(1);
    let texel = |at: u32| [at % edge, at / edge, 30 * level + 1, 255 - 40 * layer].map(|v| v as u8);
    (0..edge * edge).flat_map(texel).collect()
}
