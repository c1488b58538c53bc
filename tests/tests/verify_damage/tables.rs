//! Damages of the tables.

use super::damages::{Damage, by_tenths, damage, of_tables};
use formats::textrace::{ChosenTechniques, PassKind, Tables, UvGroup};
use formats::texture::{ColorSpace, Filter, MipFilter, Sampler, TexelFormat, Texture, Wrap};
use formats::view::Eye;

fn shadow_maps(tables: &mut Tables) -> &mut Texture {
    tables.textures.last_mut().expect("shadow maps")
}

pub fn of_textures() -> Vec<Damage> {
    vec![
        of_tables("texture: name", "the next one's", |t| {
            t.textures[0].name = t.textures[1].name.clone();
        }),
        of_tables("texture: width", "+ 1 texel", |t| {
            t.textures[0].size[0] += 1
        }),
        of_tables("texture: height", "+ 1 texel", |t| {
            t.textures[0].size[1] += 1
        }),
        of_tables("texture: mip levels", "- 1", |t| t.textures[0].levels -= 1),
        of_tables("texture: layers", "+ 1", |t| t.textures[0].layers += 1),
        of_tables("texture of the shadow maps: layers", "+ 1", |t| {
            shadow_maps(t).layers += 1;
        }),
        of_tables("texture: format", "BC3 for BC1", |t| {
            t.textures[0].format = TexelFormat::Bc3;
        }),
        of_tables("texture: colour space", "linear for sRGB", |t| {
            t.textures[0].color_space = ColorSpace::Linear;
        }),
        of_tables("texture table", "one more", |t| {
            let next = t.textures[0].clone();
            t.textures.push(next);
        }),
        of_tables("texture table", "two exchanged", |t| t.textures.swap(0, 1)),
        of_tables("texture of the shadow maps: name", "another", |t| {
            shadow_maps(t).name += "?";
        }),
        of_tables("texture of the shadow maps: width", "1024", |t| {
            shadow_maps(t).size[0] = 1024;
        }),
        of_tables("texture of the shadow maps: height", "1024", |t| {
            shadow_maps(t).size[1] = 1024;
        }),
        of_tables("texture of the shadow maps: mip levels", "2", |t| {
            shadow_maps(t).levels = 2;
        }),
        of_tables("texture of the shadow maps: format", "RGBA8", |t| {
            shadow_maps(t).format = TexelFormat::Rgba8;
        }),
    ]
}

pub fn of_samplers() -> Vec<Damage> {
    vec![
        of_tables("sampler: wrap in u", "clamp for repeat", |t| {
            t.samplers[0].wrap[0] = Wrap::ClampToEdge;
        }),
        of_tables("sampler: wrap in v", "mirrored for repeat", |t| {
            t.samplers[0].wrap[1] = Wrap::MirroredRepeat;
        }),
        of_tables("sampler: magnification", "nearest for linear", |t| {
            t.samplers[0].mag = Filter::Nearest;
        }),
        of_tables("sampler: minification", "nearest for linear", |t| {
            t.samplers[0].min = Filter::Nearest;
        }),
        of_tables("sampler: mip filter", "nearest for linear", |t| {
            t.samplers[0].mip = MipFilter::Nearest;
        }),
        of_tables(
            "sampler of the shadow maps: wrap",
            "repeat for clamp",
            |t| {
                of_shadows(t).wrap = [Wrap::Repeat; 2];
            },
        ),
        of_tables(
            "sampler of the shadow maps: minification",
            "the other",
            |t| {
                let sampler = of_shadows(t);
                sampler.min = match sampler.min {
                    Filter::Linear => Filter::Nearest,
                    Filter::Nearest => Filter::Linear,
                };
            },
        ),
        of_tables("sampler table", "one more", |t| {
            t.samplers.push(t.samplers[0])
        }),
        of_tables("sampler table", "two exchanged", |t| t.samplers.swap(0, 1)),
    ]
}

fn of_shadows(tables: &mut Tables) -> &mut Sampler {
    let mut samplers = tables.samplers.iter_mut();
    let found = samplers.find(|sampler| **sampler == Sampler::SHADOW);
    found.expect("a sampler of shadow maps")
}

