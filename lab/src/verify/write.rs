//! Converts the reference's fragments to tiles of a trace.

use super::compare::lanes;
use super::geometry::Geometry;
use super::piece::quad_center;
use super::reference::Fragment;
use formats::textrace::{
    NO_GROUP, PrimitiveRun, QuadRecord, SUBTEXELS, Tables, Tile, UvGroup, quad_morton,
};
use formats::view::TILE_SIZE_PX;
use glam::DVec2;

/// Largest fixed-point coordinate, such that sums of four fit in 32 bits.
const LIMIT: f64 = (1 << 29) as f64;

/// Lanes of one piece in one quad.
struct Quad {
    primitive: u32,
    morton: u8,
    piece: u32,
    pixel: [u32; 2],
    mask: u8,
}

/// The tile that a capture without rounding would have written. Look-ups of shadow maps, which the reference
/// does not make, are copied from the captured tile where both cover them.
pub fn reference_tile(
    geometry: &Geometry<'_>,
    tables: &Tables,
    fragments: &[Fragment],
    captured: &Tile,
) -> Tile {
    let shadows = lanes(captured);
    let mut tile = Tile::default();
    for quad in quads(geometry, fragments) {
        let piece = geometry.piece(quad.piece);
        let draw = &tables.draws[piece.draw as usize];
        if tile
            .runs
            .last()
            .is_none_or(|run| run.primitive != quad.primitive)
        {
            tile.runs.push(PrimitiveRun {
                primitive: quad.primitive,
                draw: piece.draw,
                first: tile.records.len() as u32,
                count: 0,
            });
        }
        let [x, y] = quad.pixel.map(|v| (v % TILE_SIZE_PX / 2) as u8);
        let empty = QuadRecord {
            x,
            y,
            mask: quad.mask,
            group: NO_GROUP,
            ..QuadRecord::default()
        };
        let first = tile.records.len();
        let groups = geometry.groups(piece);
        let textures = &geometry.material(piece).textures;
        for (number, (slots, group)) in (0_u8..).zip(groups.iter().zip(&draw.groups)) {
            let Some(leader) = slots.first().and_then(|&slot| textures[slot]) else {
                continue;
            };
            let coordinates = geometry.coordinates(piece, &leader);
            let at = quad_center(quad.pixel);
            let corners =
                [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|step| coordinates.at(at + step));
            if corners.iter().all(|uv| uv.is_finite()) {
                tile.records.push(record(
                    QuadRecord {
                        group: number,
                        ..empty
                    },
                    corners,
                    group,
                ));
            }
        }
        let of_quad = |l: &&super::compare::Lane| {
            let record = &captured.records[l.record as usize];
            (l.key >> 8) as u32 == quad.primitive
                && (record.x, record.y) == (x, y)
                && usize::from(l.group) >= groups.len()
                && l.group != NO_GROUP
        };
        let mut taken: Vec<u32> = shadows.iter().filter(of_quad).map(|l| l.record).collect();
        taken.sort_unstable();
        taken.dedup();
        for record in taken.into_iter().map(|r| captured.records[r as usize]) {
            if record.mask & quad.mask != 0 {
                tile.records.push(QuadRecord {
                    mask: record.mask & quad.mask,
                    ..record
                });
            }
        }
        if tile.records.len() == first {
            tile.records.push(empty);
        }
        let added = (tile.records.len() - first) as u32;
        if let Some(run) = tile.runs.last_mut() {
            run.count += added;
        }
    }
    tile
}

/// Quads in the order of a tile: by primitive, then along the Morton curve.
fn quads(geometry: &Geometry<'_>, fragments: &[Fragment]) -> Vec<Quad> {
    let mut quads: Vec<Quad> = (fragments.iter())
        .map(|fragment| {
            let [x, y] = fragment.pixel.map(|v| (v % TILE_SIZE_PX / 2) as u8);
            let [i, j] = fragment.pixel.map(|v| v & 1);
            Quad {
                primitive: geometry.primitive(geometry.piece(fragment.piece)),
                morton: quad_morton(x, y),
                piece: fragment.piece,
                pixel: fragment.pixel,
                mask: 1 << (i | j << 1),
            }
        })
        .collect();
    quads.sort_by_key(|q| (q.primitive, q.morton, q.piece, q.mask));
    quads.dedup_by(|next, kept| {
        let same =
            (next.primitive, next.morton, next.piece) == (kept.primitive, kept.morton, kept.piece);
        if same {
            kept.mask |= next.mask;
        }
        same
    });
    quads
}

/// A quad's coordinates at its four pixels in fixed point.
fn record(empty: QuadRecord, corners: [DVec2; 4], group: &UvGroup) -> QuadRecord {
    let [top_left, top_right, bottom_left, bottom_right] = corners;
    // Values that exceed 32 bits lose pairs of repeats.
    let fixed = |value: DVec2, limit: f64| {
        [0, 1].map(|axis: usize| {
            let scale = f64::from(SUBTEXELS) * f64::from(group.extent[axis]);
            let mut value = value.to_array()[axis];
            if (value * scale).abs() > limit {
                value -= 2.0 * (value / 2.0).round();
            }
            (value * scale).round_ties_even().clamp(-limit, limit) as i32
        })
    };
    let dx = top_right - top_left;
    QuadRecord {
        uv: fixed(top_left, LIMIT),
        dx: fixed(dx, LIMIT / 2.0),
        dy: fixed(bottom_left - top_left, LIMIT / 2.0),
        cross: fixed(bottom_right - bottom_left - dx, LIMIT / 2.0),
        ..empty
    }
}
