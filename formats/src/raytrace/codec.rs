//! The bytes of a tile: columns of small differences in variable-length integers.
//!
//! What follows from the eye, the pixel and the triangle table is not stored: position, geometric
//! normal, object and material. FORMAT.md has the layout.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::bytes::{ByteReader, ByteWriter, Fail};
use super::camera::sample_position_px;
use super::{
    EyeCamera, Hit, NO_PARENT, Outcome, PixelRecord, RayKind, RayRecord, RayTile, RaytraceTables,
    Visit, half, normal,
};

/// Ray byte: bits 0-1 kind, 2-3 outcome, then flags.
const HAS_ALPHA_TESTS: u8 = 1 << 4;
/// The parent is the pixel's primary ray, and no number follows.
const PARENT_IS_PRIMARY: u8 = 1 << 5;

/// A tile that breaks an invariant of the format.
pub(super) struct Broken {
    pub what: String,
    pub expected: &'static str,
    pub found: String,
}

/// Writes a tile.
pub(super) fn encode(tile: &RayTile, has_visits: bool) -> Result<Vec<u8>, Broken> {
    check(tile, has_visits)?;
    let mut out = ByteWriter::default();
    let hits = || tile.pixels.iter().filter_map(|p| p.hit.as_ref());
    let mut bits = 0u8;
    for (i, pixel) in tile.pixels.iter().enumerate() {
        bits |= u8::from(pixel.hit.is_some()) << (i % 8);
        if i % 8 == 7 || i + 1 == tile.pixels.len() {
            out.byte(bits);
            bits = 0;
        }
    }
    let mut previous = 0;
    for hit in hits() {
        out.difference(&mut previous, hit.primitive);
    }
    let mut previous = 0;
    for hit in hits() {
        out.difference(&mut previous, hit.t.to_bits());
    }
    let mut previous = [0; 2];
    for hit in hits() {
        let code = normal::encode(hit.shading_normal);
        for (previous, value) in previous.iter_mut().zip(code) {
            out.difference(previous, u32::from(value.cast_unsigned()));
        }
    }
    let mut previous = [0; 2];
    for hit in hits() {
        for (previous, value) in previous.iter_mut().zip(hit.uv) {
            out.difference(previous, value.to_bits());
        }
    }
    for channel in 0..3 {
        let mut previous = 0;
        for pixel in tile.pixels.iter().filter(|p| p.hit.is_some()) {
            let value = pixel.view_independent.get(channel).copied();
            out.difference(&mut previous, u32::from(half::encode(value.unwrap_or(0.0))));
        }
    }
    for channel in 0..3 {
        let mut previous = 0;
        for pixel in &tile.pixels {
            let value = pixel.view_dependent.get(channel).copied();
            out.difference(&mut previous, u32::from(half::encode(value.unwrap_or(0.0))));
        }
    }
    for pixel in &tile.pixels {
        out.number(pixel.ray_count);
    }
    for pixel in &tile.pixels {
        for (own, ray) in (0u32..).zip(tile.rays_of(pixel)) {
            encode_ray(&mut out, own, ray);
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
            out.wide(zigzag(difference) << 1 | kind as u64);
        }
    }
    Ok(out.into_bytes())
}

fn encode_ray(out: &mut ByteWriter, own: u32, ray: &RayRecord) {
    let mut head = ray.kind as u8 | (ray.outcome as u8) << 2;
    if ray.alpha_tests > 0 {
        head |= HAS_ALPHA_TESTS;
    }
    if own > 0 && ray.parent == 0 {
        head |= PARENT_IS_PRIMARY;
    }
    out.byte(head);
    if own > 0 && ray.parent > 0 {
        out.number(own - ray.parent);
    }
    out.number(ray.steps);
    out.number(ray.triangle_tests);
    if ray.alpha_tests > 0 {
        out.number(ray.alpha_tests);
    }
}

