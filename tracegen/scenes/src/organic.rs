//! Wood, bark, leaves, soil, cloth and metal surfaces.

use super::noise::{bank, hash_unit, lerp, smoothstep};
use super::texture_synth::{Rgb, Surface, Texel, mix, rgb, shade};
use std::f32::consts::{PI, TAU};

/// Planks with the grain along u.
pub fn planks(woods: [Rgb; 2], rows: i32, rough: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let y = v * rows as f32;
        let row = y.floor() as i32;
        let fy = y - row as f32;
        let offset = hash_unit(row, 3, 71);
        let rings = noise.cloud.at(u + offset, v * 6.0 + offset);
        let line = ((rings * 9.0 + noise.mottle.at(u * 0.0 + offset, v * 4.0) * 2.0).fract() - 0.5)
            .abs()
            * 2.0;
        let fibre = noise
            .grain
            .at(u * 0.0 + noise.cloud.at(u, v) * 0.08, v * 3.0 + offset);
        let seam = smoothstep(0.0, 0.03, fy.min(1.0 - fy));
        let end = ((u + offset).fract() - 0.5).abs();
        let gap = seam * smoothstep(0.0, 0.002, (end - 0.002).max(0.0));
        let tone = 0.25 * line + 0.35 * fibre + 0.4 * hash_unit(row, 9, 5);
        let color = shade(mix(woods[0], woods[1], tone), lerp(0.25, 1.0, gap));
        Texel {
            open: lerp(0.4, 1.0, gap),
            ..Texel::new(
                color,
                0.004 * gap + 0.0012 * fibre + 0.0006 * line,
                rough + 0.2 * (fibre - 0.5),
            )
        }
    })
}

/// A surface with the grain along v instead of u.
pub fn upright(surface: Surface) -> Surface {
    Box::new(move |u, v| surface(v, u))
}

/// One piece of polished wood with straight grain along u.
pub fn polished_wood(woods: [Rgb; 2], rough: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let warp = noise.cloud.smooth(u, v) * 0.10 + noise.cloud.at(u * 0.0 + 0.5, v * 2.0) * 0.05;
        let rings = ((v + warp) * 22.0).fract();
        let ring = smoothstep(0.0, 0.7, rings) * (1.0 - smoothstep(0.85, 1.0, rings));
        let fibre = noise.grain.at(u * 0.25, v * 3.0);
        let tone = 0.55 * ring + 0.3 * fibre + 0.25 * noise.cloud.at(u, v);
        Texel::new(
            mix(woods[0], woods[1], tone),
            0.0004 * fibre,
            rough + 0.1 * (fibre - 0.5),
        )
    })
}

/// Fissured bark with ridges along v.
pub fn bark(colors: [Rgb; 2], moss: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let warp = noise.cloud.at(u, v) * 0.12;
        let ridge = noise
            .mottle
            .at(u * 2.0 + warp, v * 0.5 + warp * 0.5)
            .max(0.9 * noise.pebble.at(u * 2.0 + warp, v));
        let ridge = smoothstep(0.2, 0.85, ridge);
        let grain = noise.grain.at(u, v * 0.5);
        let green = moss
            * smoothstep(
                0.45,
                0.75,
                noise.cloud.at(u + 0.5, v + 0.25) + 0.25 * ridge - 0.1,
            );
        let color = shade(
            mix(colors[0], colors[1], ridge * 0.8 + 0.2 * grain),
            0.8 + 0.4 * grain,
        );
        let color = mix(color, shade(rgb(0x6f8a38), 0.5 + 0.7 * grain), green);
        Texel {
            open: 0.35 + 0.65 * ridge,
            ..Texel::new(
                color,
                0.016 * ridge + 0.002 * grain + 0.003 * green * grain,
                0.92,
            )
        }
    })
}

/// Shape of a leaf that fills its texture, tip at v = 0, stalk at v = 1.
#[derive(Clone, Copy, Debug)]
pub enum LeafShape {
    /// One pointed blade with a midrib and side veins.
    Blade,
    /// Leaflets on both sides of a stalk.
    Frond,
    /// A fan of fingers.
    Palm,
    /// Several small leaves on a twig.
    Spray,
    /// A lobed ivy leaf.
    Ivy,
    /// A clump of thin stalks.
    Grass,
}

