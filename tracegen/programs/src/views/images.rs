//! Which images a frame's draws and copies read and write.
//!
//! A draw of a shadow map, of a mirror or of a browser differs from others only in the draws that read its
//! images, so these are identified by images and not by the time of a draw.

use super::{Drawn, Found};
use std::collections::HashSet;

/// The images that a draw, or a copy between images, reads and writes.
struct Step {
    reads: Vec<u32>,
    writes: Vec<u32>,
}

/// Reads and writes of a frame and, if it is captured, of the next one.
pub(super) struct Images {
    steps: Vec<Step>,
}

/// Images of a page: its canvases, and what is read for them.
pub(super) struct PageImages {
    images: HashSet<u32>,
    canvases: HashSet<u32>,
}

impl Drawn<'_> {
    /// Images that its shader may read.
    pub(super) fn reads(&self) -> impl Iterator<Item = u32> {
        let textures = self.info.textures.iter();
        textures.filter_map(|texture| Some(texture.view?.image))
    }

    /// Images whose colours or depths it writes.
    pub(super) fn writes(&self) -> impl Iterator<Item = u32> {
        self.colors()
            .chain(self.written_depth())
            .map(|view| view.image)
    }
}

impl Images {
    pub(super) fn new<'a>(
        draws: impl Iterator<Item = &'a Drawn<'a>>,
        copies: Vec<[u32; 2]>,
    ) -> Self {
        let draw = |draw: &Drawn<'_>| Step {
            reads: draw.reads().collect(),
            writes: draw.writes().collect(),
        };
        let copies = copies.into_iter().map(|[from, to]| Step {
            reads: vec![from],
            writes: vec![to],
        });
        Self {
            steps: draws.map(draw).chain(copies).collect(),
        }
    }

    /// The images, and all images from which they are made.
    pub(super) fn sources(&self, images: impl IntoIterator<Item = u32>) -> HashSet<u32> {
        closure(images, &self.steps, |step| (&step.writes, &step.reads))
    }

    /// The images, and all images that are made from them.
    pub(super) fn results(&self, images: impl IntoIterator<Item = u32>) -> HashSet<u32> {
        closure(images, &self.steps, |step| (&step.reads, &step.writes))
    }

    /// Fragments of the draws that do not process the found pictures: of the eyes, and of draws beside them.
    pub(super) fn beside(&self, draws: &[Drawn<'_>], found: &Found) -> u64 {
        let places: HashSet<usize> = found.roles.iter().map(|(place, _)| *place).collect();
        let is_eye = |draw: &&Drawn<'_>| places.contains(&draw.place);
        let eyes = draws.iter().filter(is_eye).flat_map(|draw| draw.colors());
        let results = self.results(eyes.map(|view| view.image));
        let beside = draws.iter().filter(|draw| draw.target().is_some());
        let beside = beside
            .filter(|draw| is_eye(draw) || !draw.reads().any(|image| results.contains(&image)));
        beside.map(|draw| draw.weight).sum()
    }

    /// The images of a page with these canvases; `None` if no canvas is known.
    pub(super) fn of_page(&self, canvases: &[u32]) -> Option<PageImages> {
        let canvases: HashSet<u32> = canvases.iter().copied().collect();
        (!canvases.is_empty()).then(|| PageImages {
            images: self.sources(canvases.iter().copied()),
            canvases,
        })
    }
}

impl PageImages {
    /// Whether a draw is the page's: it draws into an image of the page, or reads one that is not a canvas.
    /// The browser reads only canvases.
    pub(super) fn has(&self, draw: &Drawn<'_>) -> bool {
        let pass = draw.pass.into_iter();
        let mut targets = pass.flat_map(|pass| pass.colors.iter().chain(&pass.depth));
        let inner = |image: u32| self.images.contains(&image) && !self.canvases.contains(&image);
        targets.any(|view| self.images.contains(&view.image)) || draw.reads().any(inner)
    }
}

/// Adds the other side of each step that has one of the images on the first side.
fn closure(
    images: impl IntoIterator<Item = u32>,
    steps: &[Step],
    sides: impl Fn(&Step) -> (&Vec<u32>, &Vec<u32>),
) -> HashSet<u32> {
    let mut found: HashSet<u32> = images.into_iter().collect();
    let mut open: Vec<&Step> = steps.iter().collect();
    loop {
        let before = open.len();
        open.retain(|step| {
            let (known, new) = sides(step);
            let reached = known.iter().any(|image| found.contains(image));
            if reached {
                found.extend(new);
            }
            !reached
        });
        if open.len() == before {
            return found;
        }
    }
}
