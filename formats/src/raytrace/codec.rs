//! The bytes of a tile: columns of small differences as variable-length integers.
//!
//! Values that can be computed from the eye, the pixel and the triangle table are not stored: position,
//! geometric normal, object and material. FORMAT.md has the layout.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::camera::sample_position_px;
use super::{
    EyeCamera, Hit, NO_PARENT, Outcome, PixelRecord, RayKind, RayRecord, RayTile, RaytraceTables,
    Visit, half, normal,
};
use crate::error::Broken;
use crate::parse::{Cursor, Parsed, Taken};
use crate::varint::{low_u32, put, put_difference, unzigzag, zigzag};

/// Ray byte: bits 0-1 kind, 2-3 outcome, then flags.
const HAS_ALPHA_TESTS: u8 = 1 << 4;
/// Flag: the parent is the pixel's primary ray, and no number follows.
const PARENT_IS_PRIMARY: u8 = 1 << 5;
/// Flag in the first byte of a ray of a kind that needs lighting; bits 0 and 1 then count from 4.
const LIGHTING_KIND: u8 = 1 << 6;

/// Bits of a visit: the zigzag of a difference of 32-bit numbers, and the kind.
const VISIT_BITS: u32 = 34;

/// Smallest size of a tile with this many samples: the hit bits, and for each sample three colours, its
/// number of rays and a ray of three bytes.
pub(super) fn least_bytes(samples: u64) -> u64 {
    samples.div_ceil(8) + (3 + 1 + 3) * samples
}

/// Writes a tile.
pub(super) fn encode(tile: &RayTile, has_visits: bool) -> Result<Vec<u8>, Broken> {
    check(tile, has_visits)?;
    let mut out = Vec::new();
    let hits = || tile.pixels.iter().filter_map(|p| p.hit.as_ref());
    out.extend(tile.pixels.chunks(8).map(|eight| {
        let bits = (0u8..).zip(eight);
        bits.fold(0, |bits, (i, p)| bits | u8::from(p.hit.is_some()) << i)
    }));
    put_columns(hits().map(|hit| [hit.primitive]), &mut out);
    put_columns(hits().map(|hit| [hit.t.to_bits()]), &mut out);
    let normals = hits().map(|hit| normal::encode(hit.shading_normal));
    put_columns(
        normals.map(|code| code.map(|value| value.cast_unsigned().into())),
        &mut out,
    );
    put_columns(hits().map(|hit| hit.uv.map(f32::to_bits)), &mut out);
    let hit_pixels = tile.pixels.iter().filter(|p| p.hit.is_some());
    put_colors(hit_pixels.map(|p| p.view_independent), &mut out);
    put_colors(tile.pixels.iter().map(|p| p.view_dependent), &mut out);
    for pixel in &tile.pixels {
        put(pixel.ray_count.into(), &mut out);
    }
    for pixel in &tile.pixels {
        for (own, ray) in (0u32..).zip(tile.rays_of(pixel)) {
            put_ray(own, ray, &mut out);
        }
    }
    let mut previous = [0; 2];
    for visit in &tile.visits {
        let (kind, index) = match *visit {
            Visit::Node(index) => (0, index),
            Visit::Triangle(slot) => (1, slot),
        };
        if let Some(previous) = previous.get_mut(kind) {
            let difference = i64::from(index) - i64::from(*previous);
            *previous = index;
            put(zigzag(difference) << 1 | kind as u64, &mut out);
        }
    }
    Ok(out)
}

/// Writes columns of differences, row by row.
fn put_columns<const N: usize>(rows: impl Iterator<Item = [u32; N]>, out: &mut Vec<u8>) {
    let mut previous = [0; N];
    for row in rows {
        for (previous, value) in previous.iter_mut().zip(row) {
            put_difference(previous, value, out);
        }
    }
}

/// Reads columns of differences, row by row.
fn take_columns<'a, const N: usize, T>(
    input: &mut Cursor<'a>,
    rows: usize,
    what: &'static str,
    value: impl Fn(Cursor<'a>, [u32; N]) -> Taken<'a, T>,
) -> Taken<'a, Vec<T>> {
    let mut row = [0; N];
    let mut values = Vec::with_capacity(rows);
    for _ in 0..rows {
        let at = *input;
        for column in &mut row {
            input.difference(column, what)?;
        }
        values.push(value(at, row)?);
    }
    Ok(values)
}