/// Checks what a reader will rely on.
fn check(tile: &RayTile, has_visits: bool) -> Result<(), Broken> {
    let broken = |what: String, expected, found: String| {
        Err(Broken {
            what,
            expected,
            found,
        })
    };
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
                let found = format!("{ray:?}");
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

/// Reads a tile whose `origin_px` and `size_px` are set.
pub(super) fn decode(
    tables: &RaytraceTables,
    eye: &EyeCamera,
    bytes: &[u8],
    tile: &mut RayTile,
) -> Result<(), Fail> {
    let mut input = ByteReader::new(bytes);
    let samples = tables.meta.samples_per_px;
    let [width, height] = tile.size_px;
    let count = width as usize * height as usize * samples as usize;
    let bits = input.take(count.div_ceil(8), "a hit bit for each pixel")?;
    let is_hit = |i: usize| bits.get(i / 8).is_some_and(|b| b >> (i % 8) & 1 == 1);
    if (count..bits.len() * 8).any(is_hit) {
        return Err(input.fail("zero bits behind the last pixel", "a one"));
    }
    let hits = (0..count).filter(|i| is_hit(*i)).count();

    let mut primitives = Vec::with_capacity(hits);
    let mut previous = 0;
    for _ in 0..hits {
        primitives.push(input.difference(&mut previous, "a primitive number")?);
    }
    let mut distances = Vec::with_capacity(hits);
    let mut previous = 0;
    for _ in 0..hits {
        distances.push(f32::from_bits(
            input.difference(&mut previous, "a distance")?,
        ));
    }
    let mut normals = Vec::with_capacity(hits);
    let mut previous = [0; 2];
    for _ in 0..hits {
        let mut code = [0; 2];
        for (previous, code) in previous.iter_mut().zip(&mut code) {
            *code = input.short(previous, "a normal")?.cast_signed();
        }
        normals.push(code);
    }
    let mut coordinates = Vec::with_capacity(hits);
    let mut previous = [0; 2];
    for _ in 0..hits {
        let mut uv = [0.0; 2];
        for (previous, value) in previous.iter_mut().zip(&mut uv) {
            *value = f32::from_bits(input.difference(previous, "a texture coordinate")?);
        }
        coordinates.push(uv);
    }

    let found = primitives.iter().zip(&distances);
    let mut found = found.zip(normals.iter().zip(&coordinates));
    for i in 0..count {
        let mut pixel = PixelRecord::default();
        if let Some(((primitive, t), (code, uv))) = is_hit(i).then(|| found.next()).flatten() {
            let triangle = tables.triangle(*primitive).ok_or_else(|| {
                input.fail("a primitive of the triangle table", primitive.to_string())
            })?;
            // Tiles are at most 16x16, so the numbers below are small.
            let number = u32::try_from(i).unwrap_or(0);
            let at = number / samples;
            let x = tile.origin_px[0] + at % width;
            let y = tile.origin_px[1] + at / width;
            let point = sample_position_px(x, y, number % samples, samples);
            let direction = eye.direction(point);
            pixel.hit = Some(Hit::new(eye, direction, *t, triangle, *code, *uv));
        }
        tile.pixels.push(pixel);
    }
    for channel in 0..3 {
        let mut previous = 0;
        for pixel in tile.pixels.iter_mut().filter(|p| p.hit.is_some()) {
            let value = half::decode(input.short(&mut previous, "a colour")?);
            if let Some(c) = pixel.view_independent.get_mut(channel) {
                *c = value;
            }
        }
    }
    for channel in 0..3 {
        let mut previous = 0;
        for pixel in &mut tile.pixels {
            let value = half::decode(input.short(&mut previous, "a colour")?);
            if let Some(c) = pixel.view_dependent.get_mut(channel) {
                *c = value;
            }
        }
    }
    decode_rays(&mut input, tables.meta.has_visits, tile)?;
    input.end()
}

fn decode_rays(input: &mut ByteReader, has_visits: bool, tile: &mut RayTile) -> Result<(), Fail> {
    let mut total = 0u32;
    for pixel in &mut tile.pixels {
        let count = input.number("a ray count")?;
        pixel.first_ray = total;
        pixel.ray_count = count;
        // A ray takes three bytes at least.
        total = total
            .checked_add(count)
            .filter(|total| count > 0 && *total as usize <= input.left() / 3)
            .ok_or_else(|| input.fail("1 ray or more, for which there are bytes", count))?;
    }
    tile.rays.reserve(total as usize);
    let mut visits = 0u64;
    for pixel in &tile.pixels {
        for own in 0..pixel.ray_count {
            let ray = decode_ray(input, own, tile.rays.get(pixel.first_ray as usize..))?;
            visits += ray.visit_count();
            tile.rays.push(ray);
        }
    }
    if !has_visits {
        return Ok(());
    }
    if visits > input.left() as u64 {
        return Err(input.fail("a byte or more for each visit", visits));
    }
    let mut previous = [0u32; 2];
    for _ in 0..visits {
        let code = input.wide("a visit")?;
        let slot = usize::from(code & 1 == 1);
        let difference = unzigzag(code >> 1);
        let Some(previous) = previous.get_mut(slot) else {
            break;
        };
        let index = i64::from(*previous)
            .checked_add(difference)
            .and_then(|v| u32::try_from(v).ok())
            .ok_or_else(|| input.fail("a visit of less than 2^32", difference))?;
        *previous = index;
        tile.visits.push(match slot {
            0 => Visit::Node(index),
            _ => Visit::Triangle(index),
        });
    }
    Ok(())
}

fn decode_ray(
    input: &mut ByteReader,
    own: u32,
    earlier: Option<&[RayRecord]>,
) -> Result<RayRecord, Fail> {
    let head = input.byte("a ray")?;
    let kind = match head & 3 {
        0 => RayKind::Primary,
        1 => RayKind::Shadow,
        2 => RayKind::Reflection,
        _ => RayKind::Refraction,
    };
    let outcome = match head >> 2 & 3 {
        0 => Outcome::Miss,
        1 => Outcome::Hit,
        2 => Outcome::Occluded,
        _ => return Err(input.fail("an outcome of 0 to 2", 3)),
    };
    let flags = HAS_ALPHA_TESTS | PARENT_IS_PRIMARY;
    if head >> 4 & !(flags >> 4) != 0 || (own == 0) != (kind == RayKind::Primary) {
        return Err(input.fail(
            "a primary ray first, then the others",
            format!("{head:#04x}"),
        ));
    }
    let (parent, depth) = if own == 0 {
        (NO_PARENT, 0)
    } else {
        let parent = if head & PARENT_IS_PRIMARY != 0 {
            Some(0)
        } else {
            own.checked_sub(input.number("a parent")?)
        };
        let above = parent
            .filter(|p| *p < own)
            .and_then(|p| earlier?.get(p as usize))
            .and_then(|p| p.depth.checked_add(1));
        let number = parent.zip(above);
        number.ok_or_else(|| input.fail("an earlier ray as parent", format!("{parent:?}")))?
    };
    Ok(RayRecord {
        kind,
        outcome,
        depth,
        parent,
        steps: input.number("a step count")?,
        triangle_tests: input.number("a triangle-test count")?,
        alpha_tests: match head & HAS_ALPHA_TESTS {
            0 => 0,
            _ => input.number("an alpha-test count")?,
        },
    })
}

/// Small differences of either sign as small numbers.
fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63).cast_unsigned()
}

fn unzigzag(code: u64) -> i64 {
    (code >> 1).cast_signed() ^ -(code & 1).cast_signed()
}
