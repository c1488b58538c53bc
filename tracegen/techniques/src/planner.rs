//! Plans frames according to settings.

use crate::error::SettingsError;
use crate::eye::EyePicture;
use crate::far_field::{self, FarFieldError, FarView, Stereo};
use crate::layer::Predicted;
use crate::least_work::Object;
use crate::patch::EyePatches;
use crate::plan::{FramePlan, PictureSource};
use crate::{Settings, hidden_area, shading_reuse};
use formats::view::{Eye, FrameViews, Hmd, Lens};
use std::sync::{Arc, Mutex};

/// Largest width or height of a layer.
const MAX_LAYER_PX: u32 = 8192;

/// Layers of each eye's picture.
type Patches = Arc<Vec<EyePatches>>;

/// Plans frames of one display under the same settings.
#[derive(Debug)]
pub struct Planner {
    settings: Settings,
    hmd: Hmd,
    lenses: [Lens; 2],
    eyes: Vec<Eye>,
    fps: f32,
    /// Layers for the last gaze, reused while the gaze does not change.
    last: Mutex<Option<([f32; 2], Patches)>>,
}

impl Planner {
    /// Plans frames with the pictures of `eyes`, in this order, with `fps` frames per second. `lenses` are
    /// the visible parts of the pictures.
    ///
    /// # Errors
    /// See [`Settings::check`].
    pub fn new(
        settings: &Settings,
        hmd: &Hmd,
        lenses: [Lens; 2],
        eyes: &[Eye],
        fps: f32,
    ) -> Result<Self, SettingsError> {
        settings.check(hmd)?;
        let needs_both = [
            ("far field", settings.far_field.is_some()),
            ("shading reuse", settings.shading_reuse.is_some()),
            ("multiview", settings.multiview),
        ];
        if let Some((what, _)) = needs_both.into_iter().find(|(_, asked)| *asked)
            && eyes != [Eye::Left, Eye::Right]
        {
            return Err(SettingsError {
                what,
                expected: "both eyes".into(),
                found: eyes
                    .iter()
                    .map(Eye::to_string)
                    .collect::<Vec<_>>()
                    .join(", "),
            });
        }
        Ok(Self {
            settings: settings.clone(),
            hmd: hmd.clone(),
            lenses,
            eyes: eyes.to_vec(),
            fps,
            last: Mutex::new(None),
        })
    }

