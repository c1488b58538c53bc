//! Compares the driver's filtered texels with those of the software sampler, at every visible pixel.

use super::compare::{Lane, captured_uv, key, lanes};
use super::geometry::Geometry;
use super::reference::origin;
use super::sampler::{Decoder, SoftwareSampler, srgb_of_linear};
use formats::footprint::{LodFormula, quad_lod};
use formats::textrace::{Tables, Tile};
use formats::texture::ColorSpace;
use formats::view::TILE_SIZE_PX;
use glam::{DVec2, DVec4};
use raster::backend::Texels;
use raster::draws::DrawList;
use scene::{Material, Scene, TextureSlot};

/// A step of 8 bits.
const STEP: f64 = 1.0 / 255.0;

/// Distance in texels by which single precision may move coordinates before filtering.
const MOVED_TEXELS: f64 = 1.0 / 64.0;

/// Directions, in steps of that distance.
const AROUND: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];

/// Differences of the software sampler's colours from the driver's, in the channel that differs most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColourErrors {
    /// Visible fragments that sample a texture.
    pub fragments: u64,
    /// Fragments without a record of their primitive at their pixel.
    pub unrecorded: u64,
    /// Fragments that differ by at most 1/255 in linear light.
    pub within_as_light: u64,
    /// Fragments that differ by at most 1/255 in the texture's encoding.
    pub within_as_encoded: u64,
    /// Fragments that differ by more only because the driver decodes blocks in 8 bits.
    pub by_decoding: u64,
    /// Fragments that differ by more, unless the driver's polynomial for sRGB is used as well.
    pub by_srgb: u64,
    /// Fragments that differ by more, unless the coordinates are moved by 1/64 texel: single precision is
    /// visible where neighbouring texels differ much.
    pub by_coordinates: u64,
    /// Sum of the differences in the texture's encoding.
    pub sum: f64,
    /// Largest of them.
    pub max: f64,
    /// Largest difference if blocks and sRGB are decoded like in the driver.
    pub max_as_driver: f64,
}

impl ColourErrors {
    fn add(&mut self, light: f64, encoded: f64) {
        self.within_as_light += u64::from(light <= STEP);
        self.within_as_encoded += u64::from(encoded <= STEP);
        self.sum += encoded;
        self.max = self.max.max(encoded);
    }

    /// Adds the differences of another tile or pass.
    pub fn merge(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            fragments,
            unrecorded,
            within_as_light,
            within_as_encoded,
            by_decoding,
            by_srgb,
            by_coordinates,
            sum
        );
        self.max = self.max.max(other.max);
        self.max_as_driver = self.max_as_driver.max(other.max_as_driver);
    }
}

/// Filters the samples of a tile's records, and compares them with the driver's.
pub struct ColourCheck<'a> {
    /// The scene, for its materials.
    pub scene: &'a Scene,
    /// Its draws.
    pub draws: &'a DrawList,
    /// The trace's tables.
    pub tables: &'a Tables,
    /// The texture unit.
    pub sampler: &'a SoftwareSampler<'a>,
    /// The driver's formula of the level of detail.
    pub formula: LodFormula,
}

