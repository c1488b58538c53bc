//! Captures the frames of a scene into a trace.

use super::backend::{CaptureBackend, View};
use super::cascades;
use super::draws::{DrawList, DrawMode};
use super::error::RasterError;
use super::lighting::Lighting;
use super::regions;
use formats::textrace::{EncodedTile, Pass, PassKind, Tables, TextraceWriter, encode_tile};
use formats::view::{Eye, FrameViews, TILE_SIZE_PX};
use rayon::prelude::*;
use record::{Bins, CaptureCounts, RawRecords, Scratch, TileRect, TileRules};
use std::io::{Seek, Write};
use std::time::{Duration, Instant};

/// What to capture, the same for plain rendering and capture.
pub struct CaptureJob<'a> {
    /// Draws.
    pub draws: &'a DrawList,
    /// Lights; cascades are fitted per frame.
    pub lighting: Lighting,
    /// World-space bounds of the scene.
    pub bounds: (glam::Vec3, glam::Vec3),
    /// Distances from the head that the cascades span, metres.
    pub shadow_range_m: [f32; 2],
    /// Pixels of one eye.
    pub size_px: [u32; 2],
    /// Bands that a view is split into at first; grows when one overflows.
    pub parts: u32,
}

/// The pictures of one frame: left and right eye, sRGB RGBA8.
pub type Pictures = [Vec<u8>; 2];

impl CaptureJob<'_> {
    /// Passes of `frames` frames in the order in which [`Self::capture_frame`] writes them.
    #[must_use]
    pub fn passes(size_px: [u32; 2], frames: u32) -> Vec<Pass> {
        (0..frames)
            .flat_map(|frame| {
                [Eye::Left, Eye::Right].map(|eye| Pass {
                    frame,
                    kind: PassKind::Main,
                    eye: Some(eye),
                    size_px,
                    tiles: size_px.map(|s| s.div_ceil(TILE_SIZE_PX)),
                })
            })
            .collect()
    }

    /// Fits the frame's shadow cascades.
    pub(crate) fn light_frame(&self, views: &FrameViews) -> Lighting {
        let mut lighting = self.lighting.clone();
        let [near, far] = self.shadow_range_m;
        lighting.cascades = cascades::fit(
            views,
            self.draws.cascades,
            lighting.to_sun,
            self.bounds,
            near,
            far,
        );
        lighting
    }

    /// Makes the driver compile every shader that the frame's plain and captured pictures use, by
    /// rendering one tile of each, so that neither's time includes it.
    ///
    /// # Errors
    /// Driver errors.
    pub fn warm_up(
        &self,
        backend: &mut dyn CaptureBackend,
        views: &FrameViews,
    ) -> Result<(), RasterError> {
        let lighting = self.light_frame(views);
        backend.render_shadows(self.draws, &lighting)?;
        let corner = super::backend::Region {
            origin_px: [0, 0],
            size_px: self.size_px.map(|s| s.min(TILE_SIZE_PX)),
        };
        for eye in views.eyes {
            let mut view = View {
                eye,
                lighting: &lighting,
                visible: &[],
            };
            let visible = self.draws.visible(view.clip_from_world());
            view.visible = &visible;
            for capture in [false, true] {
                backend.render(self.draws, &view, corner, capture, &mut |_| Ok(()))?;
            }
        }
        Ok(())
    }

    /// Renders a frame without capture: shadow maps, both eyes, pictures read back.
    ///
    /// # Errors
    /// Driver errors.
    pub fn plain_frame(
        &self,
        backend: &mut dyn CaptureBackend,
        views: &FrameViews,
    ) -> Result<(Pictures, Duration), RasterError> {
        let start = Instant::now();
        let lighting = self.light_frame(views);
        backend.render_shadows(self.draws, &lighting)?;
        let mut pictures = Pictures::default();
        for (eye, picture) in views.eyes.into_iter().zip(&mut pictures) {
            let mut view = View {
                eye,
                lighting: &lighting,
                visible: &[],
            };
            let visible = self.draws.visible(view.clip_from_world());
            view.visible = &visible;
            regions::render_view(backend, self.draws, &view, self.size_px)?;
            *picture = backend.picture()?;
        }
        Ok((pictures, start.elapsed()))
    }

    /// Renders a frame with capture and appends its tiles to the trace; `first_pass` is the
    /// number of the left eye's pass. The time is what sorting, encoding and writing took.
    ///
    /// # Errors
    /// Driver errors, a record budget that one tile overflows, and errors of writing.
    pub fn capture_frame<W: Write + Seek>(
        &mut self,
        backend: &mut dyn CaptureBackend,
        views: &FrameViews,
        first_pass: usize,
        tables: &Tables,
        writer: &mut TextraceWriter<W>,
    ) -> Result<(Pictures, CaptureCounts, Duration), RasterError> {
        let modes = self.draws.calls.iter().map(|call| call.mode);
        let masked = modes.map(|mode| mode == DrawMode::Masked).collect();
        let rules = TileRules::new(tables, masked);
        let lighting = self.light_frame(views);
        backend.render_shadows(self.draws, &lighting)?;
        let mut pictures = Pictures::default();
        let mut counts = CaptureCounts::default();
        let mut sorting = Duration::ZERO;
        let eyes = views.eyes.into_iter().zip(&mut pictures).zip(first_pass..);
        for ((eye, picture), pass) in eyes {
            let mut view = View {
                eye,
                lighting: &lighting,
                visible: &[],
            };
            let visible = self.draws.visible(view.clip_from_world());
            view.visible = &visible;
            let columns = tables.passes[pass].tiles[0];
            let mut sink = |rect: &TileRect, records: RawRecords<'_>| {
                let start = Instant::now();
                let (tiles, of_region) = encode_region(&rules, tables, rect, records)?;
                counts += of_region;
                for (number, tile) in tiles.into_iter().enumerate() {
                    let [column, row] = rect.tile(number);
                    let index = (row * columns + column) as usize;
                    writer
                        .append(pass, index, tile)
                        .map_err(|e| RasterError::Write(e.to_string()))?;
                }
                sorting += start.elapsed();
                Ok(())
            };
            self.parts = regions::capture_view(
                backend,
                self.draws,
                &view,
                self.size_px,
                self.parts,
                &mut sink,
            )?;
            *picture = backend.picture()?;
        }
        Ok((pictures, counts, sorting))
    }
}

/// Bins, sorts, filters, quantises and encodes a region's records, tiles in parallel.
fn encode_region(
    rules: &TileRules,
    tables: &Tables,
    rect: &TileRect,
    records: RawRecords<'_>,
) -> Result<(Vec<EncodedTile>, CaptureCounts), RasterError> {
    let bins = Bins::new(records.quads, rect);
    let encoded: Vec<(EncodedTile, CaptureCounts)> = (0..rect.count())
        .into_par_iter()
        .map_init(Scratch::default, |scratch, tile| {
            let mut counts = rules.build(records, &bins, tile, scratch);
            let encoded = encode_tile(tables, &scratch.tile)
                .map_err(|e| RasterError::Write(e.to_string()))?;
            counts.tile_bytes = encoded.size_bytes() as u64;
            Ok((encoded, counts))
        })
        .collect::<Result<_, RasterError>>()?;
    let mut counts = CaptureCounts::default();
    let tiles = encoded
        .into_iter()
        .map(|(tile, of_tile)| {
            counts += of_tile;
            tile
        })
        .collect();
    Ok((tiles, counts))
}
