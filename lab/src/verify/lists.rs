//! Compares primitive lists with the triangles that enter the tiles of a view, by the rule of FORMAT.md.

use super::piece::DepthOrder;
use super::vertex_error::{UNIT, VertexError};
use formats::textrace::geometry::TileLists;
use formats::view::TILE_SIZE_PX;
use glam::{DMat4, DVec2, DVec3, DVec4, Mat4, Vec3};
use raster::draws::DrawList;
use rayon::prelude::*;
use scene::Scene;
use std::sync::atomic::{AtomicU32, Ordering};

/// Distance from a tile within which a primitive is in the tile's list.
const MARGIN_PX: f64 = 1.0 / 64.0;
/// Error of places on the screen besides that of single precision.
const ROUNDING_PX: f64 = 1.0 / 1024.0;
/// Largest error of places on the screen: errors of corners far outside of it are larger, but hardly turn the
/// edges inside.
const LARGEST_ERROR_PX: f64 = 1.0;
/// Part of a view's half width by which a draw that is culled may be outside of it.
const NEAR: f64 = 0.01;
/// Roundings of a clip-space coordinate: see [`VertexError`].
const CLIP_ROUNDINGS: f64 = 16.0;

/// A view that has primitive lists.
pub(super) struct ListedView<'a> {
    pub scene: &'a Scene,
    pub draws: &'a DrawList,
    /// Eye to clip space, world to eye space.
    pub matrices: [DMat4; 2],
    pub size_px: [u32; 2],
    pub order: DepthOrder,
    /// Faces that face away are drawn as well, as in shadow maps.
    pub all_faces: bool,
}

/// Differences of lists from what enters the tiles.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct ListErrors {
    /// Primitives that enter a tile and are not in its list, of draws that the view submits.
    pub missing: u64,
    /// The first of them: tile and primitive.
    pub first_missing: Option<(usize, u32)>,
    /// Listed primitives that do not enter their tile.
    pub unexpected: u64,
    /// The first tile with one.
    pub first_unexpected: Option<usize>,
}

/// A triangle in one tile.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Entry {
    /// Rounding decides whether it is listed.
    May,
    Must,
}

impl ListedView<'_> {
    /// Compares the lists of the draws that the view submits.
    pub fn compare(&self, lists: &TileLists) -> ListErrors {
        let columns = self.size_px[0].div_ceil(TILE_SIZE_PX);
        let tiles = lists.starts.len().saturating_sub(1);
        // Listed primitives that may be in their tile, by tile.
        let explained: Vec<AtomicU32> = (0..tiles).map(|_| AtomicU32::new(0)).collect();
        let of_draw = |&draw: &u32| {
            let mut missing = (0, None);
            self.entries(draw, |primitive, [column, row], entry| {
                let tile = (row * columns + column) as usize;
                if lists.tile(tile).binary_search(&primitive).is_ok() {
                    explained[tile].fetch_add(1, Ordering::Relaxed);
                } else if entry == Entry::Must {
                    missing.0 += 1;
                    missing.1 = missing.1.or(Some((tile, primitive)));
                }
            });
            missing
        };
        let missing: Vec<_> = lists.draws.par_iter().map(of_draw).collect();
        let mut errors = ListErrors::default();
        for (count, first) in missing {
            errors.missing += count;
            errors.first_missing = errors.first_missing.or(first);
        }
        for (tile, explained) in explained.into_iter().enumerate() {
            let unexpected = lists.tile(tile).len() as u64 - u64::from(explained.into_inner());
            errors.unexpected += unexpected;
            if unexpected > 0 {
                errors.first_unexpected = errors.first_unexpected.or(Some(tile));
            }
        }
        errors
    }

    /// The first tile that a draw enters for certain.
    pub fn enters(&self, draw: u32) -> Option<[u32; 2]> {
        let mut found = None;
        self.entries(draw, |_, tile, entry| {
            if entry == Entry::Must {
                found = found.or(Some(tile));
            }
        });
        found
    }

    /// Whether a box in the world reaches into the view volume, or nearly so, or is not finite.
    pub fn is_near(&self, bounds: [Vec3; 2]) -> bool {
        let clip_from_world = self.matrices[0] * self.matrices[1];
        let corners = (0..8).map(|corner| {
            let at = [0, 1, 2].map(|axis| f64::from(bounds[corner >> axis & 1][axis]));
            clip_from_world * DVec3::from(at).extend(1.0)
        });
        let corners: Vec<DVec4> = corners.collect();
        (0..6).all(|side| {
            corners
                .iter()
                .any(|c| distance(side, *c) >= -NEAR * c.w.abs() || !c.is_finite())
        })
    }

    /// Calls `visit` with a draw's primitives, each with the columns and rows of the tiles that it may enter.
    fn entries(&self, draw: u32, mut visit: impl FnMut(u32, [u32; 2], Entry)) {
        let call = &self.draws.calls[draw as usize];
        let mesh = &self.scene.meshes[call.mesh];
        let both_faces = self.all_faces || self.scene.materials[call.material].double_sided;
        let world = Mat4::from(call.transform).as_dmat4();
        let matrices = [self.matrices[0], self.matrices[1], world];
        let clip_from_object = matrices[0] * matrices[1] * world;
        let vertices: Vec<(DVec4, VertexError)> = (mesh.positions.iter())
            .map(|p| {
                let position = p.as_dvec3();
                let error = VertexError::new(&matrices, position);
                (clip_from_object * position.extend(1.0), error)
            })
            .collect();
        let triangles = mesh.indices.chunks_exact(3);
        for (primitive, triangle) in (call.first_primitive..).zip(triangles) {
            let corners = [0, 1, 2].map(|i| vertices[triangle[i] as usize]);
            let Some(polygon) = Polygon::new(corners, self.size_px, self.order) else {
                continue;
            };
            let Some(front) = polygon.faces(both_faces, call.mirrored) else {
                continue;
            };
            polygon.tiles(self.size_px, |tile, entry| {
                let is_certain = front == Entry::Must && polygon.inside == Entry::Must;
                visit(primitive, tile, if is_certain { entry } else { Entry::May });
            });
        }
    }
}

