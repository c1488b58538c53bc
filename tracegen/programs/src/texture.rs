//! Converts Vulkan formats and samplers to those of a trace.

use ash::vk::{self, Format as F};
use formats::texture::{
    ColorSpace, Filter, LodRange, MipFilter, Sampler, TexelFormat, Texture, Wrap,
};
use spool::{ImageInfo, SamplerInfo, ViewInfo};

/// Format and colour space in a trace; `None` for formats that textures cannot have.
pub fn texel_format(format: i32) -> Option<(TexelFormat, ColorSpace)> {
    use ColorSpace::{Linear, Srgb};
    use TexelFormat as T;
    Some(match F::from_raw(format) {
        F::R8_UNORM | F::R8_SNORM | F::R8_UINT | F::R8_SINT | F::S8_UINT => (T::R8, Linear),
        F::R8_SRGB => (T::R8, Srgb),
        F::R8G8_UNORM | F::R8G8_SNORM | F::R8G8_UINT | F::R8G8_SINT => (T::Rg8, Linear),
        F::R8G8_SRGB => (T::Rg8, Srgb),
        F::R8G8B8A8_UNORM
        | F::R8G8B8A8_SNORM
        | F::R8G8B8A8_UINT
        | F::R8G8B8A8_SINT
        | F::B8G8R8A8_UNORM
        | F::B8G8R8A8_UINT
        | F::A8B8G8R8_UNORM_PACK32 => (T::Rgba8, Linear),
        F::R8G8B8A8_SRGB | F::B8G8R8A8_SRGB | F::A8B8G8R8_SRGB_PACK32 => (T::Rgba8, Srgb),
        F::R5G6B5_UNORM_PACK16
        | F::B5G6R5_UNORM_PACK16
        | F::R5G5B5A1_UNORM_PACK16
        | F::B5G5R5A1_UNORM_PACK16
        | F::A1R5G5B5_UNORM_PACK16
        | F::R4G4B4A4_UNORM_PACK16
        | F::B4G4R4A4_UNORM_PACK16
        | F::A4R4G4B4_UNORM_PACK16
        | F::A4B4G4R4_UNORM_PACK16 => (T::Packed16, Linear),
        F::A2B10G10R10_UNORM_PACK32
        | F::A2R10G10B10_UNORM_PACK32
        | F::A2B10G10R10_UINT_PACK32
        | F::B10G11R11_UFLOAT_PACK32
        | F::E5B9G9R9_UFLOAT_PACK32 => (T::Packed32, Linear),
        F::R16_UNORM | F::R16_SNORM | F::R16_UINT | F::R16_SINT | F::R16_SFLOAT => (T::R16, Linear),
        F::R16G16_UNORM | F::R16G16_SNORM | F::R16G16_UINT | F::R16G16_SINT | F::R16G16_SFLOAT => {
            (T::Rg16, Linear)
        }
        F::R16G16B16A16_UNORM
        | F::R16G16B16A16_SNORM
        | F::R16G16B16A16_UINT
        | F::R16G16B16A16_SINT
        | F::R16G16B16A16_SFLOAT => (T::Rgba16, Linear),
        F::R32_UINT | F::R32_SINT | F::R32_SFLOAT => (T::R32f, Linear),
        F::R32G32_UINT | F::R32G32_SINT | F::R32G32_SFLOAT => (T::Rg32, Linear),
        F::R32G32B32A32_UINT | F::R32G32B32A32_SINT | F::R32G32B32A32_SFLOAT => (T::Rgba32, Linear),
        F::D16_UNORM => (T::D16, Linear),
        // Depth takes four bytes in these formats. The stencil is stored separately.
        F::D32_SFLOAT | F::X8_D24_UNORM_PACK32 | F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT => {
            (T::R32f, Linear)
        }
        F::BC1_RGB_UNORM_BLOCK | F::BC1_RGBA_UNORM_BLOCK => (T::Bc1, Linear),
        F::BC1_RGB_SRGB_BLOCK | F::BC1_RGBA_SRGB_BLOCK => (T::Bc1, Srgb),
        F::BC2_UNORM_BLOCK => (T::Bc2, Linear),
        F::BC2_SRGB_BLOCK => (T::Bc2, Srgb),
        F::BC3_UNORM_BLOCK => (T::Bc3, Linear),
        F::BC3_SRGB_BLOCK => (T::Bc3, Srgb),
        F::BC4_UNORM_BLOCK | F::BC4_SNORM_BLOCK => (T::Bc4, Linear),
        F::BC5_UNORM_BLOCK | F::BC5_SNORM_BLOCK => (T::Bc5, Linear),
        F::BC6H_UFLOAT_BLOCK | F::BC6H_SFLOAT_BLOCK => (T::Bc6h, Linear),
        F::BC7_UNORM_BLOCK => (T::Bc7, Linear),
        F::BC7_SRGB_BLOCK => (T::Bc7, Srgb),
        F::ETC2_R8G8B8_UNORM_BLOCK | F::ETC2_R8G8B8A1_UNORM_BLOCK => (T::Etc2, Linear),
        F::ETC2_R8G8B8_SRGB_BLOCK | F::ETC2_R8G8B8A1_SRGB_BLOCK => (T::Etc2, Srgb),
        F::ETC2_R8G8B8A8_UNORM_BLOCK => (T::Etc2Rgba, Linear),
        F::ETC2_R8G8B8A8_SRGB_BLOCK => (T::Etc2Rgba, Srgb),
        F::EAC_R11_UNORM_BLOCK | F::EAC_R11_SNORM_BLOCK => (T::EacR11, Linear),
        F::EAC_R11G11_UNORM_BLOCK | F::EAC_R11G11_SNORM_BLOCK => (T::EacRg11, Linear),
        F::ASTC_4X4_UNORM_BLOCK => (T::Astc4x4, Linear),
        F::ASTC_4X4_SRGB_BLOCK => (T::Astc4x4, Srgb),
        F::ASTC_5X5_UNORM_BLOCK => (T::Astc5x5, Linear),
        F::ASTC_5X5_SRGB_BLOCK => (T::Astc5x5, Srgb),
        F::ASTC_6X6_UNORM_BLOCK => (T::Astc6x6, Linear),
        F::ASTC_6X6_SRGB_BLOCK => (T::Astc6x6, Srgb),
        F::ASTC_8X8_UNORM_BLOCK => (T::Astc8x8, Linear),
        F::ASTC_8X8_SRGB_BLOCK => (T::Astc8x8, Srgb),
        _ => return None,
    })
}

