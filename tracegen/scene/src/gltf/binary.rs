//! The binary container: checks of the GLB header and chunks, made before the crate parses them.

use crate::SceneError;
use crate::files::Origin;

const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const JSON: &[u8] = b"JSON";

/// Checks the version and every length of a GLB, and that its first chunk is JSON. Returns its bytes up to the
/// length that the header states.
pub(super) fn check<'a>(bytes: &'a [u8], origin: &Origin) -> Result<&'a [u8], SceneError> {
    let number = |at: usize| {
        let four = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        four.map(u32::from_le_bytes)
    };
    if let Some(version) = number(4).filter(|version| *version != 2) {
        return Err(origin.invalid("GLB header, byte 4", "version 2", version.to_string()));
    }
    let length = number(8).unwrap_or(0) as usize;
    if length < HEADER_BYTES + CHUNK_HEADER_BYTES || length > bytes.len() {
        return Err(origin.invalid(
            "GLB header, byte 8",
            format!(
                "a length from {} to the file's {} bytes",
                HEADER_BYTES + CHUNK_HEADER_BYTES,
                bytes.len()
            ),
            length.to_string(),
        ));
    }
    let (mut at, mut chunk) = (HEADER_BYTES, 0);
    while at < length {
        let place = format!("GLB chunk {chunk}, byte {at}");
        let room = length.checked_sub(at + CHUNK_HEADER_BYTES);
        let Some(room) = room else {
            return Err(origin.invalid(
                place,
                format!("a header of {CHUNK_HEADER_BYTES} bytes"),
                format!("{} bytes up to the length in the header", length - at),
            ));
        };
        let chunk_bytes = number(at).unwrap_or(0) as usize;
        if chunk_bytes > room {
            return Err(origin.invalid(
                place,
                format!("at most {room} bytes, up to the length in the header"),
                chunk_bytes.to_string(),
            ));
        }
        let kind = &bytes[at + 4..at + CHUNK_HEADER_BYTES];
        if chunk == 0 && kind != JSON {
            let found = String::from_utf8_lossy(kind).into_owned();
            return Err(origin.invalid(place, "the chunk JSON", format!("'{found}'")));
        }
        at += CHUNK_HEADER_BYTES + chunk_bytes;
        chunk += 1;
    }
    Ok(&bytes[..length])
}
