// The one shader of the raster capture. Overrides choose what a pipeline keeps; the colour that
// it computes is the same with and without CAPTURE, bit for bit.

enable primitive_index;

// Append a record per covered quad and uv group.
override CAPTURE: bool = false;
// Bit per texture of the material: base colour, normal, metallic-roughness, specular, occlusion,
// emissive.
override TEXTURES: u32 = 0u;
// Bit per texture that is the first of its uv group.
override LEADERS: u32 = 0u;
// Shadow cascades, 0 to 4.
override CASCADES: u32 = 0u;
// Alpha reaches the target (blended materials).
override BLENDED: bool = false;
// The base colour texture has BC1's one-bit alpha, whose transparent texels are black.
override MASKED: bool = false;

const BASE_COLOR: u32 = 0u;
const NORMAL: u32 = 1u;
const METALLIC_ROUGHNESS: u32 = 2u;
const SPECULAR: u32 = 3u;
const OCCLUSION: u32 = 4u;
const EMISSIVE: u32 = 5u;

// Group of a quad that samples nothing, see formats::textrace.
const NO_GROUP: u32 = 15u;
// Words of a record and of a depth, see backend.rs.
const RECORD_WORDS: u32 = 11u;
const DEPTH_WORDS: u32 = 5u;
// Index of no record.
const NONE: u32 = 0xffffffffu;

struct PointLight {
    position: vec4<f32>,
    intensity: vec4<f32>,
}

struct View {
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    eye: vec4<f32>,
    to_sun: vec4<f32>,
    sun: vec4<f32>,
    sky: vec4<f32>,
    ground: vec4<f32>,
    // Edge of a shadow texel in metres, by cascade.
    shadow_texel_m: vec4<f32>,
    // World to shadow uv and depth.
    cascades: array<mat4x4<f32>, 4>,
    points: array<PointLight, 8>,
    // x: point lights, y: records that the buffer holds.
    counts: vec4<u32>,
}

struct Instance {
    world_from_object: mat4x4<f32>,
    // Inverse transpose in columns 0 to 2; column 3: x = draw, y = first primitive, as bits.
    normal_from_object: mat4x4<f32>,
}

struct Material {
    base_color: vec4<f32>,
    // w: scale of the normal map.
    emissive: vec4<f32>,
    // w: alpha cutoff.
    specular: vec4<f32>,
    // x: metalness, y: roughness.
    surface: vec4<f32>,
    // Two rows a texture; w of the first is the uv set.
    uv_rows: array<vec4<f32>, 12>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read_write> counter: atomic<u32>;
@group(0) @binding(3) var<storage, read_write> records: array<u32>;
@group(0) @binding(4) var shadow_map: texture_depth_2d_array;
@group(0) @binding(5) var shadow_sampler: sampler_comparison;
@group(0) @binding(6) var<storage, read_write> depths: array<u32>;

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var base_color_texture: texture_2d<f32>;
@group(1) @binding(2) var normal_texture: texture_2d<f32>;
@group(1) @binding(3) var metallic_roughness_texture: texture_2d<f32>;
@group(1) @binding(4) var specular_texture: texture_2d<f32>;
@group(1) @binding(5) var occlusion_texture: texture_2d<f32>;
@group(1) @binding(6) var emissive_texture: texture_2d<f32>;
@group(1) @binding(7) var base_color_sampler: sampler;
@group(1) @binding(8) var normal_sampler: sampler;
@group(1) @binding(9) var metallic_roughness_sampler: sampler;
@group(1) @binding(10) var specular_sampler: sampler;
@group(1) @binding(11) var occlusion_sampler: sampler;
@group(1) @binding(12) var emissive_sampler: sampler;

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) tangent: vec4<f32>,
    @location(3) uv: vec4<f32>,
}

struct Fragment {
    @builtin(position) position: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) tangent: vec4<f32>,
    // Set 0 in xy, set 1 in zw.
    @location(3) uv: vec4<f32>,
    // Draw and number of the draw's first primitive.
    @location(4) @interpolate(flat, either) ids: vec2<u32>,
}

@vertex
fn vertex_main(in: Vertex, @builtin(instance_index) index: u32) -> Fragment {
    let instance = instances[index];
    let world = instance.world_from_object * vec4(in.position, 1.0);
    let n = instance.normal_from_object;
    var out: Fragment;
    out.position = view.clip_from_world * world;
    out.world = world.xyz;
    out.normal = mat3x3(n[0].xyz, n[1].xyz, n[2].xyz) * in.normal;
    let w = instance.world_from_object;
    out.tangent = vec4(mat3x3(w[0].xyz, w[1].xyz, w[2].xyz) * in.tangent.xyz, in.tangent.w);
    out.uv = in.uv;
    out.ids = bitcast<vec2<u32>>(n[3].xy);
    return out;
}