/// Converts the part of an image in a view to a texture of a trace; `None` if a trace does not have the
/// format. `number` names the image: the numbers of the program differ from run to run.
pub fn texture(view: &ViewInfo, image: &ImageInfo, number: u32) -> Option<Texture> {
    let (format, color_space) = texel_format(view.format)?;
    let [first_level, levels] = view.levels;
    let [first_layer, layers] = view.layers;
    let size = [0, 1].map(|axis| (image.size[axis] >> first_level).max(1));
    let whole = [first_level, first_layer] == [0, 0] && layers == image.layers;
    let [width, height, _] = image.size;
    let mut name = format!("image {number} ({width}x{height})");
    if !whole {
        name += &format!(" from level {first_level}, layer {first_layer}");
    }
    let most = size[0].max(size[1]).ilog2() + 1;
    Some(Texture {
        name,
        size,
        levels: levels.clamp(1, most),
        layers: layers.max(1),
        format,
        color_space,
        part: None,
    })
}

/// Converts the sampler of a view.
pub fn sampler(info: &SamplerInfo, view: &ViewInfo) -> Sampler {
    let filter = |raw: i32| match vk::Filter::from_raw(raw) {
        vk::Filter::NEAREST => Filter::Nearest,
        _ => Filter::Linear,
    };
    let wrap = |raw: i32| match vk::SamplerAddressMode::from_raw(raw) {
        vk::SamplerAddressMode::REPEAT => Wrap::Repeat,
        vk::SamplerAddressMode::MIRRORED_REPEAT => Wrap::MirroredRepeat,
        vk::SamplerAddressMode::CLAMP_TO_BORDER => Wrap::ClampToBorder,
        vk::SamplerAddressMode::MIRROR_CLAMP_TO_EDGE => Wrap::MirrorClampToEdge,
        _ => Wrap::ClampToEdge,
    };
    let [bias, min, max] = info.lod;
    let fixed = |lod: f32| (256.0 * lod).round().clamp(-32768.0, 32767.0) as i16;
    // The view's least level applies after the sampler's bounds.
    let of_view = view.min_lod_256ths as f32 / 256.0 - view.levels[0] as f32;
    let (min, max) = (min.max(of_view), max.max(of_view));
    let between = vk::SamplerMipmapMode::from_raw(info.mip);
    // Filters of OpenGL without mip levels are expressed by a maximum that allows only the first level. With a
    // maximum of 0, everything is magnified.
    let is_flat = max <= 0.25 && (between == vk::SamplerMipmapMode::NEAREST || max <= 0.0);
    let mip = match between {
        _ if is_flat => MipFilter::None,
        vk::SamplerMipmapMode::NEAREST => MipFilter::Nearest,
        _ => MipFilter::Linear,
    };
    // A maximum above all levels of a texture is no bound, and a minimum below level 0 has no effect.
    let max_256ths = if max >= 127.0 { i16::MAX } else { fixed(max) };
    let min_256ths = if min <= 0.0 { i16::MIN } else { fixed(min) };
    Sampler {
        // Across an edge of a face lie the texels of another face: as many as at this one's edge.
        wrap: match is_cube(view) && !info.non_seamless {
            true => [Wrap::ClampToEdge; 2],
            false => info.wrap.map(wrap),
        },
        mag: filter(info.filters[0]),
        min: filter(info.filters[1]),
        mip,
        lod: LodRange {
            bias_256ths: fixed(bias),
            min_256ths,
            max_256ths: if is_flat && max > 0.0 {
                i16::MAX
            } else {
                max_256ths
            },
        },
        max_anisotropy_256ths: (256.0 * info.anisotropy.clamp(1.0, 16.0)).round() as u16,
    }
}

