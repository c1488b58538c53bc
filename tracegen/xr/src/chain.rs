//! Structures that programs pass: their types, their chains, and arrays that are asked for in two calls.

use crate::state::{Answer, Code, DONE, INVALID};
use openxr_sys as xr;
use std::ffi::{CStr, c_char, c_void};
use xr::{BaseInStructure, StructureType};

/// A structure that a program passes, after a check of its type.
///
/// # Safety
/// `structure` is null or points to a structure that starts with its type, and of this one if the type is `ty`.
pub(crate) unsafe fn input<'a, T>(structure: *const T, ty: StructureType) -> Result<&'a T, Code> {
    // SAFETY: as the caller promises.
    unsafe {
        let base = structure
            .cast::<BaseInStructure>()
            .as_ref()
            .ok_or(INVALID)?;
        if base.ty != ty {
            return Err(INVALID);
        }
        structure.as_ref().ok_or(INVALID)
    }
}

/// A structure that a program passes to be filled, after a check of its type.
///
/// # Safety
/// As for [`input`].
pub(crate) unsafe fn output<'a, T>(
    structure: *mut T,
    ty: StructureType,
) -> Result<&'a mut T, Code> {
    // SAFETY: as the caller promises.
    unsafe {
        input(structure, ty)?;
        structure.as_mut().ok_or(INVALID)
    }
}

/// The first structure of a type in a chain.
///
/// # Safety
/// A valid chain.
pub(crate) unsafe fn find(chain: *const c_void, ty: StructureType) -> Option<*mut c_void> {
    let mut at = chain.cast::<BaseInStructure>();
    // SAFETY: each element of a chain starts with its type and a pointer to the next one.
    while let Some(base) = unsafe { at.as_ref() } {
        if base.ty == ty {
            return Some(at.cast_mut().cast());
        }
        at = base.next;
    }
    None
}

/// Elements that a program passes.
///
/// # Safety
/// `first` is null or points to this number of elements.
pub(crate) unsafe fn elements<'a, T>(first: *const T, count: u32) -> Result<&'a [T], Code> {
    match (count, first.is_null()) {
        (0, _) => Ok(&[]),
        (_, true) => Err(INVALID),
        // SAFETY: as the caller promises.
        (_, false) => Ok(unsafe { std::slice::from_raw_parts(first, count as usize) }),
    }
}

/// Answers the first or the second call for an array of `count` elements. `write` gets the program's array in the
/// second call.
///
/// # Safety
/// `into` is null or points to `capacity` elements.
pub(crate) unsafe fn two_calls<T>(
    count: usize,
    capacity: u32,
    count_output: *mut u32,
    into: *mut T,
    write: impl FnOnce(*mut T) -> Answer,
) -> Answer {
    // SAFETY: as the caller promises.
    let output = unsafe { count_output.as_mut() }.ok_or(INVALID)?;
    if capacity > 0 && into.is_null() {
        return Err(INVALID);
    }
    *output = count as u32;
    match capacity {
        0 => DONE,
        _ if (capacity as usize) < count => Err(Code::ERROR_SIZE_INSUFFICIENT),
        _ => write(into),
    }
}

/// Answers a call for an array of plain values.
///
/// # Safety
/// As for [`two_calls`].
pub(crate) unsafe fn values<T: Copy>(
    values: &[T],
    capacity: u32,
    count_output: *mut u32,
    into: *mut T,
) -> Answer {
    let write = |into: *mut T| {
        // SAFETY: the capacity was checked.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), into, values.len()) };
        DONE
    };
    // SAFETY: as the caller promises.
    unsafe { two_calls(values.len(), capacity, count_output, into, write) }
}

/// Answers a call for an array of structures. Their `type` and `next` are the program's.
///
/// # Safety
/// As for [`two_calls`]; each element starts with its type.
pub(crate) unsafe fn structures<T>(
    count: usize,
    ty: StructureType,
    capacity: u32,
    count_output: *mut u32,
    into: *mut T,
    mut fill: impl FnMut(usize, &mut T),
) -> Answer {
    let write = |into: *mut T| {
        for place in 0..count {
            // SAFETY: the capacity was checked.
            fill(place, unsafe { output(into.add(place), ty) }?);
        }
        DONE
    };
    // SAFETY: as the caller promises.
    unsafe { two_calls(count, capacity, count_output, into, write) }
}

/// Answers a call for a text.
///
/// # Safety
/// As for [`two_calls`].
pub(crate) unsafe fn text(
    text: &str,
    capacity: u32,
    count_output: *mut u32,
    into: *mut c_char,
) -> Answer {
    let with_end: Vec<u8> = text.bytes().chain([0]).collect();
    // SAFETY: as the caller promises.
    unsafe { values(&with_end, capacity, count_output, into.cast::<u8>()) }
}

/// Writes a text into a field of a structure, with a zero at its end.
pub(crate) fn put(field: &mut [c_char], text: &str) {
    let fitting = text.bytes().take(field.len() - 1).chain([0]);
    for (to, from) in field.iter_mut().zip(fitting) {
        *to = from as c_char;
    }
}

/// The text of a field with a zero at its end.
pub(crate) fn taken(field: &[c_char]) -> Result<String, Code> {
    let bytes: Vec<u8> = field.iter().map(|byte| *byte as u8).collect();
    let text = CStr::from_bytes_until_nul(&bytes).map_err(|_| INVALID)?;
    text.to_str().map(str::to_owned).map_err(|_| INVALID)
}