// ---- What a quad covers -------------------------------------------------------------------

// Where a fragment lies in its quad, and what it belongs to.
struct Lane {
    // Quad column and row, 12 bits each.
    quad: u32,
    // 0 top left, 1 top right, 2 bottom left, 3 bottom right.
    index: u32,
    // First bit of the quad in a ballot.
    shift: u32,
    primitive: u32,
    draw: u32,
}

fn lane_of(in: Fragment, primitive: u32, invocation: u32) -> Lane {
    let pixel = vec2<u32>(in.position.xy);
    var lane: Lane;
    lane.quad = (pixel.x >> 1u) | ((pixel.y >> 1u) << 12u);
    lane.index = (pixel.x & 1u) | ((pixel.y & 1u) << 1u);
    lane.shift = invocation & 4u;
    lane.primitive = in.ids.y + primitive;
    lane.draw = in.ids.x;
    return lane;
}

// Lanes of the quad for which `takes` holds; helper lanes never vote.
fn quad_mask(lane: Lane, takes: bool) -> u32 {
    return (subgroupBallot(takes).x >> lane.shift) & 15u;
}

// Appends a record and tells its index.
fn append(lane: Lane, mask: u32, group: u32, a: vec4<f32>, b: vec4<f32>) -> u32 {
    let index = atomicAdd(&counter, 1u);
    if index < view.counts.y {
        let word = index * RECORD_WORDS;
        records[word] = lane.quad | (mask << 24u) | (group << 28u);
        records[word + 1u] = lane.primitive;
        records[word + 2u] = lane.draw;
        records[word + 3u] = bitcast<u32>(a.x);
        records[word + 4u] = bitcast<u32>(a.y);
        records[word + 5u] = bitcast<u32>(a.z);
        records[word + 6u] = bitcast<u32>(a.w);
        records[word + 7u] = bitcast<u32>(b.x);
        records[word + 8u] = bitcast<u32>(b.y);
        records[word + 9u] = bitcast<u32>(b.z);
        records[word + 10u] = bitcast<u32>(b.w);
    }
    return index;
}

// Tells the record's index to the lane that appended it. Must be called in uniform control flow:
// the derivatives need the helper lanes.
fn record_uv(lane: Lane, group: u32, takes: bool, uv: vec2<f32>) -> u32 {
    let dx = dpdx(uv);
    let dy = dpdy(uv);
    let cross = dpdx(dy);
    let mask = quad_mask(lane, takes);
    var index = NONE;
    if takes && firstTrailingBit(mask) == lane.index {
        // Back from this lane to the top-left one, the top row and the left column.
        let right = f32(lane.index & 1u);
        let down = f32(lane.index >> 1u);
        let dx_top = dx - down * cross;
        let dy_left = dy - right * cross;
        let top_left = uv - right * dx_top - down * dy_left - right * down * cross;
        index = append(lane, mask, group, vec4(top_left, dx_top), vec4(dy_left, cross));
    }
    return index;
}

// One record a uv group of the material; tells the index of group 0's.
fn record_material(lane: Lane, in: Fragment) -> u32 {
    var first = NONE;
    if LEADERS == 0u && CASCADES == 0u {
        let mask = quad_mask(lane, true);
        if firstTrailingBit(mask) == lane.index {
            _ = append(lane, mask, NO_GROUP, vec4(0.0), vec4(0.0));
        }
    }
    if (LEADERS & 1u) != 0u { first = record_uv(lane, 0u, true, texture_uv(0u, in.uv)); }
    if (LEADERS & 2u) != 0u { _ = record_uv(lane, countOneBits(LEADERS & 1u), true, texture_uv(1u, in.uv)); }
    if (LEADERS & 4u) != 0u { _ = record_uv(lane, countOneBits(LEADERS & 3u), true, texture_uv(2u, in.uv)); }
    if (LEADERS & 8u) != 0u { _ = record_uv(lane, countOneBits(LEADERS & 7u), true, texture_uv(3u, in.uv)); }
    if (LEADERS & 16u) != 0u { _ = record_uv(lane, countOneBits(LEADERS & 15u), true, texture_uv(4u, in.uv)); }
    if (LEADERS & 32u) != 0u { _ = record_uv(lane, countOneBits(LEADERS & 31u), true, texture_uv(5u, in.uv)); }
    return first;
}