/// Writes red of all pixels, then green, then blue.
fn put_colors(colors: impl Iterator<Item = [f32; 3]> + Clone, out: &mut Vec<u8>) {
    for channel in 0..3 {
        let values = colors
            .clone()
            .filter_map(|color| color.get(channel).copied());
        put_columns(values.map(|value| [half::encode(value).into()]), out);
    }
}

fn put_ray(own: u32, ray: &RayRecord, out: &mut Vec<u8>) {
    let mut head = (ray.kind as u8 & 3) | (ray.outcome as u8) << 2;
    if ray.kind.needs_lighting() {
        head |= LIGHTING_KIND;
    }
    if ray.alpha_tests > 0 {
        head |= HAS_ALPHA_TESTS;
    }
    if own > 0 && ray.parent == 0 {
        head |= PARENT_IS_PRIMARY;
    }
    out.push(head);
    if own > 0 && ray.parent > 0 {
        put((own - ray.parent).into(), out);
    }
    put(ray.steps.into(), out);
    put(ray.triangle_tests.into(), out);
    if ray.alpha_tests > 0 {
        put(ray.alpha_tests.into(), out);
    }
}

/// Checks the invariants that readers rely on.
fn check(tile: &RayTile, has_visits: bool) -> Result<(), Broken> {
    let broken =
        |what: String, expected: &str, found: String| Err(Broken::new(what, expected, found));
    let mut next = 0u64;
    for (i, pixel) in tile.pixels.iter().enumerate() {
        let what = || format!("pixel {i}");
        let rays = tile.rays_of(pixel);
        if u64::from(pixel.first_ray) != next || rays.is_empty() {
            let found = format!("{} rays from {}", pixel.ray_count, pixel.first_ray);
            return broken(what(), "its rays behind the previous pixel's", found);
        }
        next += rays.len() as u64;
        if pixel.hit.is_none() && pixel.view_independent != [0.0; 3] {
            let found = format!("{:?}", pixel.view_independent);
            return broken(what(), "no view-independent colour without a hit", found);
        }
        let colors = [pixel.view_independent, pixel.view_dependent];
        if colors.iter().any(|c| half::round3(*c) != *c) {
            return broken(what(), "colours in half floats", format!("{colors:?}"));
        }
        for (own, ray) in (0u32..).zip(rays) {
            let what = || format!("ray {own} of pixel {i}");
            let parent = usize::try_from(ray.parent).ok().and_then(|p| rays.get(p));
            let fits = match parent {
                None => own == 0 && ray.parent == NO_PARENT && ray.depth == 0,
                Some(p) => ray.parent < own && Some(ray.depth) == p.depth.checked_add(1),
            };
            if !fits || (own == 0) != (ray.kind == RayKind::Primary) {
                let found = format!(
                    "parent {}, depth {}, kind {}",
                    ray.parent, ray.depth, ray.kind
                );
                return broken(what(), "a parent before it and one level above", found);
            }
        }
    }
    if next != tile.rays.len() as u64 {
        let found = format!("{} rays, {next} of them in pixels", tile.rays.len());
        return broken("rays".to_owned(), "every ray in a pixel", found);
    }
    let visits: u64 = tile.rays.iter().map(RayRecord::visit_count).sum();
    let expected = if has_visits { visits } else { 0 };
    if tile.visits.len() as u64 != expected {
        let found = format!("{} for {visits} steps and tests", tile.visits.len());
        return broken("visits".to_owned(), "one a step and triangle test", found);
    }
    Ok(())
}

