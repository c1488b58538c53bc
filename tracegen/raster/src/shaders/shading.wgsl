// Colour: surface, lights, shadows, sky.

// Light that a texture of an additional layer (clear coat, sheen and so on) takes. It stands for the layer's
// shading: the texture is sampled as in a renderer, and its effect is small.
const LAYER_WEIGHT: f32 = 0.04;

fn texture_uv(slot: u32, uv: vec4<f32>) -> vec2<f32> {
    let row0 = material.uv_rows[2u * slot];
    let row1 = material.uv_rows[2u * slot + 1u];
    let chosen = select(uv.xy, uv.zw, row0.w > 0.5);
    // Sums in this order and not dot(), which each of Mesa's compilers expands in an order of its own.
    return vec2(
        (row0.x * chosen.x + row0.y * chosen.y) + row0.z,
        (row1.x * chosen.x + row1.y * chosen.y) + row1.z,
    );
}

fn base_color(in: Fragment) -> vec4<f32> {
    var color = material.base_color;
    if (TEXTURES & (1u << BASE_COLOR)) != 0u {
        var texel = textureSample(base_color_texture, base_color_sampler, texture_uv(BASE_COLOR, in.uv));
        if MASKED { texel = vec4(texel.rgb / max(texel.a, 0.02), texel.a); }
        color *= texel;
    }
    if COLORED { color *= in.color; }
    return color;
}

// Alpha of base_color() alone, bit for bit.
fn base_alpha(in: Fragment) -> f32 {
    var alpha = material.base_color.a;
    if (TEXTURES & (1u << BASE_COLOR)) != 0u { alpha *= texel_alpha(texture_uv(BASE_COLOR, in.uv)); }
    if COLORED { alpha *= in.color.a; }
    return alpha;
}

fn surface_normal(in: Fragment, front: bool) -> vec3<f32> {
    let n = safe_normalize(in.normal);
    var normal = n;
    if (TEXTURES & (1u << NORMAL)) != 0u {
        let uv = texture_uv(NORMAL, in.uv);
        let texel = textureSample(normal_texture, normal_sampler, uv).xyz * 2.0 - 1.0;
        let t = safe_normalize(in.tangent.xyz - n * dot(n, in.tangent.xyz));
        let b = cross(n, t) * in.tangent.w;
        let scale = material.emissive.w;
        normal = safe_normalize(t * (texel.x * scale) + b * (texel.y * scale) + n * max(texel.z, 0.05));
    }
    return select(-normal, normal, front);
}

fn safe_normalize(v: vec3<f32>) -> vec3<f32> {
    return v * inverseSqrt(max(inner(v, v), 1e-12));
}

// Shadow uv and depth of a world position in one cascade.
fn shadow_coordinates(cascade: u32, world: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    // Pushing the receiver off its surface by a little more than a texel hides the stairs that
    // the map's resolution leaves on slanted surfaces.
    let offset = normal * (1.6 * views[view_number].shadow_texel_m[cascade]);
    return product(views[view_number].cascades[cascade], vec4(world + offset, 1.0)).xyz;
}

// A margin of two texels keeps every tap inside the map.
fn in_cascade(p: vec3<f32>) -> bool {
    let margin = 2.0 / SHADOW_SIZE;
    return all(p.xy > vec2(margin)) && all(p.xy < vec2(1.0 - margin)) && p.z < 1.0;
}

struct ShadowLookup {
    coordinates: vec3<f32>,
    cascade: i32,
    // Shadow uv in every cascade.
    uv: array<vec2<f32>, MAX_CASCADES>,
}

// The finest cascade that holds the position. Which one does not depend on the eye.
fn find_cascade(world: vec3<f32>, normal: vec3<f32>) -> ShadowLookup {
    var found: ShadowLookup;
    found.cascade = -1;
    for (var k = 0u; k < CASCADES; k++) {
        let p = shadow_coordinates(k, world, normal);
        found.uv[k] = p.xy;
        if found.cascade < 0 && in_cascade(p) {
            found.coordinates = p;
            found.cascade = i32(k);
        }
    }
    return found;
}

fn sunlit(found: ShadowLookup) -> f32 {
    if found.cascade < 0 {
        return 1.0;
    }
    let uv = found.coordinates.xy;
    let depth = found.coordinates.z;
    let taps = vec4(
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, SHADOW_TAP_0),
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, SHADOW_TAP_1),
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, SHADOW_TAP_2),
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, SHADOW_TAP_3),
    );
    return dot(taps, vec4(0.25));
}

struct Surface {
    albedo: vec3<f32>,
    f0: vec3<f32>,
    alpha: f32,
    normal: vec3<f32>,
    to_eye: vec3<f32>,
}

