//! Surfaces of the plant: concrete, cladding, painted and bare steel, gratings, signs.

use crate::noise::{bank, hash_unit, lerp, smoothstep};
use crate::texture_synth::{Rgb, Surface, Texel, mix, rgb, shade};
use glam::vec3;
use std::f32::consts::TAU;

/// Number of services that pipes carry. Each has its own colour of paint.
pub(super) const SERVICES: usize = 6;

/// Materials of pipes by service.
pub(super) const PIPES: [&str; SERVICES] = [
    "pipe-water",
    "pipe-air",
    "pipe-gas",
    "pipe-fire",
    "pipe-steam",
    "pipe-acid",
];
/// Materials of cables.
pub(super) const CABLES: [&str; 3] = ["cable-black", "cable-grey", "cable-orange"];
/// Painted steel: clouds of dirt, chips down to rust.
pub fn painted(color: Rgb, wear: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        let chipped = wear * smoothstep(0.66, 0.74, 0.5 * mottle + 0.3 * cloud + 0.2 * grain);
        let dirt = smoothstep(0.5, 0.95, cloud) * 0.2;
        let paint = shade(color, (0.92 + 0.14 * grain) * (1.0 - dirt));
        let rust = shade(mix(rgb(0x6b4630), rgb(0x3b3634), mottle), 0.7 + 0.5 * grain);
        Texel {
            metal: 0.3 * chipped,
            ..Texel::new(
                mix(paint, rust, chipped.min(1.0)),
                0.0007 * grain - 0.002 * chipped + 0.0006 * mottle,
                0.42 + 0.35 * chipped + 0.2 * dirt,
            )
        }
    })
}

/// A concrete floor with saw cuts along its edges, stains and tyre marks.
pub fn concrete() -> Surface {
    Box::new(|u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        let edge = |x: f32| (x - x.floor()).min(1.0 - (x - x.floor()));
        let cut = smoothstep(0.0016, 0.0008, edge(u * 2.0).min(edge(v * 2.0)) / 2.0);
        let stain = smoothstep(
            0.62,
            0.8,
            0.6 * cloud + 0.4 * noise.mottle.at(u * 0.5, v * 0.5),
        );
        let wobble = 0.01 * (noise.cloud.at(u * 0.3, v) - 0.5);
        let tyre = |at: f32| smoothstep(0.02, 0.008, (edge(u + wobble - at)).abs());
        let marks = (tyre(0.31) + tyre(0.56)) * smoothstep(0.4, 0.7, noise.cloud.at(0.2, v));
        let pores = smoothstep(0.75, 0.95, grain) * 0.4;
        let mut color = mix(rgb(0x8e8d88), rgb(0x77767a), cloud);
        color = shade(color, 0.9 + 0.2 * mottle - 0.25 * pores);
        color = shade(color, 1.0 - 0.28 * stain - 0.3 * marks.min(1.0) - 0.6 * cut);
        let polish = smoothstep(0.3, 0.6, mottle);
        Texel {
            open: 1.0 - 0.4 * cut,
            ..Texel::new(
                color,
                0.0004 * mottle - 0.0012 * cut - 0.0004 * pores,
                lerp(0.75, 0.5, polish) - 0.15 * stain + 0.2 * cut,
            )
        }
    })
}

/// Trapezoidal sheet: ribs along v, one lap per texture, streaks below the screws.
pub fn cladding(color: Rgb) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let rib = (u * 12.0).fract();
        let flank = smoothstep(0.2, 0.3, rib) - smoothstep(0.7, 0.8, rib);
        let lap = smoothstep(0.004, 0.0, v.min(1.0 - v));
        let streak = noise.mottle.at(u * 2.0, v * 0.06 + 0.4) * noise.cloud.at(u, v);
        let dirt = smoothstep(0.3, 0.75, streak);
        let tone = 0.9 + 0.08 * flank + 0.08 * noise.grain.at(u, v);
        Texel {
            open: 0.75 + 0.25 * flank,
            ..Texel::new(
                shade(color, tone * (1.0 - 0.35 * dirt) * (1.0 - 0.4 * lap)),
                0.008 * flank - 0.003 * lap,
                0.5 + 0.3 * dirt,
            )
        }
    })
}

