//! Verifies a captured frame: its passes, with all of their tiles or a sample of them.

use super::agreement::Agreement;
use super::alpha::SampledAlpha;
use super::colour::{ColourCheck, ColourErrors};
use super::compare::Comparison;
use super::geometry::Geometry;
use super::sampler::SoftwareSampler;
use super::shadows::Shadows;
use super::write::reference_tile;
use anyhow::ensure;
use formats::footprint::LodFormula;
use formats::random::Random;
use formats::textrace::{Draw, EncodedTile, Pass, PassKind, Surfaces, Textrace, Tile, encode_tile};
use formats::view::{Eye, FrameViews};
use raster::backend::{Fragments, Texels};
use raster::cascades::Cascade;
use raster::draws::DrawList;
use rayon::prelude::*;
use scene::{Scene, TextureSlot};
use textures::TextureSet;

/// The capture and its inputs.
pub struct CaptureUnderTest<'a> {
    /// The capture.
    pub trace: &'a Textrace,
    /// Its scene, in the pose of the capture.
    pub scene: &'a Scene,
    /// The scene's draws.
    pub draws: &'a DrawList,
    /// The textures that were sampled.
    pub textures: &'a TextureSet,
    /// The frames to verify, in the trace's order.
    pub frames: &'a [FrameUnderTest],
}

/// A frame to verify.
#[derive(Clone, Debug)]
pub struct FrameUnderTest {
    /// Its eyes.
    pub views: FrameViews,
    /// Its shadow cascades; `None` if they are not known.
    pub cascades: Option<Vec<Cascade>>,
}

/// Which tiles are verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileChoice {
    /// Every tile of every pass.
    All,
    /// A sample of the tiles of all passes.
    Some {
        /// Number of tiles.
        count: usize,
        /// Seed of the sample.
        seed: u64,
    },
}

/// Results.
#[derive(Clone, Debug, Default)]
pub struct Verified {
    /// Views verified.
    pub passes: usize,
    /// Tiles verified.
    pub tiles: usize,
    /// Tiles of all passes.
    pub all_tiles: usize,
    /// Contradictions between the trace's tables and the scene.
    pub faults: Vec<String>,
    /// Comparison of the records with the reference.
    pub agreement: Agreement,
    /// Comparison of colours by slot of the materials' textures, if texels are given.
    pub colours: Vec<(TextureSlot, ColourErrors)>,
    /// The reference encoded as the trace's tiles, by pass and tile, if requested.
    pub reference: Vec<Vec<EncodedTile>>,
}

impl<'a> CaptureUnderTest<'a> {
    /// Checks that the passes of the trace are pictures of eyes with the scene's draws.
    ///
    /// # Errors
    /// The first contradiction.
    pub fn check(&self) -> anyhow::Result<()> {
        let tables = self.trace.tables();
        let calls = &self.draws.calls;
        ensure!(
            tables.draws.len() == calls.len(),
            "the trace is of another scene: expected {} draws, found {}",
            calls.len(),
            tables.draws.len()
        );
        for (number, (draw, call)) in tables.draws.iter().zip(calls).enumerate() {
            let expected = (
                call.first_primitive,
                self.scene.meshes[call.mesh].triangles() as u32,
            );
            let found = (draw.first_primitive, draw.primitives);
            ensure!(
                expected == found,
                "the trace is of another scene: draw {number}: expected {} primitives from {}, found {} from {}",
                expected.1,
                expected.0,
                found.1,
                found.0
            );
            self.check_groups(number, draw, call.material)?;
        }
        for (number, pass) in tables.passes.iter().enumerate() {
            ensure!(
                pass.kind == PassKind::Main && pass.eye.is_some(),
                "pass {number}: expected the whole picture of an eye, found a layer of a technique: verify captures the baseline"
            );
        }
        Ok(())
    }

    fn check_groups(&self, number: usize, draw: &Draw, material: usize) -> anyhow::Result<()> {
        let groups = &self.draws.groups[material].groups;
        let expected: Vec<usize> = groups.iter().map(Vec::len).collect();
        let found: Vec<usize> = (draw.groups.iter().take(expected.len()))
            .map(|g| g.samples.len())
            .collect();
        ensure!(
            expected == found,
            "the trace is of another scene: draw {number}: expected groups of {expected:?} textures, found {found:?}"
        );
        Ok(())
    }

    /// Passes of the frames, each with the position of its frame.
    pub fn passes(&self) -> Vec<(usize, &'a Pass, Eye, usize)> {
        let passes = self.trace.tables().passes.iter().enumerate();
        passes
            .filter_map(|(number, pass)| {
                let is_of = |frame: &FrameUnderTest| frame.views.frame == pass.frame;
                let frame = self.frames.iter().position(is_of)?;
                Some((number, pass, pass.eye?, frame))
            })
            .collect()
    }

