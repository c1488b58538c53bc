//! Pictures embedded in the page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// A PNG file as a `data:` address.
pub fn png(bytes: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(bytes))
}

/// A JPEG file as a `data:` address.
pub fn jpeg(bytes: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes))
}
