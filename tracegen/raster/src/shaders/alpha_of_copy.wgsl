// Alpha tests sample a copy of the base colour's alpha: see lavapipe::alpha.

@group(1) @binding(ALPHA_BINDING) var alpha_texture: texture_2d<f32>;

fn texel_alpha(uv: vec2<f32>) -> f32 {
    return textureSample(alpha_texture, base_color_sampler, uv).r;
}
