//! Anisotropic filtering: the texels of quads whose pixels are long and narrow in the texture.
//!
//! Three models. *Probes* (Vulkan 1.3, section "Texel Anisotropic Filtering"): the filter is applied N
//! times along the longer axis of the pixel. With the axes' lengths a and b, a >= b, and the ratio r =
//! min(a / b, maximum), N is r rounded up and the level of detail is log2(a / r). *Rounded probes* (the
//! example in `EXT_texture_filter_anisotropic`): the same N, and log2(a / N), which drops a level as soon
//! as a exceeds b. *Ellipse* (softpipe's, after Greene and Heckbert, 1986): all texels of one level inside
//! the pixel's ellipse, which a texture unit fetches as 2x2 blocks.

use super::{LodFormula, SamplingOptions, fast_log2};
use crate::textrace::{QuadRecord, SUBTEXELS};
use crate::texture::Sampler;
use serde::{Deserialize, Serialize};

/// Largest anisotropy, as in every API.
pub const MOST_ANISOTROPY: u32 = 16;

/// How long and narrow pixels are filtered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AnisotropyModel {
    /// The filter, several times along the longer axis; the level follows from the ratio of the axes, as in Vulkan.
    #[default]
    Probes,
    /// As probes; the level follows from the ratio rounded up, as in the example of `EXT_texture_filter_anisotropic`.
    RoundedProbes,
    /// Every texel of the pixel's ellipse on one level, as softpipe.
    Ellipse,
}

/// The kind of a quad's footprints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reach {
    /// One footprint per lane and level.
    Isotropic,
    /// Several footprints along a line.
    Probes(Probes),
    /// All texels of an ellipse.
    Ellipse(Ellipse),
}

impl Reach {
    /// The footprints of a record in a texture with `levels` levels, whose level 0 has `size` texels.
    ///
    /// Isotropic if anisotropy is off, and if the pixel is not longer than a texel (nothing is minified).
    pub fn of(
        record: &QuadRecord,
        extent: [u32; 2],
        size: [u32; 2],
        levels: u32,
        sampler: &Sampler,
        options: &SamplingOptions,
    ) -> Self {
        let most = options.max_anisotropy(sampler).min(MOST_ANISOTROPY as f32);
        if most <= 1.0 {
            return Self::Isotropic;
        }
        let texels = |derivative: [i32; 2]| {
            [0, 1].map(|a| {
                let scale = size[a] as f32 / (SUBTEXELS as f32 * extent[a] as f32);
                derivative[a] as f32 * scale
            })
        };
        let [dx, dy] = [record.dx, record.dy].map(texels);
        let squared = |d: [f32; 2]| d[0] * d[0] + d[1] * d[1];
        let (along_x, along_y) = (squared(dx), squared(dy));
        let (longer, shorter) = (along_x.max(along_y), along_x.min(along_y));
        // Also isotropic if a derivative is not finite.
        if !(longer > 1.0 && longer < f32::INFINITY) {
            return Self::Isotropic;
        }
        match options.anisotropy {
            model @ (AnisotropyModel::Probes | AnisotropyModel::RoundedProbes) => {
                // The smallest N for which N times the shorter axis is not less than the longer axis.
                let square = |n: u32| (n * n) as f32;
                let largest = most.ceil() as u32;
                let count = (1..largest).find(|&n| square(n) * shorter >= longer);
                let count = count.unwrap_or(largest);
                if count == 1 {
                    return Self::Isotropic;
                }
                let (axis, d) = if along_x >= along_y {
                    (record.dx, dx)
                } else {
                    (record.dy, dy)
                };
                // The square of the level's argument: a / N, or a / min(a / b, most).
                let narrowed = match model {
                    AnisotropyModel::RoundedProbes => longer / square(count),
                    _ => shorter.max(longer / (most * most)),
                };
                let lod = match options.lod {
                    LodFormula::Llvmpipe => 0.5 * fast_log2(narrowed),
                    LodFormula::Exact | LodFormula::PerLane => 0.5 * narrowed.log2(),
                    LodFormula::Softpipe => {
                        let ratio = (longer / narrowed).sqrt();
                        (d[0].abs().max(d[1].abs()) / ratio).log2()
                    }
                };
                Self::Probes(Probes {
                    count,
                    lod: lod + options.lod_bias,
                    axis,
                })
            }
            AnisotropyModel::Ellipse if !sampler.blends_levels() => Self::Isotropic,
            AnisotropyModel::Ellipse => {
                let narrowest = shorter.max(longer / (most * most));
                let lod = 0.5 * fast_log2(narrowest) + options.lod_bias;
                // The maximum also limits ellipses that a bias enlarges.
                let longest = 2.0 * most;
                let shortest_level = (0.5 * (longer / (longest * longest)).log2()).ceil();
                let level = (lod.max(0.0) as u32).max(shortest_level.max(0.0) as u32);
                let last = levels.saturating_sub(1);
                if level >= last {
                    return Self::Isotropic;
                }
                Self::Ellipse(Ellipse::new(level, [dx, dy]))
            }
        }
    }
}

