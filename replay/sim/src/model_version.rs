//! The versions of the models: which counts a replay of a given trace and configuration yields.

/// What changed with each version that both models share, version 1 first.
const HISTORY: &[&str] = &[
    // 1
    "The first numbered version.",
    // 2
    "Shadow maps lie in Morton order; anisotropic filtering takes its level from the unrounded ratio.",
    // 3
    "Ray tracing: traffic goes by lines and waiting by visits, whether misses come from rates or from addresses; curves go by addresses, too.",
    // 4
    "Ray tracing: with reuse of shadow outcomes, a re-tested pixel is shaded at its exact hit. Functional mode: each core has its own L2 if the L2 is not shared.",
    // 5
    "The same counts under other keys: miss rates name what they divide by.",
    // 6
    "Ray tracing: with reuse of colours, no secondary ray is traced where the reused material looks the same from everywhere.",
];

/// What changed since then in replays of texture traces. A change that alters any count adds a line.
///
/// Results of different model versions cannot be compared, so a sweep never takes a stored point of
/// another version. `tests/tests/golden.rs` refuses changed golden counts under an unchanged version.
const TEXTURE_HISTORY: &[&str] = &[];

/// The same of ray traces.
const RAY_HISTORY: &[&str] = &[];

/// The version of the texture models, recorded with every result and part of every point's key.
pub const MODEL_VERSION: u32 = (HISTORY.len() + TEXTURE_HISTORY.len()) as u32;

/// The version of the ray-tracing models, recorded with every result.
pub const RAY_MODEL_VERSION: u32 = (HISTORY.len() + RAY_HISTORY.len()) as u32;
