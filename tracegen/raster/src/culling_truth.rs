//! Errors of culling, found by drawing everything.

use super::backend::Marks;
use super::capture::CaptureJob;
use super::error::RasterError;
use super::frame::Frame;
use super::lavapipe::Lavapipe;
use std::ops::AddAssign;
use techniques::Layer;

/// Numbers of wrong culling decisions about the draws of an eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wrong {
    /// Visible but not drawn.
    pub negatives: u64,
    /// Drawn but not visible.
    pub positives: u64,
}

impl AddAssign for Wrong {
    fn add_assign(&mut self, other: Self) {
        formats::add_fields!(self, other, negatives, positives);
    }
}

/// Errors of culling in an eye's picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Judgement {
    /// Compared with everything visible in the picture.
    pub picture: Wrong,
    /// Compared with what is visible through the lens.
    pub lens: Wrong,
    /// Draws visible through the lens but not drawn, ascending.
    pub lost: Vec<u32>,
}

impl Judgement {
    /// Compares a list of draws (ascending) with the visibility of every draw.
    pub fn new(listed: &[u32], visible: &[Marks]) -> Self {
        let mut found = Self::default();
        for (draw, marks) in (0..).zip(visible) {
            let listed = listed.binary_search(&draw).is_ok();
            for (wrong, seen) in [
                (&mut found.picture, marks.picture),
                (&mut found.lens, marks.lens),
            ] {
                wrong.negatives += u64::from(seen && !listed);
                wrong.positives += u64::from(listed && !seen);
            }
            if marks.lens && !listed {
                found.lost.push(draw);
            }
        }
        found
    }
}

impl CaptureJob<'_> {
    /// The true visibility of the draws in each eye's picture, in the order of the job's eyes. A
    /// draw is visible if one of its fragments passes the depth test against the final depth of
    /// everything.
    ///
    /// # Errors
    /// Driver errors, and a device that cannot capture.
    pub fn culling_truth(
        &self,
        backend: &mut Lavapipe,
        frame: &Frame,
    ) -> Result<Vec<Vec<Marks>>, RasterError> {
        (self.planner.eyes().iter().zip(frame.rig.eyes()))
            .map(|(eye, seen)| {
                let layer = Layer::whole(*eye, seen.view, seen.size_px);
                let mut view = frame.view(0);
                view.layer = &layer;
                backend.marks(self.draws, &view, &seen.lens)
            })
            .collect()
    }

    /// Errors of the frame's lists, in the order of the job's eyes. An eye's list is that of all
    /// layers of its picture.
    ///
    /// # Errors
    /// Driver errors, and a device that cannot capture.
    pub fn judge(
        &self,
        backend: &mut Lavapipe,
        frame: &Frame,
    ) -> Result<Vec<Judgement>, RasterError> {
        Ok(self.judge_against(frame, &self.culling_truth(backend, frame)?))
    }

    /// Like [`Self::judge`], with the results of [`Self::culling_truth`] for the frame's eyes.
    pub fn judge_against(&self, frame: &Frame, truth: &[Vec<Marks>]) -> Vec<Judgement> {
        let judge = |(eye, visible): (_, &Vec<Marks>)| {
            let of_eye = |layer: &Layer| layer.eye.is_none() || layer.eye == Some(eye);
            let mut listed: Vec<u32> = (frame.views())
                .filter(|view| of_eye(view.layer))
                .flat_map(|view| view.visible.iter().copied())
                .collect();
            listed.sort_unstable();
            listed.dedup();
            Judgement::new(&listed, visible)
        };
        let eyes = self.planner.eyes().iter().copied();
        eyes.zip(truth).map(judge).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_draws_and_unnecessary_draws_are_counted_separately() {
        let marks = |picture, lens| Marks { picture, lens };
        let visible = [
            marks(true, true),
            marks(true, false),
            marks(false, false),
            marks(true, true),
        ];
        let found = Judgement::new(&[0, 2], &visible);
        let wrong = |negatives, positives| Wrong {
            negatives,
            positives,
        };
        assert_eq!(found.picture, wrong(2, 1));
        assert_eq!(found.lens, wrong(1, 1));
        assert_eq!(found.lost, [3]);
    }
}
