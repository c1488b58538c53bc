//! Matches the draws of two captures, and checks that both show the same scene.

use super::fault::{NotComparable, same};
use formats::textrace::{Draw, Pass, Tables, UvGroup};
use formats::texture::Sampler;

/// The draws of both captures, matched by their primitives.
pub(super) struct Partners<'a> {
    tables: [&'a Tables; 2],
    /// First primitive and index of each draw, ascending, by capture.
    starts: [Vec<(u32, u32)>; 2],
    opaque: Option<Vec<bool>>,
}

impl<'a> Partners<'a> {
    /// Checks that the captures show the same views of the same triangles and textures.
    ///
    /// # Errors
    /// The first property that they do not share.
    pub fn new(tables: [&'a Tables; 2]) -> Result<Self, NotComparable> {
        let [a, b] = tables;
        same(
            || "number of passes".into(),
            &a.passes.len(),
            &b.passes.len(),
        )?;
        for (index, (a, b)) in a.passes.iter().zip(&b.passes).enumerate() {
            let shows = |pass: &Pass| (pass.frame, pass.kind, pass.eye, pass.layer);
            let what = |of: &str| format!("pass {index}, {of}");
            same(|| what("frame, kind, eye and layer"), &shows(a), &shows(b))?;
            same(|| what("size in pixels"), &a.size_px, &b.size_px)?;
        }
        let count = |tables: &Tables| tables.textures.len();
        same(|| "number of textures".into(), &count(a), &count(b))?;
        for (index, (a, b)) in a.textures.iter().zip(&b.textures).enumerate() {
            let what = |of: &str| format!("texture {index} ({}), {of}", a.name);
            same(|| what("size"), &a.size, &b.size)?;
            same(|| what("levels"), &a.levels, &b.levels)?;
            same(|| what("layers"), &a.layers, &b.layers)?;
            same(|| what("format"), &a.format, &b.format)?;
        }
        let primitives = |tables: &Tables| {
            let ends = tables.draws.iter();
            let ends = ends.map(|d| u64::from(d.first_primitive) + u64::from(d.primitives));
            ends.max().unwrap_or(0)
        };
        let what = || "number of primitives".to_owned();
        same(what, &primitives(a), &primitives(b))?;
        let starts = tables.map(|tables| {
            let draws = (0..).zip(&tables.draws);
            let mut starts: Vec<(u32, u32)> = draws
                .map(|(index, draw)| (draw.first_primitive, index))
                .collect();
            starts.sort_unstable();
            starts
        });
        let opaque = a.meta.surfaces.as_ref().map(|surfaces| {
            let mut opaque = vec![true; a.draws.len()];
            for &[first, count] in &surfaces.not_opaque {
                let end = first.saturating_add(count) as usize;
                let end = end.min(opaque.len());
                opaque[(first as usize).min(end)..end].fill(false);
            }
            opaque
        });
        Ok(Self {
            tables,
            starts,
            opaque,
        })
    }

    /// Number of draws of the first capture.
    pub fn count(&self) -> usize {
        self.tables[0].draws.len().max(1)
    }

    /// Name of a draw's material.
    pub fn material(&self, draw: usize) -> &'a str {
        let draw = self.tables[0].draws.get(draw);
        draw.map_or("", |draw| draw.material.as_str())
    }

    /// Whether a draw is opaque, if the capture records it.
    pub(super) fn opacity(&self, draw: usize) -> Option<&'static str> {
        let opaque = self.opaque.as_ref()?.get(draw)?;
        Some(if *opaque {
            "opaque"
        } else {
            "masked or blended"
        })
    }

    /// The draw of the first capture that contains a primitive.
    pub(super) fn draw_of(&self, primitive: u32) -> usize {
        let starts = &self.starts[0];
        let after = starts.partition_point(|(first, _)| *first <= primitive);
        let at = after.checked_sub(1).and_then(|at| starts.get(at));
        at.map_or(0, |(_, draw)| *draw as usize)
    }

    /// The uv group with this number in two draws, if both sample the same textures.
    pub fn group(&self, draws: [u32; 2], number: u8) -> Option<&'a UvGroup> {
        let group = |side: usize| -> Option<&'a UvGroup> {
            let draw: &Draw = self.tables[side].draws.get(draws[side] as usize)?;
            draw.groups.get(usize::from(number))
        };
        let (a, b) = (group(0)?, group(1)?);
        let sampler = |side: usize, index: u16| -> Option<&Sampler> {
            self.tables[side].samplers.get(usize::from(index))
        };
        let alike = a.extent == b.extent
            && a.samples.len() == b.samples.len()
            && a.samples.iter().zip(&b.samples).all(|(a, b)| {
                (a.texture, a.layer, a.offset, a.level) == (b.texture, b.layer, b.offset, b.level)
                    && sampler(0, a.sampler) == sampler(1, b.sampler)
            });
        alike.then_some(a)
    }

    /// The first capture's tables.
    pub fn tables(&self) -> &'a Tables {
        self.tables[0]
    }
}
