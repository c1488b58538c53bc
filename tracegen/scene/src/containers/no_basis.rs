//! Refuses Basis Universal in programs that are built without its transcoder.

use super::{Fault, Header};
use crate::error::without_feature;
use formats::texture::TexelFormat;

/// Refuses the file.
pub(super) fn format(_bytes: &[u8]) -> Result<TexelFormat, Fault> {
    Err(without_feature("basis"))
}

/// Refuses the file.
pub(super) fn levels(_bytes: &[u8], _header: &Header) -> Result<Vec<Vec<u8>>, Fault> {
    Err(without_feature("basis"))
}
