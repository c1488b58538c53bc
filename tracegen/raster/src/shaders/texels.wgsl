// What visible fragments sample of one texture of their materials: a check of the records.

struct Texel {
    @location(0) color: vec4<f32>,
    // Which primitive is visible, or NONE where its material lacks the texture.
    @location(1) primitive: u32,
}

// The texture in slot views[view_number].counts.z.
fn texel(in: Fragment, primitive: u32) -> Texel {
    var out: Texel;
    out.primitive = NONE;
    let slot = views[view_number].counts.z;
    out.color = texel_of(in);
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
