// What layers hold before their draws, where that is not the sky: see techniques::start.

struct Start {
    // Pixels of this layer to pixels of the nearer layers, or of the farther one in the first.
    maps: array<mat4x4<f32>, 2>,
    // Clip space of the farther layer to this one's.
    from_farther_clip: mat4x4<f32>,
    // x, y: depth of the nearer layers' pixels without a draw; z: pixels to look at on each side.
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
