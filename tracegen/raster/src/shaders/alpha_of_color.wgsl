// Alpha tests sample the base colour itself.

fn texel_alpha(uv: vec2<f32>) -> f32 {
    return textureSample(base_color_texture, base_color_sampler, uv).a;
}
