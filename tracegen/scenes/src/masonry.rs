//! Stone, brick, tile and plaster surfaces.

use super::noise::{bank, hash, hash_unit, lerp, smoothstep};
use super::texture_synth::{Rgb, Surface, Texel, mix, rgb, shade};

/// A place in a pattern of blocks.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Distance to the nearest joint in texture widths.
    pub edge: f32,
    /// Hash of the block.
    pub id: u32,
}

/// Rectangular blocks in courses, each course shifted by `shift` of a block.
pub fn courses(u: f32, v: f32, columns: i32, rows: i32, shift: f32) -> Cell {
    let y = v * rows as f32;
    let row = y.floor();
    let x = u * columns as f32 + (row as i32 & 1) as f32 * shift;
    let column = x.floor();
    let (fx, fy) = (x - column, y - row);
    Cell {
        edge: (fx.min(1.0 - fx) / columns as f32).min(fy.min(1.0 - fy) / rows as f32),
        id: hash((column as i32).rem_euclid(columns), row as i32, 7),
    }
}

/// Ashlar: courses of blocks with uneven lengths.
pub fn ashlar(u: f32, v: f32, columns: i32, rows: i32) -> Cell {
    let y = v * rows as f32;
    let row = y.floor() as i32;
    let fy = y - row as f32;
    let x = u * columns as f32 + hash_unit(row, 0, 91);
    let joint = |i: i32| i as f32 + 0.6 * (hash_unit(i.rem_euclid(columns), row, 17) - 0.5);
    let mut column = x.floor() as i32;
    if x < joint(column) {
        column -= 1;
    } else if x >= joint(column + 1) {
        column += 1;
    }
    let across = (x - joint(column)).min(joint(column + 1) - x) / columns as f32;
    Cell {
        edge: across.min(fy.min(1.0 - fy) / rows as f32),
        id: hash(column.rem_euclid(columns), row, 7),
    }
}

/// Square tiles set diagonally with small insets at the corners (id's lowest bit is set there).
pub fn inset_tiles(u: f32, v: f32, count: i32, inset: f32) -> Cell {
    let (x, y) = (u * count as f32, v * count as f32);
    let (cx, cy) = (x.floor(), y.floor());
    let (fx, fy) = (x - cx, y - cy);
    let (gx, gy) = (x.round(), y.round());
    let corner = (x - gx).abs() + (y - gy).abs();
    let wrap = |c: f32| (c as i32).rem_euclid(count);
    let diagonal = (corner - inset).abs() * std::f32::consts::FRAC_1_SQRT_2;
    if corner < inset {
        return Cell {
            edge: diagonal / count as f32,
            id: hash(wrap(gx), wrap(gy), 3) | 1,
        };
    }
    let straight = fx.min(1.0 - fx).min(fy).min(1.0 - fy);
    Cell {
        edge: straight.min(diagonal) / count as f32,
        id: hash(wrap(cx), wrap(cy), 5) & !1,
    }
}

/// Appearance of blocks.
#[derive(Clone, Copy, Debug)]
pub struct Masonry {
    /// The range of block colours.
    pub stones: [Rgb; 2],
    /// Colour of the joints.
    pub mortar: Rgb,
    /// Width of a joint in texture widths.
    pub joint: f32,
    /// Width of the rounding at a block's edge in texture widths.
    pub bevel: f32,
    /// Depth of the joints in texture widths.
    pub depth: f32,
    /// Strength of stains and weather, 0 to 1.
    pub weather: f32,
    /// Roughness of the blocks.
    pub rough: f32,
}

impl Masonry {
    /// Blocks of these colours with joints of a width, a bevel and a depth.
    fn new(
        stones: [Rgb; 2],
        mortar: Rgb,
        [joint, bevel, depth]: [f32; 3],
        weather: f32,
        rough: f32,
    ) -> Self {
        Self {
            stones,
            mortar,
            joint,
            bevel,
            depth,
            weather,
            rough,
        }
    }

