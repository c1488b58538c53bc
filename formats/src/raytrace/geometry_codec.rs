//! The bytes of a tile's geometry: differences of each ray from its prediction. FORMAT.md has the layout.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::geometry::{RayGeometry, SlotHit, UNIT_TOLERANCE};
use super::predict::{Predictor, Subject};
use super::tables::in_range;
use super::{EyeCamera, Outcome, RayTile, RaytraceTables};
use crate::error::{Broken, ensure};
use crate::parse::{Cursor, Parsed, Taken};
use crate::varint::{put, zigzag};
use std::fmt::Debug;

/// Flags of a ray: what is not as predicted, and therefore follows.
const ORIGIN: u8 = 1 << 0;
const DIRECTION: u8 = 1 << 1;
const T_MIN: u8 = 1 << 2;
const T_MAX: u8 = 1 << 3;
const LIGHT: u8 = 1 << 4;
const DISTANCE: u8 = 1 << 5;

/// Smallest size of a ray: the flags and the depth of the stack.
const LEAST_BYTES: usize = 2;

/// Zigzag of the wrapping difference of two numbers of 32 bits.
fn difference(value: u32, prediction: u32) -> u64 {
    zigzag(value.wrapping_sub(prediction).cast_signed().into())
}

fn differences(values: [f32; 3], predictions: [f32; 3], offset: [u32; 3]) -> [u64; 3] {
    let mut out = [0; 3];
    let all = values.iter().zip(predictions).zip(offset);
    for (out, ((value, prediction), offset)) in out.iter_mut().zip(all) {
        *out = difference(value.to_bits(), prediction.to_bits().wrapping_add(offset));
    }
    out
}

fn offsets(values: [f32; 3], predictions: [f32; 3]) -> [u32; 3] {
    let mut out = predictions.map(f32::to_bits);
    for (out, value) in out.iter_mut().zip(values) {
        *out = value.to_bits().wrapping_sub(*out);
    }
    out
}

/// Writes the geometry of a tile.
pub(super) fn encode(
    tables: &RaytraceTables,
    eye: &EyeCamera,
    tile: &RayTile,
) -> Result<Vec<u8>, Broken> {
    if tile.geometry.len() != tile.rays.len() {
        let found = format!("{} for {} rays", tile.geometry.len(), tile.rays.len());
        return Err(Broken::new("geometry", "one entry for each ray", found));
    }
    let mut predictor = Predictor::new(tables, eye, tile);
    let mut out = Vec::with_capacity(8 * tile.rays.len());
    let mut geometry = tile.geometry.iter();
    for (sample, pixel) in (0u32..).zip(&tile.pixels) {
        predictor.begin_sample();
        for (record, ray) in tile.rays_of(pixel).iter().zip(&mut geometry) {
            let subject = Subject {
                record,
                pixel,
                sample,
            };
            let hits = record.outcome != Outcome::Miss;
            check(ray, hits, tables.bvh.triangles).map_err(|broken| Broken {
                what: format!("a ray of sample {sample}"),
                ..broken
            })?;
            put_ray(&mut predictor, &subject, ray, &mut out);
        }
    }
    Ok(out)
}

fn put_ray(
    predictor: &mut Predictor<'_>,
    subject: &Subject<'_>,
    ray: &RayGeometry,
    out: &mut Vec<u8>,
) {
    let kind = subject.record.kind;
    let origin = predictor.origin(subject);
    let (light, direction, limit) = best_light(predictor, subject, ray);
    let last = *predictor.of_kind(kind);
    let t_max = limit.unwrap_or(last.t_max);
    let distance = predictor.distance(subject);
    let is_light = light == predictor.light(subject.record);
    let at = differences(ray.origin, origin.value, origin.offset);
    let along = differences(ray.direction, direction, [0; 3]);
    let start = difference(ray.t_min.to_bits(), last.t_min.to_bits());
    let end = difference(ray.t_max.to_bits(), t_max.to_bits());
    let hit = ray
        .hit
        .map(|hit| difference(hit.t.to_bits(), distance.to_bits()));
    let flag = |flag: u8, set: bool| if set { flag } else { 0 };
    out.push(
        flag(ORIGIN, at != [0; 3])
            | flag(DIRECTION, along != [0; 3])
            | flag(T_MIN, start != 0)
            | flag(T_MAX, end != 0)
            | flag(LIGHT, !is_light)
            | flag(DISTANCE, hit.is_some_and(|code| code != 0)),
    );
    if !is_light {
        put(light.into(), out);
    }
    for three in [at, along] {
        if three != [0; 3] {
            three.into_iter().for_each(|code| put(code, out));
        }
    }
    for code in [start, end, hit.unwrap_or(0)] {
        if code != 0 {
            put(code, out);
        }
    }
    if let Some(hit) = ray.hit {
        put(difference(hit.slot, last.slot), out);
    }
    put(ray.stack_depth.into(), out);
    update(
        predictor,
        subject,
        ray,
        light,
        origin.keeps_offset.then_some(origin.value),
        limit,
    );
}

