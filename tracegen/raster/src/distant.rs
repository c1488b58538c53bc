//! Distance culling of a frame's lists.

use super::capture::CaptureJob;
use super::frame::Frame;
use formats::view::FrameViews;
use techniques::distance::Head;

impl CaptureJob<'_> {
    /// Removes from every layer the draws that are too far away or too small. Shadow maps keep
    /// them, because a shadow that ends at the limit would be visible where its caster is not.
    pub(crate) fn cull_distant(&self, frame: &mut Frame, views: &FrameViews) {
        let Some(limit) = self.planner.settings().distance_cull else {
            return;
        };
        let head = Head::new(views, self.planner.hmd());
        for visible in &mut frame.visible {
            visible.retain(|&draw| limit.keeps(&head, self.draws.calls[draw as usize].bounds));
        }
    }
}