/// The part of a triangle behind the near plane, on the screen.
struct Polygon {
    /// Pixels, y down.
    corners: Vec<DVec2>,
    /// Error of the corners.
    error_px: f64,
    /// Twice the area, positive if counter-clockwise with y up.
    area: f64,
    /// Whether it is in the view volume.
    inside: Entry,
}

impl Polygon {
    /// `None` if nothing of the triangle is in the view volume.
    fn new(
        triangle: [(DVec4, VertexError); 3],
        size_px: [u32; 2],
        order: DepthOrder,
    ) -> Option<Self> {
        if triangle.iter().any(|(clip, _)| !clip.is_finite()) {
            return None;
        }
        let mut inside = Entry::Must;
        let (near, far) = match order {
            DepthOrder::Ascending => (4, 5),
            DepthOrder::Reversed => (5, 4),
        };
        for plane in 0..6 {
            let distances = triangle.map(|(clip, error)| {
                let tolerance = UNIT * CLIP_ROUNDINGS * (error.terms[plane / 2] + error.terms.w);
                (distance(plane, clip), tolerance)
            });
            if distances
                .iter()
                .all(|(distance, tolerance)| *distance < -tolerance)
            {
                return None;
            }
            // Capturers need not clip at the far plane.
            let is_unsure = |(distance, tolerance): &(f64, f64)| distance < tolerance;
            let unsure = match plane == far {
                true => distances.iter().any(is_unsure),
                false => distances.iter().all(is_unsure),
            };
            if unsure {
                inside = Entry::May;
            }
        }
        let mut corners = Vec::with_capacity(4);
        let mut error_px: f64 = 0.0;
        let half = DVec2::new(size_px[0].into(), size_px[1].into()) / 2.0;
        let mut add = |clip: DVec4, error: VertexError| {
            let at = DVec2::new(1.0 + clip.x / clip.w, 1.0 - clip.y / clip.w) * half;
            error_px = error_px.max(error.moves_px(clip, size_px, at).max_element());
            corners.push(at);
        };
        for (i, &(clip, error)) in triangle.iter().enumerate() {
            let (next, next_error) = triangle[(i + 1) % 3];
            let (here, there) = (distance(near, clip), distance(near, next));
            if here >= 0.0 {
                add(clip, error);
            }
            if (here >= 0.0) != (there >= 0.0) {
                let cut = clip.lerp(next, here / (here - there));
                add(cut, error.between(next_error));
            }
        }
        let is_sound = corners.len() >= 3 && corners.iter().all(|at| at.is_finite());
        let mut polygon = Self {
            corners,
            error_px: error_px.min(LARGEST_ERROR_PX) + ROUNDING_PX,
            area: 0.0,
            inside,
        };
        polygon.area = -polygon.edges().map(|(a, b)| a.perp_dot(b)).sum::<f64>();
        is_sound.then_some(polygon)
    }

    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2)> {
        let count = self.corners.len();
        (0..count).map(move |i| (self.corners[i], self.corners[(i + 1) % count]))
    }

    /// Whether it is drawn: `None` if it faces away, [`Entry::May`] if rounding turns it over or empties it.
    fn faces(&self, both_faces: bool, mirrored: bool) -> Option<Entry> {
        let around: f64 = self.edges().map(|(a, b)| a.distance(b)).sum();
        if self.area.abs() <= around * self.error_px {
            return Some(Entry::May);
        }
        (both_faces || (self.area > 0.0) != mirrored).then_some(Entry::Must)
    }

    /// Calls `visit` for each tile that it may enter.
    fn tiles(&self, size_px: [u32; 2], mut visit: impl FnMut([u32; 2], Entry)) {
        let low = self
            .corners
            .iter()
            .copied()
            .fold(DVec2::INFINITY, DVec2::min);
        let high = self
            .corners
            .iter()
            .copied()
            .fold(DVec2::NEG_INFINITY, DVec2::max);
        // Tiles with a pixel's centre in the box.
        let range = |axis: usize, margin: f64| {
            let first = (low[axis] - margin - 0.5).ceil().max(0.0);
            let last = (high[axis] + margin - 0.5).floor();
            let last = last.min(f64::from(size_px[axis]) - 1.0);
            (first <= last).then_some([first as u32 / TILE_SIZE_PX, last as u32 / TILE_SIZE_PX])
        };
        let may = MARGIN_PX + self.error_px;
        // A tile's corner is farther from its neighbours diagonally.
        let must = MARGIN_PX * std::f64::consts::FRAC_1_SQRT_2 - self.error_px;
        let (Some(columns), Some(rows)) = (range(0, may), range(1, may)) else {
            return;
        };
        let sure = [range(0, must), range(1, must)];
        let is_sure = |axis: usize, at: u32| sure[axis].is_some_and(|[a, b]| (a..=b).contains(&at));
        let inward = if self.area > 0.0 { -1.0 } else { 1.0 };
        let tile_px = f64::from(TILE_SIZE_PX);
        for row in rows[0]..=rows[1] {
            for column in columns[0]..=columns[1] {
                let centre = (DVec2::new(column.into(), row.into()) + 0.5) * tile_px;
                // How far the tile reaches beyond the edge that it is farthest out of.
                let reach = self.edges().map(|(a, b)| {
                    let normal = (b - a).perp() * inward;
                    let length = normal.length().max(f64::MIN_POSITIVE);
                    let half = tile_px / 2.0 * (normal.x.abs() + normal.y.abs());
                    (normal.dot(centre - a) + half) / length
                });
                let reach = reach.fold(f64::INFINITY, f64::min);
                if reach < -may {
                    continue;
                }
                let is_sure = is_sure(0, column) && is_sure(1, row) && reach >= -must;
                visit(
                    [column, row],
                    if is_sure { Entry::Must } else { Entry::May },
                );
            }
        }
    }
}

