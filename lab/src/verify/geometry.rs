//! The triangles of a view, sorted into its tiles.

use super::piece::{DepthOrder, Piece, center, pieces, quad_center};
use super::vertex_error::VertexError;
use formats::footprint::LodFormula;
use formats::view::{EyeView, TILE_SIZE_PX};
use glam::{DMat4, DVec2, DVec3, DVec4, Mat4, Vec3};
use raster::draws::{DrawCall, DrawList};
use scene::{Material, Mesh, Scene, TextureRef, TextureSlot};

/// Height below which rounding of the vertices decides a triangle's winding.
pub(super) const SLIVER_PX: f64 = 4.0 / 256.0;

/// Margin in whole pixels around a triangle, because rounding may move it into the next tile.
const MARGIN_PX: u32 = 1;

/// A view's triangles in submission order, by tile.
pub struct Geometry<'a> {
    scene: &'a Scene,
    draws: &'a DrawList,
    /// Width and height.
    pub size_px: [u32; 2],
    /// Tile columns and rows.
    pub tiles: [u32; 2],
    pub(super) order: DepthOrder,
    pieces: Vec<Piece>,
    /// Pieces that may touch each tile, ascending; empty for tiles that are not verified.
    bins: Vec<Vec<u32>>,
}

impl<'a> Geometry<'a> {
    /// Projects the draws; tiles for which `wanted` is false stay empty.
    pub fn new(
        scene: &'a Scene,
        draws: &'a DrawList,
        view: &EyeView,
        size_px: [u32; 2],
        wanted: impl Fn(usize) -> bool,
    ) -> Self {
        let tiles = size_px.map(|s| s.div_ceil(TILE_SIZE_PX));
        let mut geometry = Self {
            scene,
            draws,
            size_px,
            tiles,
            order: DepthOrder::of(&view.eye_to_clip),
            pieces: Vec::new(),
            bins: vec![Vec::new(); tiles[0] as usize * tiles[1] as usize],
        };
        let wide = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m).as_dmat4();
        let view = [&view.eye_to_clip, &view.world_to_eye].map(wide);
        for (draw, call) in (0_u32..).zip(&draws.calls) {
            let world_from_object = Mat4::from(call.transform).as_dmat4();
            let matrices = [view[0], view[1], world_from_object];
            geometry.add_draw(draw, call, &matrices, &wanted);
        }
        geometry
    }

    fn add_draw(
        &mut self,
        draw: u32,
        call: &DrawCall,
        matrices: &[DMat4; 3],
        wanted: &impl Fn(usize) -> bool,
    ) {
        let mesh = &self.scene.meshes[call.mesh];
        let double_sided = self.scene.materials[call.material].double_sided;
        let clip_from_object = matrices[0] * matrices[1] * matrices[2];
        let clip: Vec<DVec4> = (mesh.positions.iter())
            .map(|p| clip_from_object * p.as_dvec3().extend(1.0))
            .collect();
        for (number, triangle) in (0_u32..).zip(mesh.indices.chunks_exact(3)) {
            let vertices = [0, 1, 2].map(|i| clip[triangle[i] as usize]);
            // All corners are beyond the same side of the picture.
            let beyond = |side: &dyn Fn(&DVec4) -> bool| vertices.iter().all(side);
            if beyond(&|v| v.x > v.w)
                || beyond(&|v| v.x < -v.w)
                || beyond(&|v| v.y > v.w)
                || beyond(&|v| v.y < -v.w)
                || beyond(&|v| v.z < 0.0)
                || beyond(&|v| v.z > v.w)
            {
                continue;
            }
            let shows =
                |counter_clockwise: bool| double_sided || counter_clockwise != call.mirrored;
            let errors = [0, 1, 2].map(|i| {
                let position = mesh.positions[triangle[i] as usize];
                VertexError::new(matrices, position.as_dvec3())
            });
            for piece in pieces(
                vertices,
                errors,
                (self.size_px, self.order),
                draw,
                number,
                shows,
            ) {
                // Undrawn pieces are kept only if different rounding might draw them.
                if !piece.dropped || piece.height_px() <= SLIVER_PX {
                    self.add(piece, wanted);
                }
            }
        }
    }

    fn add(&mut self, piece: Piece, wanted: &impl Fn(usize) -> bool) {
        let Some([[left, right], [top, bottom]]) = piece.span_px(self.size_px) else {
            return;
        };
        let index = self.pieces.len() as u32;
        let first = |px: u32| px.saturating_sub(MARGIN_PX) / TILE_SIZE_PX;
        let last =
            |px: u32, axis: usize| ((px + MARGIN_PX) / TILE_SIZE_PX).min(self.tiles[axis] - 1);
        let mut touches = false;
        for row in first(top)..=last(bottom, 1) {
            for column in first(left)..=last(right, 0) {
                let tile = row as usize * self.tiles[0] as usize + column as usize;
                if wanted(tile) {
                    self.bins[tile].push(index);
                    touches = true;
                }
            }
        }
        if touches {
            self.pieces.push(piece);
        }
    }

    /// Pieces that may touch a tile, in submission order, including undrawn ones.
    pub fn of_tile(&self, tile: usize) -> impl Iterator<Item = (u32, &Piece)> {
        self.bins[tile]
            .iter()
            .map(|&index| (index, self.piece(index)))
    }

    /// A piece by its index.
    pub fn piece(&self, index: u32) -> &Piece {
        &self.pieces[index as usize]
    }

    /// The draw of a piece.
    pub fn call(&self, piece: &Piece) -> &'a DrawCall {
        &self.draws.calls[piece.draw as usize]
    }

    /// The material of a piece.
    pub fn material(&self, piece: &Piece) -> &'a Material {
        &self.scene.materials[self.call(piece).material]
    }

    /// Slots of the material's uv groups.
    pub fn groups(&self, piece: &Piece) -> &'a [Vec<TextureSlot>] {
        &self.draws.groups[self.call(piece).material].groups
    }

    /// Number of the piece's primitive in the trace.
    pub fn primitive(&self, piece: &Piece) -> u32 {
        self.call(piece).first_primitive + piece.number
    }

    /// The texture coordinates of a piece for sampling `texture`.
    pub fn coordinates(&self, piece: &'a Piece, texture: &TextureRef) -> Coordinates<'a> {
        let mesh = &self.scene.meshes[self.call(piece).mesh];
        let set = if texture.uv_set == 1 {
            &mesh.uv1
        } else {
            &mesh.uv0
        };
        let row = |r: [f32; 3]| DVec3::from(r.map(f64::from));
        let rows = texture.uv_transform.map(row);
        let vertex = |i: usize| {
            let uv = set.get(corner(mesh, piece, i)).copied().unwrap_or_default();
            uv.as_dvec2()
        };
        let set = [vertex(0), vertex(1), vertex(2)];
        let transformed = |uv: DVec2| {
            let uv = uv.extend(1.0);
            DVec2::new(rows[0].dot(uv), rows[1].dot(uv))
        };
        Coordinates {
            piece,
            uv: set.map(transformed),
            set,
            rows,
        }
    }

    /// Values of a piece's vertices over the piece.
    pub(super) fn values(&self, piece: &'a Piece, set: [DVec2; 3]) -> Coordinates<'a> {
        Coordinates {
            piece,
            uv: set,
            set,
            rows: [DVec3::X, DVec3::Y],
        }
    }

    /// Positions and normals of a piece's vertices.
    pub(super) fn vertices(&self, piece: &Piece) -> [[DVec3; 3]; 2] {
        let mesh = &self.scene.meshes[self.call(piece).mesh];
        let corners = [0, 1, 2].map(|vertex| corner(mesh, piece, vertex));
        let normal = |vertex: usize| mesh.normals.get(vertex).copied().unwrap_or(Vec3::Y);
        [
            corners.map(|vertex| mesh.positions[vertex].as_dvec3()),
            corners.map(|vertex| normal(vertex).as_dvec3()),
        ]
    }

    /// Alpha of the vertex colours at a point; 1 without colours.
    pub fn vertex_alpha(&self, piece: &Piece, p: DVec2) -> f64 {
        let mesh = &self.scene.meshes[self.call(piece).mesh];
        if mesh.colors.is_empty() {
            return 1.0;
        }
        let over_w = piece.weights_over_w(p);
        let alpha = |i| {
            mesh.colors
                .get(corner(mesh, piece, i))
                .map_or(1.0, |c| f64::from(c.w))
        };
        over_w.dot(DVec3::new(alpha(0), alpha(1), alpha(2))) / over_w.element_sum()
    }
}

fn corner(mesh: &Mesh, piece: &Piece, vertex: usize) -> usize {
    mesh.indices[3 * piece.number as usize + vertex] as usize
}

/// Texture coordinates over a piece.
pub struct Coordinates<'a> {
    piece: &'a Piece,
    uv: [DVec2; 3],
    /// The vertices' coordinates, and the texture's transform.
    set: [DVec2; 3],
    rows: [DVec3; 2],
}

