// What is done with whole layers: their masks before the draws, the pictures after them.

// 1 where the layer may be drawn.
@group(0) @binding(0) var mask: texture_2d<u32>;

struct Part {
    // Left and top edge of the layer in the picture.
    origin: vec2<i32>,
    // Columns and rows of the picture that a pixel of the layer covers.
    coarseness: vec2<i32>,
    // x: only some tiles are filled.
    some_tiles: vec4<u32>,
    // Pixels of the picture to those of the layer, where the part is projective.
    layer_from_px: mat3x3<f32>,
}

@group(1) @binding(0) var<uniform> part: Part;
@group(1) @binding(1) var layer: texture_2d<f32>;
// 1 where the part fills a tile of the picture.
@group(1) @binding(2) var tiles: texture_2d<u32>;

// Writes the nearest depth where nothing may be drawn: no draw passes its test there.
@fragment
fn fragment_mask(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    if textureLoad(mask, vec2<i32>(position.xy), 0).x != 0u { discard; }
    return vec4(0.0, 0.0, 0.0, 1.0);
}

// Pixel of the picture, or none of the part's.
fn pixel_of(position: vec4<f32>) -> vec2<i32> {
    let pixel = vec2<i32>(position.xy);
    if part.some_tiles.x != 0u && textureLoad(tiles, pixel / TILE_SIZE, 0).x == 0u { discard; }
    return pixel - part.origin;
}

@fragment
fn fragment_copy(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return textureLoad(layer, pixel_of(position), 0);
}

// Linear between the nearest four pixels; what is loaded and returned is linear light.
@fragment
fn fragment_bilinear(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = pixel_of(position);
    // In pixels of the layer, from the centre of its first one.
    return bilinear((vec2<f32>(pixel) + 0.5) / vec2<f32>(part.coarseness) - 0.5);
}

@fragment
fn fragment_projective(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = pixel_of(position);
    let at = part.layer_from_px * vec3(vec2<f32>(pixel) + 0.5, 1.0);
    return bilinear(at.xy / at.z - 0.5);
}

fn bilinear(at: vec2<f32>) -> vec4<f32> {
    let low = vec2<i32>(floor(at));
    let last = vec2<i32>(textureDimensions(layer)) - 1;
    let a = clamp(low, vec2(0), last);
    let b = clamp(low + 1, vec2(0), last);
    let t = at - floor(at);
    let top = mix(textureLoad(layer, a, 0), textureLoad(layer, vec2(b.x, a.y), 0), t.x);
    let bottom = mix(textureLoad(layer, vec2(a.x, b.y), 0), textureLoad(layer, b, 0), t.x);
    return mix(top, bottom, t.y);
}

fn is_there(at: vec2<i32>) -> bool {
    let inside = all(at >= vec2(0)) && all(at < vec2<i32>(textureDimensions(mask)));
    return inside && textureLoad(mask, max(at, vec2(0)), 0).x != 0u;
}

// The colour between two pixels, `t` of the way, times its weight, and the weight.
fn between(a: vec2<i32>, b: vec2<i32>, t: f32) -> array<vec4<f32>, 2> {
    let near = is_there(a);
    let far = is_there(b);
    let color_a = textureLoad(layer, max(a, vec2(0)), 0);
    let color_b = textureLoad(layer, max(b, vec2(0)), 0);
    if near && far { return array(mix(color_a, color_b, t), vec4(1.0)); }
    if near { return array(0.5 * color_a, vec4(0.5)); }
    if far { return array(0.5 * color_b, vec4(0.5)); }
    return array(vec4(0.0), vec4(0.0));
}

@fragment
fn fragment_fill(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = pixel_of(position);
    if is_there(pixel) { return textureLoad(layer, pixel, 0); }
    // Columns and rows to the last pixel before this one's quad: 1 or 2; to the next one after it: 2 or 1.
    let before = (pixel & vec2(1)) + 1;
    let after = 3 - before;
    let t = vec2<f32>(before) / 3.0;
    let row = between(pixel - vec2(before.x, 0), pixel + vec2(after.x, 0), t.x);
    let column = between(pixel - vec2(0, before.y), pixel + vec2(0, after.y), t.y);
    let weight = row[1] + column[1];
    return vec4((row[0] + column[0]).rgb / max(weight.rgb, vec3(0.5)), 1.0);
}