/// A leaf with its coverage in alpha.
pub fn leaf(shape: LeafShape, colors: [Rgb; 2]) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let (x, y) = (2.0 * u - 1.0, 1.0 - v);
        let (inside, vein) = leaf_outline(shape, x, y);
        let grain = noise.grain.at(u, v);
        let mottle = noise.mottle.at(u, v);
        let alpha = smoothstep(-0.015, 0.015, inside);
        let rim = smoothstep(0.0, 0.10, inside);
        let mut color = mix(colors[0], colors[1], 0.55 * mottle + 0.3 * y + 0.15 * vein);
        color = shade(color, (0.82 + 0.3 * grain) * lerp(0.72, 1.0, rim));
        color = mix(color, mix(colors[1], rgb(0xd8dc90), 0.45), 0.5 * vein);
        Texel {
            alpha,
            ..Texel::new(color, 0.006 * vein + 0.002 * mottle, 0.55 + 0.15 * mottle)
        }
    })
}

/// A signed measure of the inside (positive inside, similar to a distance) and the strength of
/// veins, for x in -1..1 and y from the stalk (0) to the tip (1).
fn leaf_outline(shape: LeafShape, x: f32, y: f32) -> (f32, f32) {
    match shape {
        LeafShape::Blade => blade(x, y, 0.78),
        LeafShape::Ivy => ivy(x, y),
        LeafShape::Frond => frond(x, y),
        LeafShape::Palm => palm(x, y),
        LeafShape::Spray => spray(x, y),
        LeafShape::Grass => grass(x, y),
    }
}

fn blade(x: f32, y: f32, width: f32) -> (f32, f32) {
    let half = width
        * (PI * y.clamp(0.0, 1.0).powf(0.75))
            .sin()
            .max(0.0)
            .powf(0.85);
    let inside = (half - x.abs()).min(y - 0.01).min(0.99 - y);
    let side = ((y * 12.0 - x.abs() * 5.0 / width.max(0.05)).fract() - 0.5).abs();
    let rib = 1.0 - smoothstep(0.012, 0.035, x.abs());
    (inside, rib.max(0.55 * (1.0 - smoothstep(0.02, 0.12, side))))
}

fn ivy(x: f32, y: f32) -> (f32, f32) {
    let (dx, dy) = (x, y - 0.36);
    let angle = dx.atan2(dy);
    let lobe = 0.36
        + 0.22 * (angle * 2.5).cos().abs().powf(0.7) * (1.0 - 0.22 * angle.abs() / PI)
        + 0.08 * (-angle.abs()).exp();
    let r = (dx * dx * 0.62 + dy * dy).sqrt();
    let star = ((angle * 2.5 / PI).fract() - 0.0).abs();
    let vein = 1.0 - smoothstep(0.03, 0.10, star.min(1.0 - star) * (r + 0.15));
    (lobe - r, vein)
}

fn frond(x: f32, y: f32) -> (f32, f32) {
    let pairs = 15.0;
    let envelope = 0.96 * (PI * (0.06 + 0.94 * y)).sin().powf(0.6) * (1.0 - 0.25 * y);
    let stem = 0.018 - x.abs();
    // Leaflets point forwards: a leaflet's axis is a line of constant y - 0.35 |x|.
    let s = (y - 0.38 * x.abs()) * pairs;
    let within = (s - s.floor() - 0.5).abs();
    let reach = (x.abs() / envelope.max(0.02)).clamp(0.0, 1.2);
    let half = 0.44 * (1.0 - reach * reach) * smoothstep(0.0, 0.08, reach + 0.05);
    let leaflet = (half - within) / pairs * 2.0;
    let inside = if y > 0.985 || s < 0.0 {
        -1.0
    } else {
        leaflet.max(stem)
    };
    (
        inside,
        (1.0 - smoothstep(0.015, 0.04, x.abs()))
            .max(0.8 - within * 12.0)
            .clamp(0.0, 1.0),
    )
}

fn palm(x: f32, y: f32) -> (f32, f32) {
    let angle = x.atan2(y + 0.02);
    let r = (x * x + (y + 0.02) * (y + 0.02)).sqrt();
    let fingers = 11.0;
    let s = (angle / 2.9 + 0.5) * fingers;
    let within = (s.fract() - 0.5).abs();
    let length = 0.97 - 0.22 * (angle / 1.4).powi(2);
    let half = 0.47 * (1.0 - ((r - 0.35) / (length - 0.35)).clamp(0.0, 1.0).powi(2));
    let inside = if (0.0..fingers).contains(&s) {
        (half - within) * r * 0.26
    } else {
        -1.0
    };
    let stem = if y < 0.2 { 0.02 - x.abs() } else { -1.0 };
    (
        inside.min(length - r).max(stem),
        1.0 - smoothstep(0.0, 0.10, within),
    )
}

