//! Image errors of every technique against the baseline's pictures, inside the visible area.

use super::{Folder, FolderError};
use formats::view::Eye;
use image_error::flicker::flicker;
use image_error::motion::Motion;
use image_error::psnr::pooled_db;
use image_error::{Picture, PictureError, Reference};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Image errors of a technique over all its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureFigures {
    /// Mean FLIP.
    pub flip_mean: f64,
    /// Mean of the pictures' 99th percentiles of FLIP.
    pub flip_p99: f64,
    /// Mean FLIP of the worst picture.
    pub flip_worst: f64,
    /// Index of its frame.
    pub worst_frame: usize,
    /// Its eye.
    pub worst_eye: Eye,
    /// Peak signal-to-noise ratio over all pictures.
    pub psnr_db: f64,
    /// The lowest of any picture.
    pub psnr_worst_db: f64,
    /// Mean structural similarity.
    pub ssim: f64,
    /// The lowest of any picture.
    pub ssim_worst: f64,
    /// Mean flicker along the baseline's motion, over pairs of consecutive frames; `None` without such a
    /// pair.
    pub flicker: Option<f64>,
    /// Pictures whose visible pixels equal the baseline's, percent.
    pub identical_pct: f64,
    /// Mean FLIP of both eyes by frame.
    pub by_frame: Vec<f64>,
}

/// One picture of one technique.
#[derive(Clone, Copy)]
struct Compared {
    error: PictureError,
    flicker: Option<f64>,
}

const EYES: [Eye; 2] = [Eye::Left, Eye::Right];

/// Compares every picture of every row with the baseline's. Calls `done` with the number of finished
/// pictures. Returns one entry per row, in the manifest's order.
///
/// # Errors
/// A picture that cannot be read, or whose size differs from the manifest's.
pub fn picture_figures(
    folder: &Folder,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Vec<PictureFigures>, FolderError> {
    let manifest = &folder.manifest;
    let views: Vec<(usize, Eye)> = (0..manifest.frames.len())
        .flat_map(|frame| EYES.map(|eye| (frame, eye)))
        .collect();
    let by_view = views
        .par_iter()
        .map(|&(frame, eye)| {
            let compared = compare(folder, frame, eye);
            done(manifest.rows.len() as u64);
            compared
        })
        .collect::<Result<Vec<_>, _>>()?;
    let of_row = |row: usize| {
        let of_view: Vec<Compared> = by_view.iter().map(|rows| rows[row]).collect();
        figures(&views, &of_view)
    };
    Ok((0..manifest.rows.len()).map(of_row).collect())
}

/// Compares every row's picture of one eye in one frame.
fn compare(folder: &Folder, frame: usize, eye: Eye) -> Result<Vec<Compared>, FolderError> {
    let manifest = &folder.manifest;
    let rows = &manifest.rows;
    let baseline = rows.iter().position(|r| r.technique == manifest.baseline);
    let baseline = baseline.unwrap_or(0);
    let numbers = &manifest.frames;
    let before = frame
        .checked_sub(1)
        .filter(|before| numbers[*before] + 1 == numbers[frame]);
    let expected = folder.picture_file(baseline, frame, eye)?;
    let reference = reference(folder, expected.decode()?, eye);
    let expected_before = before
        .map(|before| folder.picture_file(baseline, before, eye))
        .transpose()?;
    let picture_before = expected_before.as_ref().map(|f| f.decode()).transpose()?;
    // Computed once for all techniques, and only if one differs from the baseline.
    let motion = OnceLock::new();
    let one = |row: usize| {
        let file = folder.picture_file(row, frame, eye)?;
        let same = file.bytes == expected.bytes;
        let decoded = (!same).then(|| file.decode()).transpose()?;
        let picture = decoded.as_ref().unwrap_or_else(|| reference.picture());
        let error = match &decoded {
            // Every picture has the manifest's size, so it matches the reference.
            Some(picture) => reference.error(picture).unwrap_or(PictureError::NONE),
            None => PictureError::NONE,
        };
        let mut flickers = None;
        if let (Some(before), Some(expected), Some(was)) =
            (before, &expected_before, &picture_before)
        {
            let file = folder.picture_file(row, before, eye)?;
            flickers = Some(if same && file.bytes == expected.bytes {
                0.0
            } else {
                let now = [reference.picture(), picture];
                let motion = motion.get_or_init(|| Motion::between(was, now[0]));
                flicker([[was, &file.decode()?], now], motion, reference.mask())
            });
        }
        Ok(Compared {
            error,
            flicker: flickers,
        })
    };
    (0..rows.len()).map(one).collect()
}

/// The baseline's picture as reference, limited to the visible pixels.
pub(super) fn reference(folder: &Folder, picture: Picture, eye: Eye) -> Reference {
    let mask = folder.masks[eye as usize].clone();
    let ppd = folder.manifest.pixels_per_degree;
    Reference::new(picture, mask, ppd).expect("a picture of the size that the mask has")
}

fn figures(views: &[(usize, Eye)], compared: &[Compared]) -> PictureFigures {
    let count = compared.len().max(1) as f64;
    let mean =
        |of: fn(&PictureError) -> f64| compared.iter().map(|c| of(&c.error)).sum::<f64>() / count;
    let lowest = |of: fn(&PictureError) -> f64| {
        compared
            .iter()
            .map(|c| of(&c.error))
            .fold(f64::INFINITY, f64::min)
    };
    // The first of equal ones.
    let worst = views.iter().zip(compared).rev();
    let worst = worst.max_by(|a, b| a.1.error.flip_mean.total_cmp(&b.1.error.flip_mean));
    let (worst_frame, worst_eye, flip_worst) = worst.map_or((0, Eye::Left, 0.0), |(view, c)| {
        (view.0, view.1, c.error.flip_mean)
    });
    let flickers: Vec<f64> = compared.iter().filter_map(|c| c.flicker).collect();
    let same = compared.iter().filter(|c| c.error == PictureError::NONE);
    PictureFigures {
        flip_mean: mean(|e| e.flip_mean),
        flip_p99: mean(|e| e.flip_p99),
        flip_worst,
        worst_frame,
        worst_eye,
        psnr_db: pooled_db(compared.iter().map(|c| c.error.psnr_db)),
        psnr_worst_db: lowest(|e| e.psnr_db),
        ssim: mean(|e| e.ssim),
        ssim_worst: lowest(|e| e.ssim),
        flicker: (!flickers.is_empty())
            .then(|| flickers.iter().sum::<f64>() / flickers.len() as f64),
        identical_pct: 100.0 * same.count() as f64 / count,
        by_frame: compared
            .chunks(EYES.len())
            .map(|eyes| eyes.iter().map(|c| c.error.flip_mean).sum::<f64>() / eyes.len() as f64)
            .collect(),
    }
}
