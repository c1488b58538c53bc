//! The two phases of occlusion culling on a backend.

use super::backend::CaptureBackend;
use super::capture::CaptureJob;
use super::error::RasterError;
use super::frame::Frame;
use std::time::Instant;
use visibility::{Occlusion, Pyramid};

impl CaptureJob<'_> {
    /// Removes from each layer of a frame the draws that others hide. No pixel changes.
    ///
    /// `occlusion` stores what the previous frame showed; frames may be in any order. The time is
    /// added to the frame's culling time.
    ///
    /// # Errors
    /// Driver errors.
    pub fn occlude(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &mut Frame,
        occlusion: &mut Occlusion,
    ) -> Result<(), RasterError> {
        let start = Instant::now();
        let backend = backend.for_technique("depth for occlusion culling")?;
        for number in 0..frame.plan.layers.len() {
            let first = occlusion.first(number, &frame.visible[number]);
            let (depth, clip_from_world) = {
                let mut view = frame.view(number);
                view.visible = &first;
                let depth = backend.depth(self.draws, &view)?;
                (
                    Pyramid::new(view.layer.size_px, depth),
                    view.clip_from_world(),
                )
            };
            let bounds = |draw: u32| self.draws.calls[draw as usize].bounds;
            let kept = &mut frame.visible[number];
            let before = kept.len();
            frame.occlusion_tests +=
                occlusion.second(number, kept, bounds, clip_from_world, &depth);
            frame.occluded += (before - kept.len()) as u64;
        }
        frame.cull_time += start.elapsed();
        Ok(())
    }
}