/// Footprints along the longer axis of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probes {
    /// Number of probes, 2 to 16.
    pub count: u32,
    /// Level of detail of each probe, including the bias.
    pub lod: f32,
    /// The longer axis, fixed point.
    axis: [i32; 2],
}

impl Probes {
    /// Offset of a probe from the lane's coordinates, in fixed point rounded to nearest:
    /// `i / (N + 1) - 1/2` of the axis, with i from 1 to N.
    pub fn offset(&self, probe: u32) -> [i32; 2] {
        let parts = i64::from(self.count) + 1;
        let from_middle = 2 * (i64::from(probe) + 1) - parts;
        // At most half of the axis.
        self.axis
            .map(|d| ((i64::from(d) * from_middle + parts).div_euclid(2 * parts)) as i32)
    }
}

/// The ellipse of a pixel on a level: `a u^2 + b u v + c v^2 < f`, in texels from its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Mip level.
    pub level: u32,
    a: f64,
    b: f64,
    c: f64,
    f: f64,
}

impl Ellipse {
    /// The ellipse on `level` of a pixel with these derivatives along x and y, in texels of level 0.
    fn new(level: u32, derivatives: [[f32; 2]; 2]) -> Self {
        let scale = 1.0 / f64::from(1_u32 << level);
        let [[ux, vx], [uy, vy]] = derivatives.map(|d| d.map(|t| f64::from(t) * scale));
        // Adding one keeps it at least a texel wide.
        let a = vx * vx + vy * vy + 1.0;
        let b = -2.0 * (ux * vx + uy * vy);
        let c = ux * ux + uy * uy + 1.0;
        let f = a * c - b * b / 4.0;
        Self { level, a, b, c, f }
    }

    /// Whether a texel at this distance from the centre is inside.
    fn contains(&self, u: f64, v: f64) -> bool {
        self.a * u * u + self.b * u * v + self.c * v * v < self.f
    }

    /// The 2x2 blocks at even columns and rows that hold a texel of the ellipse around fixed-point
    /// coordinates, as their upper left texel before wrapping, row by row. `size` is the size of the level.
    pub fn blocks(
        &self,
        uv: [i32; 2],
        size: [u32; 2],
        extent: [u32; 2],
    ) -> impl Iterator<Item = [i64; 2]> + use<> {
        let center = [0, 1].map(|a| {
            let unit = f64::from(SUBTEXELS) * f64::from(extent[a]);
            f64::from(uv[a]) * f64::from(size[a]) / unit - 0.5
        });
        // The extremes of u and v on the ellipse.
        let half = [self.c.sqrt(), self.a.sqrt()];
        let first = [0, 1].map(|a| (center[a] - half[a]).floor() as i64 & !1);
        let last = [0, 1].map(|a| (center[a] + half[a]).ceil() as i64);
        let ellipse = *self;
        let rows = (first[1]..=last[1]).step_by(2);
        rows.flat_map(move |y| {
            let columns = (first[0]..=last[0]).step_by(2);
            columns.map(move |x| [x, y]).filter(move |[x, y]| {
                (0..4).any(|texel| {
                    let (u, v) = (x + (texel & 1), y + (texel >> 1));
                    ellipse.contains(u as f64 - center[0], v as f64 - center[1])
                })
            })
        })
    }
}

#[cfg(test)]
mod tests;
