//! Forward reprojection: projects every left hit into the right eye; the nearest hit per pixel wins.
//!
//! The sky is reprojected by direction, as a surface at infinity.

use super::frame::{Frame, Sample};
use formats::raytrace::EyeCamera;
use formats::view::Eye;
use rayon::prelude::*;

/// Marks a right sample without arrivals.
pub const NONE: u32 = u32::MAX;

/// The arrivals at a right sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Nearest left sample, or [`NONE`].
    pub source: u32,
    /// Depth along the right eye's view direction in metres; infinite for the sky.
    pub depth: f32,
    /// Number of left samples that arrived.
    pub arrivals: u16,
}

impl Candidate {
    const EMPTY: Self = Self {
        source: NONE,
        depth: f32::INFINITY,
        arrivals: 0,
    };

    /// True without arrivals.
    pub(super) fn is_missing(&self) -> bool {
        self.source == NONE
    }
}

/// Position of a left sample in the right eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Image coordinates in pixels; NaN if the right eye cannot see it.
    pub at_px: [f32; 2],
    /// Depth along the view direction in metres; infinite for the sky.
    pub depth: f32,
}

impl Projected {
    const UNSEEN: Self = Self {
        at_px: [f32::NAN; 2],
        depth: f32::INFINITY,
    };

    /// Row and column of the pixel, if inside the image.
    pub fn pixel(&self, [width, height]: [u32; 2]) -> Option<[u32; 2]> {
        let [x, y] = self.at_px;
        let inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
        inside.then_some([x as u32, y as u32])
    }
}

/// All left samples projected into the right eye.
#[derive(Clone, Debug)]
pub struct Reprojection {
    /// By right sample.
    pub candidates: Vec<Candidate>,
    /// By left sample.
    pub projected: Vec<Projected>,
}

/// Reprojects the left eye into the right one.
pub fn reproject(frame: &Frame) -> Reprojection {
    let eye = frame.tables.camera(Eye::Right);
    let projected: Vec<Projected> = frame
        .left()
        .samples
        .par_iter()
        .map(|sample| project(eye, sample))
        .collect();

    let mut candidates = vec![Candidate::EMPTY; frame.sample_count()];
    // In order, so that the first of two equally near hits wins on every run.
    for (source, p) in projected.iter().enumerate() {
        let Some([x, y]) = p.pixel(frame.size_px) else {
            continue;
        };
        let slot = &mut candidates[y as usize * frame.size_px[0] as usize + x as usize];
        slot.arrivals = slot.arrivals.saturating_add(1);
        if slot.is_missing() || p.depth < slot.depth {
            slot.source = source as u32;
            slot.depth = p.depth;
        }
    }
    Reprojection {
        candidates,
        projected,
    }
}

fn project(eye: &EyeCamera, sample: &Sample) -> Projected {
    if sample.is_sky() {
        // A direction looks the same from everywhere, so the eye's position is not used.
        let at_origin = EyeCamera {
            position: [0.0; 3],
            ..*eye
        };
        let seen = at_origin.project(sample.position);
        return seen.map_or(Projected::UNSEEN, |(at_px, _)| Projected {
            at_px,
            depth: f32::INFINITY,
        });
    }
    eye.project(sample.position)
        .map_or(Projected::UNSEEN, |(at_px, depth)| Projected {
            at_px,
            depth,
        })
}
