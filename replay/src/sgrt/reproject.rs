//! Forward reprojection: every left hit goes to the right pixel in which it is seen; where several
//! meet, the nearest wins.
//!
//! The sky is reprojected by its direction, as a surface at infinity. With several samples a pixel a
//! left sample goes to the right sample nearest to where it is seen; samples of a pixel that none
//! went to take the nearest that arrived in the pixel.

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

    let (width, spp) = (frame.size_px[0] as usize, frame.samples_per_px as usize);
    let mut candidates = vec![Candidate::EMPTY; frame.sample_count()];
    // In order, so that of two equally near hits the left one wins on every run.
    for (source, p) in projected.iter().enumerate() {
        let Some([x, y]) = p.pixel(frame.size_px) else {
            continue;
        };
        let first = (y as usize * width + x as usize) * spp;
        let to_sample = |i: &usize| distance_px(p.at_px, frame.position_px(*i));
        let Some(target) = nearest(first..first + spp, to_sample) else {
            continue;
        };
        let slot = &mut candidates[target];
        slot.arrivals = slot.arrivals.saturating_add(1);
        if slot.is_missing() || p.depth < slot.depth {
            slot.source = source as u32;
            slot.depth = p.depth;
        }
    }
    if spp > 1 {
        candidates
            .par_chunks_exact_mut(spp)
            .enumerate()
            .for_each(|(pixel, slots)| fill_pixel(frame, &projected, pixel * spp, slots));
    }
    Reprojection {
        candidates,
        projected,
    }
}

/// Gives samples of a pixel that nothing went to the nearest of what arrived in the pixel.
fn fill_pixel(frame: &Frame, projected: &[Projected], first: usize, slots: &mut [Candidate]) {
    let arrived: Vec<Candidate> = slots.iter().filter(|c| !c.is_missing()).copied().collect();
    for (i, slot) in slots.iter_mut().enumerate() {
        if slot.is_missing() {
            let at = frame.position_px(first + i);
            let to_arrival = |c: &Candidate| distance_px(projected[c.source as usize].at_px, at);
            if let Some(near) = nearest(arrived.iter().copied(), to_arrival) {
                *slot = Candidate {
                    arrivals: 1,
                    ..near
                };
            }
        }
    }
}

/// The first of those with the least distance.
fn nearest<T>(mut all: impl Iterator<Item = T>, distance: impl Fn(&T) -> f32) -> Option<T> {
    let first = all.next()?;
    let start = (distance(&first), first);
    let (_, found) = all.fold(start, |(least, found), next| {
        let d = distance(&next);
        if d < least { (d, next) } else { (least, found) }
    });
    Some(found)
}

fn distance_px(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
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
