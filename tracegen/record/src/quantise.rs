//! Converts the shader's floats to the trace's fixed point.

use super::raw::RawRecord;
use formats::textrace::{SUBTEXELS, UvGroup};
use formats::texture::Sampler;

/// Limit of coordinates; derivatives stay below half of it. The sum of a lane's terms
/// (`uv + dx + dy + cross`) then fits 32 bits.
const LIMIT: f64 = (1 << 29) as f64;

/// Conversion of the coordinates of a uv group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GroupScale {
    /// Steps per unit of u and v.
    scale: [f64; 2],
    /// Whether all samplers of the group repeat along each axis, so that whole periods may be removed.
    periodic: [bool; 2],
}

impl GroupScale {
    /// The conversion for `group`.
    pub fn new(group: &UvGroup, samplers: &[Sampler]) -> Self {
        // Operands have no samples and are not periodic.
        let periodic = |axis: usize| {
            let mut samplers = group
                .samples
                .iter()
                .filter_map(|s| samplers.get(usize::from(s.sampler)));
            !group.samples.is_empty() && samplers.all(|s| s.wrap[axis].is_periodic())
        };
        Self {
            scale: group.extent.map(|e| f64::from(SUBTEXELS) * f64::from(e)),
            periodic: [periodic(0), periodic(1)],
        }
    }
}

/// Coordinates of a record in fixed point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FixedUv {
    /// Top-left lane.
    pub uv: [i32; 2],
    /// Horizontal derivative, top row.
    pub dx: [i32; 2],
    /// Vertical derivative, left column.
    pub dy: [i32; 2],
    /// Change of the horizontal derivative.
    pub cross: [i32; 2],
}

/// Converts the coordinates of one primitive in one group to fixed point.
///
/// Coordinates too large for 32 bits are reduced by a multiple of two repeats (two, because of mirrored
/// wrap). Neighbouring quads are reduced by the same multiple, so that a primitive stays continuous.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Quantiser {
    shift: [f64; 2],
}

impl Quantiser {
    /// Fixed-point coordinates of `record`, or `None` if a coordinate is not finite.
    pub fn quantise(&mut self, rule: &GroupScale, record: &RawRecord) -> Option<FixedUv> {
        let mut fixed = FixedUv::default();
        for axis in 0..2 {
            let scale = rule.scale[axis];
            let raw = [record.uv, record.dx, record.dy, record.cross].map(|v| f64::from(v[axis]));
            if !raw.iter().all(|v| v.is_finite()) {
                return None;
            }
            let mut u = raw[0] - self.shift[axis];
            if rule.periodic[axis] && (u * scale).abs() > LIMIT {
                self.shift[axis] = 2.0 * (raw[0] / 2.0).round();
                u = raw[0] - self.shift[axis];
            }
            fixed.uv[axis] = round(u * scale, LIMIT);
            fixed.dx[axis] = round(raw[1] * scale, LIMIT / 2.0);
            fixed.dy[axis] = round(raw[2] * scale, LIMIT / 2.0);
            fixed.cross[axis] = round(raw[3] * scale, LIMIT / 2.0);
        }
        Some(fixed)
    }
}

/// Rounds to the nearest integer, ties to even, and clamps to `limit`, which is below 2^31.
///
/// Adding 1.5 * 2^52 leaves the integer in the low mantissa bits. This is several times faster than `round`
/// on targets without a rounding instruction.
fn round(value: f64, limit: f64) -> i32 {
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    (value.clamp(-limit, limit) + MAGIC).to_bits() as u32 as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::textrace::Sample;
    use formats::texture::Wrap;

    fn rule(extent: u32, wrap: Wrap) -> GroupScale {
        let group = UvGroup {
            extent: [extent; 2],
            samples: vec![Sample::default()],
        };
        let sampler = Sampler {
            wrap: [wrap; 2],
            ..Sampler::TRILINEAR_REPEAT
        };
        GroupScale::new(&group, &[sampler])
    }

    fn at(uv: f32) -> RawRecord {
        RawRecord {
            uv: [uv, -uv],
            dx: [0.25, 0.0],
            ..RawRecord::default()
        }
    }

    #[test]
    fn rounding_equals_that_of_the_standard_library() {
        for value in [0.0, 0.5, 1.5, -0.5, -2.5, 2.4999, 1e8 + 0.3, -536_870_911.7] {
            assert_eq!(
                round(value, LIMIT),
                value.round_ties_even() as i32,
                "{value}"
            );
        }
        assert_eq!(round(1e30, LIMIT), 1 << 29);
    }

    #[test]
    fn moderate_coordinates_are_not_reduced() {
        let fixed = Quantiser::default()
            .quantise(&rule(1024, Wrap::Repeat), &at(3.5))
            .unwrap();
        assert_eq!(fixed.uv, [7 << 20, -(7 << 20)]);
        assert_eq!(fixed.dx, [1 << 19, 0]);
    }

    #[test]
    fn huge_coordinates_are_reduced_by_pairs_of_repeats_and_stay_continuous() {
        let rule = rule(1024, Wrap::MirroredRepeat);
        let mut quantiser = Quantiser::default();
        let first = quantiser.quantise(&rule, &at(100_001.5)).unwrap();
        let period = 2 * 1024 * SUBTEXELS;
        assert_eq!(first.uv[0].rem_euclid(period), 3 * period / 4);
        let second = quantiser.quantise(&rule, &at(100_003.5)).unwrap();
        assert_eq!(second.uv[0] - first.uv[0], period);
    }

    #[test]
    fn clamped_coordinates_of_any_size_stay_outside() {
        let fixed = Quantiser::default()
            .quantise(&rule(1024, Wrap::ClampToEdge), &at(1e9))
            .unwrap();
        assert_eq!(fixed.uv, [1 << 29, -(1 << 29)]);
    }

    #[test]
    fn coordinates_that_are_not_finite_are_refused() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert_eq!(
                Quantiser::default().quantise(&rule(4, Wrap::Repeat), &at(bad)),
                None
            );
        }
    }
}
