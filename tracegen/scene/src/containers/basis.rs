//! Basis Universal in KTX2: transcoded to the block format that keeps most of it.
//!
//! UASTC becomes BC7. ETC1S becomes BC1, or BC3 if it has alpha, because its quality is no better
//! and desktop drivers choose the same. No texel is decoded and compressed again.

use super::{Fault, Header, Texels, level, needed_bytes};
use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use formats::texture::TexelFormat;
use std::borrow::Cow;

fn fault(found: impl Into<String>) -> Fault {
    (
        "a readable Basis Universal image (ETC1S or UASTC)".to_owned(),
        found.into(),
    )
}

/// Place of the number of levels in the header of KTX2.
const LEVEL_COUNT: std::ops::Range<usize> = 40..44;

/// The bytes for the transcoder, which refuses a file without levels: such a file holds one.
fn held(bytes: &[u8]) -> Cow<'_, [u8]> {
    if bytes.get(LEVEL_COUNT) != Some(&[0; 4]) {
        return Cow::Borrowed(bytes);
    }
    let mut held = bytes.to_vec();
    held[LEVEL_COUNT].copy_from_slice(&1_u32.to_le_bytes());
    Cow::Owned(held)
}

fn open(bytes: &[u8]) -> Result<(Transcoder<'_>, TexelFormat, TargetFormat), Fault> {
    let transcoder = Transcoder::new(bytes).map_err(|e| fault(format!("{e:?}")))?;
    let (format, target) = match (transcoder.source_format(), transcoder.has_alpha()) {
        (SourceFormat::UastcLdr, _) => (TexelFormat::Bc7, TargetFormat::Bc7Rgba),
        (SourceFormat::Etc1s, false) => (TexelFormat::Bc1, TargetFormat::Bc1Rgb),
        (SourceFormat::Etc1s, true) => (TexelFormat::Bc3, TargetFormat::Bc3Rgba),
        (other, _) => return Err(fault(format!("{other:?}"))),
    };
    Ok((transcoder, format, target))
}

/// The block format into which a file is transcoded.
pub(super) fn format(bytes: &[u8]) -> Result<TexelFormat, Fault> {
    open(&held(bytes)).map(|(_, format, _)| format)
}

/// Transcodes all levels of the file.
pub(super) fn levels(bytes: &[u8], header: &Header) -> Result<Vec<Vec<u8>>, Fault> {
    let bytes = held(bytes);
    let (transcoder, _, target) = open(&bytes)?;
    (0..header.stored.held)
        .map(|number| {
            let transcoded = transcoder
                .transcode(number, target, DecodeFlags::NONE)
                .map_err(|e| fault(format!("{e:?} in level {number}")))?;
            let needed = needed_bytes(header, number, Texels::Own);
            level(header, number, needed, &transcoded)
        })
        .collect()
}
