//! The uv groups of a draw: the sites that share records, and their samples.

use crate::lanes::{Joins, LaneSample, lod, on_cube};
use formats::textrace::{LodRule, Sample, SampleLevel, UvGroup};
use spool::ShaderInfo;
use spool::{Access, Form, Lod, RawFragment, RawQuad, Shape, TextureSite, What};

/// A texture and a sampler of the trace that a site uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// Index of the texture.
    pub texture: u32,
    /// Index of the sampler.
    pub sampler: u16,
    /// Size of level 0 in texels.
    pub size: [u32; 2],
    /// Whether coordinates are in texels.
    pub unnormalized: bool,
    /// Whether the sampler is anisotropic.
    pub anisotropic: bool,
}

/// A uv group of a draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Element of the binding's array, if it varies between fragments.
    pub element: Option<u32>,
    /// Number among the draw's groups. The group with its operands has the number before it.
    pub number: u8,
    /// Whether records of operands precede its records.
    pub operands: bool,
    kind: TextureSite,
    /// Size of the first texture, which converts coordinates to texels.
    size: [u32; 2],
    unnormalized: bool,
    /// Whether replay derives the levels of detail of a cube map or of explicit gradients from the changes of the
    /// coordinates. A level alone does not say how long and narrow a pixel is.
    anisotropic: bool,
}

/// Reason why a site has no group.
pub type LeftOut = String;

impl Group {
    /// Builds the group for the sites of a coordinate group. `bound` returns the texture of a site.
    ///
    /// # Errors
    /// A property of a site that records of the group cannot represent.
    pub fn new(
        shader: &ShaderInfo,
        coordinates: u16,
        element: Option<u32>,
        mut bound: impl FnMut(&TextureSite) -> Result<Bound, LeftOut>,
    ) -> Result<(Self, Vec<UvGroup>), LeftOut> {
        let members = (shader.sites.iter()).filter(|site| site.group == coordinates);
        let mut group: Option<Self> = None;
        let mut samples = Vec::new();
        let mut extent = [1; 2];
        let mut reason = "a site without a texture".to_owned();
        for of in members {
            let What::Texture(texture) = &of.what else {
                continue;
            };
            let bound = match bound(texture) {
                Ok(bound) => bound,
                Err(why) => {
                    reason = why;
                    continue;
                }
            };
            let operands = needs_operands(texture, of.form);
            let of_group = group.get_or_insert(Self {
                element,
                number: u8::from(operands),
                operands,
                kind: texture.clone(),
                size: bound.size,
                unnormalized: bound.unnormalized,
                anisotropic: bound.anisotropic,
            });
            extent = [0, 1].map(|axis| extent[axis].max(bound.size[axis]));
            samples.push(Sample {
                texture: bound.texture,
                sampler: bound.sampler,
                layer: 0,
                offset: texture.offset,
                level: level(texture, of_group.operands, of_group.anisotropic),
            });
        }
        let group = group.ok_or(reason)?;
        let mut groups = Vec::with_capacity(2);
        if group.operands {
            groups.push(UvGroup {
                extent: [1, 1],
                samples: Vec::new(),
            });
        }
        groups.push(UvGroup { extent, samples });
        Ok((group, groups))
    }

    /// Converts the coordinates of a quad to those of a trace.
    pub fn quad(&self, raw: RawQuad) -> RawQuad {
        let Some((size, shift)) = self.texels(self.constant_level()) else {
            return raw;
        };
        let scaled = |v: [f32; 2]| [0, 1].map(|axis| v[axis] / size[axis] as f32);
        RawQuad {
            uv: scaled(raw.uv.map(|v| v + shift)),
            dx: scaled(raw.dx),
            dy: scaled(raw.dy),
            cross: scaled(raw.cross),
        }
    }

    /// Converts a record of a fragment to a lane's sample.
    pub fn fragment(&self, raw: &RawFragment) -> LaneSample {
        let own_lod = match self.kind.lod {
            Lod::Bias(None) | Lod::Explicit(None) => raw.lod,
            _ => 0.0,
        };
        if self.kind.shape == Shape::Cube {
            let (face, uv, slopes) = on_cube(raw);
            if self.anisotropic {
                return LaneSample {
                    uv,
                    lod: own_lod,
                    layer: face as f32,
                    slope: slopes,
                };
            }
            let derived = || lod(slopes, self.size);
            let lod = match self.kind.lod {
                Lod::Derivatives | Lod::Gradients => derived(),
                Lod::Bias(bias) => derived() + bias.unwrap_or(raw.lod),
                Lod::Explicit(_) => own_lod,
            };
            return LaneSample {
                uv,
                lod,
                layer: face as f32,
                slope: [[0.0; 2]; 2],
            };
        }
        let pair = |v: [f32; 3]| [v[0], v[1]];
        let level = match self.kind.lod {
            Lod::Explicit(None) => own_lod,
            _ => self.constant_level(),
        };
        let (mut uv, mut slope) = (pair(raw.at), [pair(raw.dx), pair(raw.dy)]);
        let gradient = match self.kind.lod {
            Lod::Gradients if !self.anisotropic => lod(slope, self.size),
            _ => own_lod,
        };
        if let Some((size, shift)) = self.texels(level) {
            let scaled = |v: [f32; 2]| [0, 1].map(|axis| v[axis] / size[axis] as f32);
            (uv, slope) = (scaled(uv.map(|v| v + shift)), slope.map(scaled));
        }
        if !matches!(self.kind.lod, Lod::Derivatives | Lod::Bias(_)) && self.joins() != Joins::None
        {
            // Explicit gradients are not differences to neighbouring lanes.
            slope = [[0.0; 2]; 2];
        }
        LaneSample {
            uv,
            lod: gradient,
            layer: match self.kind.shape {
                // Round to nearest, ties to even (Vulkan 1.3, "Integer Texel Coordinate Operations").
                Shape::Array => raw.at[2].round_ties_even().max(0.0),
                _ => 0.0,
            },
            slope,
        }
    }

