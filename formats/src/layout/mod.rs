//! Addresses of texels in memory: a pure function of the texture table and a [`LayoutConfig`].
//!
//! The layers of a texture are consecutive. Each has its levels from fine to coarse, without gaps. A level
//! is an array of blocks (4x4 texels for BC1, one texel for uncompressed formats) in the configured order.
//! Shadow maps have their own order. A texture that is a part of another one lies in that one's memory.

mod placement;

pub use placement::{BlockPlacement, interleave};

use crate::error::Broken;
use crate::texture::{Part, TexelFormat, Texture};
use serde::{Deserialize, Serialize};

/// Order of the blocks of a level in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BlockOrder {
    /// Row by row.
    #[default]
    Linear,
    /// Z-order curve; the level is padded to powers of two.
    Morton,
    /// Tiles of 4x4 blocks, row by row within and between; the level is padded to whole tiles.
    Tiled,
}

/// Order in which textures are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TextureOrder {
    /// As in the texture table.
    #[default]
    Table,
    /// Largest first, as allocators that fight fragmentation do.
    LargestFirst,
}

/// Alignment at which textures of the same size share cache sets.
pub const PAGE_ALIGNMENT_BYTES: u64 = 64 << 10;

/// Everything that decides a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LayoutConfig {
    /// Format of the colour textures; `None` keeps the captured one. Shadow maps (R32F, D16) and textures of more
    /// than 8 bits a channel always keep theirs.
    pub texel_format: Option<TexelFormat>,
    /// Block order within a level of a colour texture.
    pub block_order: BlockOrder,
    /// Block order of shadow maps (R32F, D16). In a linear map whose rows are a multiple of the cache's way size, a
    /// column of texels falls into one cache set.
    pub shadow_map_order: BlockOrder,
    /// Alignment of a texture's first byte, a power of two.
    pub base_align_bytes: u64,
    /// Order of the textures in memory.
    pub texture_order: TextureOrder,
}

impl Default for LayoutConfig {
    fn default() -> Self {
        Self {
            texel_format: None,
            block_order: BlockOrder::Linear,
            // GPUs also tile depth textures.
            shadow_map_order: BlockOrder::Morton,
            base_align_bytes: 64,
            texture_order: TextureOrder::Table,
        }
    }
}

/// A format's unit of storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockInfo {
    /// Width and height in texels.
    pub texels: [u32; 2],
    /// Size in bytes.
    pub bytes: u32,
}

impl TexelFormat {
    /// The format's block.
    pub const fn block(self) -> BlockInfo {
        let (edge, bytes) = match self {
            Self::Bc1 | Self::Bc4 | Self::Etc2 | Self::EacR11 => (4, 8),
            Self::Bc2 | Self::Bc3 | Self::Bc5 | Self::Bc6h | Self::Bc7 => (4, 16),
            Self::Etc2Rgba | Self::EacRg11 | Self::Astc4x4 => (4, 16),
            Self::Astc5x5 => (5, 16),
            Self::Astc6x6 => (6, 16),
            Self::Astc8x8 => (8, 16),
            Self::R8 => (1, 1),
            Self::Rg8 | Self::R16 | Self::Packed16 | Self::D16 => (1, 2),
            Self::Rgba8 | Self::R32f | Self::Rg16 | Self::Packed32 => (1, 4),
            Self::Rgba16 | Self::Rg32 => (1, 8),
            Self::Rgba32 => (1, 16),
        };
        BlockInfo {
            texels: [edge, edge],
            bytes,
        }
    }
}

/// Placement of one mip level within a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelLayout {
    /// Offset from the start of the layer.
    pub offset_bytes: u64,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Order of the blocks.
    pub placement: BlockPlacement,
}

/// Placement of one texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureLayout {
    /// Address of the first byte.
    pub base: u64,
    /// Format in memory.
    pub format: TexelFormat,
    /// The format's block.
    pub block: BlockInfo,
    /// Distance between layers.
    pub layer_bytes: u64,
    /// Number of layers.
    pub layers: u32,
    /// Levels from fine to coarse.
    pub levels: Vec<LevelLayout>,
    /// Whether it lies in the memory of another texture.
    pub is_part: bool,
}

impl TextureLayout {
    /// Size of all layers.
    pub fn size_bytes(&self) -> u64 {
        self.layer_bytes * u64::from(self.layers)
    }

    /// Address of the block that contains a texel; `None` if the level does not exist.
    pub fn address(&self, layer: u32, level: u32, texel: [u32; 2]) -> Option<u64> {
        let level = self.levels.get(level as usize)?;
        let block = [
            texel[0] / self.block.texels[0],
            texel[1] / self.block.texels[1],
        ];
        let within = level.placement.index(block) * u64::from(self.block.bytes);
        Some(self.base + u64::from(layer) * self.layer_bytes + level.offset_bytes + within)
    }
}

/// A block of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockAt {
    /// Index of the texture.
    pub texture: u32,
    /// Layer.
    pub layer: u32,
    /// Mip level.
    pub level: u32,
    /// Column and row in blocks; outside the level if it is padding.
    pub block: [u32; 2],
}

/// Placement of all textures of a trace.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    textures: Vec<TextureLayout>,
    end: u64,
}