/// The first group of the cascades of a draw with a texture.
fn cascade(tables: &mut Tables) -> &mut UvGroup {
    let groups = &mut textured(tables).groups;
    let first = groups.len() - 4;
    &mut groups[first]
}

/// A draw with a texture.
fn textured(tables: &mut Tables) -> &mut formats::textrace::Draw {
    let draw = tables.draws.iter_mut().find(|draw| draw.groups.len() > 4);
    draw.expect("a draw with a texture")
}

pub fn of_draws() -> Vec<Damage> {
    vec![
        of_tables("draw: material", "another name", |t| {
            t.draws[0].material += "?"
        }),
        damage("draw table", "one more", |t| {
            let mut next = t.tables.draws.last().expect("a draw").clone();
            next.first_primitive += next.primitives;
            t.tables.draws.push(next);
            let meshes = &mut t.geometry.draw_meshes;
            meshes.push(*meshes.last().expect("a mesh"));
        }),
        of_tables("uv group: extent in u", "+ 1", |t| {
            textured(t).groups[0].extent[0] += 1
        }),
        of_tables("uv group: extent in v", "+ 1", |t| {
            textured(t).groups[0].extent[1] += 1
        }),
        of_tables("uv group: samples", "one more", |t| {
            let group = &mut textured(t).groups[0];
            let next = group.samples[0];
            group.samples.push(next);
        }),
        of_tables("sample: texture", "the next one", |t| {
            textured(t).groups[0].samples[0].texture += 1;
        }),
        of_tables("sample: sampler", "the next one", |t| {
            textured(t).groups[0].samples[0].sampler += 1;
        }),
        of_tables("uv group: samples", "one less", |t| {
            textured(t).groups[0].samples.pop();
        }),
        of_tables("draw: uv groups", "one more", |t| {
            let groups = &mut t.draws.last_mut().expect("a draw").groups;
            groups.push(groups[0].clone());
        }),
        of_tables("sample of a shadow map: layer", "the next one", |t| {
            cascade(t).samples[0].layer += 1;
        }),
        of_tables("sample of a shadow map: offset in u", "+ 1", |t| {
            cascade(t).samples[0].offset[0] += 1;
        }),
        of_tables("sample of a shadow map: offset in v", "+ 1", |t| {
            cascade(t).samples[3].offset[1] += 1;
        }),
        of_tables("sample of a shadow map: texture", "the one before", |t| {
            let sample = &mut cascade(t).samples[1];
            (sample.texture, sample.layer) = (sample.texture - 1, 0);
        }),
        of_tables("sample of a shadow map: sampler", "another", |t| {
            let sample = &mut cascade(t).samples[2];
            sample.sampler = u16::from(sample.sampler == 0);
        }),
        of_tables("uv group of a cascade: samples", "one less", |t| {
            cascade(t).samples.pop();
        }),
        of_tables("uv group of a cascade: extent in u", "1024", |t| {
            cascade(t).extent[0] = 1024;
        }),
        of_tables("uv group of a cascade: extent in v", "1024", |t| {
            cascade(t).extent[1] = 1024;
        }),
        of_tables("sample: offset in u", "+ 1", |t| {
            textured(t).groups[0].samples[0].offset[0] += 1;
        }),
        of_tables("sample: offset in v", "+ 1", |t| {
            textured(t).groups[0].samples[0].offset[1] += 1;
        }),
    ]
}

