//! Paths: names that programs and the runtime exchange as numbers.

use crate::chain::text;
use crate::state::{Code, DONE, INVALID};
use openxr_sys as xr;
use std::collections::HashMap;
use std::ffi::{CStr, c_char};

/// Paths by number, from 1.
#[derive(Debug, Default)]
pub(crate) struct Paths {
    texts: Vec<String>,
    numbers: HashMap<String, u64>,
}

impl Paths {
    /// The number of a well-formed path.
    pub fn of(&mut self, text: &str) -> xr::Path {
        let next = self.texts.len() as u64 + 1;
        let number = *self.numbers.entry(text.to_owned()).or_insert(next);
        if number == next {
            self.texts.push(text.to_owned());
        }
        xr::Path::from_raw(number)
    }

    /// The text of a path.
    pub fn text(&self, path: xr::Path) -> Result<&str, Code> {
        let place = path.into_raw().checked_sub(1);
        let found = place.and_then(|place| self.texts.get(usize::try_from(place).ok()?));
        found.map(String::as_str).ok_or(Code::ERROR_PATH_INVALID)
    }
}

/// Whether a name has only the characters of a component of a path.
pub(crate) fn is_component(text: &str) -> bool {
    let allowed =
        |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_.".contains(&byte);
    !text.is_empty() && text.bytes().all(allowed)
}

/// Whether a text is a path by the rules of the specification.
fn is_path(text: &str) -> bool {
    let named =
        |component: &str| is_component(component) && component.bytes().any(|byte| byte != b'.');
    let components = text.strip_prefix('/').map(|rest| rest.split('/'));
    text.len() < xr::MAX_PATH_LENGTH && components.is_some_and(|mut all| all.all(named))
}

api! {
    fn string_to_path(instance: xr::Instance, string: *const c_char, path: *mut xr::Path) |state| {
        let instance = state.instance(instance)?;
        if string.is_null() || path.is_null() {
            return Err(INVALID);
        }
        let text = CStr::from_ptr(string).to_str().ok().filter(|text| is_path(text));
        *path = instance.paths.of(text.ok_or(Code::ERROR_PATH_FORMAT_INVALID)?);
        DONE
    }

    fn path_to_string(instance: xr::Instance, path: xr::Path, capacity: u32, count: *mut u32, buffer: *mut c_char) |state| {
        let found = state.instance(instance)?.paths.text(path)?.to_owned();
        text(&found, capacity, count, buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_checked_and_numbered_once() {
        for good in ["/user/hand/left", "/a", "/a.b/c-d_e", "/..a"] {
            assert!(is_path(good), "{good}");
        }
        for bad in [
            "", "/", "a", "/a/", "//a", "/A", "/a b", "/.", "/a/..", "/é",
        ] {
            assert!(!is_path(bad), "{bad}");
        }
        assert!(!is_path(&format!("/{}", "a".repeat(255))));
        let mut paths = Paths::default();
        let [a, b, again] = ["/a", "/b", "/a"].map(|text| paths.of(text));
        assert!(a == again && a != b);
        assert_eq!(paths.text(b), Ok("/b"));
        for unknown in [xr::Path::NULL, xr::Path::from_raw(3)] {
            assert_eq!(paths.text(unknown), Err(Code::ERROR_PATH_INVALID));
        }
    }
}
