//! `tracegen shadows`.

use super::cache_args::CacheArgs;
use super::capture_steps::{
    SHADOW_FORMATS, cascades, no_maps, prepare_environment, prepare_textures,
};
use super::lens_args::LensArgs;
use super::path_args::PathArgs;
use super::prepared::world;
use super::scene_args::SceneArgs;
use crate::study::world::World;
use anyhow::{Context, ensure};
use clap::Args;
use formats::texture::TexelFormat;
use image_error::{Mask, Picture, Reference, mean, quantile};
use raster::draws::SHADOW_SIZE;
use raster::lavapipe::{Lavapipe, device};
use scene::LoadOptions;
use shell::{Progress, Threads};
use techniques::Settings;
use textures::TextureSet;

/// Arguments of `tracegen shadows`.
#[derive(Args, Debug)]
#[command(
    after_help = "Prints CSV: size of the maps, mean FLIP inside the lenses against R32F, pixels that differ and pixels in shadow in percent of those inside the lenses, and mean, 99th percentile and maximum of the distances from the pixels that differ to the nearest pixel at an edge of the area that the R32F shadows darken."
)]
pub struct ShadowsArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Light the scene through 4 shadow cascades of 2048x2048.
    #[arg(long)]
    shadows: bool,
    #[command(flatten)]
    lens: LensArgs,
    #[command(flatten)]
    cache: CacheArgs,
    #[command(flatten)]
    threads: Threads,
}

const HEADING: &str =
    "format,map_mb,flip_mean,changed_pct,shadow_pct,edge_mean_px,edge_p99_px,edge_worst_px";

/// Memory for records; pictures make none.
const RECORD_BUDGET_BYTES: u64 = 16 << 20;

/// Runs `tracegen shadows`.
///
/// # Errors
/// Unreadable input, a scene without shadow maps, or no driver.
pub fn run(args: &ShadowsArgs) -> anyhow::Result<()> {
    prepare_environment(args.threads.count);
    args.threads.start()?;
    let cache = args.cache.open()?;
    let progress = Progress::new("loading the scene", 0, "");
    let setup = (args.scene).setup(None, &PathArgs::still(), 0..1, &LoadOptions::ALL)?;
    let cascades = cascades(&setup.scene, args.shadows);
    ensure!(cascades > 0, no_maps(&args.scene.scene));
    let lens = args.lens.lenses(&setup.hmd)?;
    let mut world = world(setup, cascades, lens)?;
    world.pose(0)?;
    let textures = prepare_textures(&world.scene, |_| Some(0), cache.as_ref())?;
    progress.stage("drawing", 1 + SHADOW_FORMATS.len() as u64, "pictures");
    let mut draw = |format, casts| {
        let pictures = pictures(&mut world, &textures, format, casts);
        progress.advance(1);
        pictures
    };
    let lit = draw(TexelFormat::R32f, false)?;
    let drawn = (SHADOW_FORMATS.iter())
        .map(|(name, format, _)| Ok((*name, *format, draw(*format, true)?)))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let mut eyes = Vec::new();
    for (eye, lit) in lit.iter().enumerate() {
        let (size_px, fov) = (world.hmd.eye_size_px, &world.hmd.fov[eye]);
        let mask = Mask::of_lens(size_px, fov, &world.lens[eye]);
        let ppd = image_error::pixels_per_degree(size_px[0], fov);
        let exact = drawn[0].2[eye].clone();
        let shadow = differing(&exact, lit);
        eyes.push((
            Reference::new(exact, mask, ppd).context("comparing pictures")?,
            shadow,
        ));
    }
    let mut text = HEADING.to_owned();
    for (name, format, pictures) in &drawn {
        let (mut flip, mut far_px) = (0.0, Vec::new());
        let (mut pixels, mut shadowed) = (0, 0);
        for ((exact, shadow), picture) in eyes.iter().zip(pictures) {
            flip += exact.error(picture)?.flip_mean / eyes.len() as f64;
            let width = picture.width();
            let distances = distances(&edges(shadow, width), width);
            let changed = differing(exact.picture(), picture);
            let inside = exact.mask();
            shadowed += inside.select(shadow).filter(|shadowed| *shadowed).count();
            pixels += inside.inside.iter().filter(|inside| **inside).count();
            let changed = inside.select(&changed).zip(inside.select(&distances));
            far_px.extend(changed.filter(|(changed, _)| *changed).map(|(_, px)| px));
        }
        let block = format.block();
        let blocks = u64::from(SHADOW_SIZE / block.texels[0]).pow(2) * u64::from(cascades);
        let percent = |count: usize| 100.0 * count as f64 / pixels.max(1) as f64;
        text += &format!(
            "\n{name},{:.1},{flip:.5},{:.3},{:.1},{:.2},{:.1},{:.1}",
            (blocks * u64::from(block.bytes)) as f64 / 1e6,
            percent(far_px.len()),
            percent(shadowed),
            mean(&far_px),
            quantile(&far_px, 0.99),
            quantile(&far_px, 1.0),
        );
    }
    drop(progress);
    shell::print(&text)
}