/// Remembers a ray for the predictions of the following ones.
fn update(
    predictor: &mut Predictor<'_>,
    subject: &Subject<'_>,
    ray: &RayGeometry,
    light: u32,
    first_child_of: Option<[f32; 3]>,
    limit: Option<f32>,
) {
    let last = predictor.of_kind(subject.record.kind);
    if let Some(point) = first_child_of {
        last.offset = offsets(ray.origin, point);
    }
    last.direction = ray.direction;
    last.t_min = ray.t_min;
    if limit.is_none() {
        last.t_max = ray.t_max;
    }
    if let Some(hit) = ray.hit {
        last.t = hit.t;
        last.slot = hit.slot;
    }
    predictor.push(subject.record, ray, light);
}

/// The light whose prediction takes the fewest bytes, with its direction and distance. The expected light is
/// tried first.
fn best_light(
    predictor: &mut Predictor<'_>,
    subject: &Subject<'_>,
    ray: &RayGeometry,
) -> (u32, [f32; 3], Option<f32>) {
    let bytes = |direction: [f32; 3]| -> u32 {
        let codes = differences(ray.direction, direction, [0; 3]);
        codes.iter().map(|code| code.max(&1).ilog2() / 7).sum()
    };
    let expected = predictor.light(subject.record);
    let (direction, limit) = predictor.direction(subject, ray.origin, expected);
    let mut best = (bytes(direction), (expected, direction, limit));
    let others = match subject.record.kind {
        super::RayKind::Shadow => u32::try_from(predictor.lights()).unwrap_or(u32::MAX),
        _ => 0,
    };
    for light in 0..others {
        if best.0 == 0 {
            break;
        }
        let (direction, limit) = predictor.direction(subject, ray.origin, light);
        // Another light takes a byte of its own.
        let bytes = bytes(direction) + 1;
        if bytes < best.0 {
            best = (bytes, (light, direction, limit));
        }
    }
    best.1
}

/// Checks a ray; the error does not name it.
fn check(ray: &RayGeometry, hits: bool, triangles: u64) -> Result<(), Broken> {
    let holds = |holds: bool, expected: &str, found: &dyn Debug| {
        ensure(holds, "", expected, format_args!("{found:?}"))
    };
    let RayGeometry {
        origin,
        direction,
        t_min,
        t_max,
        hit,
        ..
    } = *ray;
    holds(in_range(&origin), "an origin within 1e18 m", &origin)?;
    let [x, y, z] = direction;
    let off = (x * x + y * y + z * z - 1.0).abs();
    holds(
        off <= UNIT_TOLERANCE,
        "a direction of unit length",
        &direction,
    )?;
    holds(
        t_min >= 0.0 && t_min <= t_max && t_max <= f32::MAX,
        "finite limits, the first at least 0 and at most the second",
        &(t_min, t_max),
    )?;
    holds(hits == hit.is_some(), "a hit unless the ray missed", &hit)?;
    let Some(SlotHit { t, slot }) = hit else {
        return Ok(());
    };
    holds(
        (t_min..=t_max).contains(&t),
        "a distance within the ray's limits",
        &t,
    )?;
    let expected = format_args!("a slot below {triangles}");
    ensure(u64::from(slot) < triangles, "", expected, slot)
}

