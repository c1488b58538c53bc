//! Level of detail and the choice of levels and filters.

use crate::config::{LodFormula, SamplingConfig};
use formats::texture::{Filter, MipFilter, Sampler};

/// Derivatives in texels of level 0: of u and v along x, and along y.
#[derive(Clone, Copy, Debug)]
pub struct Derivatives {
    /// `[du/dx, dv/dx]`.
    pub dx: [f32; 2],
    /// `[du/dy, dv/dy]`.
    pub dy: [f32; 2],
}

/// Which levels a sample reads, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Levels {
    /// First level.
    pub first: u32,
    /// True if the next level is read, too.
    pub both: bool,
    /// Filter within a level.
    pub filter: Filter,
}

/// Level of detail with its bias.
#[inline]
pub fn lod(d: Derivatives, sampling: &SamplingConfig) -> f32 {
    let squared = |[u, v]: [f32; 2]| u * u + v * v;
    let rho_squared = squared(d.dx).max(squared(d.dy));
    let lod = match sampling.lod {
        LodFormula::Llvmpipe => 0.5 * fast_log2(rho_squared),
        LodFormula::Exact => 0.5 * rho_squared.log2(),
        LodFormula::Softpipe => {
            let axis = |a: usize| d.dx[a].abs().max(d.dy[a].abs());
            axis(0).max(axis(1)).log2()
        }
    };
    lod + sampling.lod_bias
}

/// llvmpipe's logarithm: the exponent plus the mantissa less one.
#[inline]
pub fn fast_log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits >> 23 & 0xff) as i32 - 127;
    let mantissa = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000);
    exponent as f32 + (mantissa - 1.0)
}

/// Levels read at a level of detail of a texture whose last level is `last`.
#[inline]
pub fn levels(lod: f32, sampler: &Sampler, last: u32) -> Levels {
    // NaN (degenerate derivatives) is magnification, too.
    if !(lod > 0.0) {
        return Levels { first: 0, both: false, filter: sampler.mag };
    }
    let filter = sampler.min;
    match sampler.mip {
        MipFilter::None => Levels { first: 0, both: false, filter },
        MipFilter::Nearest => Levels { first: ((lod + 0.5) as u32).min(last), both: false, filter },
        MipFilter::Linear => {
            let first = (lod as u32).min(last);
            Levels { first, both: first < last, filter }
        }
    }
}