// Depth of the four lanes and which of them pass the alpha test, for the in-order replay;
// `index` is that of the quad's record in group 0.
fn record_depth(lane: Lane, index: u32, passes: bool, depth: f32) {
    let dx = dpdx(depth);
    let dy = dpdy(depth);
    let cross = dpdx(dy);
    let passing = quad_mask(lane, passes);
    if index < view.counts.y {
        let right = f32(lane.index & 1u);
        let down = f32(lane.index >> 1u);
        let dx_top = dx - down * cross;
        let dy_left = dy - right * cross;
        let top_left = depth - right * dx_top - down * dy_left - right * down * cross;
        let top = vec2(top_left, top_left + dx_top);
        let bottom = top + vec2(dy_left, dy_left + cross);
        let word = index * DEPTH_WORDS;
        depths[word] = bitcast<u32>(top.x);
        depths[word + 1u] = bitcast<u32>(top.y);
        depths[word + 2u] = bitcast<u32>(bottom.x);
        depths[word + 3u] = bitcast<u32>(bottom.y);
        depths[word + 4u] = passing;
    }
}

// ---- Shading ------------------------------------------------------------------------------

fn texture_uv(slot: u32, uv: vec4<f32>) -> vec2<f32> {
    let row0 = material.uv_rows[2u * slot];
    let row1 = material.uv_rows[2u * slot + 1u];
    let chosen = select(uv.xy, uv.zw, row0.w > 0.5);
    return vec2(dot(row0.xyz, vec3(chosen, 1.0)), dot(row1.xyz, vec3(chosen, 1.0)));
}

fn base_color(in: Fragment) -> vec4<f32> {
    var color = material.base_color;
    if (TEXTURES & (1u << BASE_COLOR)) != 0u {
        var texel = textureSample(base_color_texture, base_color_sampler, texture_uv(BASE_COLOR, in.uv));
        if MASKED { texel = vec4(texel.rgb / max(texel.a, 0.02), texel.a); }
        color *= texel;
    }
    return color;
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
    return v * inverseSqrt(max(dot(v, v), 1e-12));
}

// Shadow uv and depth of a world position in one cascade.
fn shadow_coordinates(cascade: u32, world: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    // Pushing the receiver off its surface by a little more than a texel hides the stairs that
    // the map's resolution leaves on slanted surfaces.
    let offset = normal * (1.6 * view.shadow_texel_m[cascade]);
    return (view.cascades[cascade] * vec4(world + offset, 1.0)).xyz;
}

// A margin of two texels keeps every tap inside the map.
fn in_cascade(p: vec3<f32>) -> bool {
    let margin = 2.0 / 2048.0;
    return all(p.xy > vec2(margin)) && all(p.xy < vec2(1.0 - margin)) && p.z < 1.0;
}

struct ShadowLookup {
    coordinates: vec3<f32>,
    cascade: i32,
}

// The finest cascade that holds the position. Which one does not depend on the eye.
fn find_cascade(world: vec3<f32>, normal: vec3<f32>) -> ShadowLookup {
    var found: ShadowLookup;
    found.cascade = -1;
    for (var k = 0u; k < CASCADES; k++) {
        let p = shadow_coordinates(k, world, normal);
        if found.cascade < 0 && in_cascade(p) {
            found.coordinates = p;
            found.cascade = i32(k);
        }
    }
    return found;
}

fn record_shadow(lane: Lane, found: ShadowLookup, world: vec3<f32>, normal: vec3<f32>) {
    let first = countOneBits(LEADERS);
    // Almost every subgroup lies in one cascade: visit those between its nearest and farthest.
    // The bounds are the same for all its lanes, so that control flow stays uniform.
    let nearest = subgroupMin(select(found.cascade, 99, found.cascade < 0));
    let farthest = subgroupMax(found.cascade);
    for (var k = nearest; k <= farthest; k++) {
        let p = shadow_coordinates(u32(k), world, normal);
        _ = record_uv(lane, first + u32(k), found.cascade == k, p.xy);
    }
    // Lanes outside every cascade sample nothing; without a texture they still count.
    if LEADERS == 0u {
        let alone = found.cascade < 0;
        let mask = quad_mask(lane, alone);
        if alone && firstTrailingBit(mask) == lane.index {
            _ = append(lane, mask, NO_GROUP, vec4(0.0), vec4(0.0));
        }
    }
}

fn sunlit(found: ShadowLookup) -> f32 {
    if found.cascade < 0 {
        return 1.0;
    }
    let uv = found.coordinates.xy;
    let depth = found.coordinates.z;
    let taps = vec4(
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, vec2(-1, -1)),
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, vec2(1, -1)),
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, vec2(-1, 1)),
        textureSampleCompareLevel(shadow_map, shadow_sampler, uv, found.cascade, depth, vec2(1, 1)),
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
    return mix(view.ground.rgb, view.sky.rgb, 0.5 + 0.5 * direction.y);
}

