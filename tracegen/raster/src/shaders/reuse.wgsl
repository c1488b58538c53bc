// What a layer takes from the other eye's layer before its draws: see techniques::shading_reuse. It follows starts.wgsl,
// whose textures nearer_depth and nearer are the other eye's.

struct Reuse {
    // Clip space of this layer to the other one's.
    other_from_clip: mat4x4<f32>,
    // Depth is b / w - a at distance w. x, y: a and b of this layer; z, w: of the other one.
    depth_of: vec4<f32>,
    // Depth of the nearest surfaces to look for.
    nearest: f32,
    // Largest contrast.
    contrast: f32,
}

@group(0) @binding(0) var<uniform> reuse: Reuse;

// Most steps along a ray. Longer paths take longer steps, which may miss thin surfaces; those are drawn.
const REUSE_STEPS = 64;
// Halvings of the last step: to 1/256 pixel of steps of one pixel.
const REUSE_HALVINGS = 10;
// Pixels belong to one surface if their distances differ by less than this share.
const SAME_SURFACE = 0.02;
// Largest distance between ray and surface where they meet, as a share of the distance from the eye.
const MET = 0.001;
// Share of the distance by which the initial depth is nearer than the surface, so that the surface itself is not drawn.
const NEARER = 0.01;
// Texels with less weight do not count.
const LEAST_WEIGHT = 0.00390625;

// The point of this pixel's ray at a depth, in the other eye: pixels, depth, and 1 if it is in the picture.
fn other_place(ndc: vec2<f32>, depth: f32, size: vec2<f32>) -> vec4<f32> {
    let clip = reuse.other_from_clip * vec4(ndc, depth, 1.0);
    if clip.w <= 0.0 { return vec4(0.0); }
    let px = (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * size;
    let inside = all(px >= vec2(0.0)) && all(px < size);
    return vec4(px, clip.z / clip.w, select(0.0, 1.0, inside));
}

// The four texels around a place, and the weights of their second column and row.
struct Around {
    first: vec2<i32>,
    last: vec2<i32>,
    t: vec2<f32>,
}

fn around(px: vec2<f32>, size: vec2<i32>) -> Around {
    let at = px - 0.5;
    let low = floor(at + LEAST_WEIGHT);
    let t = select(vec2(0.0), at - low, at - low > vec2(LEAST_WEIGHT));
    let a = clamp(vec2<i32>(low), vec2(0), size - 1);
    let b = clamp(vec2<i32>(low) + select(vec2(0), vec2(1), t > vec2(0.0)), vec2(0), size - 1);
    return Around(a, b, t);
}

fn depths_around(at: Around) -> vec4<f32> {
    return vec4(
        textureLoad(nearer_depth, at.first, 0),
        textureLoad(nearer_depth, vec2(at.last.x, at.first.y), 0),
        textureLoad(nearer_depth, vec2(at.first.x, at.last.y), 0),
        textureLoad(nearer_depth, at.last, 0),
    );
}

fn mixed(at: Around, v: vec4<f32>) -> f32 {
    return mix(mix(v.x, v.y, at.t.x), mix(v.z, v.w, at.t.x), at.t.y);
}

@fragment
fn fragment_reused(@builtin(position) position: vec4<f32>) -> Pixel {
    let size = vec2<i32>(textureDimensions(nearer_depth));
    let extent = vec2<f32>(size);
    // Both eyes' layers have the same size.
    let ndc = position.xy / extent * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    let path = other_place(ndc, reuse.nearest, extent).xy - other_place(ndc, 0.0, extent).xy;
    let steps = clamp(i32(ceil(length(path))), 1, REUSE_STEPS);

    // From near to far: the first point behind what the other eye shows, after one in front of it.
    var before = -1.0;
    var behind = -1.0;
    for (var i = 0; i <= steps; i++) {
        let depth = reuse.nearest * (1.0 - f32(i) / f32(steps));
        let place = other_place(ndc, depth, extent);
        if place.w == 0.0 { before = -1.0; continue; }
        let shown = textureLoad(nearer_depth, vec2<i32>(place.xy), 0);
        if shown < place.z {
            before = depth;
        } else {
            behind = depth;
            break;
        }
    }
    if before < 0.0 || behind < 0.0 { discard; }
    // Between pixels' centres, the interpolated surface may be crossed a step earlier or later.
    let step = reuse.nearest / f32(steps);
    before += step;
    behind = max(behind - step, 0.0);
    for (var i = 0; i < REUSE_HALVINGS; i++) {
        let middle = 0.5 * (before + behind);
        let place = other_place(ndc, middle, extent);
        let at = around(place.xy, size);
        if mixed(at, depths_around(at)) < place.z { before = middle; } else { behind = middle; }
    }

    let depth = 0.5 * (before + behind);
    let place = other_place(ndc, depth, extent);
    let at = around(place.xy, size);
    let shown = depths_around(at);
    // Nothing was drawn (0), or the mask forbids it (1).
    if place.w == 0.0 || any(shown <= vec4(0.0)) || any(shown >= vec4(1.0)) { discard; }
    let distances = reuse.depth_of.w / (shown + reuse.depth_of.z);
    let nearest = min(min(distances.x, distances.y), min(distances.z, distances.w));
    let farthest = max(max(distances.x, distances.y), max(distances.z, distances.w));
    let own = reuse.depth_of.w / (place.z + reuse.depth_of.z);
    let met = reuse.depth_of.w / (mixed(at, shown) + reuse.depth_of.z);
    if farthest > nearest * (1.0 + SAME_SURFACE) { discard; }
    if abs(own - met) > MET * met { discard; }

    let a = textureLoad(nearer, at.first, 0);
    let b = textureLoad(nearer, vec2(at.last.x, at.first.y), 0);
    let c = textureLoad(nearer, vec2(at.first.x, at.last.y), 0);
    let d = textureLoad(nearer, at.last, 0);
    let low = min(min(a, b), min(c, d)).rgb;
    let high = max(max(a, b), max(c, d)).rgb;
    if any(sqrt(high) - sqrt(low) > vec3(reuse.contrast)) { discard; }

    let distance = reuse.depth_of.y / (depth + reuse.depth_of.x);
    // Linear in linear light. A cubic through four pixels has a larger FLIP, because its overshoots at edges are seen.
    let color = mix(mix(a, b, at.t.x), mix(c, d, at.t.x), at.t.y);
    return Pixel(color, clamp(reuse.depth_of.y / (distance * (1.0 - NEARER)) - reuse.depth_of.x, 0.0, 1.0));
}
