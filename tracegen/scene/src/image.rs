//! Images: their properties, known before decoding, and the sources that produce their texels.

use crate::SceneError;
use crate::blocks::{ImageData, StoredBlocks};
use formats::texture::ColorSpace;
use rayon::prelude::*;
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// An image of a scene. Loading a scene decodes no texels; they are decoded on request.
#[derive(Clone)]
pub struct Image {
    /// File name, or the built-in texture's name.
    pub name: String,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Colour space of RGB.
    pub color_space: ColorSpace,
    /// Blocks that the source holds and that are kept unchanged.
    pub stored: Option<StoredBlocks>,
    /// Produces the texels.
    pub source: Arc<dyn ImageSource>,
    /// Which of the source's images this is.
    pub part: usize,
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Image")
            .field("name", &self.name)
            .field("size", &self.size)
            .field("color_space", &self.color_space)
            .field("part", &self.part)
            .finish_non_exhaustive()
    }
}

/// Produces images. A file produces one; a generator produces all maps of a material together.
pub trait ImageSource: Send + Sync {
    /// Reads the source's input.
    ///
    /// # Errors
    /// An unreadable file.
    fn open(&self) -> Result<Box<dyn OpenSource + '_>, SceneError>;
}

/// A source whose input has been read and not yet decoded.
pub trait OpenSource {
    /// Passes `sink` every byte that determines the texels. Equal bytes mean equal texels.
    fn identify(&self, sink: &mut dyn FnMut(&[u8]));

    /// The texels of each of `parts`: RGBA8, row by row from the top (v = 0).
    ///
    /// # Errors
    /// Damaged input.
    fn texels(&self, parts: &[usize]) -> Result<Vec<Vec<u8>>, SceneError>;

    /// The contents of each of `parts`: blocks where [`Image::stored`] names them, or else texels.
    ///
    /// # Errors
    /// Damaged input.
    fn data(&self, parts: &[usize]) -> Result<Vec<ImageData>, SceneError> {
        Ok(self
            .texels(parts)?
            .into_iter()
            .map(ImageData::Rgba8)
            .collect())
    }
}

/// Texels in memory.
struct Texels(Vec<u8>);

impl ImageSource for Texels {
    fn open(&self) -> Result<Box<dyn OpenSource + '_>, SceneError> {
        Ok(Box::new(self))
    }
}

impl OpenSource for &Texels {
    fn identify(&self, sink: &mut dyn FnMut(&[u8])) {
        sink(b"texels");
        sink(&self.0);
    }

    fn texels(&self, parts: &[usize]) -> Result<Vec<Vec<u8>>, SceneError> {
        Ok(vec![self.0.clone(); parts.len()])
    }
}

impl Image {
    /// An image from texels in memory (RGBA8, row by row from the top).
    pub fn from_texels(
        name: &str,
        size: [u32; 2],
        color_space: ColorSpace,
        rgba: impl Into<Vec<u8>>,
    ) -> Self {
        Self {
            name: name.to_owned(),
            size,
            color_space,
            stored: None,
            source: Arc::new(Texels(rgba.into())),
            part: 0,
        }
    }
}

/// The indices of the `wanted` images, grouped by source.
pub fn by_source(images: &[Image], wanted: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut group_of: HashMap<*const (), usize> = HashMap::new();
    for (index, image) in images.iter().enumerate().filter(|(i, _)| wanted(*i)) {
        let source = Arc::as_ptr(&image.source).cast::<()>();
        let group = *group_of.entry(source).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(index);
    }
    groups
}

/// The texels of the `wanted` images, produced on all cores; `None` for the others.
///
/// # Errors
/// Unreadable or damaged files.
pub fn texels(
    images: &[Image],
    wanted: impl Fn(usize) -> bool,
) -> Result<Vec<Option<Vec<u8>>>, SceneError> {
    let made: Vec<Vec<(usize, Vec<u8>)>> = by_source(images, wanted)
        .into_par_iter()
        .map(|group| {
            let parts: Vec<usize> = group.iter().map(|&i| images[i].part).collect();
            let made = images[group[0]].source.open()?.texels(&parts)?;
            Ok(group.into_iter().zip(made).collect())
        })
        .collect::<Result<_, SceneError>>()?;
    let mut texels = vec![None; images.len()];
    for (index, rgba) in made.into_iter().flatten() {
        texels[index] = Some(rgba);
    }
    Ok(texels)
}
