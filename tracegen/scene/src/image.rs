//! Images: what is known of one before its texels are made, and who makes them.

use crate::SceneError;
use crate::blocks::{ImageData, StoredBlocks};
use formats::texture::ColorSpace;
use rayon::prelude::*;
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// An image of a scene. Loading a scene makes no texels; whoever needs them asks for them.
#[derive(Clone)]
pub struct Image {
    /// File name, or the built-in texture's name.
    pub name: String,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Colour space of RGB.
    pub color_space: ColorSpace,
    /// Blocks that the source holds and that are kept as they are.
    pub stored: Option<StoredBlocks>,
    /// Makes the texels.
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

/// Makes images: a file makes one, a generator makes all maps of a material in one go.
pub trait ImageSource: Send + Sync {
    /// Reads what the texels are made from.
    ///
    /// # Errors
    /// An unreadable file.
    fn open(&self) -> Result<Box<dyn OpenSource + '_>, SceneError>;
}

/// A source that has been read and has made nothing yet.
pub trait OpenSource {
    /// Hands `sink` every byte that decides the texels: what hands over the same bytes makes the
    /// same texels.
    fn identify(&self, sink: &mut dyn FnMut(&[u8]));

    /// The texels of each of `parts`: RGBA8, row by row from the top (v = 0).
    ///
    /// # Errors
    /// Damaged input.
    fn texels(&self, parts: &[usize]) -> Result<Vec<Vec<u8>>, SceneError>;

    /// What each of `parts` holds: blocks where [`Image::stored`] names them, or else texels.
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

/// Texels that are at hand.
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
    /// An image whose texels (RGBA8, row by row from the top) are at hand.
    #[must_use]
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

/// The indices of the `wanted` images, those of one source together.
#[must_use]
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

/// The texels of the `wanted` images, made on all cores; `None` for the others.
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
