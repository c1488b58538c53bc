//! Colours of series: Okabe and Ito's ("Color Universal Design", 2008), which stay apart under the
//! common kinds of colour blindness.

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// Orange.
pub const ORANGE: Rgb = [0xE6, 0x9F, 0x00];
/// Sky blue.
pub const SKY_BLUE: Rgb = [0x56, 0xB4, 0xE9];
/// Blue.
pub const BLUE: Rgb = [0x00, 0x72, 0xB2];
/// Bluish green.
pub const GREEN: Rgb = [0x00, 0x9E, 0x73];
/// Vermilion.
pub const VERMILION: Rgb = [0xD5, 0x5E, 0x00];
/// Reddish purple.
pub const PURPLE: Rgb = [0xCC, 0x79, 0xA7];
/// Yellow, darkened to be visible on white.
pub const YELLOW: Rgb = [0xC9, 0xB8, 0x1A];
/// Neutral grey.
pub const GREY: Rgb = [0x80, 0x86, 0x8E];