fn spray(x: f32, y: f32) -> (f32, f32) {
    let mut best = (0.012 - (x - 0.06 * (y * 7.0).sin()).abs(), 0.6);
    for i in 0..9 {
        let side = if i % 2 == 0 { 1.0 } else { -1.0f32 };
        let base = 0.06 + 0.088 * i as f32;
        let (angle, size) = (side * (1.05 - 0.06 * i as f32), 0.60 - 0.028 * i as f32);
        let (sin, cos) = angle.sin_cos();
        let (dx, dy) = (x - 0.06 * (base * 7.0).sin(), (y - base) * 2.0);
        let (lx, ly) = (dx * cos - dy * sin, dx * sin + dy * cos);
        // Most texels are far from most leaves, so the powers are skipped.
        if !(-0.1..1.4).contains(&ly) || lx.abs() > 0.4 {
            continue;
        }
        let (inside, vein) = blade(lx / size * 1.15, ly / size * 0.8, 0.42);
        if inside * size > best.0 {
            best = (inside * size, vein);
        }
    }
    if !(0.01..=0.99).contains(&y) || x.abs() > 0.98 {
        (-1.0, 0.0)
    } else {
        best
    }
}

fn grass(x: f32, y: f32) -> (f32, f32) {
    let mut best = -1.0f32;
    for i in 0..17 {
        let root = -0.8 + 0.1 * i as f32;
        let height = 0.55 + 0.42 * hash_unit(i, 1, 3);
        let lean = (hash_unit(i, 2, 3) - 0.5) * 0.9;
        let center = root * 0.8 + lean * (y / height).powi(2) * height;
        let half = 0.05 * (1.0 - y / height);
        best = best.max((half - (x - center).abs()).min(0.97 - x.abs()));
    }
    (best, 0.3)
}

/// Soil with pebbles and twigs, or a forest floor under leaf litter.
pub fn soil(colors: [Rgb; 2], litter: Option<Rgb>, stones: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        let pebble =
            stones * smoothstep(0.42, 0.2, noise.pebble.at(u, v)) * smoothstep(0.4, 0.6, mottle);
        let mut color = shade(
            mix(colors[0], colors[1], 0.5 * cloud + 0.5 * mottle),
            0.7 + 0.6 * grain,
        );
        let mut height = 0.008 * mottle + 0.004 * grain + 0.01 * pebble;
        if let Some(leaf) = litter {
            let shingle = noise
                .pebble
                .at(u * 2.0 + 0.1 * mottle, v * 2.0 + 0.1 * cloud);
            let cover = smoothstep(0.35, 0.55, noise.cloud.at(u + 0.3, v + 0.6));
            color = mix(
                color,
                shade(leaf, 0.45 + 0.75 * (1.0 - shingle) + 0.3 * (grain - 0.5)),
                0.85 * cover,
            );
            height += 0.010 * cover * (1.0 - shingle);
        }
        color = mix(color, shade(rgb(0x8d8578), 0.7 + 0.5 * grain), pebble);
        Texel {
            open: 0.6 + 0.4 * mottle,
            ..Texel::new(color, height, 0.95 - 0.15 * pebble)
        }
    })
}

/// Rock with cracks, strata, and moss on parts that face up in the texture.
pub fn rock(colors: [Rgb; 2], moss: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        let warp = 0.3 * cloud;
        let crack = smoothstep(
            0.06,
            0.0,
            (noise.cloud.at(u + warp, v * 2.0 + warp) - 0.5).abs(),
        );
        let strata = ((v * 12.0 + cloud * 4.0).fract() - 0.5).abs();
        let mut color = mix(
            colors[0],
            colors[1],
            0.5 * mottle + 0.3 * cloud + 0.3 * strata,
        );
        color = shade(color, (0.75 + 0.5 * grain) * (1.0 - 0.5 * crack));
        let green = moss
            * smoothstep(
                0.5,
                0.7,
                noise.cloud.at(u + 0.6, v + 0.1) + 0.3 * (mottle - 0.5),
            );
        color = mix(color, shade(rgb(0x5d7a2c), 0.5 + 0.8 * grain), green);
        Texel {
            open: 1.0 - 0.5 * crack,
            ..Texel::new(
                color,
                0.014 * mottle + 0.004 * strata - 0.012 * crack + 0.004 * grain,
                0.9,
            )
        }
    })
}