    /// Which lanes share a record. On cube maps, the coordinates of lanes with different layers are on different
    /// faces. The gradients of a lane are the changes of its coordinates in a record of its own.
    pub fn joins(&self) -> Joins {
        match (self.kind.lod, self.kind.shape) {
            (Lod::Gradients, _) if self.anisotropic => Joins::None,
            (_, Shape::Cube) => Joins::Layer,
            _ => Joins::All,
        }
    }

    fn constant_level(&self) -> f32 {
        match self.kind.lod {
            Lod::Explicit(Some(level)) => level,
            _ => 0.0,
        }
    }

    /// Size of the level to which coordinates in texels refer, and the offset from a texel's coordinate to
    /// its centre; `None` for normalised coordinates.
    fn texels(&self, level: f32) -> Option<([u32; 2], f32)> {
        if self.kind.access == Access::Fetch {
            let level = level.clamp(0.0, 31.0) as u32;
            return Some((self.size.map(|size| (size >> level).max(1)), 0.5));
        }
        self.unnormalized.then_some((self.size, 0.0))
    }
}

/// Whether each fragment has its own level or layer.
fn needs_operands(texture: &TextureSite, form: Form) -> bool {
    let own_level = matches!(
        texture.lod,
        Lod::Bias(None) | Lod::Explicit(None) | Lod::Gradients
    );
    form == Form::Fragment && (own_level || texture.shape != Shape::Flat)
}