// Radiance from a direction, as scene::light::Sky has it.
fn background(direction: vec3<f32>) -> vec3<f32> {
    let zenith = view.sky.rgb * vec3(0.75, 0.85, 1.0);
    let sky = mix(view.sky.rgb, zenith, clamp(direction.y, 0.0, 1.0));
    return mix(view.ground.rgb, sky, smoothstep(-0.1, 0.02, direction.y));
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
    s.to_eye = safe_normalize(view.eye.xyz - in.world);

    light += reflect_light(s, view.to_sun.xyz) * view.sun.rgb * sunlit(found);
    for (var k = 0u; k < view.counts.x; k++) {
        let to_light = view.points[k].position.xyz - in.world;
        let falloff = 1.0 / max(dot(to_light, to_light), 0.01);
        light += reflect_light(s, safe_normalize(to_light)) * view.points[k].intensity.rgb * falloff;
    }
    let mirror = reflect(-s.to_eye, normal);
    let gloss = (1.0 - roughness) * (1.0 - roughness);
    let mirrored = mix(ambient(mirror), background(mirror), gloss);
    light += (s.albedo * ambient(normal) + s.f0 * mirrored) * occlusion;
    return vec4(tone_map(light), select(1.0, base.a, BLENDED));
}

// Everything that a fragment of an opaque or blended draw does.
fn capture_and_shade(in: Fragment, front: bool, primitive: u32, invocation: u32) -> vec4<f32> {
    let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
    let found = find_cascade(in.world, geometric);
    if CAPTURE {
        let lane = lane_of(in, primitive, invocation);
        _ = record_material(lane, in);
        if CASCADES > 0u { record_shadow(lane, found, in.world, geometric); }
    }
    return shade(in, front, base_color(in), found);
}

@fragment @early_depth_test(force)
fn fragment_early(
    in: Fragment,
    @builtin(front_facing) front: bool,
    @builtin(primitive_index) primitive: u32,
    @builtin(subgroup_invocation_id) invocation: u32,
) -> @location(0) vec4<f32> {
    return capture_and_shade(in, front, primitive, invocation);
}

// Colour of an alpha-masked draw: depth is tested and written after the discard.
@fragment
fn fragment_masked(in: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let base = base_color(in);
    let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
    let found = find_cascade(in.world, geometric);
    let color = shade(in, front, base, found);
    if base.a < material.specular.w { discard; }
    return color;
}

// Records of an alpha-masked draw. Forced early depth with a discard would write the depth of
// discarded fragments, so a draw of its own records them and writes neither colour nor depth.
@fragment @early_depth_test(force)
fn fragment_masked_record(
    in: Fragment,
    @builtin(front_facing) front: bool,
    @builtin(primitive_index) primitive: u32,
    @builtin(subgroup_invocation_id) invocation: u32,
) -> @location(0) vec4<f32> {
    let lane = lane_of(in, primitive, invocation);
    let index = record_material(lane, in);
    if CASCADES > 0u {
        let geometric = select(-1.0, 1.0, front) * safe_normalize(in.normal);
        record_shadow(lane, find_cascade(in.world, geometric), in.world, geometric);
    }
    record_depth(lane, index, base_color(in).a >= material.specular.w, in.position.z);
    return vec4(0.0);
}

// ---- Background and shadow maps -----------------------------------------------------------

struct Background {
    @builtin(position) position: vec4<f32>,
    @location(0) direction: vec3<f32>,
}

// One triangle over the view at the far plane; it also clears the region's depth.
@vertex
fn vertex_background(@builtin(vertex_index) index: u32) -> Background {
    let ndc = vec2(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    let far = view.world_from_clip * vec4(ndc, 1.0, 1.0);
    var out: Background;
    out.position = vec4(ndc, 1.0, 1.0);
    out.direction = far.xyz / far.w - view.eye.xyz;
    return out;
}

@fragment
fn fragment_background(in: Background) -> @location(0) vec4<f32> {
    let direction = safe_normalize(in.direction);
    return vec4(tone_map(background(direction)), 1.0);
}

// Fragments per pixel by additive blending (a check of the records).
@fragment @early_depth_test(force)
fn fragment_count() -> @location(0) vec4<f32> {
    return vec4(1.0);
}

// Alpha-masked casters.
@fragment
fn fragment_shadow(in: Fragment) {
    if base_color(in).a < material.specular.w { discard; }
}
