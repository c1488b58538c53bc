//! Layers of a frame.

use crate::Mask;
use crate::start::Start;
use formats::view::{Eye, EyeView};
use glam::{Mat4, Vec2, Vec3, Vec4};
use std::sync::Arc;

/// One rendering of a part of one or both eyes' pictures: a render pass of the trace.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The eye; `None` for a layer that both pictures use.
    pub eye: Option<Eye>,
    /// Number among the frame's layers of that eye. Left and right layers with the same number show the same
    /// part.
    pub number: u16,
    /// Matrices, with a narrowed, shifted or clipped projection.
    pub view: EyeView,
    /// Size of the layer in pixels, smaller than the part of the picture if it is coarser.
    pub size_px: [u32; 2],
    /// Pixels that may be drawn; all if there is no mask.
    pub mask: Option<Arc<Mask>>,
    /// The draws that are drawn into it.
    pub draws: Stage,
    /// Initial contents.
    pub start: Start,
}

impl Layer {
    /// The whole picture of an eye at its full size.
    pub fn whole(eye: Eye, view: EyeView, size_px: [u32; 2]) -> Self {
        Self {
            eye: Some(eye),
            number: 0,
            view,
            size_px,
            mask: None,
            draws: Stage::All,
            start: Start::Sky,
        }
    }

    /// Whether it has all draws, the sky and no mask.
    pub fn is_plain(&self) -> bool {
        self.mask.is_none() && self.start == Start::Sky && self.draws == Stage::All
    }

    /// World to clip space.
    pub fn clip_from_world(&self) -> Mat4 {
        self.view.clip_from_world()
    }

    /// World to a clip space whose far end is the end of the drawn geometry.
    pub fn drawn_from_world(&self) -> Mat4 {
        match self.start {
            Start::Nearer { end } => {
                let beyond = 1.0 / (1.0 - end.min(1.0 - 1e-6));
                let nearer = Mat4::from_cols(
                    Vec4::X,
                    Vec4::Y,
                    Vec4::Z * beyond,
                    Vec4::new(0.0, 0.0, -end * beyond, 1.0),
                );
                nearer * self.clip_from_world()
            }
            _ => self.clip_from_world(),
        }
    }

    /// Whether a draw with these world-space bounds may touch a pixel that may be drawn. True in doubt.
    pub fn may_draw(&self, [low, high]: [Vec3; 2]) -> bool {
        let Some(mask) = &self.mask else { return true };
        let clip_from_world = self.clip_from_world();
        // Half of the near plane's distance, at most a millimetre.
        let [_, _, depth, shift] = self.view.eye_to_clip.map(|column| column[2]);
        let least_w = (0.5 * shift / (1.0 + depth)).clamp(0.0, 1e-3);
        let (mut first, mut last) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low } else { high }[axis];
            let at = clip_from_world * Vec3::new(pick(0), pick(1), pick(2)).extend(1.0);
            // Bounds next to or behind the eye, or that are not finite, may be anywhere.
            if at.w.is_nan() || at.w < least_w || at.w <= 0.0 {
                return true;
            }
            let ndc = Vec2::new(at.x, -at.y) / at.w;
            (first, last) = (first.min(ndc), last.max(ndc));
        }
        let size = Vec2::new(self.size_px[0] as f32, self.size_px[1] as f32);
        let px = |ndc: Vec2| (ndc + 1.0) / 2.0 * size;
        // One more pixel, because vertices are rounded to the rasteriser's grid.
        let (first, last) = (px(first) - 1.0, px(last) + 1.0);
        if first.is_nan() || last.is_nan() {
            return true;
        }
        mask.any_in(
            [first.x as u32, first.y as u32],
            [last.x.ceil() as u32, last.y.ceil() as u32],
        )
    }

    /// Number of pixels that may be drawn.
    pub fn drawn_px(&self) -> u64 {
        let all = u64::from(self.size_px[0]) * u64::from(self.size_px[1]);
        self.mask.as_ref().map_or(all, |mask| mask.count())
    }
}

/// A part of a frame's draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// Every draw.
    #[default]
    All,
    /// Draws that write depth: opaque and alpha-masked ones.
    Opaque,
    /// Blended draws.
    Transparent,
}

/// Predictions of a technique for a frame, to be compared with measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Predicted {
    /// Share of pixels that may be shaded, including those that only reconstruction needs, relative to the
    /// pixels of the pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shaded_share: Option<f32>,
    /// The same without pixels that only reconstruction needs: the mean shading rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_share: Option<f32>,
    /// Largest shift of a far point in the picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disparity_px: Option<f32>,
    /// Distance from which both eyes share one picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub split_m: Option<f32>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::Random;
    use glam::camera::rh::proj::directx::perspective;

    /// A view along -z in which only the leftmost tiles may be drawn.
    fn layer() -> Layer {
        let view = EyeView {
            eye_to_clip: perspective(1.0, 1.0, 100.0, 0.1).to_cols_array_2d(),
            ..EyeView::default()
        };
        Layer {
            mask: Some(Arc::new(Mask::new([64, 64], |x, _| x < 16))),
            ..Layer::whole(Eye::Left, view, [64, 64])
        }
    }

    #[test]
    fn only_bounds_that_touch_drawn_tiles_are_drawn() {
        let may_draw = |x: f32, z: f32, half: f32| {
            let center = Vec3::new(x, 0.0, z);
            layer().may_draw([center - half, center + half])
        };
        // At 10 m, the picture is 10.9 m wide and a tile 2.7 m.
        assert!(!may_draw(3.0, -10.0, 0.5));
        assert!(may_draw(-4.0, -10.0, 0.5));
        assert!(may_draw(0.0, -10.0, 4.0));
        // Bounds around the eye.
        assert!(may_draw(3.0, -1.0, 4.0));
        assert!(may_draw(f32::NAN, -10.0, 0.5));
    }

    #[test]
    fn bounds_with_a_point_in_a_drawn_pixel_are_drawn() {
        let layer = layer();
        let clip = layer.clip_from_world();
        let mut source = Random(7);
        let mut random = || source.unit_f32() * 20.0 - 10.0;
        let mut drawn = 0;
        for _ in 0..5000 {
            let (p, q) = (
                Vec3::new(random(), random(), random()),
                Vec3::new(random(), random(), random()),
            );
            let c = clip * p.extend(1.0);
            if c.w > 0.1 && c.x.abs() <= c.w && c.y.abs() <= c.w && (c.x / c.w + 1.0) * 32.0 < 16.0
            {
                drawn += 1;
                assert!(layer.may_draw([p.min(q), p.max(q)]), "{p} {q}");
                assert!(layer.may_draw([p, p]), "{p}");
            }
        }
        assert!(drawn > 50, "{drawn}");
    }
}
