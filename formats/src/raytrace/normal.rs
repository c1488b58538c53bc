//! Unit vectors in 2 x 16 bits, encoded by the octahedral map (Cigolle et al., JCGT 2014).

/// The code of a unit vector.
pub fn encode(n: [f32; 3]) -> [i16; 2] {
    let sum = n[0].abs() + n[1].abs() + n[2].abs();
    if sum.is_nan() || sum <= 0.0 {
        return [0, 0];
    }
    let (mut x, mut y) = (n[0] / sum, n[1] / sum);
    if n[2] < 0.0 {
        (x, y) = ((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y));
    }
    [x, y].map(|v| (v * 32767.0).round() as i16)
}

/// The unit vector of a code. Zeros are +0, so that encoding it again gives the same vector, bit by bit.
pub fn decode(code: [i16; 2]) -> [f32; 3] {
    let [mut x, mut y] = code.map(|v| f32::from(v.max(-32767)) / 32767.0);
    let z = 1.0 - x.abs() - y.abs();
    if z < 0.0 {
        (x, y) = ((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y));
    }
    let length = (x * x + y * y + z * z).sqrt();
    [x / length + 0.0, y / length + 0.0, z / length]
}

fn sign(v: f32) -> f32 {
    if v < 0.0 { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_normal_is_decoded_within_a_ten_thousandth() {
        for i in 0..10_000u32 {
            // Points spread evenly over the sphere.
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 10_000.0;
            let angle = i as f32 * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            let n = [r * angle.cos(), r * angle.sin(), z];
            let back = decode(encode(n));
            let error: f32 = (0..3).map(|a| (n[a] - back[a]).abs()).fold(0.0, f32::max);
            assert!(error < 1e-4, "{n:?} {back:?}");
        }
    }

    #[test]
    fn a_decoded_normal_is_decoded_to_the_same_bits_again() {
        let stays = |code: [i16; 2]| {
            let normal = decode(code);
            let again = decode(encode(normal));
            assert_eq!(
                again.map(f32::to_bits),
                normal.map(f32::to_bits),
                "{code:?}"
            );
        };
        for x in i16::MIN..=i16::MAX {
            // The border of the square, its middle lines, the diagonals where z is 0, and a line in between.
            let rest = 32767 - x.saturating_abs();
            for y in [i16::MIN, -32767, -1, 0, 1, 32767, rest, -rest, x ^ 0x2A5] {
                stays([x, y]);
                stays([y, x]);
            }
        }
    }

    #[test]
    fn the_axes_are_exact() {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let mut n = [0.0; 3];
                n[axis] = side;
                assert_eq!(decode(encode(n)), n);
            }
        }
    }
}
