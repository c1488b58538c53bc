//! Seeded randomness and periodic noise fields.
//!
//! Textures of a scene share a few precomputed fields. A look-up takes a few nanoseconds,
//! evaluating six octaves about fifty, and a scene has some 70 M texels.

use formats::random::Random;
use std::io;
use std::panic::resume_unwind;
use std::sync::OnceLock;
use std::thread::{Builder, ScopedJoinHandle};

/// Edge of the shared noise fields in samples: a power of two, so that wrapping is a bit mask.
pub const FIELD_SIZE: usize = 1024;

/// Pseudo-random numbers for placing and shaping objects.
#[derive(Clone, Debug)]
pub struct Rng(Random);

impl Rng {
    /// A generator whose sequence depends only on `seed`.
    pub fn new(seed: u64) -> Self {
        Self(Random(seed ^ 0x5851_f42d_4c95_7f2d))
    }

    /// The next 32 random bits.
    pub fn bits(&mut self) -> u32 {
        (self.0.bits() >> 32) as u32
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        self.0.unit_f32()
    }

    /// Uniform in `low..high`.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Uniform in -`spread`..`spread`.
    pub fn jitter(&mut self, spread: f32) -> f32 {
        self.range(-spread, spread)
    }

    /// Uniform index below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() as usize) % count.max(1)
    }
}

