//! The objects, which differ in how their shaders sample.

/// An object: a box or the floor, and the body of its fragment shader.
pub struct Object {
    /// Name on the command line.
    pub name: &'static str,
    /// Body of a function from the fragment's inputs to a colour; see `shaders`.
    pub body: &'static str,
}

const fn object(name: &'static str, body: &'static str) -> Object {
    Object { name, body }
}

/// The body of a shader that reads a texture in one of several branches, as shaders of sprites do.
macro_rules! chain {
    ($($number:literal)*) => {
        concat!(
            "let chosen = u32(24.0 * fract(in.uv.x)); var color = vec4(0.0);",
            $(
                "if chosen == ", $number, "u { color = textureSampleLevel(flat, nearest, in.uv + ",
                $number, ".0 * 0.03125, 0.0); } else "
            ),*,
            "{ color = vec4(1.0); } return color;"
        )
    };
}

/// Objects that are rendered only if they are named.
pub const NAMED: &[Object] = &[object(
    "chain",
    chain!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23),
)];

/// Every object that is rendered by default.
pub const OBJECTS: &[Object] = &[
    object("plain", "return textureSample(flat, nearest, in.uv);"),
    object(
        // Two textures at the same coordinates; only the second one is visible.
        "pair",
        "let unseen = textureSample(other, nearest, in.uv);
        return textureSample(flat, nearest, in.uv) + unseen * 0.0;",
    ),
    object(
        "bias",
        "return textureSampleBias(flat, nearest, in.uv, 1.5);",
    ),
    object(
        "own-bias",
        "return textureSampleBias(flat, nearest, in.uv, 3.0 * fract(in.uv.x));",
    ),
    object(
        "level",
        "return textureSampleLevel(flat, nearest, in.uv, 2.0);",
    ),
    object(
        "own-level",
        "return textureSampleLevel(flat, nearest, in.uv, 4.0 * fract(in.uv.y));",
    ),
    object(
        "gradients",
        "return textureSampleGrad(flat, nearest, in.uv, vec2(0.05, 0.0), vec2(0.0, 0.01));",
    ),
    object(
        "array",
        "return textureSample(layered, nearest, in.uv, i32(4.0 * fract(in.uv.x * 0.5)));",
    ),
    object("cube", "return textureSample(sky, nearest, in.direction);"),
    object(
        "own-cube",
        "return textureSampleLevel(sky, nearest, in.direction, 3.0 * fract(in.uv.x));",
    ),
    object(
        "fetch",
        "let at = vec2<i32>(in.position.xy) % vec2<i32>(32);
        return textureLoad(flat, at, 1);",
    ),
    object(
        "discard",
        "let color = textureSample(flat, nearest, in.uv);
        if (i32(floor(8.0 * in.uv.x)) + i32(floor(8.0 * in.uv.y))) % 2 == 0 { discard; }
        return color;",
    ),
    object(
        // Only the last iteration is visible.
        "loop",
        "var color = vec4(0.0);
        for (var i = 0; i < 1 + i32(3.0 * fract(in.uv.x)); i++) {
            color = textureSampleLevel(flat, nearest, in.uv * (1.0 + f32(i)), f32(i));
        }
        return color;",
    ),
    object(
        "branch",
        "if fract(in.uv.x) < 0.5 { return textureSampleLevel(flat, nearest, in.uv, 0.0); }
        return vec4(0.0, 0.0, 0.0, 1.0);",
    ),
    object("gather", "return textureGather(0, flat, nearest, in.uv);"),
    object(
        "volume",
        "return textureSample(volume, nearest, fract(in.direction));",
    ),
    object("untextured", "return vec4(0.0, 0.0, 0.0, 1.0);"),
    object(
        "border",
        "return textureSample(flat, bordered, 2.0 * in.uv - 0.5);",
    ),
];
