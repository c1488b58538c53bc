//! Range-checked reading of accessors.

use super::meshopt;
use crate::SceneError;
use crate::files::{Bytes, Origin};
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use std::cell::{Cell, OnceCell};

/// Most bytes of vertices, indices and instances created per byte of the file. Shared accessors,
/// accessors without a buffer view and meshes that are placed many times take almost no space in a
/// file. Real scenes stay far below this limit.
const MADE_PER_BYTE: u64 = 1024;

/// Bytes that any file may create, however small it is.
const SMALL_FILE_MADE: u64 = 1 << 26;

/// The JSON tables and the bytes that they describe.
pub(super) struct Buffers<'a> {
    pub root: &'a Root,
    pub origin: &'a Origin,
    bytes: Vec<Bytes>,
    /// Decompressed views, by number, filled on first use.
    decompressed: Vec<OnceCell<Vec<u8>>>,
    /// The file uses KHR_mesh_quantization.
    quantized: bool,
    /// Bytes of elements and instances that may still be created.
    budget: Cell<u64>,
}

/// Elements of an accessor: `count` of them, `stride` bytes apart.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Buffers<'a> {
    /// `json_bytes` is the size of the JSON, or of the GLB.
    pub fn new(root: &'a Root, bytes: Vec<Bytes>, origin: &'a Origin, json_bytes: usize) -> Self {
        let file_bytes = json_bytes + bytes.iter().map(|buffer| buffer.len()).sum::<usize>();
        let budget = (file_bytes as u64) * MADE_PER_BYTE + SMALL_FILE_MADE;
        Self {
            root,
            origin,
            bytes,
            decompressed: root.buffer_views.iter().map(|_| OnceCell::new()).collect(),
            quantized: (root.extensions_used.iter().chain(&root.extensions_required))
                .any(|name| name == "KHR_mesh_quantization"),
            budget: Cell::new(budget),
        }
    }

    /// Deducts `count` values of type `T` from the budget that the file's size allows.
    pub fn spend<T>(&self, count: u64, place: impl FnOnce() -> String) -> Result<(), SceneError> {
        let left = self.budget.get();
        let rest = (count.checked_mul(size_of::<T>() as u64))
            .and_then(|made| left.checked_sub(made))
            .ok_or_else(|| {
                self.origin.invalid(
                    place(),
                    format!("at most {left} bytes of values more in a file of this size"),
                    format!("{count} values of {} bytes", size_of::<T>()),
                )
            })?;
        self.budget.set(rest);
        Ok(())
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<&[u8], SceneError> {
        let place = || format!("bufferViews[{index}]");
        let Some(view) = self.root.buffer_views.get(index) else {
            return Err(self.origin.invalid(
                place(),
                format!("one of {} buffer views", self.root.buffer_views.len()),
                index.to_string(),
            ));
        };
        if let Some(compressed) = meshopt::of_view(view, &place(), self.origin)? {
            if let Some(known) = self.decompressed[index].get() {
                return Ok(known);
            }
            self.spend::<u8>(compressed.decoded_bytes(), place)?;
            let stored = self.range(
                &place(),
                compressed.buffer,
                compressed.byte_offset,
                compressed.byte_length,
            )?;
            let decoded = compressed.decode(stored, &place(), self.origin)?;
            return Ok(self.decompressed[index].get_or_init(|| decoded));
        }
        let start = view.byte_offset.map_or(0, |o| o.0);
        self.range(&place(), view.buffer.value(), start, view.byte_length.0)
    }

    /// A range of a buffer, for `place`.
    fn range(
        &self,
        place: &str,
        buffer: usize,
        start: u64,
        length: u64,
    ) -> Result<&[u8], SceneError> {
        let bytes = self.bytes.get(buffer).map_or(&[][..], |buffer| buffer);
        slice(bytes, start, length).ok_or_else(|| {
            self.origin.invalid(
                place,
                format!("a range inside buffers[{buffer}] of {} bytes", bytes.len()),
                format!("{length} bytes at {start}"),
            )
        })
    }

    /// Elements of `N` floats; integers are converted. Integers that are not normalized require
    /// KHR_mesh_quantization.
    pub fn floats<const N: usize>(
        &self,
        index: usize,
        expected: &str,
    ) -> Result<Vec<[f32; N]>, SceneError> {
        let (accessor, component) = self.accessor(index)?;
        let wanted = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            16 => Type::Mat4,
            _ => Type::Vec4,
        };
        let normalized = accessor.normalized;
        let allowed = component == ComponentType::F32
            || (component != ComponentType::U32 && (normalized || self.quantized));
        if accessor.type_ != Checked::Valid(wanted) || !allowed {
            return Err(self.origin.invalid(
                format!("accessors[{index}]"),
                expected,
                kind(accessor, component, ""),
            ));
        }
        let read = |bytes: &[u8]| {
            std::array::from_fn(|i| {
                read_float(&bytes[i * component.size()..], component, normalized)
            })
        };
        self.elements(index, accessor, N * component.size(), [0.0; N], read)
    }

    /// Four joint indices per vertex.
    pub fn joints(&self, index: usize) -> Result<Vec<[u16; 4]>, SceneError> {
        let (accessor, component) = self.accessor(index)?;
        let unsigned = matches!(component, ComponentType::U8 | ComponentType::U16);
        if accessor.type_ != Checked::Valid(Type::Vec4) || !unsigned || accessor.normalized {
            return Err(self.origin.invalid(
                format!("accessors[{index}]"),
                "joints: Vec4 of U8 or U16, not normalized",
                kind(
                    accessor,
                    component,
                    if accessor.normalized {
                        "normalized "
                    } else {
                        ""
                    },
                ),
            ));
        }
        let size = component.size();
        let read = |bytes: &[u8]| {
            std::array::from_fn(|i| read_index(&bytes[i * size..], component) as u16)
        };
        self.elements(index, accessor, 4 * size, [0; 4], read)
    }

    /// Unsigned scalars.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>, SceneError> {
        let (accessor, component) = self.accessor(index)?;
        let unsigned = matches!(
            component,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        );
        if accessor.type_ != Checked::Valid(Type::Scalar) || !unsigned {
            return Err(self.origin.invalid(
                format!("accessors[{index}]"),
                "indices: scalars of U8, U16 or U32",
                kind(accessor, component, ""),
            ));
        }
        let read = |bytes: &[u8]| read_index(bytes, component);
        self.elements(index, accessor, component.size(), 0, read)
    }

    /// Whether an accessor's integers represent numbers from 0 or -1 to 1.
    #[cfg(feature = "draco")]
    pub fn is_normalized(&self, index: Option<usize>) -> bool {
        let accessor = index.and_then(|index| self.root.accessors.get(index));
        accessor.is_some_and(|accessor| accessor.normalized)
    }

    /// The type of an accessor's elements.
    pub fn element_type(&self, index: usize) -> Option<Type> {
        self.root.accessors.get(index).and_then(|a| valid(&a.type_))
    }

    fn accessor(&self, index: usize) -> Result<(&Accessor, ComponentType), SceneError> {
        let accessor = self.root.accessors.get(index);
        match accessor.map(|a| (a, valid(&a.component_type))) {
            Some((accessor, Some(component))) => Ok((accessor, component.0)),
            _ => Err(self.origin.invalid(
                format!("accessors[{index}]"),
                format!("one of {} valid accessors", self.root.accessors.len()),
                "none",
            )),
        }
    }

    fn elements<T: Clone>(
        &self,
        index: usize,
        accessor: &Accessor,
        size: usize,
        zero: T,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, SceneError> {
        let count = accessor.count.0;
        let place = || format!("accessors[{index}]");
        self.spend::<T>(count, place)?;
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |o| o.0);
                let elements = self.strided(place(), view.value(), offset, count, size)?;
                elements.iter(size).map(&read).collect()
            }
            None => vec![zero; count as usize],
        };
        if let Some(sparse) = &accessor.sparse {
            let place = format!("accessors[{index}].sparse");
            let Some(component) = valid(&sparse.indices.component_type) else {
                return Err(self.origin.invalid(place, "valid indices", "others"));
            };
            let component = component.0;
            let at = self.strided(
                format!("{place}.indices"),
                sparse.indices.buffer_view.value(),
                sparse.indices.byte_offset.0,
                sparse.count.0,
                component.size(),
            )?;
            let new = self.strided(
                format!("{place}.values"),
                sparse.values.buffer_view.value(),
                sparse.values.byte_offset.0,
                sparse.count.0,
                size,
            )?;
            for (at, new) in at.iter(component.size()).zip(new.iter(size)) {
                let at = read_index(at, component);
                let Some(value) = values.get_mut(at as usize) else {
                    return Err(self.origin.invalid(
                        place,
                        format!("indices below {count}"),
                        at.to_string(),
                    ));
                };
                *value = read(new);
            }
        }
        Ok(values)
    }

    /// `count` elements of `size` bytes, checked to lie inside the view before any is read.
    fn strided(
        &self,
        place: String,
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
    ) -> Result<Elements<'_>, SceneError> {
        let bytes = self.view(view)?;
        let stride = self.root.buffer_views[view].byte_stride;
        // glTF 1 wrote 0 for elements without a gap, and exporters still do.
        let stride = stride.map(|s| s.0).filter(|&s| s > 0).unwrap_or(size);
        if stride < size {
            return Err(self.origin.invalid(
                format!("bufferViews[{view}].byteStride"),
                format!("at least {size} bytes, the size of an element of {place}"),
                stride.to_string(),
            ));
        }
        let needed = match count.checked_sub(1) {
            None => Some(0),
            Some(last) => last
                .checked_mul(stride as u64)
                .and_then(|n| n.checked_add(size as u64)),
        };
        needed
            .and_then(|needed| slice(bytes, offset, needed))
            .map(|bytes| Elements { bytes, stride })
            .ok_or_else(|| {
                self.origin.invalid(
                    place,
                    format!(
                        "a range inside bufferViews[{view}] of {} bytes",
                        bytes.len()
                    ),
                    format!("{count} elements of {size} bytes, {stride} apart, at {offset}"),
                )
            })
    }
}