    /// The texel at (`u`, `v`) inside `cell`.
    pub fn texel(&self, u: f32, v: f32, cell: Cell) -> Texel {
        let noise = bank();
        let offset = (cell.id & 1023) as f32 / 1024.0;
        let mottle = noise.mottle.at(u + offset, v + offset);
        let grain = noise.grain.at(u, v);
        let cloud = noise.cloud.at(u, v);
        let chip = (mottle - 0.5) * self.bevel * 1.2;
        let block = smoothstep(self.joint, self.joint + self.bevel, cell.edge + chip);
        let tone = (cell.id >> 10 & 255) as f32 / 255.0;
        let mut stone = mix(self.stones[0], self.stones[1], 0.7 * tone + 0.3 * mottle);
        stone = shade(stone, 0.86 + 0.28 * lerp(mottle, grain, 0.5));
        let pits = smoothstep(0.62, 0.9, grain) * 0.3;
        let grime = self.weather * smoothstep(0.35, 0.85, cloud);
        stone = mix(stone, shade(stone, 0.55), grime * 0.7 + pits * self.weather);
        let mortar = shade(self.mortar, 0.8 + 0.4 * grain);
        let lift = hash_unit(cell.id as i32, 1, 2) * 0.25;
        Texel {
            open: lerp(0.45, 1.0, block),
            ..Texel::new(
                mix(mortar, stone, block),
                self.depth * (block * (0.75 + lift) - 0.12 * pits) + 0.0016 * mottle * self.weather,
                lerp(0.95, self.rough + 0.18 * grime + 0.1 * (grain - 0.5), block),
            )
        }
    }
}

/// Weathered running-bond brick, 8 bricks by 16 courses.
pub fn brick(stones: [Rgb; 2]) -> Surface {
    let mortar = rgb(0xa89c88);
    let look = Masonry::new(stones, mortar, [0.0022, 0.005, 0.006], 0.6, 0.85);
    Box::new(move |u, v| {
        let wobble = (bank().mottle.at(u, v) - 0.5) * 0.004;
        look.texel(u, v, courses(u + wobble, v + wobble, 10, 30, 0.5))
    })
}

/// Dressed stone blocks of uneven length.
pub fn dressed_stone(stones: [Rgb; 2], columns: i32, rows: i32, weather: f32) -> Surface {
    let mortar = shade(stones[0], 0.62);
    let look = Masonry::new(stones, mortar, [0.0015, 0.005, 0.004], weather, 0.8);
    Box::new(move |u, v| look.texel(u, v, ashlar(u, v, columns, rows)))
}

/// Large floor slabs, worn and half polished.
pub fn slabs(stones: [Rgb; 2], columns: i32, rows: i32, rough: f32) -> Surface {
    let mortar = shade(stones[0], 0.42);
    let look = Masonry::new(stones, mortar, [0.0012, 0.003, 0.0025], 0.25, rough);
    Box::new(move |u, v| look.texel(u, v, courses(u, v, columns, rows, 0.5)))
}

/// Octagonal tiles with dark insets.
pub fn octagon_tiles(stones: [Rgb; 2], inset: Rgb, count: i32) -> Surface {
    let look = Masonry {
        stones,
        mortar: rgb(0x5c5448),
        joint: 0.0014,
        bevel: 0.0025,
        depth: 0.0025,
        weather: 0.35,
        rough: 0.42,
    };
    Box::new(move |u, v| {
        let cell = inset_tiles(u, v, count, 0.24);
        let look = if cell.id & 1 == 1 {
            Masonry {
                stones: [inset, shade(inset, 1.3)],
                ..look
            }
        } else {
            look
        };
        look.texel(u, v, cell)
    })
}

/// Unjointed stone: columns, capitals, mouldings.
pub fn carved_stone(stones: [Rgb; 2], veins: f32, pitting: f32, rough: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        let warp = cloud * 0.35 + mottle * 0.08;
        let ridge = 1.0 - (noise.cloud.at(u * 2.0 + warp, v + warp) - 0.5).abs() * 14.0;
        let vein = veins * smoothstep(0.2, 1.0, ridge);
        let pit = pitting * smoothstep(0.55, 0.85, grain) * smoothstep(0.3, 0.6, mottle);
        let mut color = mix(
            stones[0],
            stones[1],
            smoothstep(0.25, 0.75, cloud * 0.6 + mottle * 0.4),
        );
        color = shade(color, (0.93 + 0.14 * grain) * (1.0 - 0.45 * pit));
        color = mix(color, shade(stones[1], 0.45), vein);
        Texel {
            open: 1.0 - 0.5 * pit,
            ..Texel::new(
                color,
                0.002 * mottle * (0.3 + pitting) - 0.0035 * pit,
                rough + 0.25 * pit + 0.15 * (cloud - 0.5),
            )
        }
    })
}

