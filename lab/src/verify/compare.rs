//! Compares the tiles of a captured pass with the reference.

use super::agreement::{Agreement, Read, Side};
use super::causes::{FragmentCoordinates, LARGEST_DIFFERENCE, SMALL, UvCause};
use super::classes::classify;
use super::geometry::Geometry;
use super::lod::{clamped, level_of_detail, taps};
use super::piece::{center, quad_center};
use super::precision::rounding_texels;
use super::reference::{AlphaTest, Fragment, origin, render_tile};
use super::shadows::Shadows;
use formats::footprint::{LodFormula, SamplingOptions, footprints, quad_lod};
use formats::textrace::{NO_GROUP, QuadRecord, SUBTEXELS, Tables, Tile, UvGroup};
use formats::view::TILE_SIZE_PX;
use glam::DVec2;
use raster::backend::Fragments;

/// Inputs that all tiles of a comparison share.
pub struct Comparison<'a> {
    /// The trace's tables.
    pub tables: &'a Tables,
    /// The alpha test.
    pub alpha: &'a dyn AlphaTest,
    /// The fragments that the trace holds.
    pub recorded: Fragments,
    /// The driver's formula of the level of detail; replays of the trace use the same.
    pub formula: LodFormula,
    /// The frame's shadow maps, if they are known.
    pub shadows: Option<&'a Shadows>,
}

/// A captured lane in one group: primitive and pixel of the tile, group and record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Lane {
    pub key: u64,
    pub group: u8,
    pub record: u32,
}

/// Primitive and pixel of a tile as one number.
pub(super) fn key(primitive: u32, pixel: [u32; 2]) -> u64 {
    let [x, y] = pixel.map(|v| v % TILE_SIZE_PX);
    u64::from(primitive) << 8 | u64::from(y * TILE_SIZE_PX + x)
}

/// The pixel of a key, in a tile that starts at `origin`.
pub(super) fn pixel_of(key: u64, origin: [u32; 2]) -> [u32; 2] {
    let pixel = (key & 0xff) as u32;
    [
        origin[0] + pixel % TILE_SIZE_PX,
        origin[1] + pixel / TILE_SIZE_PX,
    ]
}

/// The lanes of a captured tile, sorted.
pub(super) fn lanes(tile: &Tile) -> Vec<Lane> {
    let mut lanes = Vec::with_capacity(4 * tile.records.len());
    for run in &tile.runs {
        for record in run.first..run.first + run.count {
            let quad = &tile.records[record as usize];
            for lane in (0..4).filter(|lane| quad.mask >> lane & 1 == 1) {
                let pixel = [
                    u32::from(quad.x) * 2 + (lane & 1),
                    u32::from(quad.y) * 2 + (lane >> 1),
                ];
                lanes.push(Lane {
                    key: key(run.primitive, pixel),
                    group: quad.group,
                    record,
                });
            }
        }
    }
    lanes.sort_unstable();
    lanes
}

