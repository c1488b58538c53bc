// What visible fragments sample of one texture of their materials: a check of the records.

struct Texel {
    @location(0) color: vec4<f32>,
    // Which primitive is visible, or NONE where its material lacks the texture.
    @location(1) primitive: u32,
}

// The texture in slot view.counts.z.
fn texel(in: Fragment, primitive: u32) -> Texel {
    var out: Texel;
    out.primitive = NONE;
    let slot = view.counts.z;
    if (TEXTURES & (1u << BASE_COLOR)) != 0u && slot == BASE_COLOR {
        out.color = textureSample(base_color_texture, base_color_sampler, texture_uv(BASE_COLOR, in.uv));
    }
    if (TEXTURES & (1u << NORMAL)) != 0u && slot == NORMAL {
        out.color = textureSample(normal_texture, normal_sampler, texture_uv(NORMAL, in.uv));
    }
    if (TEXTURES & (1u << METALLIC_ROUGHNESS)) != 0u && slot == METALLIC_ROUGHNESS {
        let uv = texture_uv(METALLIC_ROUGHNESS, in.uv);
        out.color = textureSample(metallic_roughness_texture, metallic_roughness_sampler, uv);
    }
    if (TEXTURES & (1u << SPECULAR)) != 0u && slot == SPECULAR {
        out.color = textureSample(specular_texture, specular_sampler, texture_uv(SPECULAR, in.uv));
    }
    if (TEXTURES & (1u << OCCLUSION)) != 0u && slot == OCCLUSION {
        out.color = textureSample(occlusion_texture, occlusion_sampler, texture_uv(OCCLUSION, in.uv));
    }
    if (TEXTURES & (1u << EMISSIVE)) != 0u && slot == EMISSIVE {
        out.color = textureSample(emissive_texture, emissive_sampler, texture_uv(EMISSIVE, in.uv));
    }
    if (TEXTURES & (1u << slot)) != 0u { out.primitive = in.ids.y + primitive; }
    return out;
}

@fragment
fn fragment_texel(in: Fragment, place: Place) -> Texel {
    return texel(in, primitive_of(place));
}

@fragment
fn fragment_texel_masked(in: Fragment, place: Place) -> Texel {
    let out = texel(in, primitive_of(place));
    if base_color(in).a < material.specular.w { discard; }
    return out;
}
