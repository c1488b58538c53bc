//! The draws behind the images that an OpenXR program shows to the eyes.
//!
//! A program may draw an eye into the image that it shows, or into targets of its own, from which full-screen passes,
//! copies, blits and resolves make that image. The search goes back over these to the draws of the scene.

use super::{Drawn, Found, LEFT, RIGHT, Role, View, viewport};
use crate::session::Session;
use spool::openxr::ShownEye;
use std::collections::HashMap;

/// An array layer of an image.
type Layer = (u32, u32);

/// Most passes and copies from a target of the scene to the shown image.
const LONGEST_PATH: usize = 24;

/// Draws of an eye: indices into the list of draws, each with the number of its view in a multiview pass.
#[derive(Clone, Debug, Default)]
struct Picture {
    draws: Vec<(usize, Option<u32>)>,
    /// Number of fragments.
    weight: u64,
    /// Place of the picture, if it is only a part of the image.
    part: Option<View>,
    is_scene: bool,
}

/// A search for the draws of an eye.
struct Search<'a> {
    session: &'a Session,
    draws: &'a [Drawn<'a>],
    /// Copies between layers: image and layer of the source, image and layer of the destination.
    copies: &'a [[u32; 4]],
}

/// The number of the view by which a draw writes a layer; the inner value is `None` without multiview.
fn writes(draw: &Drawn<'_>, (image, layer): Layer) -> Option<Option<u32>> {
    let mask = draw.pass?.view_mask;
    let mut views = draw.colors().filter(|view| view.image == image);
    views.find_map(|view| {
        let within = layer.checked_sub(view.layers[0])?;
        match mask {
            0 => (within < view.layers[1]).then_some(None),
            _ => (within < u32::BITS && mask >> within & 1 == 1).then_some(Some(within)),
        }
    })
}

/// Whether the middle of a draw's viewport is in a rectangle.
fn is_in(draw: &Drawn<'_>, part: View) -> bool {
    let of = viewport(draw.info);
    (0..2).all(|axis| {
        let middle = i64::from(of.origin[axis]) + i64::from(of.size[axis]) / 2;
        let start = i64::from(part.origin[axis]);
        (start..start + i64::from(part.size[axis])).contains(&middle)
    })
}