/// Reads the geometry of a tile whose records are decoded.
pub(super) fn decode<'a>(
    tables: &RaytraceTables,
    eye: &EyeCamera,
    input: &'a [u8],
    tile: &RayTile,
) -> Parsed<'a, Vec<RayGeometry>> {
    let mut input = Cursor::new(input);
    if tile.rays.len() > input.rest().len() / LEAST_BYTES {
        let expected = format!(
            "{LEAST_BYTES} bytes or more for each of {} rays",
            tile.rays.len()
        );
        return Err(input.fault(expected, format_args!("{} bytes", input.rest().len())));
    }
    let mut predictor = Predictor::new(tables, eye, tile);
    let mut out = Vec::with_capacity(tile.rays.len());
    for (sample, pixel) in (0u32..).zip(&tile.pixels) {
        predictor.begin_sample();
        for record in tile.rays_of(pixel) {
            let at = input;
            let subject = Subject {
                record,
                pixel,
                sample,
            };
            let ray = take_ray(&mut predictor, &subject, &mut input)?;
            let hits = record.outcome != Outcome::Miss;
            check(&ray, hits, tables.bvh.triangles)
                .map_err(|broken| at.fault(broken.expected, broken.found))?;
            out.push(ray);
        }
    }
    Ok((input.rest(), out))
}

fn take_ray<'a>(
    predictor: &mut Predictor<'_>,
    subject: &Subject<'_>,
    input: &mut Cursor<'a>,
) -> Taken<'a, RayGeometry> {
    let at = *input;
    let kind = subject.record.kind;
    let flags: u8 = input.fixed("a ray")?;
    let lights = if kind == super::RayKind::Shadow {
        predictor.lights()
    } else {
        0
    };
    let hits = subject.record.outcome != Outcome::Miss;
    if flags >> 6 != 0 || (flags & LIGHT != 0 && lights == 0) || (flags & DISTANCE != 0 && !hits) {
        let expected = "flags of a ray of its kind and outcome";
        return Err(at.fault(expected, format_args!("{flags:#04x}")));
    }
    let light = if flags & LIGHT == 0 {
        predictor.light(subject.record)
    } else {
        let at = *input;
        let light = input.number_u32("a light")?;
        if light as usize >= lights {
            return Err(at.fault(format!("a light below {lights}"), light));
        }
        light
    };
    let origin = predictor.origin(subject);
    let expected = origin.offset;
    let place = three(
        input,
        flags & ORIGIN != 0,
        origin.value,
        expected,
        "an origin",
    )?;
    let (direction, limit) = predictor.direction(subject, place, light);
    let direction = three(
        input,
        flags & DIRECTION != 0,
        direction,
        [0; 3],
        "a direction",
    )?;
    let last = *predictor.of_kind(kind);
    let t_max = limit.unwrap_or(last.t_max);
    let distance = predictor.distance(subject);
    let t_min = one(input, flags & T_MIN != 0, last.t_min, "a least distance")?;
    let t_max = one(input, flags & T_MAX != 0, t_max, "a largest distance")?;
    let t = one(input, flags & DISTANCE != 0, distance, "a distance")?;
    let mut slot = last.slot;
    if hits {
        input.difference(&mut slot, "a slot")?;
    }
    let ray = RayGeometry {
        origin: place,
        direction,
        t_min,
        t_max,
        hit: hits.then_some(SlotHit { t, slot }),
        stack_depth: input.number_u32("the depth of a stack")?,
    };
    update(
        predictor,
        subject,
        &ray,
        light,
        origin.keeps_offset.then_some(origin.value),
        limit,
    );
    Ok(ray)
}

/// A value: its prediction, or the difference from it.
fn one<'a>(
    input: &mut Cursor<'a>,
    differs: bool,
    prediction: f32,
    what: &'static str,
) -> Taken<'a, f32> {
    let mut bits = prediction.to_bits();
    if differs {
        input.difference(&mut bits, what)?;
    }
    Ok(f32::from_bits(bits))
}

fn three<'a>(
    input: &mut Cursor<'a>,
    differs: bool,
    predictions: [f32; 3],
    offset: [u32; 3],
    what: &'static str,
) -> Taken<'a, [f32; 3]> {
    let mut out = predictions;
    for (value, offset) in out.iter_mut().zip(offset) {
        let mut bits = value.to_bits().wrapping_add(offset);
        if differs {
            input.difference(&mut bits, what)?;
        }
        *value = f32::from_bits(bits);
    }
    Ok(out)
}