/// Painted or bare plaster with trowel marks, stains and peeled patches.
pub fn plaster(paint: Rgb, under: Rgb, peeling: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        // Columns of noise stretched downwards look like rain streaks.
        let streak = noise.mottle.at(u * 2.0, v * 0.0 + 0.3) * noise.cloud.at(u, v * 0.5 + 0.25);
        let off = peeling * smoothstep(0.66, 0.70, cloud + 0.12 * (mottle - 0.5));
        let wall = shade(
            mix(
                paint,
                shade(paint, 0.72),
                smoothstep(0.2, 0.9, mottle * 0.5 + streak * 0.5),
            ),
            0.93 + 0.14 * grain,
        );
        let bare = shade(under, 0.75 + 0.5 * grain);
        Texel::new(
            mix(wall, bare, off),
            0.0016 * mottle - 0.004 * off + 0.0006 * grain,
            0.85 + 0.1 * off,
        )
    })
}

/// A carved band: egg-and-dart between fillets, repeating along u.
pub fn carved_band(stones: [Rgb; 2]) -> Surface {
    let stone = carved_stone(stones, 0.0, 0.6, 0.8);
    Box::new(move |u, v| {
        let mut texel = stone(u, v);
        let band = (v * 4.0).fract();
        let egg_u = (u * 16.0).fract() - 0.5;
        let egg = 1.0 - (egg_u * 2.6).powi(2) - ((band - 0.42) * 2.5).powi(2);
        let dart = (0.5 - (egg_u.abs() - 0.5).abs() * 9.0) * smoothstep(0.1, 0.7, band);
        let fillet = smoothstep(0.84, 0.86, band) - smoothstep(0.95, 0.97, band);
        let carved = egg.max(0.0).sqrt().max(dart.max(0.0)).max(fillet * 0.8);
        texel.height += 0.012 * carved;
        texel.open *= lerp(0.5, 1.0, smoothstep(0.0, 0.5, carved));
        texel.color = shade(texel.color, lerp(0.62, 1.04, smoothstep(0.0, 0.6, carved)));
        texel
    })
}

/// Half-round clay roof tiles in overlapping rows.
pub fn roof_tiles(stones: [Rgb; 2]) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let (columns, rows) = (12.0, 8.0);
        let (x, y) = (u * columns, v * rows);
        let (fx, fy) = (x.fract(), y.fract());
        let id = hash(x as i32, y as i32, 13);
        let round = (std::f32::consts::PI * fx).sin();
        let tone = (id & 255) as f32 / 255.0;
        let lichen = smoothstep(0.62, 0.8, noise.mottle.at(u, v));
        let mut color = mix(stones[0], stones[1], tone);
        color = shade(
            color,
            0.7 + 0.3 * round + 0.15 * (noise.grain.at(u, v) - 0.5),
        );
        color = mix(color, rgb(0x9a9a7a), 0.4 * lichen);
        let lip = smoothstep(0.0, 0.12, fy);
        Texel {
            open: 0.4 + 0.6 * round * lip,
            ..Texel::new(
                shade(color, 0.55 + 0.45 * lip),
                0.02 * round + 0.012 * fy,
                0.85,
            )
        }
    })
}

/// Polished tiles in two alternating stones, `count` (even) per side.
pub fn checker(stones: [Rgb; 2], count: i32) -> Surface {
    let surfaces = stones.map(|s| carved_stone([s, mix(s, rgb(0x8f8a84), 0.35)], 0.5, 0.0, 0.2));
    Box::new(move |u, v| {
        let cell = courses(u, v, count, count, 0.0);
        let odd = ((u * count as f32) as i32 + (v * count as f32) as i32) & 1;
        let shift = (cell.id & 255) as f32 / 256.0;
        let mut texel = surfaces[odd as usize](u * 2.0 + shift, v * 2.0 + shift);
        let tile = smoothstep(0.0012, 0.0025, cell.edge);
        texel.color = mix(rgb(0x55504a), texel.color, tile);
        texel.height = 0.0015 * tile;
        texel.rough = lerp(0.7, texel.rough, tile);
        texel
    })
}