/// Coordinates and their derivatives by x and y, in units of the texture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sampled {
    /// Coordinates.
    pub uv: DVec2,
    /// Horizontal derivative.
    pub dx: DVec2,
    /// Vertical derivative.
    pub dy: DVec2,
}

impl Coordinates<'_> {
    /// Numerator and denominator of the coordinates, both linear in the point.
    fn fraction(&self, p: DVec2) -> (DVec2, f64) {
        let over_w = self.piece.weights_over_w(p);
        let [a, b, c] = self.uv;
        (
            a * over_w.x + b * over_w.y + c * over_w.z,
            over_w.element_sum(),
        )
    }

    /// Coordinates at a point of the screen.
    pub fn at(&self, p: DVec2) -> DVec2 {
        let (uv, one) = self.fraction(p);
        uv / one
    }

    /// Coordinates with their exact derivatives at a point.
    pub fn exact(&self, p: DVec2) -> Sampled {
        let (above, below) = self.fraction(p);
        let uv = above / below;
        let by = |step: DVec2| {
            let (a, b) = self.fraction(p + step);
            ((a - above) - uv * (b - below)) / below
        };
        Sampled {
            uv,
            dx: by(DVec2::X),
            dy: by(DVec2::Y),
        }
    }

    /// Coordinates at a pixel, with the differences in its quad that drivers use as derivatives: of the left
    /// column and the top row (the bottom row in softpipe), or a lane's own.
    pub fn in_quad(&self, pixel: [u32; 2], formula: LodFormula) -> Sampled {
        let quad = quad_center(pixel);
        let lane = center(pixel) - quad;
        let (row, column) = match formula {
            LodFormula::Softpipe => (quad + DVec2::Y, quad),
            LodFormula::Llvmpipe | LodFormula::Exact => (quad, quad),
            LodFormula::PerLane => (quad + DVec2::Y * lane.y, quad + DVec2::X * lane.x),
        };
        Sampled {
            uv: self.at(center(pixel)),
            dx: self.at(row + DVec2::X) - self.at(row),
            dy: self.at(column + DVec2::Y) - self.at(column),
        }
    }

    /// Coordinates of a pixel according to its quad's record, if the driver uses the same differences for the
    /// whole quad like softpipe: extrapolated from the `first` covered lane.
    pub fn without_cross(&self, pixel: [u32; 2], first: u32) -> DVec2 {
        let quad = self.in_quad(pixel, LodFormula::Softpipe);
        let start = quad_center(pixel) + DVec2::new((first & 1).into(), (first >> 1).into());
        let steps = center(pixel) - start;
        self.at(start) + quad.dx * steps.x + quad.dy * steps.y
    }

    /// Error in single precision at a point: a few units in the last place of the largest terms of the plane
    /// equations of numerator and denominator.
    pub fn interpolation_error(&self, p: DVec2) -> DVec2 {
        let (above, below) = self.fraction(p);
        let (mut terms, mut term) = (above.abs(), below.abs());
        for (axis, step) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
            let (a, b) = self.fraction(p + step);
            let away = self.piece.farthest_px(p, axis);
            terms += (a - above).abs() * away;
            term += (b - below).abs() * away;
        }
        16.0 * f64::from(f32::EPSILON) * (terms + (above / below).abs() * term) / below.abs()
    }

    /// The denominator.
    pub fn piece(&self) -> &Piece {
        self.piece
    }

    /// The same coordinates over another piece of the primitive.
    pub fn on<'p>(&self, piece: &'p Piece) -> Coordinates<'p> {
        Coordinates {
            piece,
            uv: self.uv,
            set: self.set,
            rows: self.rows,
        }
    }

    /// The vertices' coordinates before the texture's transform.
    pub(super) fn set(&self) -> &[DVec2; 3] {
        &self.set
    }

    /// The rows of the texture's transform.
    pub(super) fn rows(&self) -> &[DVec3; 2] {
        &self.rows
    }
}
