// What the host hands to the shader, and the vertex stage. Overrides choose what a pipeline keeps;
// the colour is the same with and without CAPTURE, bit for bit. Constants that the host uses as
// well stand before this text: see shader.rs.

// Append a record per covered quad and uv group.
override CAPTURE: bool = false;
// Bit per texture of the material, by slot.
override TEXTURES: u32 = 0u;
// Bit per texture that is the first of its uv group.
override LEADERS: u32 = 0u;
// Shadow cascades, 0 to 4.
override CASCADES: u32 = 0u;
// Alpha reaches the target (blended materials).
override BLENDED: bool = false;
// The base colour texture has BC1's one-bit alpha, whose transparent texels are black.
override MASKED: bool = false;
// Vertices have colours, which multiply the base colour.
override COLORED: bool = false;

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
    cascades: array<mat4x4<f32>, MAX_CASCADES>,
    points: array<PointLight, MAX_POINT_LIGHTS>,
    // x: point lights, y: records that the buffer holds, z: slot of the texture that is checked.
    counts: vec4<u32>,
    // What the lens shows: xy: centre, zw: inverse radii, pixels.
    lens: vec4<f32>,
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
    uv_rows: array<vec4<f32>, 2u * MATERIAL_TEXTURES>,
}

// The views that are drawn at once; `view_number` is that of the invocation (one_view.wgsl, two_views.wgsl).
@group(0) @binding(VIEW_BINDING) var<uniform> views: array<View, VIEW_COUNT>;
@group(0) @binding(INSTANCES_BINDING) var<storage, read> instances: array<Instance>;
@group(0) @binding(COUNTER_BINDING) var<storage, read_write> counter: atomic<u32>;
@group(0) @binding(RECORDS_BINDING) var<storage, read_write> records: array<vec4<u32>>;
// In place of the records where draws are marked.
@group(0) @binding(RECORDS_BINDING) var<storage, read_write> marks: array<u32>;
@group(0) @binding(SHADOW_MAP_BINDING) var shadow_map: texture_depth_2d_array;
@group(0) @binding(SHADOW_SAMPLER_BINDING) var shadow_sampler: sampler_comparison;
@group(0) @binding(DEPTHS_BINDING) var<storage, read_write> depths: array<vec4<f32>>;

@group(1) @binding(MATERIAL_BINDING) var<uniform> material: Material;

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) tangent: vec4<f32>,
    @location(3) uv: vec4<f32>,
    // One an instance.
    @location(4) draw: u32,
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
    // Vertex colour, read where COLORED.
    @location(5) color: vec4<f32>,
}

fn transform(in: Vertex, color: vec4<f32>) -> Fragment {
    let instance = instances[in.draw];
    let world = product(instance.world_from_object, vec4(in.position, 1.0));
    let n = instance.normal_from_object;
    var out: Fragment;
    out.position = placed(product(views[view_number].clip_from_world, world));
    out.world = world.xyz;
    out.normal = turned(n, in.normal);
    out.tangent = vec4(turned(instance.world_from_object, in.tangent.xyz), in.tangent.w);
    out.uv = in.uv;
    out.ids = bitcast<vec2<u32>>(n[3].xy);
    out.color = color;
    return out;
}