impl ColourCheck<'_> {
    /// Compares the visible pixels of a tile; `texels` holds the driver's texels of the textures in `slot`.
    pub fn tile(
        &self,
        geometry: &Geometry<'_>,
        number: usize,
        tile: &Tile,
        texels: &Texels,
        slot: TextureSlot,
    ) -> ColourErrors {
        let mut errors = ColourErrors::default();
        let lanes = lanes(tile);
        let [left, top] = origin(geometry, number);
        let end = |start: u32, axis: usize| (start + TILE_SIZE_PX).min(geometry.size_px[axis]);
        for y in top..end(top, 1) {
            for x in left..end(left, 0) {
                let pixel = y as usize * geometry.size_px[0] as usize + x as usize;
                let primitive = texels.primitives[pixel];
                if primitive == Texels::NO_PRIMITIVE {
                    continue;
                }
                errors.fragments += 1;
                let found = DVec4::from(texels.colors[pixel].map(f64::from));
                let difference = |decoder, moved: DVec2| {
                    let sampler = self.sampler.with(decoder);
                    let (expected, srgb) =
                        self.filtered(&sampler, &lanes, tile, (primitive, [x, y]), slot, moved)?;
                    let light = (found - expected).abs().max_element();
                    let encoded = (encode(found) - encode(expected)).abs().max_element();
                    Some((light, if srgb { encoded } else { light }))
                };
                let Some((light, encoded)) = difference(Decoder::Exact, DVec2::ZERO) else {
                    errors.unrecorded += 1;
                    continue;
                };
                errors.add(light, encoded);
                let of_driver = difference(Decoder::EightBitsAndPolynomial, DVec2::ZERO);
                let (_, of_driver) = of_driver.unwrap_or_default();
                errors.max_as_driver = errors.max_as_driver.max(of_driver);
                if encoded > STEP {
                    let explains = |decoder, moved| {
                        let found = difference(decoder, moved);
                        found.is_some_and(|(_, d)| d <= STEP)
                    };
                    if explains(Decoder::EightBits, DVec2::ZERO) {
                        errors.by_decoding += 1;
                    } else if of_driver <= STEP {
                        errors.by_srgb += 1;
                    } else if AROUND.into_iter().any(|to| {
                        let moved = DVec2::from(to) * MOVED_TEXELS;
                        explains(Decoder::EightBitsAndPolynomial, moved)
                    }) {
                        errors.by_coordinates += 1;
                    }
                }
            }
        }
        errors
    }

    /// The software sampler's colour for a fragment's record, and whether the texture is sRGB.
    fn filtered(
        &self,
        sampler: &SoftwareSampler<'_>,
        lanes: &[Lane],
        tile: &Tile,
        (primitive, pixel): (u32, [u32; 2]),
        slot: TextureSlot,
        moved_texels: DVec2,
    ) -> Option<(DVec4, bool)> {
        let calls = &self.draws.calls;
        let call = calls.get(
            calls
                .partition_point(|c| c.first_primitive <= primitive)
                .checked_sub(1)?,
        )?;
        let material: &Material = &self.scene.materials[call.material];
        let reference = material.textures[slot]?;
        let groups = &self.draws.groups[call.material].groups;
        let group = groups.iter().position(|slots| slots.contains(&slot))?;
        let key = key(primitive, pixel);
        let first = lanes.partition_point(|lane| lane.key < key);
        let lane = lanes[first..]
            .iter()
            .take_while(|l| l.key == key)
            .find(|l| usize::from(l.group) == group)?;
        let record = &tile.records[lane.record as usize];
        let draw = tile
            .runs
            .iter()
            .find(|run| run.primitive == primitive)?
            .draw;
        let uv_group = self.tables.draws.get(draw as usize)?.groups.get(group)?;
        let texture = sampler.texture(reference.image)?;
        let lod = quad_lod(record, uv_group.extent, texture.texture.size, self.formula);
        let index = (pixel[0] & 1) | (pixel[1] & 1) << 1;
        let [width, height] = texture
            .texture
            .level_size((lod.max(0.0) as u32).min(texture.texture.levels - 1));
        let level_size = DVec2::new(width.into(), height.into());
        let uv = captured_uv(record, index, uv_group) + moved_texels / level_size;
        let color = sampler.sample(texture, &reference.sampler, uv, lod.into());
        Some((color, texture.texture.color_space == ColorSpace::Srgb))
    }
}

/// Colour in sRGB encoding; alpha unchanged.
fn encode(color: DVec4) -> DVec4 {
    let [r, g, b] = [color.x, color.y, color.z].map(srgb_of_linear);
    DVec4::new(r, g, b, color.w)
}
