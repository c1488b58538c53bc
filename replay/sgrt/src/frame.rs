//! A stereo frame of a ray trace: the hit of each pixel and the cost of its rays.

use super::work::PixelWork;
use formats::raytrace::camera::sample_position_px;
use formats::raytrace::{Hierarchy, RayTile, Raytrace, RaytraceTables};
use formats::view::{Eye, TILE_SIZE_PX};
use rayon::prelude::*;
use sim::sums::Unbalanced;
use std::error::Error;
use std::sync::Arc;

/// Object and primitive number of a sky pixel.
pub(super) const SKY: u32 = u32::MAX;

/// An invalid tile, with its location.
pub type TileError = Box<dyn Error + Send + Sync>;

/// A source of ray trace tiles.
pub trait RaySource: Sync {
    /// All tables.
    fn tables(&self) -> &RaytraceTables;

    /// Decodes a tile of an eye into `tile`.
    ///
    /// # Errors
    /// An invalid tile, with its location.
    fn tile(&self, eye: Eye, index: u32, tile: &mut RayTile) -> Result<(), TileError>;

    /// Decodes a tile with the geometry of its rays, if the source has it.
    ///
    /// # Errors
    /// As [`Self::tile`].
    fn tile_with_geometry(
        &self,
        eye: Eye,
        index: u32,
        tile: &mut RayTile,
    ) -> Result<(), TileError> {
        self.tile(eye, index, tile)
    }

    /// Whether the source has the geometry of rays.
    fn has_geometry(&self) -> bool {
        false
    }

    /// The content of the hierarchy, if the source has it and the geometry of rays.
    ///
    /// # Errors
    /// An invalid hierarchy.
    fn hierarchy(&self) -> Result<Option<Hierarchy>, TileError> {
        Ok(None)
    }
}

impl RaySource for Raytrace {
    fn tables(&self) -> &RaytraceTables {
        Self::tables(self)
    }

    fn tile(&self, eye: Eye, index: u32, tile: &mut RayTile) -> Result<(), TileError> {
        Ok(self.decode_tile(eye, index, tile)?)
    }

    fn tile_with_geometry(
        &self,
        eye: Eye,
        index: u32,
        tile: &mut RayTile,
    ) -> Result<(), TileError> {
        Ok(self.decode_tile_with_geometry(eye, index, tile)?)
    }

    fn has_geometry(&self) -> bool {
        Self::has_geometry(self)
    }

    fn hierarchy(&self) -> Result<Option<Hierarchy>, TileError> {
        let found = self.has_geometry().then(|| self.read_hierarchy());
        Ok(found.transpose()?.flatten().map(|(hierarchy, _)| hierarchy))
    }
}

/// Reasons why a frame cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// An unreadable tile.
    #[error("{eye} eye, tile {tile}: {source}")]
    Tile {
        /// The eye.
        eye: Eye,
        /// Tile number.
        tile: u32,
        /// The error.
        source: TileError,
    },
    /// Nodes and triangles occupy more lines than cache line numbers allow.
    #[error(
        "hierarchy: expected fewer than 2^32 - 1 cache lines of nodes and triangles, found {lines}"
    )]
    Lines {
        /// Lines of all nodes and triangles.
        lines: u64,
    },
    /// An option needs the addresses that rays visit.
    #[error(
        "{0}: expected a trace with the visits of its rays (tracegen rays --visits), found a trace without"
    )]
    NoVisits(&'static str),
    /// A key and its value need the geometry of rays.
    #[error(
        "{0} ({1}): expected a trace with its hierarchy and the geometry of its rays (tracegen rays --all-columns), found a trace without"
    )]
    NoColumns(&'static str, &'static str),
    /// A sort in which rays wait between their visits, in the cycle-level model.
    #[error(
        "tni.ray_sort: expected with --timing cycle a sort whose rays run to their end, found {0}"
    )]
    Interrupted(&'static str),
    /// An unreadable hierarchy.
    #[error("{0}")]
    Hierarchy(TileError),
    /// Frames of a sequence with different tiles.
    #[error("--between: expected frames of {}x{} tiles an eye as before, found {}x{}", expected[0], expected[1], found[0], found[1])]
    Grid {
        /// Tile columns and rows of the last frame.
        expected: [u32; 2],
        /// Those of this frame.
        found: [u32; 2],
    },
    /// A defect of the cycle-level model.
    #[error(transparent)]
    Unbalanced(#[from] Unbalanced),
    /// A tile with a wrong number of pixel records.
    #[error("{eye} eye, tile {tile}: expected {expected} pixel records, found {found}")]
    Pixels {
        /// The eye.
        eye: Eye,
        /// Tile number.
        tile: u32,
        /// Width times height times samples.
        expected: usize,
        /// Records in the tile.
        found: usize,
    },
    /// Several samples per pixel. Their number would determine how many left samples are available per
    /// right pixel, and thus dominate the reuse.
    #[error(
        "samples per pixel: expected 1, found {found}: the scheme keeps one hit per pixel in its \
         G-buffer"
    )]
    Samples {
        /// Samples of the trace.
        found: u32,
    },
    /// Image sizes that reprojection does not support.
    #[error("eyes: expected two images of one size above 0, found {}x{} and {}x{} px", left[0], left[1], right[0], right[1])]
    Size {
        /// Left image.
        left: [u32; 2],
        /// Right image.
        right: [u32; 2],
    },
}

