//! Basis Universal in KTX2: transcoded to the block format that keeps most of it.
//!
//! UASTC becomes BC7. ETC1S becomes BC1, or BC3 if it has alpha, because its quality is no better
//! and desktop drivers choose the same. No texel is decoded and compressed again.

use super::{Fault, Header, Texels, level, needed_bytes};
use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use formats::texture::TexelFormat;

fn fault(found: impl Into<String>) -> Fault {
    (
        "a readable Basis Universal image (ETC1S or UASTC)".to_owned(),
        found.into(),
    )
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
    open(bytes).map(|(_, format, _)| format)
}

/// Transcodes all levels of the file.
pub(super) fn levels(bytes: &[u8], header: &Header) -> Result<Vec<Vec<u8>>, Fault> {
    let (transcoder, _, target) = open(bytes)?;
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
