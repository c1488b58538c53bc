// What layers hold before their draws, where that is not the sky: see techniques::start.

struct Start {
    // Pixels of this layer to pixels of the nearer layers, or of the farther one in the first.
    // Reuse: the first column has a and b of this layer's depth, b / w - a at distance w, and of the other eye's.
    maps: array<mat4x4<f32>, 2>,
    // Clip space of the farther layer to this one's.
    from_farther_clip: mat4x4<f32>,
    // x, y: depth of the nearer layers' pixels without a draw; z: pixels to look at on each side.
    // Reuse: x is the depth of the nearest surfaces to look for, w the largest contrast.
    ends: vec4<f32>,
}

@group(0) @binding(0) var<uniform> start: Start;
@group(0) @binding(1) var nearer_depth: texture_depth_2d;
@group(0) @binding(2) var other_depth: texture_depth_2d;
@group(0) @binding(3) var nearer: texture_2d<f32>;
@group(0) @binding(4) var farther: texture_2d<f32>;
@group(0) @binding(5) var farther_depth: texture_depth_2d;

struct Pixel {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

// One triangle over the whole target.
@vertex
fn vertex_whole(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let ndc = vec2(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return vec4(ndc, 0.0, 1.0);
}

// Nothing, and nothing from a depth on.
@fragment
fn fragment_nearer() -> Pixel {
    return Pixel(vec4(0.0, 0.0, 0.0, 1.0), start.ends.x);
}

// Whether a nearer layer has a pixel without a draw around the place of a pixel of this layer.
fn is_open(eye: u32, position: vec4<f32>) -> bool {
    let place = start.maps[eye] * vec4(position.xy, 1.0, 0.0);
    // Behind the eye.
    if place.z <= 0.0 { return false; }
    let center = vec2<i32>(floor(place.xy / place.z));
    let reach = i32(start.ends.z);
    var size = vec2<i32>(textureDimensions(nearer_depth));
    if eye == 1u { size = vec2<i32>(textureDimensions(other_depth)); }
    let first = max(center - reach, vec2(0));
    let last = min(center + reach, size - 1);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            if eye == 0u {
                if textureLoad(nearer_depth, vec2(x, y), 0) <= start.ends.x { return true; }
            } else {
                if textureLoad(other_depth, vec2(x, y), 0) <= start.ends.y { return true; }
            }
        }
    }
    return false;
}

// The nearest depth where nearer layers cover everything: no draw passes its test there.
@fragment
fn fragment_behind(@builtin(position) position: vec4<f32>) -> Pixel {
    if is_open(0u, position) || is_open(1u, position) { discard; }
    return Pixel(vec4(0.0, 0.0, 0.0, 1.0), 1.0);
}

// The nearer layer, and the farther one behind it: linear between the four nearest pixels, in linear light.
@fragment
fn fragment_composed(@builtin(position) position: vec4<f32>) -> Pixel {
    let pixel = vec2<i32>(position.xy);
    let depth = textureLoad(nearer_depth, pixel, 0);
    if depth > start.ends.x {
        return Pixel(textureLoad(nearer, pixel, 0), depth);
    }
    let place = start.maps[0] * vec4(position.xy, 1.0, 0.0);
    let at = place.xy / place.z - 0.5;
    let size = vec2<i32>(textureDimensions(farther));
    // On a pixel's centre but for rounding, that pixel alone counts.
    let low = floor(at + 1.0 / 256.0);
    let t = select(vec2(0.0), at - low, at - low > vec2(1.0 / 256.0));
    let a = clamp(vec2<i32>(low), vec2(0), size - 1);
    let b = clamp(vec2<i32>(low) + 1, vec2(0), size - 1);
    var color = textureLoad(farther, a, 0);
    if any(t > vec2(0.0)) {
        let top = mix(color, textureLoad(farther, vec2(b.x, a.y), 0), t.x);
        let bottom = mix(textureLoad(farther, vec2(a.x, b.y), 0), textureLoad(farther, b, 0), t.x);
        color = mix(top, bottom, t.y);
    }
    let nearest = clamp(vec2<i32>(floor(at + 0.5)), vec2(0), size - 1);
    let behind = textureLoad(farther_depth, nearest, 0);
    let uv = (vec2<f32>(nearest) + 0.5) / vec2<f32>(size);
    let clip = start.from_farther_clip * vec4(uv * vec2(2.0, -2.0) + vec2(-1.0, 1.0), behind, 1.0);
    return Pixel(color, clamp(clip.z / clip.w, 0.0, start.ends.x));
}

// Reuse: what the other eye shows, see techniques::shading_reuse.

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
    let clip = start.from_farther_clip * vec4(ndc, depth, 1.0);
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
    let path = other_place(ndc, start.ends.x, extent).xy - other_place(ndc, 0.0, extent).xy;
    let steps = clamp(i32(ceil(length(path))), 1, REUSE_STEPS);

    // From near to far: the first point behind what the other eye shows, after one in front of it.
    var before = -1.0;
    var behind = -1.0;
    for (var i = 0; i <= steps; i++) {
        let depth = start.ends.x * (1.0 - f32(i) / f32(steps));
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
    let step = start.ends.x / f32(steps);
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
    let constants = start.maps[0][0];
    let distances = constants.w / (shown + constants.z);
    let nearest = min(min(distances.x, distances.y), min(distances.z, distances.w));
    let farthest = max(max(distances.x, distances.y), max(distances.z, distances.w));
    let own = constants.w / (place.z + constants.z);
    let met = constants.w / (mixed(at, shown) + constants.z);
    if farthest > nearest * (1.0 + SAME_SURFACE) { discard; }
    if abs(own - met) > MET * met { discard; }

    let a = textureLoad(nearer, at.first, 0);
    let b = textureLoad(nearer, vec2(at.last.x, at.first.y), 0);
    let c = textureLoad(nearer, vec2(at.first.x, at.last.y), 0);
    let d = textureLoad(nearer, at.last, 0);
    let low = min(min(a, b), min(c, d)).rgb;
    let high = max(max(a, b), max(c, d)).rgb;
    if any(sqrt(high) - sqrt(low) > vec3(start.ends.w)) { discard; }

    let distance = constants.y / (depth + constants.x);
    // Linear in linear light. A cubic through four pixels has a larger FLIP, because its overshoots at edges are seen.
    let color = mix(mix(a, b, at.t.x), mix(c, d, at.t.x), at.t.y);
    return Pixel(color, clamp(constants.y / (distance * (1.0 - NEARER)) - constants.x, 0.0, 1.0));
}
