//! The layers of one eye without its pose. They are the same for all frames with the same gaze.

use crate::Mask;
use crate::eye::EyePicture;
use crate::layer::{Layer, Stage};
use crate::plan::{Filter, PicturePart};
use crate::start::Start;
use formats::view::{Eye, EyeView, TILE_SIZE_PX};
use glam::{DMat3, DMat4, DVec3, DVec4, Mat4};
use std::sync::Arc;

/// A layer of an eye's picture.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    pub number: u16,
    /// Left and top edge in the picture, in pixels.
    pub origin_px: [u32; 2],
    /// Columns and rows of the picture per pixel.
    pub coarseness: [u32; 2],
    pub size_px: [u32; 2],
    pub mask: Option<Arc<Mask>>,
    /// Tiles of the picture that the layer fills.
    pub tiles: Option<Arc<Mask>>,
    pub filter: Filter,
    /// Map from pixels of the picture to pixels of the layer, if it does not follow from origin and
    /// coarseness.
    pub layer_from_px: Option<DMat3>,
}

/// The layers of an eye's picture.
#[derive(Clone, Debug)]
pub(crate) struct EyePatches {
    pub patches: Vec<Patch>,
    /// Whether the only layer is the picture itself.
    pub is_picture: bool,
    /// Number of shaded pixels if each pixel of the picture had exactly its rate.
    pub rate_px: f64,
}

impl Patch {
    /// Whether the mask has any pixel to draw.
    pub fn draws_something(&self) -> bool {
        self.mask.as_ref().is_none_or(|mask| mask.first().is_some())
    }

    /// A whole picture in which only the pixels of `mask` may be drawn.
    pub fn whole(picture: &EyePicture, mask: Option<Arc<Mask>>) -> Self {
        Self {
            number: 0,
            origin_px: [0, 0],
            coarseness: [1, 1],
            size_px: picture.size_px,
            mask,
            tiles: None,
            filter: Filter::Copy,
            layer_from_px: None,
        }
    }

    /// A layer over the whole picture that fills the tiles in `owned`. Its mask has the pixels that the lens
    /// shows and those from which the picture's pixels are interpolated.
    pub fn of_tiles(picture: &EyePicture, number: u16, coarseness: [u32; 2], owned: Mask) -> Self {
        let cover = Patch {
            number,
            coarseness,
            size_px: [0, 1].map(|axis| picture.size_px[axis].div_ceil(coarseness[axis])),
            filter: if coarseness == [1, 1] {
                Filter::Copy
            } else {
                Filter::Bilinear
            },
            ..Self::whole(picture, None)
        };
        let shown = Mask::new(cover.size_px, |x, y| {
            let [low, high] = cover.covered_px(picture, [x, y]);
            let tile = low.map(|px| px / TILE_SIZE_PX);
            owned.get(tile[0], tile[1]) && picture.shows(low, high)
        });
        let mask = match cover.filter {
            Filter::Copy => shown,
            _ => shown.grown(coarseness.map(|n| u32::from(n > 1))),
        };
        Self {
            mask: Some(Arc::new(mask)),
            tiles: Some(Arc::new(owned)),
            ..cover
        }
    }

    /// Pixels of the picture that a pixel covers, clipped at the edge: first pixel and exclusive end.
    pub fn covered_px(&self, picture: &EyePicture, pixel: [u32; 2]) -> [[u32; 2]; 2] {
        let edge = |step: u32| {
            [0, 1].map(|axis: usize| {
                (self.origin_px[axis] + (pixel[axis] + step) * self.coarseness[axis])
                    .min(picture.size_px[axis])
            })
        };
        [edge(0), edge(1)]
    }

    /// The layer for an eye with a pose.
    pub fn layer(&self, eye: Eye, view: &EyeView, picture_px: [u32; 2]) -> Layer {
        let covers = [0, 1].map(|axis| self.size_px[axis] * self.coarseness[axis]);
        let view = match &self.layer_from_px {
            Some(map) => mapped(view, map, picture_px, self.size_px),
            None => narrowed(view, self.origin_px, covers, picture_px),
        };
        Layer {
            eye: Some(eye),
            number: self.number,
            view,
            size_px: self.size_px,
            mask: self.mask.clone(),
            draws: Stage::All,
            start: Start::Sky,
        }
    }

    /// The part of the picture that it fills; `layer` is its index in the plan.
    pub fn part(&self, layer: usize) -> PicturePart {
        PicturePart {
            layer,
            origin_px: self.origin_px,
            coarseness: self.coarseness,
            tiles: self.tiles.clone(),
            filter: self.filter,
            layer_from_px: self.layer_from_px,
        }
    }
}

/// The view through a rectangle of an eye's picture; the rectangle may extend beyond the picture.
fn narrowed(view: &EyeView, origin: [u32; 2], covers: [u32; 2], picture_px: [u32; 2]) -> EyeView {
    if origin == [0, 0] && covers == picture_px {
        return *view;
    }
    // Scale and offset of clip space along an axis, from the edges of the rectangle.
    let axis = |axis: usize| {
        let ndc = |px: u32| 2.0 * f64::from(px) / f64::from(picture_px[axis]) - 1.0;
        let (low, high) = (ndc(origin[axis]), ndc(origin[axis] + covers[axis]));
        (2.0 / (high - low), -(high + low) / (high - low))
    };
    let ((x_scale, x_shift), (y_scale, y_shift)) = (axis(0), axis(1));
    // Rows of pixels are numbered downwards; clip space points upwards.
    let narrow = DMat4::from_cols(
        DVec4::new(x_scale, 0.0, 0.0, 0.0),
        DVec4::new(0.0, y_scale, 0.0, 0.0),
        DVec4::Z,
        DVec4::new(x_shift, -y_shift, 0.0, 1.0),
    );
    let eye_to_clip = Mat4::from_cols_array_2d(&view.eye_to_clip).as_dmat4();
    EyeView {
        eye_to_clip: (narrow * eye_to_clip).as_mat4().to_cols_array_2d(),
        ..*view
    }
}

/// The view of a layer defined by a projective map of the picture's pixels.
fn mapped(
    view: &EyeView,
    layer_from_px: &DMat3,
    picture_px: [u32; 2],
    layer_px: [u32; 2],
) -> EyeView {
    // Homogeneous clip space (x, y, w) to pixels; rows are numbered downwards.
    let px_from_clip = |size_px: [u32; 2]| {
        let [x, y] = size_px.map(|size| f64::from(size) / 2.0);
        DMat3::from_cols(
            DVec3::new(x, 0.0, 0.0),
            DVec3::new(0.0, -y, 0.0),
            DVec3::new(x, y, 1.0),
        )
    };
    let map = px_from_clip(layer_px).inverse() * *layer_from_px * px_from_clip(picture_px);
    // Depth is unchanged: points in one direction keep their order, because the same factor scales their w.
    let column = |c: DVec3| DVec4::new(c.x, c.y, 0.0, c.z);
    let map = DMat4::from_cols(
        column(map.x_axis),
        column(map.y_axis),
        DVec4::Z,
        column(map.z_axis),
    );
    let eye_to_clip = Mat4::from_cols_array_2d(&view.eye_to_clip).as_dmat4();
    EyeView {
        eye_to_clip: (map * eye_to_clip).as_mat4().to_cols_array_2d(),
        ..*view
    }
}