impl Layout {
    /// Lays out `textures`, from address 0.
    ///
    /// # Errors
    /// The alignment is not a power of two, or the textures are too large to address.
    pub fn new(textures: &[Texture], config: &LayoutConfig) -> Result<Self, Broken> {
        let align = config.base_align_bytes;
        if !align.is_power_of_two() {
            return Err(Broken::new(
                "base alignment",
                "a power of two of bytes",
                align,
            ));
        }
        let mut placed = Vec::with_capacity(textures.len());
        for (index, texture) in textures.iter().enumerate() {
            placed.push(place(texture, config).ok_or_else(|| too_large(index, texture))?);
        }
        let mut order: Vec<usize> = (0..textures.len()).collect();
        order.retain(|&index| textures[index].part.is_none());
        if config.texture_order == TextureOrder::LargestFirst {
            order.sort_by_key(|&index| {
                std::cmp::Reverse(placed[index].layer_bytes * u64::from(textures[index].layers))
            });
        }
        let mut end = 0u64;
        for index in order {
            let texture = &textures[index];
            let size = placed[index].layer_bytes * u64::from(texture.layers);
            let base = end.checked_next_multiple_of(align);
            let after = base.and_then(|base| base.checked_add(size));
            (placed[index].base, end) = base
                .zip(after)
                .filter(|(_, end)| *end < 1 << 63)
                .ok_or_else(|| too_large(index, texture))?;
        }
        for (index, texture) in textures.iter().enumerate() {
            if let Some(part) = texture.part {
                placed[index] = within(part, texture, &placed).ok_or_else(|| {
                    let (expected, found) = ("a part of another texture", "levels that it lacks");
                    of_texture(index, texture, expected, found)
                })?;
            }
        }
        Ok(Self {
            textures: placed,
            end,
        })
    }

    /// Placement of each texture, in table order.
    pub fn textures(&self) -> &[TextureLayout] {
        &self.textures
    }

    /// First address after the last texture.
    pub fn end(&self) -> u64 {
        self.end
    }

    /// The block at an address; `None` between textures and after the last one.
    pub fn block_at(&self, address: u64) -> Option<BlockAt> {
        let holds = |texture: &TextureLayout| {
            let end = texture.base + texture.size_bytes();
            !texture.is_part && (texture.base..end).contains(&address)
        };
        let (number, texture) = (0..).zip(&self.textures).find(|(_, t)| holds(t))?;
        let within = address - texture.base;
        let (layer, within) = (within / texture.layer_bytes, within % texture.layer_bytes);
        let levels = &texture.levels;
        let level = levels.partition_point(|level| level.offset_bytes <= within);
        let level = level.checked_sub(1)?;
        let placed = levels.get(level)?;
        let block = (within - placed.offset_bytes) / u64::from(texture.block.bytes);
        Some(BlockAt {
            texture: number,
            layer: layer as u32,
            level: level as u32,
            block: placed.placement.block(block),
        })
    }

    /// Address of the block that contains a texel; `None` if the texture or level does not exist.
    pub fn address(&self, texture: u32, layer: u32, level: u32, texel: [u32; 2]) -> Option<u64> {
        let texture = self.textures.get(texture as usize)?;
        texture.address(layer, level, texel)
    }
}

fn too_large(index: usize, texture: &Texture) -> Broken {
    of_texture(index, texture, "addresses below 2^63", "more")
}

fn of_texture(index: usize, texture: &Texture, expected: &str, found: &str) -> Broken {
    let what = format!("texture {index} ({})", texture.name);
    Broken::new(what, expected, found)
}

/// Format in memory. The override applies only to ordinary colour: its blocks cannot hold depth or channels
/// of more than 8 bits.
fn memory_format(texture: &Texture, config: &LayoutConfig) -> TexelFormat {
    config
        .texel_format
        .filter(|_| texture.format.is_ordinary_color())
        .unwrap_or(texture.format)
}

/// Lays out one texture from address 0.
fn place(texture: &Texture, config: &LayoutConfig) -> Option<TextureLayout> {
    let format = memory_format(texture, config);
    let block = format.block();
    let order = if format.is_depth() {
        config.shadow_map_order
    } else {
        config.block_order
    };
    let mut offset_bytes = 0u64;
    let levels = (0..texture.levels)
        .map(|level| {
            let size = texture.level_size(level);
            let blocks = [0, 1].map(|a| size[a].div_ceil(block.texels[a]));
            let placement = BlockPlacement::new(order, blocks);
            let layout = LevelLayout {
                offset_bytes,
                size,
                placement,
            };
            let bytes = placement
                .blocks(blocks)
                .checked_mul(u64::from(block.bytes))?;
            offset_bytes = offset_bytes.checked_add(bytes)?;
            Some(layout)
        })
        .collect::<Option<Vec<_>>>()?;
    // The size of all layers together must be a valid address.
    offset_bytes.checked_mul(u64::from(texture.layers))?;
    Some(TextureLayout {
        base: 0,
        format,
        block,
        layer_bytes: offset_bytes,
        layers: texture.layers,
        levels,
        is_part: false,
    })
}

/// The placement of a part of a texture; `None` if that texture does not have its levels.
fn within(part: Part, texture: &Texture, placed: &[TextureLayout]) -> Option<TextureLayout> {
    let whole = placed
        .get(part.of as usize)
        .filter(|whole| !whole.is_part)?;
    let (first, layer) = (part.level as usize, u64::from(part.layer));
    let levels = whole.levels.get(first..first + texture.levels as usize)?;
    Some(TextureLayout {
        base: whole.base + layer * whole.layer_bytes,
        layers: texture.layers,
        levels: levels.to_vec(),
        is_part: true,
        ..*whole
    })
}

#[cfg(test)]
mod tests;