impl Comparison<'_> {
    /// Compares one tile with the reference's fragments, which are returned as well.
    pub fn tile(
        &self,
        geometry: &Geometry<'_>,
        number: usize,
        tile: &Tile,
    ) -> (Agreement, Vec<Fragment>) {
        let mut result = Agreement::default();
        let captured = lanes(tile);
        let fragments = render_tile(geometry, number, self.alpha, self.recorded);
        let mut expected: Vec<(u64, &Fragment)> = (fragments.iter())
            .map(|f| (key(geometry.primitive(geometry.piece(f.piece)), f.pixel), f))
            .collect();
        expected.sort_unstable_by_key(|(key, _)| *key);
        let mut expected = expected.into_iter().peekable();
        let origin = origin(geometry, number);
        let differs = |result: &mut Agreement, side: Side, key: u64| {
            let primitive = (key >> 8) as u32;
            let pixel = pixel_of(key, origin);
            let class = classify(
                geometry,
                number,
                self.alpha,
                self.recorded,
                primitive,
                pixel,
            );
            result.differ(side, class);
        };
        for lanes in captured.chunk_by(|a, b| a.key == b.key) {
            let key = lanes[0].key;
            while let Some((missing, _)) = expected.next_if(|(k, _)| *k < key) {
                differs(&mut result, Side::Reference, missing);
            }
            result.recorded_twice += lanes
                .windows(2)
                .filter(|w| w[0].group == w[1].group)
                .count() as u64;
            match expected.next_if(|(k, _)| *k == key) {
                None => differs(&mut result, Side::Capture, key),
                Some((_, fragment)) => {
                    result.both += 1;
                    self.fragment(geometry, fragment, lanes, tile, &mut result);
                }
            }
        }
        for (missing, _) in expected {
            differs(&mut result, Side::Reference, missing);
        }
        (result, fragments)
    }

    /// Compares what a fragment samples.
    fn fragment(
        &self,
        geometry: &Geometry<'_>,
        fragment: &Fragment,
        lanes: &[Lane],
        tile: &Tile,
        result: &mut Agreement,
    ) {
        let piece = geometry.piece(fragment.piece);
        let textures = &geometry.material(piece).textures;
        let draw = &self.tables.draws[piece.draw as usize];
        self.groups(geometry, fragment, lanes, result);
        self.lookups(geometry, fragment, lanes, tile, result);
        for lane in lanes {
            let number = usize::from(lane.group);
            let Some(slots) = geometry.groups(piece).get(number) else {
                continue;
            };
            let (Some(leader), Some(group)) = (
                slots.first().and_then(|&s| textures[s]),
                draw.groups.get(number),
            ) else {
                continue;
            };
            let record = &tile.records[lane.record as usize];
            let index = (fragment.pixel[0] & 1) | (fragment.pixel[1] & 1) << 1;
            let coordinates = geometry.coordinates(piece, &leader);
            let subject = FragmentCoordinates {
                coordinates: &coordinates,
                pixel: fragment.pixel,
                extent: extent(group),
                size_px: geometry.size_px,
                formula: self.formula,
            };
            let captured = captured_uv(record, index, group);
            let error = period_free(captured - coordinates.at(center(fragment.pixel)));
            let error_texels = (error * extent(group)).length();
            if !error_texels.is_finite() {
                result.not_finite += 1;
                continue;
            }
            let cause = subject.of_uv(record, error);
            result.uv_errors_texels.0.push(error_texels as f32);
            result.uv_causes[cause as usize] += 1;
            // softpipe's lanes lack the cross term, so the bounds do not apply to them.
            if cause != UvCause::Saturated && self.formula != LodFormula::Softpipe {
                let place = (piece.draw, lane.group);
                add_to_means(&subject, record, index, error, place, result);
            }
            self.samples(record, index, group, &subject, cause, result);
        }
    }

    /// Counts a fragment's groups that have no record, and unexpected records.
    fn groups(
        &self,
        geometry: &Geometry<'_>,
        fragment: &Fragment,
        lanes: &[Lane],
        result: &mut Agreement,
    ) {
        let piece = geometry.piece(fragment.piece);
        let textures = &geometry.material(piece).textures;
        let groups = geometry.groups(piece);
        let alone = lanes.iter().filter(|lane| lane.group == NO_GROUP).count();
        if !groups.is_empty() {
            result.groups_unexpected += alone as u64;
        }
        for (number, slots) in groups.iter().enumerate() {
            let Some(leader) = slots.first().and_then(|&slot| textures[slot]) else {
                continue;
            };
            if lanes.iter().any(|lane| usize::from(lane.group) == number) {
                continue;
            }
            // A capture has no record of coordinates that are not finite.
            let coordinates = geometry.coordinates(piece, &leader);
            let corner = |step| coordinates.single_precision(quad_center(fragment.pixel) + step);
            let corners = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(corner);
            result.groups_missing += u64::from(corners.iter().all(|bound| bound.is_finite()));
        }
    }

    /// Compares levels and texels of the samples of a group.
    fn samples(
        &self,
        record: &QuadRecord,
        lane: u32,
        group: &UvGroup,
        subject: &FragmentCoordinates<'_>,
        uv: UvCause,
        result: &mut Agreement,
    ) {
        let only = QuadRecord {
            mask: 1 << lane,
            ..*record
        };
        let options = SamplingOptions {
            lod: self.formula,
            ..SamplingOptions::default()
        };
        let quad = subject.coordinates.in_quad(subject.pixel, self.formula);
        let exact = subject.coordinates.exact(center(subject.pixel));
        for sample in &group.samples {
            let texture = &self.tables.textures[sample.texture as usize];
            let sampler = &self.tables.samplers[usize::from(sample.sampler)];
            let lod = f64::from(quad_lod(record, group.extent, texture.size, self.formula));
            let lod = clamped(lod, texture);
            let mut read: Vec<Read> = Vec::with_capacity(2);
            footprints(
                &only,
                None,
                group.extent,
                sample,
                texture,
                sampler,
                &options,
                |f| {
                    read.push((u32::from(f.level), [f.i, f.j]));
                },
            );
            let reading = |uv, lod| -> Vec<Read> {
                let taps = taps(uv, lod, texture, sampler);
                taps.map(|tap| (tap.level, tap.texels)).collect()
            };
            let references = [
                (&mut result.capture, quad, self.formula),
                (&mut result.specification, exact, LodFormula::Exact),
            ];
            for (errors, at, formula) in references {
                let expected = level_of_detail(&at, texture, formula);
                let lods = [lod, clamped(expected, texture)];
                if errors.add(lods, &read, &reading(at.uv, expected)) {
                    let cause =
                        subject.of_sample(texture, uv, lods, |uv, lod| reading(uv, lod) == read);
                    errors.causes[cause as usize] += 1;
                }
            }
        }
    }
}