pub fn of_description() -> Vec<Damage> {
    let rows = |field: &str, what: &str, change: fn(&mut Tables)| of_tables(field, what, change);
    vec![
        rows("META: scene_triangles", "+ 1", |t| {
            t.meta.scene_triangles += 1
        }),
        rows("META: seed", "+ 1", |t| t.meta.seed += 1),
        by_tenths("META: origin_m, x", " m", |t, by| {
            t.meta.origin_m[0] += f64::from(by)
        }),
        by_tenths("META: origin_m, y", " m", |t, by| {
            t.meta.origin_m[1] += f64::from(by)
        }),
        by_tenths("META: origin_m, z", " m", |t, by| {
            t.meta.origin_m[2] += f64::from(by)
        }),
        by_tenths("META: hmd.fov, left", "", |t, by| {
            t.meta.hmd.fov[0].left += by
        }),
        by_tenths("META: hmd.fov, right", "", |t, by| {
            t.meta.hmd.fov[1].right += by
        }),
        by_tenths("META: hmd.fov, up", "", |t, by| t.meta.hmd.fov[0].up += by),
        by_tenths("META: hmd.fov, down", "", |t, by| {
            t.meta.hmd.fov[1].down += by
        }),
        by_tenths("META: hmd.ipd_m", " m", |t, by| t.meta.hmd.ipd_m += by),
        by_tenths("META: hmd.cant_deg", " degrees", |t, by| {
            t.meta.hmd.cant_deg += by;
        }),
        by_tenths("META: world_to_eye", " in one element", |t, by| {
            t.meta.frames[0].eyes[0].world_to_eye[0][0] += by;
        }),
        by_tenths(
            "META: world_to_eye",
            " m to the side, both eyes and positions",
            |t, by| {
                for eye in &mut t.meta.frames[0].eyes {
                    let side = [0, 1, 2].map(|axis| eye.world_to_eye[axis][0]);
                    eye.world_to_eye[3][0] -= by;
                    for (at, side) in eye.position.iter_mut().zip(side) {
                        *at += by * side;
                    }
                }
            },
        ),
        by_tenths("META: eye_to_clip", " in one element", |t, by| {
            t.meta.frames[0].eyes[1].eye_to_clip[1][1] += by;
        }),
        by_tenths("META: position, x", " m", |t, by| {
            t.meta.frames[0].eyes[1].position[0] += by;
        }),
        by_tenths("META: position, y", " m", |t, by| {
            t.meta.frames[0].eyes[0].position[1] += by;
        }),
        by_tenths("META: position, z", " m", |t, by| {
            t.meta.frames[0].eyes[0].position[2] += by;
        }),
        by_tenths("META: world_to_eye, translation", " m", |t, by| {
            t.meta.frames[0].eyes[1].world_to_eye[3][2] += by;
        }),
        by_tenths("META: eye_to_clip, centre", "", |t, by| {
            t.meta.frames[0].eyes[0].eye_to_clip[2][0] += by;
        }),
        by_tenths("META: eye_to_clip, depth of one eye", "", |t, by| {
            t.meta.frames[0].eyes[0].eye_to_clip[3][2] += by;
        }),
        rows("META: eye_to_clip", "eyes exchanged", |t| {
            t.meta.frames[0].eyes.swap(0, 1);
        }),
        rows("META: eye_to_clip, depth", "another near plane", |t| {
            for eye in &mut t.meta.frames[0].eyes {
                eye.eye_to_clip[3][2] *= 2.0;
            }
        }),
        rows("META: techniques", "one for none", |t| {
            t.meta.techniques = Some(ChosenTechniques {
                frames: vec!["baseline".into()],
                schedule: "baseline".into(),
                choice: None,
            });
        }),
        rows("META: surfaces.depth_tested", "false for true", |t| {
            t.meta.surfaces.as_mut().expect("surfaces").depth_tested = false;
        }),
        rows("META: surfaces.not_opaque", "draw 0 as well", |t| {
            let surfaces = t.meta.surfaces.as_mut().expect("surfaces");
            match surfaces.not_opaque.first_mut() {
                Some([0, count]) => *count -= 1,
                _ => surfaces.not_opaque.insert(0, [0, 1]),
            }
        }),
        rows("META: surfaces.not_opaque", "none", |t| {
            let surfaces = t.meta.surfaces.as_mut().expect("surfaces");
            match surfaces.not_opaque.is_empty() {
                true => surfaces.not_opaque.push([5, 1]),
                false => surfaces.not_opaque.clear(),
            }
        }),
        rows("pass: eye", "both left", |t| {
            t.passes[1].eye = Some(Eye::Left)
        }),
        rows("pass: eye", "the right one's none", |t| {
            t.passes[1].eye = None
        }),
        rows("pass: kind", "shadow map", |t| {
            t.passes[1].kind = PassKind::Shadow
        }),
        rows("pass: kind", "layer", |t| {
            t.passes[1].kind = PassKind::Layer;
        }),
        rows("pass: eye", "exchanged", |t| {
            let [left, right] = &mut t.passes[..] else {
                panic!("two passes");
            };
            std::mem::swap(&mut left.eye, &mut right.eye);
        }),
    ]
}
