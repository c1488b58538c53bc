//! Wrong calls, and calls in two steps, each with the code that the specification asks for.

mod actions;
mod instance;
mod session;
mod spaces;
mod swapchains;

use crate::api::{Api, Result, of, put};
use crate::session::{Opened, instance};
use crate::targets::swapchain_info;
use crate::{xr_call, xr_do};
use openxr_sys as xr;
use std::ffi::CString;
use std::ptr::{null, null_mut};
use xr::{Handle, Result as Code, SessionState, StructureType as Type};

/// Answers that were not as expected, and the number of all.
#[derive(Default)]
struct Checks {
    count: u32,
    wrong: Vec<String>,
}

impl Checks {
    fn expect<T: PartialEq + std::fmt::Debug>(&mut self, what: &str, found: T, expected: T) {
        self.count += 1;
        if found != expected {
            self.wrong
                .push(format!("{what}: expected {expected:?}, found {found:?}"));
        }
    }
}

const INVALID: Code = Code::ERROR_VALIDATION_FAILURE;
const HANDLE: Code = Code::ERROR_HANDLE_INVALID;
const ORDER: Code = Code::ERROR_CALL_ORDER_INVALID;
const SIZE: Code = Code::ERROR_SIZE_INSUFFICIENT;
const DONE: Code = Code::SUCCESS;

/// Makes all calls; writes their number to a file.
pub fn run(file: &str) -> Result<()> {
    let mut checks = Checks::default();
    instance::without_session(&mut checks)?;
    session::with_session(&mut checks)?;
    std::fs::write(file, checks.count.to_string()).map_err(|error| error.to_string())?;
    match checks.wrong.is_empty() {
        true => Ok(()),
        false => Err(checks.wrong.join("\n")),
    }
}

fn path(api: &Api, text: &str) -> (Code, xr::Path) {
    let text = CString::new(text).unwrap_or_default();
    let mut path = xr::Path::NULL;
    (
        xr_call!(api, StringToPath(api.instance, text.as_ptr(), &mut path)),
        path,
    )
}
