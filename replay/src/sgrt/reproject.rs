//! Forward reprojection: every left hit goes to the right pixel in which it is seen; where several
//! meet, the nearest wins.
//!
//! The sky is reprojected by its direction, as a surface at infinity.

use super::frame::{Frame, Sample};
use formats::raytrace::EyeCamera;
use formats::view::Eye;
use rayon::prelude::*;

/// Source of a right sample that no left sample reached.
pub const NONE: u32 = u32::MAX;

/// What reached a right sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Nearest left sample, or [`NONE`].
    pub source: u32,
    /// Its depth along the right eye's view direction, metres; infinite for the sky.
    pub depth: f32,
    /// Left samples that met here.
    pub arrivals: u16,
}

impl Candidate {
    const EMPTY: Self = Self {
        source: NONE,
        depth: f32::INFINITY,
        arrivals: 0,
    };

    /// True where nothing arrived.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        self.source == NONE
    }
}

/// Where a left sample is seen by the right eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Image coordinates in pixels; not a number where the right eye cannot see it.
    pub at_px: [f32; 2],
    /// Depth along the view direction, metres; infinite for the sky.
    pub depth: f32,
}

impl Projected {
    const UNSEEN: Self = Self {
        at_px: [f32::NAN; 2],
        depth: f32::INFINITY,
    };

    /// Number of the pixel's row and column, where it lies in the image.
    #[must_use]
    pub fn pixel(&self, [width, height]: [u32; 2]) -> Option<[u32; 2]> {
        let [x, y] = self.at_px;
        let inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
        inside.then_some([x as u32, y as u32])
    }
}

/// All left samples in the right eye.
#[derive(Clone, Debug)]
pub struct Reprojection {
    /// By right sample.
    pub candidates: Vec<Candidate>,
    /// By left sample.
    pub projected: Vec<Projected>,
}

/// Reprojects the left eye into the right one.
#[must_use]
pub fn reproject(frame: &Frame) -> Reprojection {
    let eye = frame.tables.camera(Eye::Right);
    let projected: Vec<Projected> = frame
        .left()
        .samples
        .par_iter()
        .map(|sample| project(eye, sample))
        .collect();

    let mut candidates = vec![Candidate::EMPTY; frame.sample_count()];
    // In order, so that of two equally near hits the left one wins on every run.
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
        // A direction is seen alike from everywhere: no distance may blur it.
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