/// Both eyes' pictures with maps of a format, or with maps into which nothing was drawn.
fn pictures(
    world: &mut World,
    textures: &TextureSet,
    format: TexelFormat,
    casts: bool,
) -> anyhow::Result<Vec<Picture>> {
    world.draws.shadow_format = format;
    let planner = world.planner(&Settings::default())?;
    let job = world.job(&planner);
    let mut frame = job.frame(&world.views[0])?;
    if !casts {
        frame.casters.iter_mut().for_each(Vec::clear);
    }
    let (gpu, size_px) = (device::open(None)?, world.hmd.eye_size_px);
    let (scene, draws) = (&world.scene, &world.draws);
    let mut backend = Lavapipe::new(gpu, scene, draws, textures, size_px, RECORD_BUDGET_BYTES)?;
    job.light(&mut backend, &frame)?;
    let (pictures, _) = job.plain_frame(&mut backend, &frame)?;
    let rgb = |rgba: &Vec<u8>| rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
    let picture = |rgba| Picture {
        size_px,
        pixels: rgb(rgba),
    };
    Ok(pictures.iter().map(picture).collect())
}

/// Whether each pixel differs.
fn differing(a: &Picture, b: &Picture) -> Vec<bool> {
    a.pixels
        .iter()
        .zip(&b.pixels)
        .map(|(a, b)| a != b)
        .collect()
}

/// Whether each pixel has a neighbour on the other side of the area's edge.
fn edges(area: &[bool], width: usize) -> Vec<bool> {
    let differs = |at: usize, other: Option<usize>| {
        other
            .and_then(|other| area.get(other))
            .is_some_and(|other| *other != area[at])
    };
    (0..area.len())
        .map(|at| {
            let left = (at % width > 0).then(|| at - 1);
            let right = ((at + 1) % width > 0).then_some(at + 1);
            let beside = [left, right, at.checked_sub(width), Some(at + width)];
            beside.into_iter().any(|other| differs(at, other))
        })
        .collect()
}

/// Distance of each pixel from the nearest marked one, in pixels; infinite without any.
fn distances(marked: &[bool], width: usize) -> Vec<f32> {
    // Squares of the distances within the column, then the least over the columns of a row.
    let mut within: Vec<f32> = marked
        .iter()
        .map(|m| if *m { 0.0 } else { f32::INFINITY })
        .collect();
    for at in width..within.len() {
        within[at] = within[at].min(within[at - width] + 1.0);
    }
    for at in (width..within.len()).rev() {
        within[at - width] = within[at - width].min(within[at] + 1.0);
    }
    (0..within.len())
        .map(|at| {
            let row = &within[at / width * width..][..width];
            let square = |(x, d): (usize, &f32)| (x.abs_diff(at % width) as f32).powi(2) + d * d;
            row.iter()
                .enumerate()
                .map(square)
                .fold(f32::INFINITY, f32::min)
                .sqrt()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_nearest_marked_pixel() {
        let width = 13;
        let marked: Vec<bool> = (0..width * 9).map(|at| at * at % 29 == 5).collect();
        let place = |at: usize| [at % width, at / width].map(|at| at as f32);
        for (at, found) in distances(&marked, width).into_iter().enumerate() {
            let to = |other: usize| {
                let ([a, b], [x, y]) = (place(at), place(other));
                (a - x).hypot(b - y)
            };
            let all = (0..marked.len()).filter(|&other| marked[other]).map(to);
            let least = all.fold(f32::INFINITY, f32::min);
            assert!(
                (found - least).abs() < 1e-4,
                "{at}: {found}, expected {least}"
            );
        }
        assert_eq!(distances(&[false; 4], 2), [f32::INFINITY; 4]);
    }

    #[test]
    fn the_edge_of_half_a_picture_has_two_columns() {
        let (width, height) = (8, 5);
        let half: Vec<bool> = (0..width * height).map(|at| at % width < 3).collect();
        for (at, edge) in edges(&half, width).into_iter().enumerate() {
            assert_eq!(edge, [2, 3].contains(&(at % width)), "{at}");
        }
    }
}