/// Zinc with its spangle.
pub fn galvanised() -> Surface {
    Box::new(|u, v| {
        let noise = bank();
        let spangle = noise.pebble.at(u * 2.0, v * 2.0);
        let cell = hash_unit(
            (u * 48.0 + noise.mottle.at(u, v) * 3.0) as i32,
            (v * 48.0 + noise.mottle.at(v, u) * 3.0) as i32,
            19,
        );
        let tone = 0.8 + 0.18 * cell + 0.12 * (spangle - 0.5);
        Texel {
            metal: 0.75,
            ..Texel::new(
                shade(rgb(0xa7acb0), tone),
                0.0004 * spangle,
                0.38 + 0.2 * cell,
            )
        }
    })
}

/// Sheet-metal lagging of a steam pipe with its bands.
pub fn lagging() -> Surface {
    Box::new(|u, v| {
        let noise = bank();
        // Pipes run along u.
        let along = (u * 2.0).fract();
        let band = smoothstep(0.03, 0.025, (along - 0.5).abs());
        let lap = smoothstep(0.012, 0.0, along.min(1.0 - along));
        let dent = noise.cloud.at(u, v);
        Texel {
            metal: 0.7,
            ..Texel::new(
                shade(rgb(0xc3c6c8), 0.82 + 0.2 * dent + 0.1 * band - 0.3 * lap),
                0.003 * dent + 0.004 * band - 0.004 * lap,
                0.34 + 0.15 * noise.grain.at(u, v),
            )
        }
    })
}

/// Bearing bars and cross rods. More than half is steel, so that distant mip levels stay opaque.
pub fn grating_bars() -> Surface {
    Box::new(|u, v| {
        let noise = bank();
        let bar = ((u * 20.0).fract() - 0.5).abs() > 0.31;
        let rod = ((v * 10.0).fract() - 0.5).abs() > 0.36;
        let tone = 0.75 + 0.3 * noise.grain.at(u, v);
        Texel {
            alpha: f32::from(u8::from(bar || rod)),
            metal: 0.6,
            ..Texel::new(shade(rgb(0x9a9ea2), tone), 0.0, 0.5)
        }
    })
}

/// Stripes of yellow and black paint.
pub fn hazard_stripes() -> Surface {
    let paint = painted(rgb(0xe3b91e), 0.3);
    let black = painted(rgb(0x222222), 0.3);
    Box::new(move |u, v| {
        let stripe = ((u + v) * 4.0).fract() < 0.5;
        if stripe { paint(u, v) } else { black(u, v) }
    })
}

/// Enamelled sheets with seams, screws and louvres.
pub fn machine_paint(color: Rgb) -> Surface {
    let paint = painted(color, 0.12);
    Box::new(move |u, v| {
        let mut texel = paint(u, v);
        let (x, y) = ((u * 2.0).fract(), (v * 2.0).fract());
        let seam = smoothstep(0.006, 0.003, x.min(1.0 - x).min(y).min(1.0 - y));
        let corner = vec3((x - 0.5).abs() - 0.46, (y - 0.5).abs() - 0.46, 0.0).length();
        let screw = smoothstep(0.014, 0.010, corner);
        let louvres = u > 0.58 && u < 0.92 && v > 0.1 && v < 0.32;
        let slot = if louvres { (v * 44.0).fract() } else { 0.5 };
        let shadow = if louvres {
            smoothstep(0.5, 0.9, slot)
        } else {
            0.0
        };
        texel.color = shade(texel.color, 1.0 - 0.55 * seam - 0.5 * shadow - 0.3 * screw);
        texel.height += 0.003 * slot - 0.003 * seam + 0.0015 * screw;
        texel.open = 1.0 - 0.4 * seam - 0.4 * shadow;
        texel
    })
}

/// Slotted uprights of a pallet rack.
pub fn perforated(color: Rgb) -> Surface {
    let paint = painted(color, 0.2);
    Box::new(move |u, v| {
        let mut texel = paint(u, v);
        let (x, y) = ((u * 20.0).fract() - 0.5, (v * 20.0).fract() - 0.5);
        let hole = smoothstep(0.24, 0.2, (x * x * 2.5 + y * y).sqrt());
        texel.color = mix(texel.color, rgb(0x101418), hole);
        texel.height -= 0.004 * hole;
        texel
    })
}

