//! Causes of a fragment that only the capture or only the reference has.

use super::geometry::{Geometry, SLIVER_PX};
use super::piece::{Piece, Side, center};
use super::reference::AlphaTest;
use raster::backend::Fragments;
use raster::draws::DrawMode;
use serde::Serialize;

/// Distance to an edge within which rounding the vertices to 1/256 pixel decides coverage.
const EDGE_PX: f64 = 2.0 / 256.0;
/// The same for clipped primitives, whose corners are replaced.
const CLIPPED_PX: f64 = 16.0 / 256.0;
/// Difference of alpha from the cutoff within which the filter's rounding and the level of detail decide.
const ALPHA: f64 = 1.0 / 16.0;

/// A class of differences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// The pixel's centre lies within 1/128 pixel of an edge of the primitive.
    Edge,
    /// The primitive is so thin that rounding decides its winding or whether it has an area.
    Sliver,
    /// The near or far plane cuts the primitive, and its cut edges are within 1/16 pixel.
    Clipped,
    /// Another fragment or the far plane has the same depth within single precision.
    DepthTie,
    /// It overlaps an alpha-masked fragment whose alpha is within 1/16 of the cutoff.
    AlphaBorder,
    /// Only one side has a nearer fragment, for one of the reasons above.
    Hidden,
    /// None of these.
    Unexplained,
}

impl Class {
    /// Every class.
    pub const ALL: [Self; 7] = [
        Self::Edge,
        Self::Sliver,
        Self::Clipped,
        Self::DepthTie,
        Self::AlphaBorder,
        Self::Hidden,
        Self::Unexplained,
    ];

    /// Its cause, for reports.
    pub fn cause(self) -> &'static str {
        match self {
            Self::Edge => "edges within 1/128 px: vertices rounded to 1/256 px",
            Self::Sliver => "slivers: rounding turns or empties the primitive",
            Self::Clipped => "cut by the near or far plane",
            Self::DepthTie => "as deep as another fragment or the far plane in single precision",
            Self::AlphaBorder => "alpha within 1/16 of the cutoff",
            Self::Hidden => "behind a fragment that differs",
            Self::Unexplained => "unexplained",
        }
    }
}

fn side(piece: &Piece, pixel: [u32; 2]) -> Side {
    let margin = if piece.clipped { CLIPPED_PX } else { EDGE_PX };
    piece.side(pixel, margin)
}

/// The class of a fragment of a primitive at a pixel of a tile, which only one side has.
pub fn classify(
    geometry: &Geometry<'_>,
    tile: usize,
    alpha: &dyn AlphaTest,
    recorded: Fragments,
    primitive: u32,
    pixel: [u32; 2],
) -> Class {
    let at = center(pixel);
    let own = |piece: &Piece| geometry.primitive(piece) == primitive;
    let of_primitive = || geometry.of_tile(tile).filter(|(_, piece)| own(piece));
    if of_primitive().any(|(_, piece)| piece.dropped || piece.height_px() <= SLIVER_PX) {
        return Class::Sliver;
    }
    let nearest = of_primitive()
        .map(|(index, piece)| (piece.distance_px(pixel), index, piece))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, index, piece)) = nearest else {
        return Class::Unexplained;
    };
    if piece.side(pixel, EDGE_PX) == Side::Border {
        return Class::Edge;
    }
    match side(piece, pixel) {
        Side::Border => return Class::Clipped,
        Side::Outside => return Class::Unexplained,
        Side::Inside => {}
    }
    let (depth, error) = (piece.depth(at), piece.depth_error(at));
    if (f64::from(geometry.order.farthest()) - depth).abs() <= error {
        return Class::DepthTie;
    }
    if recorded == Fragments::All {
        return Class::Unexplained;
    }
    // The effect of an earlier fragment at the pixel, if it exists: it hides this one or not.
    let mut class = Class::Unexplained;
    for (_, earlier) in geometry.of_tile(tile).filter(|(other, _)| *other < index) {
        let side = side(earlier, pixel);
        let borderline =
            side == Side::Border || earlier.dropped || earlier.height_px() <= SLIVER_PX;
        if own(earlier) || (side == Side::Outside && !borderline) {
            continue;
        }
        let mode = geometry.call(earlier).mode;
        if mode == DrawMode::Blended {
            continue;
        }
        let (there, tolerance) = (earlier.depth(at), error + earlier.depth_error(at));
        let margin = match mode {
            DrawMode::Masked => alpha.margin(geometry, earlier, pixel),
            _ => 1.0,
        };
        if margin < -ALPHA {
            continue;
        }
        if (there - depth).abs() <= tolerance {
            return Class::DepthTie;
        }
        if there > depth {
            continue;
        }
        if margin.abs() <= ALPHA {
            class = Class::AlphaBorder;
        } else if borderline && class == Class::Unexplained {
            class = Class::Hidden;
        }
    }
    class
}