impl Search<'_> {
    /// Width and height of an image, if it is described.
    fn size(&self, image: u32) -> Option<[u32; 2]> {
        let [width, height, _] = self.session.image(image)?.size;
        Some([width, height])
    }

    /// The same part of another image.
    fn scaled(&self, part: View, from: u32, to: u32) -> Option<View> {
        let (from, to) = (self.size(from)?, self.size(to)?);
        let scale = |at: i64, axis: usize| at * i64::from(to[axis]) / i64::from(from[axis].max(1));
        Some(View {
            origin: [0, 1].map(|axis| scale(part.origin[axis].into(), axis) as i32),
            size: [0, 1].map(|axis| scale(part.size[axis].into(), axis) as u32),
        })
    }

    /// The draws that make a layer of an image, or a part of it, before a place in the frame.
    fn picture(
        &self,
        layer: Layer,
        part: Option<View>,
        before: usize,
        path: &mut Vec<Layer>,
    ) -> Option<Picture> {
        if path.contains(&layer) || path.len() == LONGEST_PATH {
            return None;
        }
        let all = self.draws.iter().enumerate();
        let writers: Vec<(usize, &Drawn<'_>, Option<u32>)> = all
            .filter(|(_, draw)| draw.place < before && part.is_none_or(|part| is_in(draw, part)))
            .filter_map(|(at, draw)| Some((at, draw, writes(draw, layer)?)))
            .collect();
        // A target that both eyes share is read for the first one, then cleared and drawn for the second.
        let start = writers.first().map_or(0, |(_, draw, _)| draw.place);
        let is_new = |(_, draw, _): &&(usize, &Drawn<'_>, Option<u32>)| {
            let before = |other: &Drawn<'_>| (start..draw.place).contains(&other.place);
            let read = |other: &Drawn<'_>| other.reads().any(|image| image == layer.0);
            draw.pass.is_some_and(|pass| pass.clears)
                && (self.draws.iter()).any(|other| before(other) && read(other))
        };
        let first = writers.iter().rev().find(is_new);
        let first = first.map_or(0, |(_, draw, _)| draw.pass_number);
        let writers: Vec<_> = writers
            .into_iter()
            .filter(|(_, draw, _)| draw.pass_number >= first)
            .collect();
        let own = Picture {
            draws: writers.iter().map(|(at, _, view)| (*at, *view)).collect(),
            weight: writers.iter().map(|(_, draw, _)| draw.weight).sum(),
            part,
            is_scene: writers
                .iter()
                .any(|(_, draw, _)| draw.is_of_scene() && draw.weight > 0),
        };
        if own.is_scene {
            return Some(own);
        }
        path.push(layer);
        let mut best: Option<Picture> = None;
        let mut take = |found: &Picture| {
            let rank = |of: &Picture| (of.is_scene, of.weight);
            if !found.draws.is_empty() && best.as_ref().is_none_or(|best| rank(found) > rank(best))
            {
                best = Some(found.clone());
            }
        };
        // Draws of a pass that read the same layer read the same picture.
        let mut known: HashMap<(Layer, usize), Option<Picture>> = HashMap::new();
        let mut only_processes = true;
        for (_, draw, view) in writers.iter().rev() {
            let mut processes = draw.weight == 0;
            for read in draw.info.textures.iter().filter_map(|texture| texture.view) {
                // A multiview pass reads the layer of its own view.
                let shift = view.filter(|_| read.layers[1] > 1).unwrap_or(0);
                let source = (read.image, read.layers[0] + shift);
                let is_part = part.is_some_and(|part| viewport(draw.info) == part);
                let of =
                    (part.filter(|_| !is_part)).and_then(|of| self.scaled(of, layer.0, read.image));
                let found = (known.entry((source, draw.pass_number)))
                    .or_insert_with(|| self.picture(source, of, draw.place, path));
                if let Some(found) = found {
                    processes |= found.weight > 0;
                    take(found);
                }
            }
            only_processes &= processes;
        }
        for &[image, at, _, _] in self
            .copies
            .iter()
            .filter(|copy| (copy[2], copy[3]) == layer)
        {
            let of = part.and_then(|of| self.scaled(of, layer.0, image));
            if let Some(found) = self.picture((image, at), of, before, path) {
                take(&found);
            }
        }
        path.pop();
        match best {
            Some(best) if best.is_scene || only_processes => Some(best),
            _ => Some(own),
        }
    }

    /// The draws of a shown picture.
    fn eye(&self, eye: &ShownEye) -> Option<(Picture, View)> {
        let [left, top, width, height] = eye.rect;
        let rect = View {
            origin: [left, top],
            size: [width, height].map(|size| u32::try_from(size).unwrap_or(0)),
        };
        let whole = self
            .size(eye.image)
            .is_none_or(|size| rect.origin == [0; 2] && rect.size == size);
        let part = Some(rect).filter(|_| !whole);
        let found = self.picture((eye.image, eye.layer), part, usize::MAX, &mut Vec::new())?;
        if found.weight == 0 {
            return None;
        }
        // In the image itself, the program tells the rectangle. In other targets, it is that of most fragments.
        let own = found
            .draws
            .iter()
            .any(|(at, _)| writes(&self.draws[*at], (eye.image, eye.layer)).is_some());
        let main = || {
            let draws = found.draws.iter().map(|(at, _)| &self.draws[*at]);
            let largest = draws.max_by_key(|draw| draw.weight);
            largest.map_or(rect, |draw| viewport(draw.info))
        };
        let view = if own {
            rect
        } else {
            found.part.unwrap_or_else(main)
        };
        Some((found, view))
    }
}

/// The draws of both eyes. `None` if no draws of one were found.
pub(super) fn find(
    session: &Session,
    eyes: &[ShownEye; 2],
    draws: &[Drawn<'_>],
    copies: &[[u32; 4]],
) -> Option<Found> {
    let search = Search {
        session,
        draws,
        copies,
    };
    let [(left, left_view), (right, right_view)] = [search.eye(&eyes[0])?, search.eye(&eyes[1])?];
    let view_of = |of: &Picture| of.draws.iter().find_map(|(_, view)| *view);
    let mut layers = [0, 1];
    let mut roles: Vec<(usize, Role)> = Vec::new();
    let mut weight = left.weight + right.weight;
    if let (Some(a), Some(b)) = (view_of(&left), view_of(&right)) {
        layers = [a, b];
        weight = left.weight;
    }
    for (at, view) in &left.draws {
        let role = if view.is_some() {
            Role::Multiview
        } else {
            LEFT
        };
        roles.push((draws[*at].place, role));
    }
    for (at, view) in &right.draws {
        let place = draws[*at].place;
        match roles.iter_mut().find(|(of, _)| *of == place) {
            // One picture for both eyes.
            Some((_, role)) if view.is_none() => *role = Role::Seen(None),
            Some(_) => {}
            None if view.is_some() => roles.push((place, Role::Multiview)),
            None => roles.push((place, RIGHT)),
        }
    }
    Some(Found {
        eyes: [left_view, right_view],
        layers,
        roles,
        weight,
    })
}
