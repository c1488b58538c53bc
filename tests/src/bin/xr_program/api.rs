//! The functions of OpenXR, through the system's loader or, where it is not installed, straight from the runtime.

use openxr_sys as xr;
use std::ffi::CString;
use xr::Handle;
use xr::loader::{
    FnNegotiateLoaderRuntimeInterface, XrNegotiateLoaderInfo, XrNegotiateRuntimeRequest,
};
use xr::pfn::{GetInstanceProcAddr, VoidFunction};

/// Result with the error as text.
pub type Result<T> = std::result::Result<T, String>;

/// Calls a function by the name of its type.
#[macro_export]
macro_rules! xr_call {
    ($api:expr, $kind:ident($($argument:expr),* $(,)?)) => {{
        let function = $api.function(concat!("xr", stringify!($kind)));
        // SAFETY: the name determines the function's type, and the caller passes what the test wants.
        #[allow(unused_unsafe, clippy::macro_metavars_in_unsafe)]
        unsafe {
            let function: openxr_sys::pfn::$kind = std::mem::transmute(function);
            function($($argument),*)
        }
    }};
}

/// Calls a function that must succeed.
#[macro_export]
macro_rules! xr_do {
    ($api:expr, $kind:ident($($argument:expr),* $(,)?)) => {{
        let code = $crate::xr_call!($api, $kind($($argument),*));
        if code.into_raw() < 0 {
            return Err(format!("xr{}: {code:?}", stringify!($kind)));
        }
        code
    }};
}

/// The entry point and the instance.
pub struct Api {
    get: GetInstanceProcAddr,
    pub instance: xr::Instance,
}

/// A structure of zeros with its type.
pub fn of<T>(ty: xr::StructureType) -> T {
    let mut made = std::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: all structures of OpenXR start with their type, and zeros are values of all their fields here.
    unsafe {
        made.as_mut_ptr().cast::<xr::StructureType>().write(ty);
        made.assume_init()
    }
}

/// Writes a name into a field.
pub fn put(field: &mut [std::ffi::c_char], text: &str) {
    for (to, from) in field.iter_mut().zip(text.bytes().chain([0])) {
        *to = from as std::ffi::c_char;
    }
}

extern "system" fn missing() {
    eprintln!("xr_program: a function of OpenXR is missing");
    std::process::abort();
}

impl Api {
    pub fn open() -> Result<Self> {
        let instance = xr::Instance::NULL;
        // SAFETY: the names determine the functions' types; the libraries stay open.
        unsafe {
            if let Ok(loader) = libloading::Library::new("libopenxr_loader.so.1") {
                let get = loader.get::<GetInstanceProcAddr>(b"xrGetInstanceProcAddr\0");
                let get = *get.map_err(|error| error.to_string())?;
                std::mem::forget(loader);
                return Ok(Self { get, instance });
            }
            println!("without a loader of OpenXR");
            let manifest =
                std::env::var("XR_RUNTIME_JSON").map_err(|_| "no active OpenXR runtime")?;
            let folder = std::path::Path::new(&manifest)
                .parent()
                .ok_or("no folder")?;
            let library = libloading::Library::new(folder.join("libparallax_xr.so"));
            let library = library.map_err(|error| error.to_string())?;
            let negotiate = library
                .get::<FnNegotiateLoaderRuntimeInterface>(b"xrNegotiateLoaderRuntimeInterface\0");
            let negotiate = *negotiate.map_err(|error| error.to_string())?;
            std::mem::forget(library);
            let info = XrNegotiateLoaderInfo {
                ty: XrNegotiateLoaderInfo::TYPE,
                struct_version: XrNegotiateLoaderInfo::VERSION,
                struct_size: size_of::<XrNegotiateLoaderInfo>(),
                min_interface_version: 1,
                max_interface_version: 1,
                min_api_version: xr::Version::new(1, 0, 0),
                max_api_version: xr::Version::new(1, 0x3ff, 0xfff),
            };
            let mut request = XrNegotiateRuntimeRequest {
                ty: XrNegotiateRuntimeRequest::TYPE,
                struct_version: XrNegotiateRuntimeRequest::VERSION,
                struct_size: size_of::<XrNegotiateRuntimeRequest>(),
                runtime_interface_version: 0,
                runtime_api_version: xr::Version::new(0, 0, 0),
                get_instance_proc_addr: None,
            };
            let code = negotiate(&info, &mut request);
            let get = request
                .get_instance_proc_addr
                .ok_or(format!("negotiation: {code:?}"))?;
            Ok(Self { get, instance })
        }
    }

    pub fn find(&self, name: &str) -> (xr::Result, Option<VoidFunction>) {
        let name = CString::new(name).unwrap_or_default();
        let mut found = None;
        // SAFETY: a valid call.
        let code = unsafe { (self.get)(self.instance, name.as_ptr(), &mut found) };
        (code, found)
    }

    pub fn function(&self, name: &str) -> VoidFunction {
        self.find(name).1.unwrap_or(missing)
    }

    /// The information for an instance with these extensions, whose names must live as long.
    pub fn info(names: &[*const std::ffi::c_char]) -> xr::InstanceCreateInfo {
        let mut info: xr::InstanceCreateInfo = of(xr::StructureType::INSTANCE_CREATE_INFO);
        put(&mut info.application_info.application_name, "xr_program");
        info.application_info.api_version = xr::Version::new(1, 0, 20);
        info.enabled_extension_count = names.len() as u32;
        info.enabled_extension_names = names.as_ptr();
        info
    }
}
