// Fragments of masked draws, the background and shadow maps.

// Colour of an alpha-masked draw: depth is tested and written after the discard.
fn masked(in: Fragment, front: bool) -> vec4<f32> {
    let base = base_color(in);
    let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
    let found = find_cascade(in.world, geometric);
    let color = shade(in, front, base, found);
    if base.a < material.specular.w { discard; }
    return color;
}

struct Background {
    @builtin(position) position: vec4<f32>,
    @location(0) direction: vec3<f32>,
}

// One triangle over the view at the far plane; it also clears the region's depth.
fn background_corner(index: u32) -> Background {
    let ndc = vec2(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    // Of a far plane at infinity, only the direction is known: its w is 0.
    let far = views[view_number].world_from_clip * vec4(ndc, 0.0, 1.0);
    var out: Background;
    out.position = placed(vec4(ndc, 0.0, 1.0));
    out.direction = far.xyz - views[view_number].eye.xyz * far.w;
    return out;
}

fn background_color(in: Background) -> vec4<f32> {
    let direction = safe_normalize(in.direction);
    return vec4(tone_map(background(direction)), 1.0);
}

// Depth of alpha-masked draws alone.
@fragment
fn fragment_shadow(in: Fragment) {
    if base_alpha(in) < material.specular.w { discard; }
}
