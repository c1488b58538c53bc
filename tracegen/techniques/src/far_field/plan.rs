//! The layers of a frame with a far field.

use super::FarView;
use crate::Mask;
use crate::layer::{Layer, Predicted, Stage};
use crate::plan::{FramePlan, PictureSource};
use crate::start::{Composition, Opening, Start};
use formats::view::{Eye, FrameViews};
use std::sync::Arc;

/// Indices of the layers.
const NEARER: [usize; 2] = [0, 1];
const FARTHER: usize = 2;
const PICTURES: [usize; 2] = [3, 4];

/// Plans three kinds of layers: opaque draws up to the split for each eye, draws beyond it once where the
/// first ones leave pixels open, and the blended draws of each eye over both.
pub(crate) fn plan(
    far: &FarView,
    views: &FrameViews,
    size_px: [u32; 2],
    masks: [Option<Arc<Mask>>; 2],
) -> FramePlan {
    let of_eye = |eye: Eye| Layer::whole(eye, views.eyes[eye as usize], size_px);
    let nearer = |eye: Eye| Layer {
        mask: masks[eye as usize].clone(),
        draws: Stage::Opaque,
        start: Start::Nearer {
            end: far.split_depth[eye as usize],
        },
        ..of_eye(eye)
    };
    let opening = |eye: usize| Opening {
        nearer: NEARER[eye],
        end: far.split_depth[eye],
        nearer_from_px: far.eye_from_far_px[eye],
        reach_px: far.reach_px,
    };
    let farther = Layer {
        eye: None,
        number: 0,
        view: far.camera,
        size_px: far.size_px,
        mask: None,
        draws: Stage::Opaque,
        start: Start::Behind([opening(0), opening(1)]),
    };
    let over = |eye: Eye| Layer {
        number: 1,
        draws: Stage::Transparent,
        start: Start::Composed(Composition {
            nearer: NEARER[eye as usize],
            end: far.split_depth[eye as usize],
            farther: FARTHER,
            farther_from_px: far.far_from_eye_px[eye as usize],
            from_farther_clip: far.eye_from_far_clip[eye as usize],
        }),
        ..of_eye(eye)
    };
    FramePlan {
        layers: vec![
            nearer(Eye::Left),
            nearer(Eye::Right),
            farther,
            over(Eye::Left),
            over(Eye::Right),
        ],
        pictures: PICTURES.map(PictureSource::Layer).to_vec(),
        predicted: Predicted {
            disparity_px: Some(far.worst_shift_px),
            split_m: Some(far.split_m),
            ..Predicted::default()
        },
    }
}
