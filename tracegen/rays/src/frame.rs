//! A stereo frame: tiles are traced in parallel and written in order.

use super::scene::TraceScene;
use super::tracer::{TraceSettings, Tracer, triangle};
use formats::Result;
use formats::raytrace::{
    EncodedRayTile, EyeCamera, RayKind, RayTile, RayTriangle, RaytraceTables, RaytraceWriter,
    encode_ray_tile, encode_ray_tile_with_geometry,
};
use glam::Vec3;
use rayon::prelude::*;
use std::io::{Seek, Write};
use std::ops::Range;

/// Number of tiles traced before they are written: enough to keep all threads busy, and few enough
/// to keep the memory for encoded tiles small.
const TILES_AT_ONCE: u32 = 256;

/// Linear pixels of one eye, row by row.
pub struct EyeImage {
    /// Width and height.
    pub size_px: [u32; 2],
    /// Mean radiance of each pixel's samples.
    pub pixels: Vec<Vec3>,
}

/// Cost of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameStats {
    /// Rays by kind, in the order of [`RayKind`].
    pub rays: [u64; 6],
    /// Steps.
    pub steps: u64,
    /// Triangle tests.
    pub triangle_tests: u64,
    /// Pixels (or samples) that hit something.
    pub hits: u64,
}

impl FrameStats {
    fn add(&mut self, tile: &RayTile) {
        for ray in &tile.rays {
            self.rays[ray.kind as usize] += 1;
            self.steps += u64::from(ray.steps);
            self.triangle_tests += u64::from(ray.triangle_tests);
        }
        self.hits += tile.pixels.iter().filter(|p| p.hit.is_some()).count() as u64;
    }

    fn merge(&mut self, other: &Self) {
        for (sum, n) in self.rays.iter_mut().zip(other.rays) {
            *sum += n;
        }
        formats::add_fields!(self, other, steps, triangle_tests, hits);
    }

    /// Rays of all kinds.
    pub fn total_rays(&self) -> u64 {
        self.rays.iter().sum()
    }

    /// Rays of one kind.
    pub fn rays_of(&self, kind: RayKind) -> u64 {
        self.rays[kind as usize]
    }
}

/// A traced frame.
pub struct RayFrame {
    /// Both eyes' pictures.
    pub images: [EyeImage; 2],
    /// Triangles that primary rays hit, for the trace's table.
    pub triangles: Vec<RayTriangle>,
    /// Cost.
    pub stats: FrameStats,
}

/// Results of tracing one tile.
struct TileResult {
    encoded: Result<EncodedRayTile>,
    origin_px: [u32; 2],
    size_px: [u32; 2],
    colors: Vec<Vec3>,
    primitives: Vec<u32>,
    stats: FrameStats,
}

/// Traces the tiles of both eyes and appends them to a trace. One batch is written while the next
/// is traced. The result does not depend on the number of threads. After each batch, `progress` is
/// called with the number of traced tiles.
///
/// # Errors
/// Errors of writing.
pub fn trace_frame<W: Write + Seek + Send>(
    scene: &TraceScene,
    settings: TraceSettings,
    tables: &RaytraceTables,
    writer: &mut RaytraceWriter<W>,
    mut progress: impl FnMut(u64),
) -> Result<RayFrame> {
    let size_px = tables.meta.eyes[0].size_px;
    let blank = || EyeImage {
        size_px,
        pixels: vec![Vec3::ZERO; size_px[0] as usize * size_px[1] as usize],
    };
    let mut frame = RayFrame {
        images: [blank(), blank()],
        triangles: Vec::new(),
        stats: FrameStats::default(),
    };
    let mut hit = vec![false; scene.soup.count()];
    let tiles = tables.tile_count();
    let batches = (0..tables.meta.eyes.len()).flat_map(|eye| {
        let starts = (0..tiles).step_by(TILES_AT_ONCE as usize);
        starts.map(move |first| (eye, first..(first + TILES_AT_ONCE).min(tiles)))
    });
    let mut traced: (usize, Vec<TileResult>) = (0, Vec::new());
    for (eye, batch) in batches {
        let count = batch.len() as u64;
        let (taken, next) = rayon::join(
            || frame.take(traced, writer, &mut hit),
            || trace_batch(scene, settings, tables, eye, batch),
        );
        taken?;
        traced = (eye, next);
        progress(count);
    }
    frame.take(traced, writer, &mut hit)?;
    frame.triangles = (0u32..)
        .zip(hit)
        .filter(|(_, hit)| *hit)
        .map(|(primitive, _)| triangle(scene, primitive))
        .collect();
    Ok(frame)
}

impl RayFrame {
    /// Writes a batch of an eye's tiles and adds it to the frame.
    fn take<W: Write + Seek>(
        &mut self,
        (eye, batch): (usize, Vec<TileResult>),
        writer: &mut RaytraceWriter<W>,
        hit: &mut [bool],
    ) -> Result<()> {
        let image = &mut self.images[eye];
        for result in batch {
            writer.tile(&result.encoded?)?;
            self.stats.merge(&result.stats);
            for primitive in result.primitives {
                hit[primitive as usize] = true;
            }
            let width = result.size_px[0] as usize;
            for (row, colors) in result.colors.chunks(width.max(1)).enumerate() {
                let y = result.origin_px[1] as usize + row;
                let at = y * image.size_px[0] as usize + result.origin_px[0] as usize;
                image.pixels[at..at + colors.len()].copy_from_slice(colors);
            }
        }
        Ok(())
    }
}

fn trace_batch(
    scene: &TraceScene,
    settings: TraceSettings,
    tables: &RaytraceTables,
    eye: usize,
    batch: Range<u32>,
) -> Vec<TileResult> {
    let (earlier, eye) = (&tables.meta.eyes[..eye], &tables.meta.eyes[eye]);
    batch
        .into_par_iter()
        .map_init(
            || {
                let tracer = Tracer::new(scene, settings).after(earlier, eye);
                (tracer, RayTile::default())
            },
            |(tracer, tile), number| {
                tile.clear();
                (tile.origin_px, tile.size_px) = tables.tile_rect(number);
                trace_tile(tracer, settings, tables, eye, tile)
            },
        )
        .collect()
}

fn trace_tile(
    tracer: &mut Tracer<'_>,
    settings: TraceSettings,
    tables: &RaytraceTables,
    eye: &EyeCamera,
    tile: &mut RayTile,
) -> TileResult {
    tracer.tile(eye, tile);
    let mut stats = FrameStats::default();
    stats.add(tile);
    let mut primitives: Vec<u32> = tile
        .pixels
        .iter()
        .filter_map(|p| p.hit.map(|h| h.primitive))
        .collect();
    primitives.sort_unstable();
    primitives.dedup();
    let samples = settings.samples_per_px as usize;
    let colors = tile
        .pixels
        .chunks(samples.max(1))
        .map(|pixel| {
            let sum: Vec3 = pixel.iter().map(|p| Vec3::from(p.color())).sum();
            sum / pixel.len() as f32
        })
        .collect();
    TileResult {
        encoded: if settings.geometry {
            encode_ray_tile_with_geometry(tables, eye, tile)
        } else {
            encode_ray_tile(tile, settings.visits)
        },
        origin_px: tile.origin_px,
        size_px: tile.size_px,
        colors,
        primitives,
        stats,
    }
}