    /// Compares the chosen tiles; `texels` are the driver's of the first passes, by pass and slot.
    /// `keep` requests the reference's encoded tiles.
    ///
    /// # Errors
    /// A damaged tile.
    pub fn verify(
        &self,
        choice: TileChoice,
        formula: LodFormula,
        texels: &[Vec<(TextureSlot, Texels)>],
        keep: bool,
    ) -> anyhow::Result<Verified> {
        let tables = self.trace.tables();
        let sampler = SoftwareSampler::new(self.textures);
        let alpha = SampledAlpha {
            sampler: &sampler,
            formula,
        };
        let colour = ColourCheck {
            scene: self.scene,
            draws: self.draws,
            tables,
            sampler: &sampler,
            formula,
        };
        let passes = self.passes();
        let counts: Vec<usize> = passes
            .iter()
            .map(|(_, pass, ..)| pass.tile_count() as usize)
            .collect();
        let wanted = choose(choice, &counts);
        let mut result = Verified {
            passes: passes.len(),
            all_tiles: counts.iter().sum(),
            faults: super::tables::faults(self.scene, tables)?,
            ..Verified::default()
        };
        for (position, (number, pass, eye, frame)) in passes.into_iter().enumerate() {
            let wanted = &wanted[position];
            let frame = &self.frames[frame];
            let shadows = frame.cascades.as_deref().map(Shadows::new);
            let comparison = Comparison {
                tables,
                alpha: &alpha,
                recorded: recorded(tables.meta.surfaces.as_ref()),
                formula,
                shadows: shadows.as_ref(),
            };
            let geometry = Geometry::new(
                self.scene,
                self.draws,
                &frame.views.eyes[eye as usize],
                pass.size_px,
                |tile| wanted[tile],
            );
            let texels = texels.get(position).map_or(&[][..], Vec::as_slice);
            let tiles: Vec<usize> = (0..wanted.len()).filter(|&tile| wanted[tile]).collect();
            let found = (tiles.into_par_iter())
                .map(|tile| {
                    let mut captured = Tile::default();
                    self.trace.decode_tile(number, tile, &mut captured)?;
                    let (agreement, fragments) = comparison.tile(&geometry, tile, &captured);
                    let colours: Vec<ColourErrors> = (texels.iter())
                        .map(|(slot, texels)| {
                            colour.tile(&geometry, tile, &captured, texels, *slot)
                        })
                        .collect();
                    let reference = if keep {
                        let tile = reference_tile(&geometry, tables, &fragments, &captured);
                        Some(encode_tile(tables, &tile)?)
                    } else {
                        None
                    };
                    Ok((agreement, colours, reference))
                })
                .collect::<anyhow::Result<Vec<_>>>()?;
            result.tiles += found.len();
            let mut reference = Vec::new();
            // Summed in the order of the tiles, so that sums do not depend on the number of threads.
            for (agreement, colours, tile) in found {
                result.agreement.merge(&agreement);
                if result.colours.is_empty() {
                    let slots = texels.iter().map(|(slot, _)| *slot);
                    result.colours = slots.map(|slot| (slot, ColourErrors::default())).collect();
                }
                for ((_, sum), errors) in result.colours.iter_mut().zip(&colours) {
                    sum.merge(errors);
                }
                reference.extend(tile);
            }
            result.reference.push(reference);
        }
        let lookups = (choice == TileChoice::All).then_some(result.agreement.lookups.by_cascade);
        let geometry = self.geometry_faults(lookups)?;
        result.faults.extend(geometry);
        Ok(result)
    }
}

/// The fragments that a trace holds.
fn recorded(surfaces: Option<&Surfaces>) -> Fragments {
    match surfaces {
        Some(surfaces) if !surfaces.depth_tested => Fragments::All,
        _ => Fragments::DepthTested,
    }
}

/// Chooses the tiles to verify; `counts` are the numbers of tiles per pass.
fn choose(choice: TileChoice, counts: &[usize]) -> Vec<Vec<bool>> {
    let all: usize = counts.iter().sum();
    let mut chosen = match choice {
        TileChoice::All => vec![true; all],
        TileChoice::Some { count, seed } => {
            // Selection sampling (Knuth, algorithm S).
            let mut random = Random(seed);
            let mut needed = count.min(all);
            (0..all)
                .map(|tile| {
                    let take = random.below(all - tile) < needed;
                    needed -= usize::from(take);
                    take
                })
                .collect()
        }
    };
    let mut chosen = chosen.drain(..);
    counts
        .iter()
        .map(|&count| chosen.by_ref().take(count).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_has_the_size_that_is_asked_for_and_follows_from_its_seed() {
        let counts = [300, 200];
        let of = |seed| choose(TileChoice::Some { count: 40, seed }, &counts);
        let chosen = of(7);
        assert_eq!(chosen.iter().map(Vec::len).collect::<Vec<_>>(), counts);
        let total = |chosen: &[Vec<bool>]| chosen.iter().flatten().filter(|c| **c).count();
        assert_eq!(total(&chosen), 40);
        assert_eq!(chosen, of(7));
        assert_ne!(chosen, of(8));
        // Both passes have chosen tiles.
        assert!(chosen.iter().all(|pass| pass.iter().any(|c| *c)));
        assert_eq!(total(&choose(TileChoice::All, &counts)), 500);
        assert_eq!(
            total(&choose(
                TileChoice::Some {
                    count: 900,
                    seed: 1
                },
                &counts
            )),
            500
        );
    }
}