/// Woven cloth with a damask pattern that repeats `pattern` times per texture.
pub fn damask(ground: Rgb, figure: Rgb, pattern: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let threads = 128.0;
        let (warp, weft) = ((u * threads * TAU).sin(), (v * threads * TAU).sin());
        let over = ((u * threads) as i32 + (v * threads) as i32) & 1 == 0;
        let weave = if over { warp.abs() } else { weft.abs() };
        let (x, y) = ((u * pattern).fract() - 0.5, (v * pattern).fract() - 0.5);
        let shift = if (v * pattern) as i32 & 1 == 1 {
            ((u * pattern + 0.5).fract()) - 0.5
        } else {
            x
        };
        let r = (shift * shift * 1.7 + y * y).sqrt();
        let angle = shift.atan2(y);
        let petals = 0.30 + 0.09 * (6.0 * angle).cos() + 0.03 * (14.0 * angle).cos();
        let flower = smoothstep(0.02, -0.02, r - petals)
            - smoothstep(0.02, -0.02, r - petals * 0.62)
            + smoothstep(0.02, -0.02, r - 0.08);
        let vine = smoothstep(0.05, 0.02, (shift - 0.32 * (TAU * y).sin()).abs() - 0.012);
        let figure_here = flower.max(0.8 * vine).clamp(0.0, 1.0);
        let worn = noise.cloud.at(u, v);
        let color = shade(
            mix(ground, figure, figure_here),
            (0.72 + 0.28 * weave) * (0.85 + 0.25 * worn),
        );
        Texel::new(
            color,
            0.0014 * weave + 0.0012 * figure_here,
            0.85 - 0.3 * figure_here,
        )
    })
}

/// Metal with scratches and, where `patina` is above zero, oxide in the hollows.
pub fn metal(color: Rgb, oxide: Rgb, patina: f32, rough: f32) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        let scratch = noise.grain.at(u * 0.125 + 0.2 * cloud, v * 2.0);
        let rust = patina * smoothstep(0.4, 0.65, 0.6 * cloud + 0.4 * mottle);
        let bare = shade(color, 0.85 + 0.2 * scratch);
        Texel {
            metal: 1.0 - rust,
            ..Texel::new(
                mix(bare, shade(oxide, 0.7 + 0.6 * grain), rust),
                0.0006 * scratch + 0.003 * rust * grain + 0.001 * mottle,
                rough + 0.12 * (scratch - 0.5) + 0.45 * rust,
            )
        }
    })
}

/// Grass seen from above.
pub fn turf(colors: [Rgb; 2], earth: Rgb) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let (cloud, mottle) = (noise.cloud.at(u, v), noise.mottle.at(u, v));
        let blades = noise.grain.at(u + 0.02 * mottle, v * 0.5 + 0.05 * cloud);
        let bare = smoothstep(0.62, 0.78, cloud * 0.7 + mottle * 0.3);
        let color = shade(
            mix(colors[0], colors[1], 0.5 * mottle + 0.5 * blades),
            0.6 + 0.6 * blades,
        );
        Texel::new(
            mix(color, shade(earth, 0.7 + 0.5 * blades), bare),
            0.01 * blades,
            0.95,
        )
    })
}

/// Scaly hide, darker along the folds.
pub fn skin(colors: [Rgb; 2]) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let [cloud, mottle, grain] = noise.at(u, v);
        let scale = noise.pebble.at(u * 3.0 + 0.02 * mottle, v * 3.0);
        let fold = noise.pebble.at(u + 0.05 * cloud, v + 0.05 * cloud);
        let bump = 1.0 - scale.min(1.0);
        let stripe = smoothstep(
            0.45,
            0.6,
            noise.cloud.at(u * 0.0 + 0.02 * mottle + 0.25, v * 2.0),
        );
        let color = mix(colors[0], colors[1], 0.65 * stripe + 0.35 * cloud);
        let color = shade(color, (0.55 + 0.55 * bump) * (0.85 + 0.3 * grain));
        Texel {
            open: 0.5 + 0.5 * bump,
            ..Texel::new(color, 0.004 * bump - 0.004 * fold, 0.62 + 0.2 * scale)
        }
    })
}

/// A bottle's paper label with a border and lines of writing.
pub fn paper_label(paper: Rgb, ink: Rgb) -> Surface {
    Box::new(move |u, v| {
        let noise = bank();
        let rim = u.min(1.0 - u).min(v.min(1.0 - v));
        let border = smoothstep(0.012, 0.0, (rim - 0.06).abs());
        let line = (v * 9.0) as i32;
        let (start, end) = (0.15, 0.55 + 0.3 * hash_unit(line, 4, 8));
        let letter = noise
            .grain
            .at(u * 0.35, line as f32 * 0.137 + 0.01 * (v * 9.0).fract());
        let inside = (start..end).contains(&u)
            && (2..8).contains(&line)
            && (0.25..0.7).contains(&(v * 9.0).fract());
        let written = if inside {
            smoothstep(0.5, 0.6, letter)
        } else {
            0.0
        };
        let color = shade(paper, 0.85 + 0.2 * noise.cloud.at(u * 0.5, v * 0.5));
        Texel::new(mix(color, ink, border.max(written)), 0.0, 0.9)
    })
}