// Lambert and GGX (height-correlated Smith, approximated after Karis 2013) under unit irradiance.
fn reflect_light(s: Surface, to_light: vec3<f32>) -> vec3<f32> {
    let n_l = max(dot(s.normal, to_light), 0.0);
    let n_v = max(dot(s.normal, s.to_eye), 1e-3);
    let h = safe_normalize(to_light + s.to_eye);
    let n_h = max(dot(s.normal, h), 0.0);
    let l_h = max(dot(to_light, h), 0.0);
    let a2 = s.alpha * s.alpha;
    let d = n_h * n_h * (a2 - 1.0) + 1.0;
    let distribution = a2 / (3.14159265 * d * d);
    let visibility = 0.5 / mix(2.0 * n_l * n_v, n_l + n_v, s.alpha);
    let f = 1.0 - l_h;
    let f2 = f * f;
    let fresnel = s.f0 + (1.0 - s.f0) * (f2 * f2 * f);
    return (s.albedo * 0.31830989 + fresnel * (distribution * visibility)) * n_l;
}

// Mean radiance over the hemisphere around a direction, as scene::light::Sky has it.
fn ambient(direction: vec3<f32>) -> vec3<f32> {
    return mix(views[view_number].ground.rgb, views[view_number].sky.rgb, 0.5 + 0.5 * direction.y);
}

// Radiance from a direction, as scene::light::Sky has it.
fn background(direction: vec3<f32>) -> vec3<f32> {
    let zenith = views[view_number].sky.rgb * vec3(0.75, 0.85, 1.0);
    let sky = mix(views[view_number].sky.rgb, zenith, clamp(direction.y, 0.0, 1.0));
    return mix(views[view_number].ground.rgb, sky, smoothstep(-0.1, 0.02, direction.y));
}

// Narkowicz 2015, a fit of the ACES filmic curve.
fn tone_map(c: vec3<f32>) -> vec3<f32> {
    return clamp((c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14), vec3(0.0), vec3(1.0));
}

fn shade(in: Fragment, front: bool, base: vec4<f32>, found: ShadowLookup) -> vec4<f32> {
    let normal = surface_normal(in, front);
    var metalness = material.surface.x;
    var roughness = material.surface.y;
    if (TEXTURES & (1u << METALLIC_ROUGHNESS)) != 0u {
        let uv = texture_uv(METALLIC_ROUGHNESS, in.uv);
        let texel = textureSample(metallic_roughness_texture, metallic_roughness_sampler, uv);
        roughness *= texel.g;
        metalness *= texel.b;
    }
    var specular = material.specular.rgb;
    if (TEXTURES & (1u << SPECULAR)) != 0u {
        let uv = texture_uv(SPECULAR, in.uv);
        specular *= textureSample(specular_texture, specular_sampler, uv).rgb;
    }
    var occlusion = 1.0;
    if (TEXTURES & (1u << OCCLUSION)) != 0u {
        let uv = texture_uv(OCCLUSION, in.uv);
        occlusion = textureSample(occlusion_texture, occlusion_sampler, uv).r;
    }
    var light = material.emissive.rgb;
    if (TEXTURES & (1u << EMISSIVE)) != 0u {
        let uv = texture_uv(EMISSIVE, in.uv);
        light *= textureSample(emissive_texture, emissive_sampler, uv).rgb;
    }

    var s: Surface;
    s.albedo = base.rgb * (1.0 - metalness);
    s.f0 = mix(0.04 * specular, base.rgb, metalness);
    s.alpha = max(roughness * roughness, 0.02);
    s.normal = normal;
    s.to_eye = safe_normalize(views[view_number].eye.xyz - in.world);

    light += reflect_light(s, views[view_number].to_sun.xyz) * views[view_number].sun.rgb * sunlit(found);
    for (var k = 0u; k < views[view_number].counts.x; k++) {
        let to_light = views[view_number].points[k].position.xyz - in.world;
        let falloff = 1.0 / max(dot(to_light, to_light), 0.01);
        light += reflect_light(s, safe_normalize(to_light)) * views[view_number].points[k].intensity.rgb * falloff;
    }
    let mirror = reflect(-s.to_eye, normal);
    let gloss = (1.0 - roughness) * (1.0 - roughness);
    let mirrored = mix(ambient(mirror), background(mirror), gloss);
    light += (s.albedo * ambient(normal) + s.f0 * mirrored) * occlusion;
    light *= kept_by_layers(in);
    return vec4(tone_map(light), select(1.0, base.a, BLENDED));
}
