//! Captures by this program, run as a user runs it, and comparisons of them.

use super::Error;
use super::lanes::{FragmentKey, Lane, lanes};
use crate::verify::alpha::SampledAlpha;
use crate::verify::geometry::Geometry;
use crate::verify::piece::center;
use crate::verify::reference::render_tile;
use crate::verify::sampler::SoftwareSampler;
use anyhow::{Context, anyhow};
use formats::footprint::LodFormula;
use formats::textrace::{Textrace, Tile};
use formats::view::Eye;
use glam::DVec2;
use raster::backend::Fragments;
use raster::draws::{DrawList, DrawMode};
use scene::{LoadOptions, load_file};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use textures::TextureSet;

/// Fragments of a trace, left and right.
pub(super) type Views = [BTreeMap<FragmentKey, Lane>; 2];

/// A scene and how it is captured.
#[derive(Clone, Debug)]
pub(super) struct Capture {
    /// The scene's file.
    pub scene: PathBuf,
    /// Flags after `tracegen raster SCENE`.
    pub flags: Vec<String>,
}

impl Capture {
    /// Flags are separated by spaces.
    pub fn new(scene: PathBuf, flags: &str) -> Self {
        Self {
            scene,
            flags: flags.split_whitespace().map(str::to_owned).collect(),
        }
    }
}

/// Result of a run of the program.
pub(super) struct Ran {
    /// `None` after a signal.
    pub exit_code: Option<i32>,
    /// Its warnings and errors, one per line.
    pub said: Vec<String>,
}

impl Ran {
    /// The first line that contains this part.
    pub fn said(&self, part: &str) -> Option<&str> {
        self.said
            .iter()
            .map(String::as_str)
            .find(|line| line.contains(part))
    }
}

/// Runs captures in a folder.
pub(super) struct Probe<'a> {
    folder: &'a Path,
    program: PathBuf,
}

impl<'a> Probe<'a> {
    pub fn new(folder: &'a Path) -> anyhow::Result<Self> {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make {}", folder.display()))?;
        Ok(Self {
            folder,
            program: std::env::current_exe()?,
        })
    }

    /// Writes a file into the folder.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> anyhow::Result<PathBuf> {
        let path = self.folder.join(name);
        std::fs::write(&path, content)
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    fn trace(&self) -> PathBuf {
        self.folder.join("stress.textrace")
    }

    /// Captures, replacing the trace of the last capture.
    pub fn capture(&self, capture: &Capture) -> anyhow::Result<Ran> {
        let _ = std::fs::remove_file(self.trace());
        let output = Command::new(&self.program)
            .arg("raster")
            .arg(&capture.scene)
            .args(&capture.flags)
            .args(["--no-plain", "--quiet", "-o"])
            .arg(self.trace())
            .output()?;
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let folder = format!("{}/", self.folder.display());
        let said = (text.lines())
            .filter(|line| ["warning:", "error:"].iter().any(|w| line.contains(w)))
            .map(|line| line.replace(&folder, ""));
        let said = said.collect();
        let panicked = text.contains("panicked");
        Ok(Ran {
            exit_code: output.status.code().filter(|_| !panicked),
            said,
        })
    }

    /// The fragments of the last capture.
    pub fn views(&self) -> anyhow::Result<Views> {
        let trace = Textrace::open(&self.trace())?;
        let tables = trace.tables();
        let mut views = Views::default();
        for (pass, of) in tables.passes.iter().enumerate() {
            let tiles = (0..of.tile_count())
                .map(|index| {
                    let mut tile = Tile::default();
                    trace.decode_tile(pass, index as usize, &mut tile)?;
                    Ok(([index % of.tiles[0], index / of.tiles[0]], tile))
                })
                .collect::<formats::Result<Vec<_>>>()?;
            let tiles = tiles.iter().map(|(at, tile)| (*at, tile));
            let eye = usize::from(of.eye == Some(Eye::Right));
            views[eye] = lanes(&tables.draws, tiles).map_err(|e| anyhow!(e))?;
        }
        Ok(views)
    }

    /// Compares the last capture with the brute-force rasteriser.
    pub fn against_reference(&self, capture: &Capture) -> anyhow::Result<Error> {
        let scene = load_file(&capture.scene, &LoadOptions::ALL)?.scene;
        let draws = DrawList::new(&scene, 0)?;
        // Only the alpha test needs texels, so they are prepared only for masked scenes.
        let masked = draws.calls.iter().any(|call| call.mode == DrawMode::Masked);
        let textures = match masked {
            true => TextureSet::prepare(&scene, |_| Some(0), None)?,
            false => TextureSet::default(),
        };
        let sampler = SoftwareSampler::new(&textures);
        let alpha = SampledAlpha {
            sampler: &sampler,
            formula: LodFormula::Llvmpipe,
        };
        let trace = Textrace::open(&self.trace())?;
        let meta = &trace.tables().meta;
        let size_px = meta.hmd.eye_size_px;
        let views = self.views()?;
        let mut total = Totals::default();
        for (eye, found) in meta.frames[0].eyes.iter().zip(&views) {
            let geometry = Geometry::new(&scene, &draws, eye, size_px, |_| true);
            let mut expected = Vec::new();
            for tile in 0..(geometry.tiles[0] * geometry.tiles[1]) as usize {
                let rendered = render_tile(&geometry, tile, &alpha, Fragments::DepthTested);
                expected.extend(rendered.iter().map(|fragment| {
                    let piece = geometry.piece(fragment.piece);
                    let group = geometry.groups(piece).first();
                    let leader =
                        group.and_then(|slots| geometry.material(piece).textures[slots[0]]);
                    let uv = leader.map_or(DVec2::ZERO, |leader| {
                        geometry
                            .coordinates(piece, &leader)
                            .at(center(fragment.pixel))
                    });
                    ((fragment.pixel, geometry.primitive(piece)), uv)
                }));
            }
            total.add(expected.into_iter(), found);
        }
        Ok(total.error())
    }

    /// Compares the last capture with an earlier one of the same scene.
    pub fn against(&self, expected: &Views) -> anyhow::Result<Error> {
        let mut total = Totals::default();
        for (expected, found) in expected.iter().zip(&self.views()?) {
            total.add(expected.iter().map(|(key, lane)| (*key, lane.uv)), found);
        }
        Ok(total.error())
    }
}

/// Sums over views.
#[derive(Default)]
struct Totals {
    both: u64,
    one: u64,
    uv_texels: f64,
}

impl Totals {
    fn add(
        &mut self,
        expected: impl Iterator<Item = (FragmentKey, DVec2)>,
        found: &BTreeMap<FragmentKey, Lane>,
    ) {
        let mut both = 0;
        for (key, uv) in expected {
            let Some(lane) = found.get(&key) else {
                self.one += 1;
                continue;
            };
            both += 1;
            let off = uv - lane.uv;
            // A trace leaves out multiples of two repeats in large coordinates.
            let off = off - 2.0 * (off / 2.0).round();
            self.uv_texels = self.uv_texels.max((off * lane.extent).length());
        }
        self.one += found.len() as u64 - both;
        self.both += both;
    }

    fn error(&self) -> Error {
        let fragments = self.both + self.one;
        Error {
            fragments,
            fragments_pct: 100.0 * self.one as f64 / fragments.max(1) as f64,
            uv_texels: self.uv_texels,
        }
    }
}