/// Whether a view is of a cube map, or of several.
fn is_cube(view: &ViewInfo) -> bool {
    [vk::ImageViewType::CUBE, vk::ImageViewType::CUBE_ARRAY]
        .contains(&vk::ImageViewType::from_raw(view.kind))
}

/// The sampler of a fetch at integer coordinates.
pub const FETCH: Sampler = Sampler {
    wrap: [Wrap::ClampToEdge; 2],
    mag: Filter::Nearest,
    min: Filter::Nearest,
    mip: MipFilter::Nearest,
    lod: LodRange::WHOLE,
    max_anisotropy_256ths: Sampler::ISOTROPIC,
};

/// The sampler of a gather, which reads the four texels of a bilinear footprint independently of the filter.
pub fn gathering(sampler: Sampler) -> Sampler {
    Sampler {
        mag: Filter::Linear,
        min: Filter::Linear,
        mip: MipFilter::None,
        max_anisotropy_256ths: Sampler::ISOTROPIC,
        ..sampler
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INFO: SamplerInfo = SamplerInfo {
        filters: [1, 1],
        mip: 1,
        wrap: [0, 3],
        lod: [-0.5, 0.0, 1000.0],
        anisotropy: 16.0,
        unnormalized: false,
        non_seamless: false,
    };

    const VIEW: ViewInfo = ViewInfo {
        image: 3,
        format: 37,
        kind: 1,
        levels: [0, 8],
        layers: [0, 1],
        min_lod_256ths: 0,
    };

    #[test]
    fn samplers_are_converted_to_those_of_a_trace() {
        let found = sampler(&INFO, &VIEW);
        assert_eq!(found.wrap, [Wrap::Repeat, Wrap::ClampToBorder]);
        assert_eq!((found.min, found.mip), (Filter::Linear, MipFilter::Linear));
        let bias = LodRange {
            bias_256ths: -128,
            ..LodRange::WHOLE
        };
        assert_eq!(found.lod, bias);
        for (most, stored) in [(1.0, 256), (2.5, 640), (16.0, 4096), (64.0, 4096)] {
            let info = SamplerInfo {
                anisotropy: most,
                ..INFO
            };
            let found = sampler(&info, &VIEW);
            assert_eq!(found.max_anisotropy_256ths, stored, "{most}");
            assert_eq!(gathering(found).max_anisotropy_256ths, 256);
        }
    }

    #[test]
    fn opengl_filters_without_levels_are_recognised_by_the_maximum_level() {
        let with = |mip, max| {
            let info = SamplerInfo {
                mip,
                lod: [0.0, 0.0, max],
                ..INFO
            };
            let found = sampler(&info, &VIEW);
            (found.mip, found.lod.max_256ths)
        };
        assert_eq!(with(0, 0.25), (MipFilter::None, i16::MAX));
        // A maximum of 0 magnifies, and between levels a quarter of the next one is read.
        assert_eq!(with(0, 0.0), (MipFilter::None, 0));
        assert_eq!(with(1, 0.0), (MipFilter::None, 0));
        assert_eq!(with(1, 0.25), (MipFilter::Linear, 64));
        assert_eq!(with(0, 0.5), (MipFilter::Nearest, 128));
    }

    #[test]
    fn the_faces_of_cube_maps_are_clamped_unless_they_have_seams() {
        for (kind, non_seamless, wrap) in [
            (3, false, [Wrap::ClampToEdge; 2]),
            (6, false, [Wrap::ClampToEdge; 2]),
            (3, true, [Wrap::Repeat, Wrap::ClampToBorder]),
            (5, false, [Wrap::Repeat, Wrap::ClampToBorder]),
        ] {
            let info = SamplerInfo {
                non_seamless,
                ..INFO
            };
            let view = ViewInfo { kind, ..VIEW };
            assert_eq!(sampler(&info, &view).wrap, wrap, "{kind} {non_seamless}");
        }
    }

    #[test]
    fn the_least_level_of_a_view_counts_from_the_first_level_of_the_view() {
        let with = |first, max| {
            let info = SamplerInfo {
                lod: [0.0, 0.5, max],
                ..INFO
            };
            let view = ViewInfo {
                levels: [first, 5],
                min_lod_256ths: 896,
                ..VIEW
            };
            let LodRange {
                min_256ths,
                max_256ths,
                ..
            } = sampler(&info, &view).lod;
            (min_256ths, max_256ths)
        };
        assert_eq!(with(0, 1000.0), (896, i16::MAX));
        assert_eq!(with(1, 1000.0), (640, i16::MAX));
        assert_eq!(with(3, 2.0), (128, 512));
        assert_eq!(with(0, 2.0), (896, 896));
        assert_eq!(with(4, 2.0), (128, 512));
    }

    #[test]
    fn a_view_of_some_levels_is_a_separate_texture() {
        let image = ImageInfo {
            image: 3,
            format: F::BC7_SRGB_BLOCK.as_raw(),
            size: [300, 100, 1],
            levels: 9,
            layers: 6,
            samples: 1,
            presented: false,
        };
        let mut view = ViewInfo {
            image: 3,
            format: image.format,
            kind: 1,
            levels: [2, 3],
            layers: [0, 6],
            min_lod_256ths: 0,
        };
        let part = texture(&view, &image, 3).unwrap();
        assert_eq!((part.size, part.levels, part.layers), ([75, 25], 3, 6));
        assert_eq!(
            (part.format, part.color_space),
            (TexelFormat::Bc7, ColorSpace::Srgb)
        );
        assert_eq!(part.name, "image 3 (300x100) from level 2, layer 0");
        view.format = F::G8B8G8R8_422_UNORM.as_raw();
        assert_eq!(texture(&view, &image, 3), None);
    }

    #[test]
    fn every_format_has_as_many_bytes_in_a_trace_as_in_vulkan() {
        // Block sizes of Vulkan 1.3, "Compatible Formats".
        let bytes = [
            (F::R8_UNORM, 1),
            (F::R8G8_UNORM, 2),
            (F::R5G6B5_UNORM_PACK16, 2),
            (F::R16_SFLOAT, 2),
            (F::D16_UNORM, 2),
            (F::R8G8B8A8_SRGB, 4),
            (F::A2B10G10R10_UNORM_PACK32, 4),
            (F::B10G11R11_UFLOAT_PACK32, 4),
            (F::R16G16_SFLOAT, 4),
            (F::R32_SFLOAT, 4),
            (F::R16G16B16A16_SFLOAT, 8),
            (F::R32G32_SFLOAT, 8),
            (F::BC1_RGBA_UNORM_BLOCK, 8),
            (F::BC4_UNORM_BLOCK, 8),
            (F::ETC2_R8G8B8_UNORM_BLOCK, 8),
            (F::EAC_R11_UNORM_BLOCK, 8),
            (F::R32G32B32A32_SFLOAT, 16),
            (F::BC2_UNORM_BLOCK, 16),
            (F::BC5_UNORM_BLOCK, 16),
            (F::BC6H_UFLOAT_BLOCK, 16),
            (F::EAC_R11G11_UNORM_BLOCK, 16),
            (F::ASTC_6X6_UNORM_BLOCK, 16),
        ];
        for (format, bytes) in bytes {
            let (of_trace, _) = texel_format(format.as_raw()).unwrap();
            assert_eq!(of_trace.block().bytes, bytes, "{format:?}");
        }
    }
}