fn level(texture: &TextureSite, operands: bool, anisotropic: bool) -> SampleLevel {
    let fixed = |lod: f32| (256.0 * lod).round().clamp(-32768.0, 32767.0) as i16;
    let (rule, lod_256ths) = match (texture.shape, texture.lod) {
        // Derivatives are wrong where a quad crosses faces, so the level is an operand.
        (_, Lod::Gradients) if anisotropic => (LodRule::Derivatives, 0),
        (Shape::Cube, Lod::Explicit(Some(level))) => (LodRule::Explicit, fixed(level)),
        (Shape::Cube, _) if !anisotropic => (LodRule::Explicit, 0),
        (_, Lod::Derivatives) => (LodRule::Derivatives, 0),
        (_, Lod::Bias(bias)) => (LodRule::Bias, fixed(bias.unwrap_or(0.0))),
        (_, Lod::Explicit(level)) => (LodRule::Explicit, fixed(level.unwrap_or(0.0))),
        (_, Lod::Gradients) => (LodRule::Explicit, 0),
    };
    SampleLevel {
        rule,
        lod_256ths,
        operands,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spool::{Binding, DepthTests, Site};

    fn site(form: Form, group: u16, shape: Shape, access: Access, lod: Lod) -> Site {
        let binding = Binding {
            set: 0,
            binding: 0,
            element: Some(0),
        };
        Site {
            what: What::Texture(TextureSite {
                access,
                shape,
                image: binding,
                sampler: Some(binding),
                lod,
                offset: [1, 0],
            }),
            form,
            group,
            unconditional: true,
        }
    }

    fn made(sites: Vec<Site>) -> (Group, Vec<UvGroup>) {
        made_with(sites, false)
    }

    fn made_with(sites: Vec<Site>, anisotropic: bool) -> (Group, Vec<UvGroup>) {
        let shader = ShaderInfo {
            shader: 0,
            tests: DepthTests::Either,
            sites,
        };
        let mut sizes = [[64, 32], [16, 128]].into_iter();
        let bound = |_: &TextureSite| {
            let size = sizes.next().ok_or("no more".to_owned())?;
            Ok(Bound {
                texture: 5,
                sampler: 1,
                size,
                unnormalized: false,
                anisotropic,
            })
        };
        Group::new(&shader, 0, None, bound).unwrap()
    }

    #[test]
    fn sites_of_a_coordinate_group_share_the_uv_group_and_its_extent() {
        let flat = |group| {
            site(
                Form::Quad,
                group,
                Shape::Flat,
                Access::Sample,
                Lod::Derivatives,
            )
        };
        let (group, groups) = made(vec![flat(0), flat(0), flat(1)]);
        assert_eq!((group.number, group.operands), (0, false));
        let [of] = &groups[..] else {
            panic!("{groups:?}");
        };
        assert_eq!((of.extent, of.samples.len()), ([64, 128], 2));
        assert!(
            of.samples
                .iter()
                .all(|s| s.level.is_default() && s.offset == [1, 0])
        );
    }

    #[test]
    fn sites_with_a_level_or_layer_per_fragment_have_operands() {
        let array = site(
            Form::Fragment,
            0,
            Shape::Array,
            Access::Sample,
            Lod::Bias(None),
        );
        let (group, groups) = made(vec![array]);
        assert_eq!((group.number, group.operands, groups.len()), (1, true, 2));
        assert!(groups[1].has_operands() && groups[0].samples.is_empty());
        let raw = RawFragment {
            at: [0.5, 0.25, 2.5],
            lod: 1.5,
            ..RawFragment::default()
        };
        let lane = group.fragment(&raw);
        assert_eq!((lane.uv, lane.lod, lane.layer), ([0.5, 0.25], 1.5, 2.0));
    }

    #[test]
    fn a_fetch_is_at_the_centre_of_its_texel_on_its_level() {
        let fetch = site(
            Form::Quad,
            0,
            Shape::Flat,
            Access::Fetch,
            Lod::Explicit(Some(2.0)),
        );
        let (group, groups) = made(vec![fetch]);
        assert_eq!(groups[0].samples[0].level.lod_256ths, 512);
        let raw = RawQuad {
            uv: [3.0, 1.0],
            dx: [1.0, 0.0],
            ..RawQuad::default()
        };
        let quad = group.quad(raw);
        // Level 2 has 16x8 texels.
        assert_eq!(
            (quad.uv, quad.dx),
            ([3.5 / 16.0, 1.5 / 8.0], [1.0 / 16.0, 0.0])
        );
    }

    #[test]
    fn the_level_of_a_cube_follows_from_face_coordinates_or_is_explicit() {
        let sky = |lod| {
            made(vec![site(
                Form::Fragment,
                0,
                Shape::Cube,
                Access::Sample,
                lod,
            )])
            .0
        };
        let raw = RawFragment {
            at: [0.0, 0.0, 1.0],
            dx: [0.25, 0.0, 0.0],
            lod: 7.0,
            ..RawFragment::default()
        };
        // The derivatives span an eighth of 64 texels.
        assert_eq!(sky(Lod::Derivatives).fragment(&raw).lod, 3.0);
        assert_eq!(sky(Lod::Bias(Some(1.0))).fragment(&raw).lod, 4.0);
        assert_eq!(sky(Lod::Explicit(None)).fragment(&raw).lod, 7.0);
        assert_eq!(sky(Lod::Derivatives).fragment(&raw).layer, 4.0);
    }

    #[test]
    fn with_anisotropy_records_keep_the_shape_of_the_pixel_instead_of_a_level() {
        let of = |shape, lod| {
            made_with(
                vec![site(Form::Fragment, 0, shape, Access::Sample, lod)],
                true,
            )
        };
        let raw = RawFragment {
            at: [0.0, 0.0, 1.0],
            dx: [0.25, 0.0, 0.0],
            dy: [0.0, 0.5, 0.0],
            lod: 7.0,
        };
        for (shape, lod, rule, own, slope, joins) in [
            (
                Shape::Cube,
                Lod::Derivatives,
                LodRule::Derivatives,
                0.0,
                0.125,
                Joins::Layer,
            ),
            (
                Shape::Cube,
                Lod::Bias(None),
                LodRule::Bias,
                7.0,
                0.125,
                Joins::Layer,
            ),
            (
                Shape::Cube,
                Lod::Explicit(None),
                LodRule::Explicit,
                7.0,
                0.125,
                Joins::Layer,
            ),
            (
                Shape::Cube,
                Lod::Gradients,
                LodRule::Derivatives,
                0.0,
                0.125,
                Joins::None,
            ),
            (
                Shape::Flat,
                Lod::Gradients,
                LodRule::Derivatives,
                0.0,
                0.25,
                Joins::None,
            ),
            (
                Shape::Array,
                Lod::Gradients,
                LodRule::Derivatives,
                0.0,
                0.25,
                Joins::None,
            ),
            (
                Shape::Array,
                Lod::Derivatives,
                LodRule::Derivatives,
                0.0,
                0.25,
                Joins::All,
            ),
        ] {
            let (group, groups) = of(shape, lod);
            let sample = groups.last().unwrap().samples[0];
            let lane = group.fragment(&raw);
            assert_eq!(
                (sample.level.rule, group.joins()),
                (rule, joins),
                "{shape:?} {lod:?}"
            );
            assert_eq!(
                (lane.lod, lane.slope[0]),
                (own, [slope, 0.0]),
                "{shape:?} {lod:?}"
            );
        }
    }
}