/// A cabinet's door: a screen, instruments, rows of buttons.
pub fn control_panel() -> Surface {
    let paint = machine_paint(rgb(0x9aa0a4));
    Box::new(move |u, v| {
        let mut texel = paint(u * 0.5, v * 0.5);
        let inside = |x0: f32, y0: f32, x1: f32, y1: f32| u > x0 && u < x1 && v > y0 && v < y1;
        if inside(0.12, 0.1, 0.62, 0.4) {
            let line = (v * 40.0) as i32;
            let reach = 0.16 + 0.42 * hash_unit(line, 1, 5);
            let lit = (v * 40.0).fract() < 0.6 && u > 0.15 && u < reach;
            let wave = (0.25 + 0.05 * (u * 40.0).sin() - v).abs() < 0.006;
            let on = if wave { rgb(0xf0d040) } else { rgb(0x58c890) };
            texel.color = if lit || wave { on } else { rgb(0x10241f) };
            (texel.rough, texel.metal) = (0.15, 0.0);
        } else if inside(0.12, 0.5, 0.88, 0.8) {
            let (x, y) = ((u * 12.0).fract() - 0.5, (v * 12.0).fract() - 0.5);
            let r = x.hypot(y);
            let id = hash_unit((u * 12.0) as i32, (v * 12.0) as i32, 3);
            let cap = [0xb02418, 0x1e8a3c, 0xd8b020, 0xe6e6e0][(id * 4.0) as usize & 3];
            if r < 0.3 {
                texel.color = shade(rgb(cap), 0.75 + 0.5 * (0.3 - r));
                texel.height += 0.006 * (0.3 - r);
            } else if r < 0.36 {
                texel.color = rgb(0x202224);
            }
        } else {
            for center in [0.22, 0.36] {
                let (x, y) = (u - 0.77, v - center);
                let r = x.hypot(y);
                if r < 0.055 {
                    let needle = (x - y).abs() < 0.006 && x > -0.01;
                    texel.color = if needle { rgb(0xb02418) } else { rgb(0xecebe4) };
                } else if r < 0.065 {
                    texel.color = rgb(0x202224);
                }
            }
        }
        texel
    })
}

/// A yellow triangle on white above lines of text.
pub fn warning_sign() -> Surface {
    Box::new(|u, v| {
        let rim = u.min(1.0 - u).min(v.min(1.0 - v));
        let half = (v - 0.1) * 0.55;
        let within = |inset: f32| {
            v > 0.1 + 1.6 * inset && v < 0.62 - inset && (u - 0.5).abs() < half - 1.5 * inset
        };
        let mark =
            (u - 0.5).abs() < 0.025 && v > 0.28 && v < 0.46 || (u - 0.5).hypot(v - 0.53) < 0.03;
        let line = (v * 16.0) as i32;
        let text = (11..15).contains(&line)
            && (v * 16.0).fract() < 0.55
            && u > 0.12
            && u < 0.5 + 0.38 * hash_unit(line, 3, 1);
        let color = if rim < 0.03 || mark && within(0.0) || text || within(0.0) && !within(0.03) {
            rgb(0x18181a)
        } else if within(0.03) {
            rgb(0xeebb18)
        } else {
            rgb(0xe8e6de)
        };
        Texel::new(shade(color, 0.9 + 0.15 * bank().cloud.at(u, v)), 0.0, 0.5)
    })
}

/// Corrugated board with tape and a printed mark.
pub fn cardboard() -> Surface {
    Box::new(|u, v| {
        let noise = bank();
        let flute = (u * 64.0 * TAU).sin();
        let tape = smoothstep(0.05, 0.04, (v - 0.5).abs());
        let stamp = (0.12..0.3).contains(&u)
            && (0.12..0.3).contains(&v)
            && hash_unit((u * 60.0) as i32, (v * 20.0) as i32, 8) > 0.45;
        let mut color = shade(
            rgb(0xa8804e),
            0.9 + 0.2 * noise.cloud.at(u, v) + 0.03 * flute,
        );
        color = mix(color, rgb(0xc2a878), 0.6 * tape);
        if stamp {
            color = shade(color, 0.45);
        }
        Texel::new(color, 0.0004 * flute, 0.85 - 0.35 * tape)
    })
}