/// The hit of a pixel's sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Hit position relative to the trace's origin; for the sky, the unit direction.
    pub position: [f32; 3],
    /// Primitive, or [`SKY`].
    pub primitive: u32,
    /// Object, or [`SKY`].
    pub object: u32,
    /// Material; 0 for the sky.
    pub material: u32,
    /// View-independent radiance, linear RGB.
    pub view_independent: [f32; 3],
    /// View-dependent radiance, linear RGB.
    pub view_dependent: [f32; 3],
}

impl Sample {
    /// True if nothing was hit.
    pub(super) fn is_sky(&self) -> bool {
        self.primitive == SKY
    }

    /// Traced colour, linear RGB.
    pub fn color(&self) -> [f32; 3] {
        add(self.view_independent, self.view_dependent)
    }
}

/// Sum of two colours.
pub fn add(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| a[c] + b[c])
}

/// One eye, with one entry per pixel, row by row.
#[derive(Clone, Debug, Default)]
pub struct EyeFrame {
    /// The hits.
    pub samples: Vec<Sample>,
    /// The tracing costs.
    pub work: Vec<PixelWork>,
}

/// Both eyes, completely traced.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The trace's tables.
    pub tables: RaytraceTables,
    /// Left and right eye.
    pub eyes: [Arc<EyeFrame>; 2],
    /// Width and height of one eye's image in pixels.
    pub size_px: [u32; 2],
}

impl Frame {
    /// Decodes all tiles of both eyes.
    ///
    /// # Errors
    /// [`FrameError`] for eyes or sample counts that reprojection does not support, or for the first unreadable tile.
    pub fn load(source: &dyn RaySource) -> Result<Self, FrameError> {
        let tables = source.tables().clone();
        let [left, right] = [Eye::Left, Eye::Right].map(|e| tables.camera(e).size_px);
        if left != right || left.contains(&0) {
            return Err(FrameError::Size { left, right });
        }
        let found = tables.meta.samples_per_px;
        if found > 1 {
            return Err(FrameError::Samples { found });
        }
        let load = |eye| load_eye(source, eye, left).map(Arc::new);
        let eyes = [load(Eye::Left)?, load(Eye::Right)?];
        Ok(Self {
            tables,
            eyes,
            size_px: left,
        })
    }

    /// The left eye.
    pub fn left(&self) -> &EyeFrame {
        &self.eyes[0]
    }

    /// The right eye.
    pub fn right(&self) -> &EyeFrame {
        &self.eyes[1]
    }

    /// Samples per eye, one per pixel.
    pub(super) fn sample_count(&self) -> usize {
        self.size_px[0] as usize * self.size_px[1] as usize
    }

    /// Sample indices of a tile's pixels, row by row.
    pub(super) fn tile_samples(&self, tile: u32) -> impl Iterator<Item = usize> + use<> {
        let ([x, y], [w, h]) = self.tables.tile_rect(tile);
        let width = self.size_px[0] as usize;
        (y..y + h).flat_map(move |row| {
            let first = row as usize * width + x as usize;
            first..first + w as usize
        })
    }

    /// Image position of a sample of either eye, in pixels from the top left.
    pub(super) fn position_px(&self, sample: usize) -> [f32; 2] {
        let (x, y) = (
            sample as u32 % self.size_px[0],
            sample as u32 / self.size_px[0],
        );
        sample_position_px(x, y, 0, 1)
    }
}

fn load_eye(
    source: &dyn RaySource,
    eye: Eye,
    [width, height]: [u32; 2],
) -> Result<EyeFrame, FrameError> {
    let tables = source.tables();
    let camera = tables.camera(eye);
    let columns = width.div_ceil(TILE_SIZE_PX);
    let count = width as usize * height as usize;
    let empty = Sample {
        position: [0.0; 3],
        primitive: SKY,
        object: SKY,
        material: 0,
        view_independent: [0.0; 3],
        view_dependent: [0.0; 3],
    };
    let mut samples = vec![empty; count];
    let mut work = vec![PixelWork::default(); count];
    let band = width as usize * TILE_SIZE_PX as usize;
    samples
        .par_chunks_mut(band)
        .zip(work.par_chunks_mut(band))
        .enumerate()
        .try_for_each(|(tile_row, (samples, work))| {
            let mut tile = RayTile::default();
            for column in 0..columns {
                let index = tile_row as u32 * columns + column;
                source
                    .tile(eye, index, &mut tile)
                    .map_err(|source| FrameError::Tile {
                        eye,
                        tile: index,
                        source,
                    })?;
                let ([left, top], [w, h]) = tables.tile_rect(index);
                let expected = w as usize * h as usize;
                if tile.pixels.len() != expected {
                    return Err(FrameError::Pixels {
                        eye,
                        tile: index,
                        expected,
                        found: tile.pixels.len(),
                    });
                }
                for (i, pixel) in tile.pixels.iter().enumerate() {
                    let (row, column) = (i / w as usize, i % w as usize);
                    let at = row * width as usize + left as usize + column;
                    let seen = &mut samples[at];
                    *seen = match &pixel.hit {
                        Some(hit) => Sample {
                            position: hit.position,
                            primitive: hit.primitive,
                            object: hit.object,
                            material: hit.material,
                            ..empty
                        },
                        None => {
                            let (x, y) = (left + column as u32, top + row as u32);
                            let at = sample_position_px(x, y, 0, 1);
                            Sample {
                                position: camera.direction(at),
                                ..empty
                            }
                        }
                    };
                    seen.view_independent = pixel.view_independent;
                    seen.view_dependent = pixel.view_dependent;
                    work[at] = PixelWork::of(tile.rays_of(pixel));
                }
            }
            Ok(())
        })?;
    Ok(EyeFrame { samples, work })
}