impl<'a> Elements<'a> {
    fn iter(&self, size: usize) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        self.bytes
            .chunks(self.stride)
            .map(move |chunk| &chunk[..size])
    }
}

/// An index as a position in its table.
pub(super) fn at<T>(index: &Index<T>) -> usize {
    index.value()
}

/// The type of an accessor's elements for messages, with a word before the component's.
fn kind(accessor: &Accessor, component: ComponentType, word: &str) -> String {
    let component = component_name(component);
    format!("{} of {word}{component}", type_name(&accessor.type_))
}

/// A type by its glTF name.
fn type_name(type_: &Checked<Type>) -> &'static str {
    match valid(type_) {
        None => "no valid type",
        Some(Type::Scalar) => "SCALAR",
        Some(Type::Vec2) => "VEC2",
        Some(Type::Vec3) => "VEC3",
        Some(Type::Vec4) => "VEC4",
        Some(Type::Mat2) => "MAT2",
        Some(Type::Mat3) => "MAT3",
        Some(Type::Mat4) => "MAT4",
    }
}

fn component_name(component: ComponentType) -> &'static str {
    match component {
        ComponentType::I8 => "bytes",
        ComponentType::U8 => "unsigned bytes",
        ComponentType::I16 => "shorts",
        ComponentType::U16 => "unsigned shorts",
        ComponentType::U32 => "unsigned integers",
        ComponentType::F32 => "floats",
    }
}

fn valid<T: Copy>(checked: &Checked<T>) -> Option<T> {
    match checked {
        Checked::Valid(value) => Some(*value),
        Checked::Invalid => None,
    }
}

fn slice(bytes: &[u8], start: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(start).ok()?;
    let length = usize::try_from(length).ok()?;
    bytes.get(start..start.checked_add(length)?)
}

fn read_float(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let two = || [bytes[0], bytes[1]];
    let (value, one) = match component {
        ComponentType::F32 => {
            return f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        }
        ComponentType::U8 => (f32::from(bytes[0]), 255.0),
        ComponentType::I8 => (f32::from(bytes[0] as i8), 127.0),
        ComponentType::U16 => (f32::from(u16::from_le_bytes(two())), 65535.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes(two())), 32767.0),
        ComponentType::U32 => return read_index(bytes, component) as f32,
    };
    if normalized {
        (value / one).max(-1.0)
    } else {
        value
    }
}

fn read_index(bytes: &[u8], component: ComponentType) -> u32 {
    match component.size() {
        1 => u32::from(bytes[0]),
        2 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}