/// Reads a tile; its `origin_px` and `size_px` must be set.
pub(super) fn decode<'a>(
    tables: &RaytraceTables,
    eye: &EyeCamera,
    input: &'a [u8],
    tile: &mut RayTile,
) -> Parsed<'a, ()> {
    let mut input = Cursor::new(input);
    let samples = tables.meta.samples_per_px;
    let [width, height] = tile.size_px;
    let count = width as usize * height as usize * samples as usize;
    let at_bits = input;
    let bits = input.bytes("a hit bit for each sample", count.div_ceil(8))?;
    let is_hit = |i: usize| bits.get(i / 8).is_some_and(|b| b >> (i % 8) & 1 == 1);
    if (count..bits.len() * 8).any(is_hit) {
        return Err(at_bits.fault("zero bits behind the last sample's", "a one"));
    }
    let hits = (0..count).filter(|i| is_hit(*i)).count();

    let primitives = take_columns(&mut input, hits, "a primitive number", |at, [primitive]| {
        let known = tables.triangle(primitive);
        known.ok_or_else(|| at.fault("a primitive of the triangle table", primitive))
    })?;
    let distances = take_columns(&mut input, hits, "a distance", |at, [bits]| {
        let distance = f32::from_bits(bits);
        let is_distance = (0.0..=f32::MAX).contains(&distance);
        at.check(is_distance, "a distance of 0 or more", distance)?;
        Ok(distance)
    })?;
    let normals = take_columns(&mut input, hits, "a normal", |at, [u, v]| {
        let short = |value| short(at, "a normal", value).map(u16::cast_signed);
        Ok([short(u)?, short(v)?])
    })?;
    let coordinates = take_columns(
        &mut input,
        hits,
        "a texture coordinate",
        |_, uv: [u32; 2]| Ok(uv.map(f32::from_bits)),
    )?;

    let found = primitives.into_iter().zip(distances);
    let mut found = found.zip(normals.into_iter().zip(coordinates));
    for (i, number) in (0..count).zip(0u32..) {
        let mut pixel = PixelRecord::default();
        if let Some(((triangle, t), (code, uv))) = is_hit(i).then(|| found.next()).flatten() {
            let at = number / samples;
            let x = tile.origin_px[0] + at % width;
            let y = tile.origin_px[1] + at / width;
            let point = sample_position_px(x, y, number % samples, samples);
            pixel.hit = Some(Hit::new(eye, eye.direction(point), t, triangle, code, uv));
        }
        tile.pixels.push(pixel);
    }
    let hit_pixels = tile.pixels.iter_mut().filter(|p| p.hit.is_some());
    decode_colors(
        &mut input,
        hit_pixels.map(|p| &mut p.view_independent).collect(),
    )?;
    decode_colors(
        &mut input,
        tile.pixels
            .iter_mut()
            .map(|p| &mut p.view_dependent)
            .collect(),
    )?;
    decode_rays(&mut input, tile, tables.meta.lighting.is_some())?;
    if tables.meta.has_visits {
        decode_visits(&mut input, tables, tile)?;
    }
    Ok((input.rest(), ()))
}

/// A value of 16 bits.
fn short<'a>(at: Cursor<'a>, what: &str, value: u32) -> Taken<'a, u16> {
    u16::try_from(value).map_err(|_| at.fault(format_args!("{what}, below 2^16"), value))
}

fn decode_colors<'a>(input: &mut Cursor<'a>, mut colors: Vec<&mut [f32; 3]>) -> Taken<'a> {
    for channel in 0..3 {
        let values = take_columns(input, colors.len(), "a colour", |at, [code]| {
            let value = half::decode(short(at, "a colour", code)?);
            at.check(value.is_finite(), "a finite colour", value)?;
            Ok(value)
        })?;
        let channel = colors.iter_mut().filter_map(|color| color.get_mut(channel));
        channel.zip(values).for_each(|(to, value)| *to = value);
    }
    Ok(())
}

fn decode_rays<'a>(input: &mut Cursor<'a>, tile: &mut RayTile, has_lighting: bool) -> Taken<'a> {
    let mut total = 0u32;
    for pixel in &mut tile.pixels {
        let at = *input;
        let count = input.number_u32("a ray count")?;
        pixel.first_ray = total;
        pixel.ray_count = count;
        // A ray takes at least three bytes.
        total = total
            .checked_add(count)
            .filter(|total| count > 0 && *total as usize <= input.rest().len() / 3)
            .ok_or_else(|| at.fault("1 ray or more, for which there are bytes", count))?;
    }
    tile.rays.reserve(total as usize);
    for pixel in &tile.pixels {
        for own in 0..pixel.ray_count {
            let earlier = tile.rays.get(pixel.first_ray as usize..);
            let ray = decode_ray(input, own, earlier, has_lighting)?;
            tile.rays.push(ray);
        }
    }
    Ok(())
}