/// Adds a lane's error to the means of its draw and group and, for the first lane of a record, the errors of
/// the record's differences over the quad.
fn add_to_means(
    subject: &FragmentCoordinates<'_>,
    record: &QuadRecord,
    lane: u32,
    error: DVec2,
    (draw, group): (u32, u8),
    result: &mut Agreement,
) {
    let (coordinates, extent) = (subject.coordinates, subject.extent);
    let center = center(subject.pixel);
    let beyond = |error: DVec2, bound: DVec2| error.abs().cmpgt(bound).any();
    let mut bound = coordinates.single_precision(center) * extent + rounding_texels(lane);
    // The bound of clipped triangles is wider and expensive to compute, so it is only computed if an error
    // exceeds the other bound.
    if beyond(error * extent, bound) {
        let [cut] = coordinates.single_precision_cut(center, subject.size_px, [center]);
        bound = cut * extent + rounding_texels(lane);
    }
    let means = result.means.of(draw, group);
    for axis in 0..2 {
        means[axis].add(error[axis] * extent[axis], bound[axis]);
    }
    if lane != record.mask.trailing_zeros() {
        return;
    }
    let points =
        [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|step| quad_center(subject.pixel) + step);
    let [top_left, top_right, bottom_left, bottom_right] =
        points.map(|p| coordinates.at(p) * extent);
    let columns = [
        (record.dx, top_right - top_left),
        (record.dy, bottom_left - top_left),
        (
            record.cross,
            bottom_right - bottom_left - (top_right - top_left),
        ),
    ];
    // The lanes that each column is a difference of.
    let bounds_of = |bounds: [DVec2; 4]| {
        let [top_left, top_right, bottom_left, bottom_right] = bounds.map(|bound| bound * extent);
        let all = top_left + top_right + bottom_left + bottom_right;
        [top_left + top_right, top_left + bottom_left, all].map(|b| b + rounding_texels(0))
    };
    let found = |found: [i32; 2]| DVec2::from(found.map(f64::from)) / f64::from(SUBTEXELS);
    let mut bounds = bounds_of(points.map(|p| coordinates.single_precision(p)));
    let needs_more = (columns.iter().zip(bounds))
        .any(|((column, expected), bound)| beyond(found(*column) - *expected, bound));
    if needs_more {
        bounds = bounds_of(coordinates.single_precision_cut(center, subject.size_px, points));
    }
    for (column, ((found, expected), bound)) in columns.into_iter().zip(bounds).enumerate() {
        for axis in 0..2 {
            // Beyond the fixed-point range, a record's differences are clamped or lose pairs of repeats.
            let largest = f64::from(LARGEST_DIFFERENCE) / f64::from(SUBTEXELS);
            if found[axis].unsigned_abs() >= LARGEST_DIFFERENCE || expected[axis].abs() >= largest {
                continue;
            }
            let error = f64::from(found[axis]) / f64::from(SUBTEXELS) - expected[axis];
            let bound = bound[axis];
            means[2 + 2 * column + axis].add(error, bound);
            let explained = error.abs() <= SMALL + bound || !error.is_finite();
            result.differences_unexplained += u64::from(!explained);
        }
    }
}

/// Coordinates of a lane in the trace.
pub(super) fn captured_uv(record: &QuadRecord, lane: u32, group: &UvGroup) -> DVec2 {
    let [u, v] = record.lane_uv(lane).map(f64::from);
    DVec2::new(u, v) / (f64::from(SUBTEXELS) * extent(group))
}

fn extent(group: &UvGroup) -> DVec2 {
    DVec2::new(group.extent[0].into(), group.extent[1].into())
}

/// A difference of coordinates without the pairs of repeats that a trace may leave out.
fn period_free(difference: DVec2) -> DVec2 {
    let axis = |d: f64| {
        if d.abs() < 1.0 {
            d
        } else {
            d - 2.0 * (d / 2.0).round()
        }
    };
    DVec2::new(axis(difference.x), axis(difference.y))
}