/// A well mixed hash of two integers and a seed.
pub fn hash(x: i32, y: i32, seed: u32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x8da6_b343)
        ^ (y as u32).wrapping_mul(0xd816_3841)
        ^ seed.wrapping_mul(0xcb1a_b31f);
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// [`hash`] as a number in 0..1.
pub fn hash_unit(x: i32, y: i32, seed: u32) -> f32 {
    (hash(x, y, seed) >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Cubic step from 0 at `low` to 1 at `high`.
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear interpolation.
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// A scalar field over the unit torus, sampled on [`FIELD_SIZE`]² points.
pub struct Field(Vec<f32>);

impl Field {
    fn build(f: impl Fn(usize, usize) -> f32) -> Self {
        let mut samples = vec![0.0; FIELD_SIZE * FIELD_SIZE];
        for (y, row) in samples.chunks_mut(FIELD_SIZE).enumerate() {
            for (x, sample) in row.iter_mut().enumerate() {
                *sample = f(x, y);
            }
        }
        Self(samples)
    }

    /// Value noise summed over octaves, starting with `cells` cells per side, in 0..1.
    fn fbm(cells: usize, octaves: u32, gain: f32, seed: u32) -> Self {
        let mut samples = vec![0.0f32; FIELD_SIZE * FIELD_SIZE];
        let (mut total, mut amplitude) = (0.0, 1.0);
        for octave in 0..octaves {
            let period = cells << octave;
            let span = FIELD_SIZE / period;
            for (y, row) in samples.chunks_mut(FIELD_SIZE).enumerate() {
                let (cell_y, ty) = (y / span, (y % span) as f32 / span as f32);
                let sy = ty * ty * (3.0 - 2.0 * ty);
                let next_y = (cell_y + 1) % period;
                let column = |cell_x: usize| {
                    let at =
                        |y: usize| hash_unit((cell_x % period) as i32, y as i32, seed + octave);
                    lerp(at(cell_y), at(next_y), sy)
                };
                let mut left = column(0);
                for cell_x in 0..period {
                    let right = column(cell_x + 1);
                    for i in 0..span {
                        let tx = i as f32 / span as f32;
                        let sx = tx * tx * (3.0 - 2.0 * tx);
                        row[cell_x * span + i] += amplitude * lerp(left, right, sx);
                    }
                    left = right;
                }
            }
            total += amplitude;
            amplitude *= gain;
        }
        // Sums of octaves concentrate around one half. Stretching restores the contrast.
        for s in &mut samples {
            *s = ((*s / total - 0.5) * 1.7 + 0.5).clamp(0.0, 1.0);
        }
        Self(samples)
    }

    /// Distance to the nearest point, with one jittered point per cell, in cells.
    fn cells(cells: usize, seed: u32) -> Self {
        let wrap = |c: i32| c.rem_euclid(cells as i32);
        Self::build(|x, y| {
            let px = x as f32 * cells as f32 / FIELD_SIZE as f32;
            let py = y as f32 * cells as f32 / FIELD_SIZE as f32;
            let (cx, cy) = (px as i32, py as i32);
            let mut nearest = f32::MAX;
            for j in -1..=1 {
                for i in -1..=1 {
                    let (wx, wy) = (wrap(cx + i), wrap(cy + j));
                    let dx = (cx + i) as f32 + hash_unit(wx, wy, seed) - px;
                    let dy = (cy + j) as f32 + hash_unit(wx, wy, seed + 1) - py;
                    nearest = nearest.min(dx * dx + dy * dy);
                }
            }
            nearest.sqrt()
        })
    }

    /// Nearest sample at (`u`, `v`), periodic.
    pub fn at(&self, u: f32, v: f32) -> f32 {
        let x = (u * FIELD_SIZE as f32) as i32 as usize & (FIELD_SIZE - 1);
        let y = (v * FIELD_SIZE as f32) as i32 as usize & (FIELD_SIZE - 1);
        self.0[y * FIELD_SIZE + x]
    }

    /// Bilinear sample at (`u`, `v`), periodic.
    pub fn smooth(&self, u: f32, v: f32) -> f32 {
        let (x, y) = (u * FIELD_SIZE as f32, v * FIELD_SIZE as f32);
        let (fx, fy) = (x.floor(), y.floor());
        let at = |dx: i32, dy: i32| {
            let column = (fx as i32 + dx) as usize & (FIELD_SIZE - 1);
            let row = (fy as i32 + dy) as usize & (FIELD_SIZE - 1);
            self.0[row * FIELD_SIZE + column]
        };
        let (tx, ty) = (x - fx, y - fy);
        lerp(
            lerp(at(0, 0), at(1, 0), tx),
            lerp(at(0, 1), at(1, 1), tx),
            ty,
        )
    }
}

/// The noise fields used by every texture recipe.
pub struct NoiseBank {
    /// Clouds: 4 cells per side, 7 octaves.
    pub cloud: Field,
    /// Mottling: 16 cells per side, 5 octaves.
    pub mottle: Field,
    /// Grain: 128 cells per side, 3 octaves.
    pub grain: Field,
    /// Distance to scattered points, 24 cells per side.
    pub pebble: Field,
}

impl NoiseBank {
    /// Clouds, mottling and grain at (`u`, `v`).
    pub fn at(&self, u: f32, v: f32) -> [f32; 3] {
        [&self.cloud, &self.mottle, &self.grain].map(|field| field.at(u, v))
    }
}

/// The shared fields, computed at first use.
pub fn bank() -> &'static NoiseBank {
    static BANK: OnceLock<NoiseBank> = OnceLock::new();
    BANK.get_or_init(|| {
        // On separate threads. A worker of the pool that waits for other work may run a job that
        // needs this bank, and would then wait for itself.
        std::thread::scope(|scope| {
            let start = |field: fn() -> Field| (field, Builder::new().spawn_scoped(scope, field));
            let mottle = start(|| Field::fbm(16, 5, 0.6, 23));
            let grain = start(|| Field::fbm(128, 3, 0.7, 37));
            let pebble = start(|| Field::cells(24, 53));
            let cloud = Field::fbm(4, 7, 0.55, 11);
            let join = |(field, thread): (fn() -> Field, io::Result<ScopedJoinHandle<'_, _>>)| {
                match thread {
                    Ok(thread) => thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
                    // Not enough memory for another thread.
                    Err(_) => field(),
                }
            };
            NoiseBank {
                cloud,
                mottle: join(mottle),
                grain: join(grain),
                pebble: join(pebble),
            }
        })
    })
}