    /// The eyes of the frames.
    pub fn eyes(&self) -> &[Eye] {
        &self.eyes
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The display.
    pub fn hmd(&self) -> &Hmd {
        &self.hmd
    }

    /// Visible parts of the left and right eye's picture.
    pub fn lenses(&self) -> &[Lens; 2] {
        &self.lenses
    }

    /// Checks that the far field, if any, can be drawn for a frame's eyes.
    ///
    /// # Errors
    /// See [`Stereo::view`].
    pub fn check_views(&self, views: &FrameViews) -> Result<(), FarFieldError> {
        self.far_view(views, Vec::new).map(|_| ())
    }

    fn far_view(
        &self,
        views: &FrameViews,
        objects: impl FnOnce() -> Vec<Object>,
    ) -> Result<Option<FarView>, FarFieldError> {
        let Some(far_field) = &self.settings.far_field else {
            return Ok(None);
        };
        let size_px = self.hmd.eye_size_px;
        let stereo = Stereo::new(&views.eyes, size_px, far_field.variant, views.frame);
        far_field.view(&stereo, MAX_LAYER_PX, objects)
    }

    /// Plans a frame of a scene that `blends` some draws or none; `objects` returns its draws, for techniques that depend
    /// on them.
    ///
    /// # Errors
    /// See [`Self::check_views`].
    pub fn plan(
        &self,
        views: &FrameViews,
        blends: bool,
        objects: impl FnOnce() -> Vec<Object>,
    ) -> Result<FramePlan, FarFieldError> {
        if self.settings.reprojects(views.frame) {
            return Ok(FramePlan::default());
        }
        let size_px = self.hmd.eye_size_px;
        let masks = || {
            let masks = self.patches([0.0; 2]);
            [0, 1].map(|eye: usize| masks[eye].patches.first().and_then(|p| p.mask.clone()))
        };
        if let Some(far) = self.far_view(views, objects)? {
            return Ok(far_field::plan::plan(&far, views, size_px, masks()));
        }
        if let Some(reuse) = self.settings.shading_reuse {
            return Ok(shading_reuse::plan(reuse, views, size_px, masks(), blends));
        }
        let time_s = views.frame as f32 / self.fps;
        let gaze = (self.settings.foveation.as_ref())
            .map_or([0.0; 2], |foveation| foveation.gaze.at(time_s));
        let eyes = self.patches(gaze);
        let mut numbered: Vec<_> = (0..eyes.len())
            .flat_map(|eye| (0..eyes[eye].patches.len()).map(move |patch| (eye, patch)))
            .collect();
        // Left and right layers with the same number are consecutive.
        numbered.sort_by_key(|&(eye, patch)| (eyes[eye].patches[patch].number, eye));
        let layers: Vec<_> = (numbered.iter())
            .map(|&(eye, patch)| {
                let which = self.eyes[eye];
                let view = &views.eyes[which as usize];
                eyes[eye].patches[patch].layer(which, view, self.hmd.eye_size_px)
            })
            .collect();
        let of_eye = |eye: usize| {
            let own = (numbered.iter().enumerate()).filter(move |(_, (of, _))| *of == eye);
            own.map(|(layer, (_, patch))| (layer, *patch))
        };
        let picture = |(eye, made): (usize, &EyePatches)| match of_eye(eye).next() {
            Some((layer, _)) if made.is_picture => PictureSource::Layer(layer),
            _ => PictureSource::Composed {
                size_px: self.hmd.eye_size_px,
                parts: (of_eye(eye))
                    .map(|(layer, patch)| made.patches[patch].part(layer))
                    .collect(),
            },
        };
        let all = (self.hmd.eye_size_px.map(f64::from).iter()).product::<f64>();
        let all = all * eyes.len() as f64;
        let rate_px: f64 = eyes.iter().map(|eye| eye.rate_px).sum();
        let drawn_px: u64 = layers.iter().map(|layer| layer.drawn_px()).sum();
        let shares = self.settings.foveation.is_some() || self.settings.masks_hidden_area();
        Ok(FramePlan {
            predicted: Predicted {
                shaded_share: shares.then_some((drawn_px as f64 / all) as f32),
                rate_share: shares.then_some((rate_px / all) as f32),
                ..Predicted::default()
            },
            pictures: eyes.iter().enumerate().map(picture).collect(),
            layers,
        })
    }

    /// The layers of each eye for a gaze.
    fn patches(&self, gaze_deg: [f32; 2]) -> Patches {
        // A plan is only stored when complete, so the state is valid after a panic.
        let mut last = self.last.lock().unwrap_or_else(|e| e.into_inner());
        if let Some((_, patches)) = last.as_ref().filter(|(gaze, _)| *gaze == gaze_deg) {
            return Arc::clone(patches);
        }
        let of_eye = |eye: &Eye| {
            let number = *eye as usize;
            let lens = (self.settings.masks_hidden_area()).then_some(self.lenses[number]);
            let mut picture = EyePicture::new(&self.hmd, number, lens, gaze_deg);
            if let Some(mesh) = &self.settings.hidden_area_mesh {
                picture = picture.hidden_by(mesh, number);
            }
            let mut made = match &self.settings.foveation {
                None => hidden_area::patches(&picture),
                Some(foveation) => (foveation.kind.mode().patches)(&picture, &foveation.rates),
            };
            // A rate without tiles needs no layer.
            made.patches.retain(|patch| patch.draws_something());
            made
        };
        let patches = Arc::new(self.eyes.iter().map(of_eye).collect());
        *last = Some((gaze_deg, Arc::clone(&patches)));
        patches
    }
}

#[cfg(test)]
mod tests;
