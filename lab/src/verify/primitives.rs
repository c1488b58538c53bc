//! Verifies a trace's geometry: its meshes, its views, and the primitives in their tiles.

use super::faults::Faults;
use super::frame::CaptureUnderTest;
use super::lists::{ListErrors, ListedView};
use super::meshes;
use super::piece::DepthOrder;
use formats::textrace::geometry::{Geometry, GeometryView, TileLists, ViewTarget};
use glam::{DMat4, Mat4};
use raster::cascades::Cascade;
use raster::draws::DrawMode;

impl CaptureUnderTest<'_> {
    /// Contradictions of the trace's geometry to the scene. `lookups` are the look-ups of each cascade that
    /// the records hold, if every tile was compared.
    pub(super) fn geometry_faults(&self, lookups: Option<[u64; 4]>) -> anyhow::Result<Vec<String>> {
        let mut faults = Faults::default();
        let Some(geometry) = self.trace.geometry() else {
            return Ok(faults.0);
        };
        let drawn: Vec<usize> = self.draws.calls.iter().map(|call| call.mesh).collect();
        let cascades = self.draws.cascades as usize;
        meshes::hold(self.scene, &drawn, cascades, geometry, &mut faults);
        for (number, view) in geometry.views.iter().enumerate() {
            let lists = self.trace.tile_lists(number)?;
            if let Some(listed) = self.listed(view) {
                let place = place(number, view);
                hold(&place, view, &listed.compare(&lists), &mut faults);
                if matches!(view.target, ViewTarget::ShadowMap(_)) {
                    self.hold_casters(&place, &listed, &lists, &mut faults);
                }
            }
        }
        if let Some(lookups) = lookups {
            self.hold_shadow_maps(geometry, lookups, &mut faults);
        }
        Ok(faults.0)
    }

    /// A view of a frame that is verified; `None` if its matrices are not known.
    fn listed(&self, view: &GeometryView) -> Option<ListedView<'_>> {
        let frame = self
            .frames
            .iter()
            .find(|frame| frame.views.frame == view.frame)?;
        let wide = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m).as_dmat4();
        let (matrices, order, all_faces) = match view.target {
            ViewTarget::Pass(pass) => {
                let eye = self.trace.tables().passes.get(pass as usize)?.eye?;
                let eye = &frame.views.eyes[eye as usize];
                let matrices = [wide(&eye.eye_to_clip), wide(&eye.world_to_eye)];
                (matrices, DepthOrder::of(&eye.eye_to_clip), false)
            }
            ViewTarget::ShadowMap(cascade) => {
                let cascade: &Cascade = frame.cascades.as_ref()?.get(cascade as usize)?;
                let matrices = [cascade.clip_from_world.as_dmat4(), DMat4::IDENTITY];
                (matrices, DepthOrder::Ascending, true)
            }
        };
        Some(ListedView {
            scene: self.scene,
            draws: self.draws,
            matrices,
            size_px: view.size_px,
            order,
            all_faces,
        })
    }

    /// A shadow map is drawn with every opaque or masked draw that enters it, and no other.
    fn hold_casters(
        &self,
        place: &str,
        listed: &ListedView<'_>,
        lists: &TileLists,
        faults: &mut Faults,
    ) {
        for (draw, call) in (0_u32..).zip(&self.draws.calls) {
            let is_listed = lists.draws.binary_search(&draw).is_ok();
            let is_blended = call.mode == DrawMode::Blended;
            if is_listed && is_blended {
                faults.add(&format!("{place}: draw {draw}"), "no blended draws", "one");
            }
            let may_cast = || listed.is_near(call.bounds);
            if is_listed && !may_cast() {
                faults.add(
                    &format!("{place}: draw {draw}"),
                    "draws that enter it",
                    "another",
                );
            }
            if !is_listed && !is_blended && listed.enters(draw).is_some() {
                faults.add(place, &format!("draw {draw}"), "none");
            }
        }
    }

    /// A cascade that is looked up has been drawn.
    fn hold_shadow_maps(&self, geometry: &Geometry, lookups: [u64; 4], faults: &mut Faults) {
        for frame in self.frames {
            for (cascade, lookups) in (0_u32..).zip(lookups) {
                let target = ViewTarget::ShadowMap(cascade);
                let is_map = |v: &GeometryView| (v.frame, v.target) == (frame.views.frame, target);
                // Look-ups are counted over all frames, so only a single frame tells.
                if lookups > 0 && self.frames.len() == 1 && !geometry.views.iter().any(is_map) {
                    let expected =
                        format!("shadow map {cascade}, which {lookups} fragments look up");
                    faults.add(
                        &format!("views of frame {}", frame.views.frame),
                        &expected,
                        "none",
                    );
                }
            }
        }
    }
}

fn place(number: usize, view: &GeometryView) -> String {
    match view.target {
        ViewTarget::Pass(pass) => format!("primitive lists of view {number} (pass {pass})"),
        ViewTarget::ShadowMap(map) => {
            format!("primitive lists of view {number} (shadow map {map})")
        }
    }
}

fn hold(place: &str, view: &GeometryView, errors: &ListErrors, faults: &mut Faults) {
    let columns = view.tiles()[0] as usize;
    let at = |tile: usize| {
        format!(
            "tile {tile} (column {}, row {})",
            tile % columns,
            tile / columns
        )
    };
    if let Some((tile, primitive)) = errors.first_missing {
        let expected = format!(
            "every primitive that enters a tile, as {primitive} enters {}",
            at(tile)
        );
        faults.add(place, &expected, &format!("{} missing", errors.missing));
    }
    if let Some(tile) = errors.first_unexpected {
        let expected = format!(
            "only primitives that enter their tile, unlike in {}",
            at(tile)
        );
        faults.add(place, &expected, &format!("{} others", errors.unexpected));
    }
}
