//! Causes of a fragment that only the capture or only the reference has.

use super::geometry::{Geometry, SLIVER_PX};
use super::piece::{Piece, center};
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// The pixel's centre lies within 1/128 pixel of an edge of the primitive.
    Edge,
    /// The primitive is so thin that rounding decides its winding or whether it has an area.
    Sliver,
    /// The near or far plane cuts the primitive, and its cut edges are within 1/16 pixel.
    Clipped,
    /// Another fragment has the same depth within single precision.
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
    #[must_use]
    pub fn cause(self) -> &'static str {
        match self {
            Self::Edge => "edges within 1/128 px: vertices rounded to 1/256 px",
            Self::Sliver => "slivers: rounding turns or empties the primitive",
            Self::Clipped => "cut by the near or far plane",
            Self::DepthTie => "as deep as another fragment in single precision",
            Self::AlphaBorder => "alpha within 1/16 of the cutoff",
            Self::Hidden => "behind a fragment that differs",
            Self::Unexplained => "unexplained",
        }
    }
}

/// The class of a fragment of a primitive at a pixel of a tile, which only one side has.
#[must_use]
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
    let Some((distance, index, piece)) = nearest else {
        return Class::Unexplained;
    };
    if distance.abs() <= EDGE_PX {
        return Class::Edge;
    }
    if piece.clipped && distance.abs() <= CLIPPED_PX {
        return Class::Clipped;
    }
    if distance < 0.0 || recorded == Fragments::All {
        return Class::Unexplained;
    }
    let (depth, error) = (piece.depth(at), piece.depth_error(at));
    // The effect of an earlier fragment at the pixel, if it exists: it hides this one or not.
    let mut class = Class::Unexplained;
    for (_, earlier) in geometry.of_tile(tile).filter(|(other, _)| *other < index) {
        let distance = earlier.distance_px(pixel);
        let borderline = distance.abs() <= if earlier.clipped { CLIPPED_PX } else { EDGE_PX }
            || earlier.dropped
            || earlier.height_px() <= SLIVER_PX;
        if own(earlier) || (distance < 0.0 && !borderline) {
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
