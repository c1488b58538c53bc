//! EXT_meshopt_compression and KHR_meshopt_compression: compressed buffer views.

use crate::SceneError;
use crate::files::Origin;
use gltf::json::buffer::{Buffer, View};
use serde::Deserialize;
use serde_json::Value;

const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Most decoded bytes per compressed byte. A run of equal vertices is nearly free, but each header
/// byte describes at most sixteen vertices of 256 bytes.
const MAX_EXPANSION: u64 = 4096 * 16;

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// The extension's object in a buffer view.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    byte_stride: usize,
    count: u64,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

/// The compressed data of a view, if it is compressed.
pub(super) fn of_view(
    view: &View,
    place: &str,
    origin: &Origin,
) -> Result<Option<Compressed>, SceneError> {
    let Some((name, value)) = view.extensions.as_ref().and_then(|e| object(&e.others)) else {
        return Ok(None);
    };
    let place = || format!("{place}.extensions.{name}");
    let read = Compressed::deserialize(value)
        .map_err(|e| origin.invalid(place(), "a compressed view", e.to_string()))?;
    let stride = read.byte_stride;
    let is_allowed = match read.mode {
        Mode::Attributes => stride.is_multiple_of(4) && (4..=256).contains(&stride),
        Mode::Triangles => (stride == 2 || stride == 4) && read.count.is_multiple_of(3),
        Mode::Indices => stride == 2 || stride == 4,
    };
    let is_filtered = match read.filter {
        Filter::None => true,
        _ if read.mode != Mode::Attributes => false,
        Filter::Octahedral | Filter::Color => stride == 4 || stride == 8,
        Filter::Quaternion => stride == 8,
        Filter::Exponential => true,
    };
    let decoded = read.count.checked_mul(stride as u64);
    if !is_allowed || !is_filtered || decoded != Some(view.byte_length.0) {
        return Err(origin.invalid(
            place(),
            format!(
                "a stride that its mode and filter allow, and a count that fills {} bytes",
                view.byte_length.0
            ),
            format!(
                "{} elements of {stride} bytes, {:?}, filter {:?}",
                read.count, read.mode, read.filter
            ),
        ));
    }
    Ok(Some(read))
}

fn object(others: &serde_json::Map<String, Value>) -> Option<(&'static str, &Value)> {
    NAMES
        .into_iter()
        .find_map(|name| Some((name, others.get(name)?)))
}

/// True for a buffer without bytes that only reserves space for decoded views.
pub(super) fn is_fallback(buffer: &Buffer) -> bool {
    let named = buffer.extensions.as_ref().and_then(|e| object(&e.others));
    named.is_some_and(|(_, value)| value.get("fallback") == Some(&Value::Bool(true)))
}

impl Compressed {
    /// Size of the decoded view in bytes.
    pub fn decoded_bytes(&self) -> u64 {
        self.count.saturating_mul(self.byte_stride as u64)
    }

    /// Decodes the view.
    pub fn decode(
        &self,
        stored: &[u8],
        place: &str,
        origin: &Origin,
    ) -> Result<Vec<u8>, SceneError> {
        let invalid = |expected: String, found: String| {
            Err(origin.invalid(format!("{place} (meshopt compression)"), expected, found))
        };
        let bytes = self.decoded_bytes();
        if bytes > (stored.len() as u64).saturating_mul(MAX_EXPANSION) {
            let most = stored.len() as u64 * MAX_EXPANSION;
            return invalid(format!("at most {most} bytes"), format!("{bytes} bytes"));
        }
        let (count, stride) = (self.count as usize, self.byte_stride);
        // 64-bit words satisfy every filter's alignment.
        let mut words = vec![0_u64; (bytes as usize).div_ceil(8)];
        if let Err((expected, found)) = self.decode_into(&mut words, stored) {
            return invalid(expected, found);
        }
        let bytes = words.iter().flat_map(|word| word.to_ne_bytes());
        Ok(bytes.take(count * stride).collect())
    }

    #[cfg(not(feature = "meshopt"))]
    fn decode_into(&self, _to: &mut [u64], _stored: &[u8]) -> Result<(), (String, String)> {
        Err(crate::error::without_feature("meshopt"))
    }

    /// Decodes into words that hold all elements.
    #[cfg(feature = "meshopt")]
    fn decode_into(&self, words: &mut [u64], stored: &[u8]) -> Result<(), (String, String)> {
        let (count, stride) = (self.count as usize, self.byte_stride);
        assert!(
            size_of_val(words) >= count * stride,
            "room for all elements"
        );
        let to = words.as_mut_ptr().cast();
        let (from, length) = (stored.as_ptr(), stored.len());
        // SAFETY: `to` holds `count * stride` bytes. `of_view` has checked the strides and counts
        // that the functions require. The decoders read at most `length` bytes, whatever the bytes
        // are.
        let code = unsafe {
            match self.mode {
                Mode::Attributes => {
                    meshopt::ffi::meshopt_decodeVertexBuffer(to, count, stride, from, length)
                }
                Mode::Triangles => {
                    meshopt::ffi::meshopt_decodeIndexBuffer(to, count, stride, from, length)
                }
                Mode::Indices => {
                    meshopt::ffi::meshopt_decodeIndexSequence(to, count, stride, from, length)
                }
            }
        };
        if code != 0 {
            let expected = format!("{count} elements of {stride} bytes");
            return Err((expected, format!("damaged data (code {code})")));
        }
        // SAFETY: as above; filters work in place on the same elements.
        unsafe {
            match self.filter {
                Filter::None => {}
                Filter::Octahedral => meshopt::ffi::meshopt_decodeFilterOct(to, count, stride),
                Filter::Quaternion => meshopt::ffi::meshopt_decodeFilterQuat(to, count, stride),
                Filter::Exponential => meshopt::ffi::meshopt_decodeFilterExp(to, count, stride),
                Filter::Color => meshopt::ffi::meshopt_decodeFilterColor(to, count, stride),
            }
        }
        Ok(())
    }
}