fn decode_ray<'a>(
    input: &mut Cursor<'a>,
    own: u32,
    earlier: Option<&[RayRecord]>,
    has_lighting: bool,
) -> Taken<'a, RayRecord> {
    let at = *input;
    let head: u8 = input.fixed("a ray")?;
    let needs_lighting = head & LIGHTING_KIND != 0;
    let kind = match (head & 3, needs_lighting) {
        (0, false) => RayKind::Primary,
        (1, false) => RayKind::Shadow,
        (2, false) => RayKind::Reflection,
        (3, false) => RayKind::Refraction,
        (0, true) if has_lighting => RayKind::AmbientOcclusion,
        (1, true) if has_lighting => RayKind::Diffuse,
        (number, _) => {
            return Err(at.fault("a kind that the trace's lighting has", number + 4));
        }
    };
    let outcome = match head >> 2 & 3 {
        0 => Outcome::Miss,
        1 => Outcome::Hit,
        2 => Outcome::Occluded,
        _ => return Err(at.fault("an outcome of 0 to 2", 3)),
    };
    if head >> 7 != 0 || (own == 0 && head & PARENT_IS_PRIMARY != 0) {
        return Err(at.fault("no other flags", format_args!("{head:#04x}")));
    }
    let is_first = (own == 0) == (kind == RayKind::Primary);
    let found = format_args!("kind {kind} as ray {own}");
    at.check(is_first, "a primary ray first, then the others", found)?;
    let (parent, depth) = if own == 0 {
        (NO_PARENT, 0)
    } else {
        let parent = if head & PARENT_IS_PRIMARY != 0 {
            Some(0)
        } else {
            // The primary ray as parent has its own flag.
            own.checked_sub(input.number_u32("a parent")?)
                .filter(|p| *p > 0)
        };
        let above = parent
            .filter(|p| *p < own)
            .and_then(|p| earlier?.get(p as usize))
            .and_then(|p| p.depth.checked_add(1));
        let number = parent.zip(above);
        number.ok_or_else(|| {
            at.fault(
                "an earlier ray as parent, below 255 others",
                parent.map_or_else(|| "none".to_owned(), |p| p.to_string()),
            )
        })?
    };
    let steps = input.number_u32("a step count")?;
    let triangle_tests = input.number_u32("a triangle-test count")?;
    let alpha_tests = match head & HAS_ALPHA_TESTS {
        0 => 0,
        _ => input.number_u32("an alpha-test count")?,
    };
    if head & HAS_ALPHA_TESTS != 0 && alpha_tests == 0 {
        return Err(at.fault("alpha tests, as the flag requires", 0));
    }
    Ok(RayRecord {
        kind,
        outcome,
        depth,
        parent,
        steps,
        triangle_tests,
        alpha_tests,
    })
}

fn decode_visits<'a>(
    input: &mut Cursor<'a>,
    tables: &RaytraceTables,
    tile: &mut RayTile,
) -> Taken<'a> {
    let visits: u64 = tile.rays.iter().map(RayRecord::visit_count).sum();
    if visits > input.rest().len() as u64 {
        return Err(input.fault("a byte or more for each visit", visits));
    }
    let mut previous = [0u32; 2];
    let ends = [tables.bvh.nodes, tables.bvh.triangles];
    for _ in 0..visits {
        let at = *input;
        let code = input.number("a visit", VISIT_BITS)?;
        let slot = usize::from(code & 1 == 1);
        let difference = unzigzag(code >> 1);
        let (Some(previous), Some(end)) = (previous.get_mut(slot), ends.get(slot)) else {
            break;
        };
        let index = i64::from(*previous)
            .saturating_add(difference)
            .cast_unsigned();
        if index >= *end {
            let expected = format!("a node or triangle slot below {end}");
            return Err(at.fault(expected, index.cast_signed()));
        }
        *previous = low_u32(index);
        tile.visits.push(match slot {
            0 => Visit::Node(*previous),
            _ => Visit::Triangle(*previous),
        });
    }
    Ok(())
}
