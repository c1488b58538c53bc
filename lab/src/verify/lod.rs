//! Levels of detail and texels of a sample in double precision, from the specification.

use super::geometry::Sampled;
use formats::footprint::LodFormula;
use formats::texture::{Filter, MipFilter, Sampler, Texture, Wrap};
use glam::DVec2;

/// Texels of level 0.
fn size(texture: &Texture) -> DVec2 {
    DVec2::new(texture.size[0].into(), texture.size[1].into())
}

/// Level of detail before clamping, from derivatives in units of the texture: `log2(rho)`, where rho is the
/// longer derivative in texels, or a driver's approximation.
pub fn level_of_detail(at: &Sampled, texture: &Texture, formula: LodFormula) -> f64 {
    let (dx, dy) = (at.dx * size(texture), at.dy * size(texture));
    let longest = dx.length_squared().max(dy.length_squared());
    match formula {
        LodFormula::Exact | LodFormula::PerLane => 0.5 * longest.log2(),
        LodFormula::Llvmpipe => {
            // The logarithm as a chord between powers of two.
            let exponent = longest.log2().floor().clamp(-127.0, 127.0);
            0.5 * (exponent + longest / exponent.exp2() - 1.0)
        }
        LodFormula::Softpipe => {
            let component = |d: DVec2| d.abs().max_element();
            component(dx).max(component(dy)).log2()
        }
    }
}

/// A level of detail clamped to the texture's levels.
pub fn clamped(lod: f64, texture: &Texture) -> f64 {
    // Not a number if the derivatives are not.
    lod.max(0.0)
        .min(f64::from(texture.levels.saturating_sub(1)))
}

/// One level that a sample reads: bilinear taps or a single texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tap {
    /// Mip level.
    pub level: u32,
    /// Left and right column, upper and lower row, wrapped.
    pub texels: [[u32; 2]; 2],
    /// Weights of the right column and of the lower row.
    pub between: DVec2,
    /// Weight of this level in the result.
    pub weight: f64,
}

/// The levels and texels that a sample at `uv` reads; none if the coordinates are not finite.
pub fn taps(
    uv: DVec2,
    lod: f64,
    texture: &Texture,
    sampler: &Sampler,
) -> impl Iterator<Item = Tap> + use<> {
    let last = texture.levels.saturating_sub(1);
    let filter = if lod > 0.0 { sampler.min } else { sampler.mag };
    let lod = clamped(lod, texture);
    let levels = match sampler.mip {
        MipFilter::None => [(0, 1.0), (0, 0.0)],
        MipFilter::Nearest => [(((lod + 0.5) as u32).min(last), 1.0), (0, 0.0)],
        MipFilter::Linear => {
            let first = lod as u32;
            [
                (first, 1.0 - lod.fract()),
                ((first + 1).min(last), lod.fract()),
            ]
        }
    };
    let sizes = levels.map(|(level, _)| texture.level_size(level));
    let wrap = sampler.wrap;
    let finite = uv.is_finite();
    // A level of weight zero is read as well unless the other one is the last, because drivers do not check
    // the weight.
    let reads_next = sampler.mip == MipFilter::Linear && lod > 0.0 && lod < f64::from(last);
    let count = if finite {
        1 + usize::from(reads_next)
    } else {
        0
    };
    levels
        .into_iter()
        .zip(sizes)
        .take(count)
        .map(move |((level, weight), size)| {
            let axis = |uv: f64, axis: usize| {
                let at = uv * f64::from(size[axis]);
                let (low, between) = match filter {
                    Filter::Nearest => (at.floor(), 0.0),
                    Filter::Linear => ((at - 0.5).floor(), (at - 0.5) - (at - 0.5).floor()),
                };
                let high = if filter == Filter::Linear {
                    low + 1.0
                } else {
                    low
                };
                (
                    [low, high].map(|t| wrapped(t, size[axis], wrap[axis])),
                    between,
                )
            };
            let (columns, u) = axis(uv.x, 0);
            let (rows, v) = axis(uv.y, 1);
            Tap {
                level,
                texels: [columns, rows],
                between: DVec2::new(u, v),
                weight,
            }
        })
}

fn wrapped(texel: f64, size: u32, wrap: Wrap) -> u32 {
    let size = f64::from(size);
    let inside = match wrap {
        Wrap::Repeat => texel.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let folded = texel.rem_euclid(2.0 * size);
            folded.min(2.0 * size - 1.0 - folded)
        }
        // Scene files have no other modes.
        Wrap::ClampToEdge | Wrap::ClampToBorder | Wrap::MirrorClampToEdge => {
            texel.clamp(0.0, size - 1.0)
        }
    };
    inside as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture() -> Texture {
        Texture {
            size: [256, 64],
            levels: 9,
            layers: 1,
            ..Texture::default()
        }
    }

    fn at(dx: [f64; 2], dy: [f64; 2]) -> Sampled {
        Sampled {
            uv: DVec2::ZERO,
            dx: DVec2::from(dx) / size(&texture()),
            dy: DVec2::from(dy) / size(&texture()),
        }
    }

    #[test]
    fn the_longer_derivative_in_texels_gives_the_level() {
        let lod = |sampled, formula| level_of_detail(&sampled, &texture(), formula);
        assert!((lod(at([8.0, 0.0], [0.0, 2.0]), LodFormula::Exact) - 3.0).abs() < 1e-12);
        assert!((lod(at([0.0, 0.0], [3.0, 4.0]), LodFormula::Exact) - 5_f64.log2()).abs() < 1e-12);
        // 25 lies 9/16 of the way from 16 to 32.
        let chord = 0.5 * (4.0 + 9.0 / 16.0);
        assert!((lod(at([3.0, 4.0], [0.0, 1.0]), LodFormula::Llvmpipe) - chord).abs() < 1e-12);
        assert!((lod(at([3.0, 4.0], [0.0, 1.0]), LodFormula::Softpipe) - 2.0).abs() < 1e-12);
        assert_eq!(clamped(f64::NAN, &texture()), 0.0);
        assert_eq!(clamped(20.0, &texture()), 8.0);
    }

    #[test]
    fn taps_wrap_and_weigh() {
        let found: Vec<Tap> = taps(
            DVec2::new(0.0, 0.5),
            1.25,
            &texture(),
            &Sampler::TRILINEAR_REPEAT,
        )
        .collect();
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].level, found[0].weight), (1, 0.75));
        assert_eq!(found[0].texels, [[127, 0], [15, 16]]);
        assert_eq!(found[0].between, DVec2::splat(0.5));
        assert_eq!((found[1].level, found[1].texels), (2, [[63, 0], [7, 8]]));
        let clamp = Sampler {
            wrap: [Wrap::ClampToEdge, Wrap::MirroredRepeat],
            ..Sampler::SHADOW
        };
        let found: Vec<Tap> = taps(DVec2::new(-1.0, 1.0), 3.0, &texture(), &clamp).collect();
        assert_eq!((found.len(), found[0].texels), (1, [[0, 0], [63, 63]]));
        assert_eq!(taps(DVec2::NAN, 1.0, &texture(), &clamp).count(), 0);
    }
}
