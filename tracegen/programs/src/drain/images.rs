//! The views that draws read, as textures of the trace.

use crate::texture::texture;
use formats::texture::{Part, Texture};
use record::{RecordError, Recorder};
use spool::{ImageInfo, ViewInfo};
use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};

/// The textures of a trace, by view.
#[derive(Default)]
pub struct ImageTextures {
    indices: HashMap<ViewInfo, u32>,
    /// Numbers of the program's images, from 1 in the order in which the trace uses them.
    numbers: HashMap<u32, u32>,
    by_number: BTreeMap<u32, OfImage>,
}

/// The views of an image, in the order of their textures.
struct OfImage {
    image: ImageInfo,
    number: u32,
    views: Vec<(ViewInfo, Texture, u32)>,
}

/// Whether two ranges, each given by its first element and its length, have a common element.
fn overlap([a, a_count]: [u32; 2], [b, b_count]: [u32; 2]) -> bool {
    a < b.saturating_add(b_count) && b < a.saturating_add(a_count)
}

impl ImageTextures {
    /// Index and size of the texture of a view, which is added if it is new; `None` if a trace does not have its
    /// format.
    ///
    /// # Errors
    /// The table is full.
    pub fn get<W: Write + Seek>(
        &mut self,
        recorder: &mut Recorder<W>,
        view: &ViewInfo,
        image: &ImageInfo,
    ) -> Result<Option<(u32, [u32; 2])>, RecordError> {
        let next = self.numbers.len() as u32 + 1;
        let number = *self.numbers.get(&view.image).unwrap_or(&next);
        let Some(of_trace) = texture(view, image, number) else {
            return Ok(None);
        };
        self.numbers.insert(view.image, number);
        let size = of_trace.size;
        // Views that differ in these alone are of the same memory.
        let view = ViewInfo {
            kind: 0,
            min_lod_256ths: 0,
            ..*view
        };
        if let Some(index) = self.indices.get(&view) {
            return Ok(Some((*index, size)));
        }
        let index = recorder.texture(of_trace.clone())?;
        self.indices.insert(view, index);
        let of_image = self.by_number.entry(number).or_insert_with(|| OfImage {
            image: image.clone(),
            number,
            views: Vec::new(),
        });
        of_image.views.push((view, of_trace, index));
        Ok(Some((index, size)))
    }

    /// Makes the views of an image parts of one texture where they have common texels.
    ///
    /// # Errors
    /// The table is full.
    pub fn join<W: Write + Seek>(&self, recorder: &mut Recorder<W>) -> Result<(), RecordError> {
        for of in self.by_number.values() {
            of.join(recorder)?;
        }
        Ok(())
    }
}

impl OfImage {
    fn join<W: Write + Seek>(&self, recorder: &mut Recorder<W>) -> Result<(), RecordError> {
        let pairs = (self.views.iter().enumerate())
            .flat_map(|(number, a)| self.views[..number].iter().map(move |b| (&a.0, &b.0)));
        let shared = |(a, b): (&ViewInfo, &ViewInfo)| {
            overlap(a.levels, b.levels) && overlap(a.layers, b.layers)
        };
        if !pairs.into_iter().any(shared) {
            return Ok(());
        }
        let inside = |[first, count]: [u32; 2], [start, length]: [u32; 2]| {
            first >= start && first + count <= start + length
        };
        let holds = |(whole, _, _): &(ViewInfo, Texture, u32)| {
            (self.views.iter()).all(|(view, _, _)| {
                inside(view.levels, whole.levels) && inside(view.layers, whole.layers)
            })
        };
        let added;
        let whole = match self.views.iter().find(|whole| holds(whole)) {
            Some(whole) => whole,
            None => {
                let view = ViewInfo {
                    format: self.views[0].0.format,
                    levels: [0, self.image.levels],
                    layers: [0, self.image.layers],
                    ..self.views[0].0
                };
                let Some(of_trace) = texture(&view, &self.image, self.number) else {
                    return Ok(());
                };
                let index = recorder.texture(of_trace.clone())?;
                added = (view, of_trace, index);
                &added
            }
        };
        for (view, of_trace, index) in self.views.iter().filter(|(_, _, index)| *index != whole.2) {
            if let Some(part) = part(view, of_trace, whole) {
                recorder.part(*index, part)?;
            }
        }
        Ok(())
    }
}

/// Place of a view in the texture of another one; `None` if it is not a part of it.
fn part(
    view: &ViewInfo,
    of_trace: &Texture,
    (whole, texture, of): &(ViewInfo, Texture, u32),
) -> Option<Part> {
    let [level, layer] = [(view.levels, whole.levels), (view.layers, whole.layers)]
        .map(|([first, _], [start, _])| first.checked_sub(start));
    let part = Part {
        of: *of,
        level: level?,
        layer: layer?,
    };
    of_trace.fits(part, texture).then_some(part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::textrace::TextraceWriter;

    type Place = (u32, u32, u32);

    /// Textures of views of an image of 64x64 texels, 7 levels and 6 layers, each by format, levels and layers:
    /// the place of each, and the number of textures.
    fn joined(views: &[(i32, [u32; 2], [u32; 2])]) -> (Vec<Option<Place>>, usize) {
        let image = ImageInfo {
            image: 3,
            format: 37,
            size: [64, 64, 1],
            levels: 7,
            layers: 6,
            samples: 1,
            presented: false,
        };
        let mut recorder = Recorder::new(TextraceWriter::growing_in_memory().unwrap(), Vec::new());
        let mut textures = ImageTextures::default();
        for (number, &(format, levels, layers)) in (0..).zip(views) {
            for kind in [1, 5] {
                let view = ViewInfo {
                    image: 3,
                    format,
                    kind,
                    levels,
                    layers,
                    min_lod_256ths: 0,
                };
                let (index, _) = textures.get(&mut recorder, &view, &image).unwrap().unwrap();
                assert_eq!(index, number);
            }
        }
        textures.join(&mut recorder).unwrap();
        let writer = recorder.into_writer().unwrap();
        let tables = writer.tables();
        let place = |texture: &Texture| texture.part.map(|p| (p.of, p.level, p.layer));
        let places = tables.textures.iter().map(place).collect();
        (places, tables.textures.len())
    }

    #[test]
    fn views_with_common_texels_are_parts_of_one_texture() {
        // Whole, levels 2 to 4 of layer 3 as sRGB, and whole with another block size.
        let (places, _) = joined(&[
            (37, [0, 7], [0, 6]),
            (43, [2, 3], [3, 1]),
            (9, [0, 7], [0, 6]),
        ]);
        assert_eq!(places, [None, Some((0, 2, 3)), None]);
    }

    #[test]
    fn an_image_whose_views_overlap_without_a_whole_one_is_added() {
        let (places, count) = joined(&[(37, [0, 3], [0, 2]), (37, [1, 6], [1, 5])]);
        assert_eq!(
            (places, count),
            (vec![Some((2, 0, 0)), Some((2, 1, 1)), None], 3)
        );
    }

    #[test]
    fn views_without_common_texels_stay_apart() {
        let (places, count) = joined(&[(37, [0, 7], [0, 3]), (37, [0, 7], [3, 3])]);
        assert_eq!((places, count), (vec![None; 2], 2));
    }
}