/// Distance to a side of the view volume in clip space, negative outside: left, right, bottom, top, depth 0,
/// depth 1.
fn distance(side: usize, clip: DVec4) -> f64 {
    let value = clip[side / 2];
    match side {
        4 => value,
        _ if side.is_multiple_of(2) => clip.w + value,
        _ => clip.w - value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tiles that a triangle on a screen of 64x64 pixels enters, in and not in doubt.
    fn tiles(corners: [[f64; 2]; 3]) -> [Vec<[u32; 2]>; 2] {
        let corner = |[x, y]: [f64; 2]| {
            let clip = DVec4::new(x / 32.0 - 1.0, 1.0 - y / 32.0, 0.5, 1.0);
            (clip, VertexError::default())
        };
        let polygon = Polygon::new(corners.map(corner), [64; 2], DepthOrder::Ascending).unwrap();
        let mut found = [Vec::new(), Vec::new()];
        polygon.tiles([64; 2], |tile, entry| {
            found[usize::from(entry == Entry::Must)].push(tile);
        });
        found
    }

    #[test]
    fn the_margin_leaves_tiles_in_doubt() {
        let of = |right: f64| tiles([[1.0, 1.0], [right, 1.0], [1.0, 30.0]]);
        // The second column of tiles starts at 16, its first centre at 16.5.
        let first = vec![[0, 0], [0, 1]];
        assert_eq!(of(16.4), [vec![], first.clone()]);
        assert_eq!(of(16.5 - MARGIN_PX), [vec![[1, 0]], first]);
        assert_eq!(of(16.6)[1], [[0, 0], [1, 0], [0, 1]]);
        // A diagonal that passes a tile's corner in its margin.
        let diagonal = |by: f64| tiles([[0.0, 32.0 + by], [32.0 + by, 0.0], [0.0, 0.0]]);
        assert_eq!(diagonal(-0.1)[1].len() + diagonal(-0.1)[0].len(), 3);
        assert_eq!(diagonal(-MARGIN_PX * 1.2)[0], [[1, 1]]);
        assert!(diagonal(0.1)[1].contains(&[1, 1]));
    }
}
