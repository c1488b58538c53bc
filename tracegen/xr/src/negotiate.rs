//! The call by which a loader finds the runtime's functions.

use crate::functions::get_instance_proc_addr;
use openxr_sys as xr;
use xr::loader::{
    CURRENT_LOADER_RUNTIME_VERSION, XrNegotiateLoaderInfo, XrNegotiateRuntimeRequest,
};

/// Newest version of OpenXR that the runtime implements.
pub(crate) const NEWEST: xr::Version = xr::Version::new(1, 1, 0);

/// Called by the loader to get the runtime's entry point.
///
/// # Safety
/// The loader makes the call.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn xrNegotiateLoaderRuntimeInterface(
    loader: *const XrNegotiateLoaderInfo,
    request: *mut XrNegotiateRuntimeRequest,
) -> xr::Result {
    // SAFETY: as the caller promises.
    let (Some(loader), Some(request)) = (unsafe { (loader.as_ref(), request.as_mut()) }) else {
        return xr::Result::ERROR_INITIALIZATION_FAILED;
    };
    let versions = loader.min_interface_version..=loader.max_interface_version;
    let fits = loader.ty == XrNegotiateLoaderInfo::TYPE
        && loader.struct_version == XrNegotiateLoaderInfo::VERSION
        && loader.struct_size == size_of::<XrNegotiateLoaderInfo>()
        && request.ty == XrNegotiateRuntimeRequest::TYPE
        && request.struct_version == XrNegotiateRuntimeRequest::VERSION
        && request.struct_size == size_of::<XrNegotiateRuntimeRequest>()
        && versions.contains(&CURRENT_LOADER_RUNTIME_VERSION)
        && loader.min_api_version <= NEWEST;
    if !fits {
        return xr::Result::ERROR_INITIALIZATION_FAILED;
    }
    request.runtime_interface_version = CURRENT_LOADER_RUNTIME_VERSION;
    request.runtime_api_version = NEWEST.min(loader.max_api_version);
    request.get_instance_proc_addr = Some(get_instance_proc_addr);
    xr::Result::SUCCESS
}
