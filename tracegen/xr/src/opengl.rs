//! OpenGL: the context of a program, and the textures of swapchains.
//!
//! OpenGL must be Mesa's zink, whose textures are images of Vulkan. The layer names the image that zink has just created
//! for a texture.

use crate::chain::output;
use crate::recorder;
use crate::state::{Code, DONE};
use crate::system::check_system;
use libloading::os::unix::Library;
use openxr_sys as xr;
use std::ffi::{c_char, c_int, c_uint, c_ulong, c_void};
use std::ptr::NonNull;
use std::sync::{Arc, OnceLock};
use xr::StructureType;

const TEXTURE_2D: c_uint = 0x0de1;
const TEXTURE_2D_ARRAY: c_uint = 0x8c1a;
const TEXTURE_CUBE_MAP: c_uint = 0x8513;
const TEXTURE_2D_MULTISAMPLE: c_uint = 0x9100;
const TEXTURE_2D_MULTISAMPLE_ARRAY: c_uint = 0x9102;
const TRUE: u8 = 1;
const NO_ERROR: c_uint = 0;
const FRAMEBUFFER: c_uint = 0x8d40;
const DRAW_FRAMEBUFFER_BINDING: c_uint = 0x8ca6;
const READ_FRAMEBUFFER_BINDING: c_uint = 0x8caa;
const DRAW_FRAMEBUFFER: c_uint = 0x8ca9;
const READ_FRAMEBUFFER: c_uint = 0x8ca8;
const COLOR_ATTACHMENT0: c_uint = 0x8ce0;
const COLOR_BUFFER_BIT: c_uint = 0x4000;
const FRAMEBUFFER_SRGB: c_uint = 0x8db9;

/// A texture target and the query of what is bound to it.
const TARGETS: [(c_uint, c_uint); 5] = [
    (TEXTURE_2D, 0x8069),
    (TEXTURE_2D_ARRAY, 0x8c1d),
    (TEXTURE_CUBE_MAP, 0x8514),
    (TEXTURE_2D_MULTISAMPLE, 0x9104),
    (TEXTURE_2D_MULTISAMPLE_ARRAY, 0x9105),
];

/// Formats of swapchains, the preferred ones first: SRGB8_ALPHA8, RGBA8, RGBA16F, SRGB8, RGB8; DEPTH_COMPONENT32F,
/// DEPTH_COMPONENT24, DEPTH_COMPONENT16, DEPTH24_STENCIL8, DEPTH32F_STENCIL8.
const FORMATS: [i64; 10] = [
    0x8c43, 0x8058, 0x881a, 0x8c41, 0x8051, 0x8cac, 0x81a6, 0x81a5, 0x88f0, 0x8cad,
];

/// Number of colour formats, which come first.
const COLORS: usize = 5;

/// Lists functions of the library by name and type.
macro_rules! functions {
    ($($field:ident: $name:literal fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Functions of GLX and OpenGL.
        struct Functions {
            $($field: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Looks all functions up. A symbol of the process may have a function's name and be a program's variable, so
            /// only the library is asked.
            unsafe fn load(get: GetProcAddress) -> Option<Self> {
                // SAFETY: the name determines the function's type.
                unsafe {
                    Some(Self {
                        $($field: std::mem::transmute::<Function, unsafe extern "C" fn($($argument),*) $(-> $result)?>(get($name.as_ptr())?),)*
                    })
                }
            }
        }
    };
}

type Function = NonNull<c_void>;
type GetProcAddress = unsafe extern "C" fn(*const c_char) -> Option<Function>;

functions! {
    current_context: c"glXGetCurrentContext" fn() -> *mut c_void;
    current_display: c"glXGetCurrentDisplay" fn() -> *mut c_void;
    current_drawable: c"glXGetCurrentDrawable" fn() -> c_ulong;
    make_current: c"glXMakeCurrent" fn(*mut c_void, c_ulong, *mut c_void) -> c_int;
    generate: c"glGenTextures" fn(c_int, *mut c_uint);
    delete: c"glDeleteTextures" fn(c_int, *const c_uint);
    bind: c"glBindTexture" fn(c_uint, c_uint);
    storage: c"glTexStorage2D" fn(c_uint, c_int, c_uint, c_int, c_int);
    array_storage: c"glTexStorage3D" fn(c_uint, c_int, c_uint, c_int, c_int, c_int);
    samples_storage: c"glTexStorage2DMultisample" fn(c_uint, c_int, c_uint, c_int, c_int, u8);
    array_samples_storage: c"glTexStorage3DMultisample" fn(c_uint, c_int, c_uint, c_int, c_int, c_int, u8);
    integer: c"glGetIntegerv" fn(c_uint, *mut c_int);
    generate_framebuffers: c"glGenFramebuffers" fn(c_int, *mut c_uint);
    delete_framebuffers: c"glDeleteFramebuffers" fn(c_int, *const c_uint);
    bind_framebuffer: c"glBindFramebuffer" fn(c_uint, c_uint);
    framebuffer_texture: c"glFramebufferTexture" fn(c_uint, c_uint, c_uint, c_int);
    clear: c"glClear" fn(c_uint);
    enable: c"glEnable" fn(c_uint);
    disable: c"glDisable" fn(c_uint);
    is_enabled: c"glIsEnabled" fn(c_uint) -> u8;
    error: c"glGetError" fn() -> c_uint;
    finish: c"glFinish" fn();
}

impl Functions {
    fn of_library() -> Result<Self, Code> {
        let missing = Code::ERROR_RUNTIME_FAILURE;
        // SAFETY: the name determines the function's type; the library stays open.
        unsafe {
            let library = Library::new("libGL.so.1").map_err(|_| missing)?;
            let get = library.get::<GetProcAddress>(b"glXGetProcAddress\0");
            let get = *get.map_err(|_| missing)?;
            std::mem::forget(library);
            Self::load(get).ok_or(missing)
        }
    }
}

/// A program's context.
#[derive(Clone)]
pub(crate) struct Context(Arc<Opened>);

struct Opened {
    gl: Functions,
    display: *mut c_void,
    drawable: c_ulong,
    context: *mut c_void,
    /// `VkDevice` handle of zink, once a texture is known.
    device: OnceLock<u64>,
}

// SAFETY: the pointers are used under the runtime's lock, in calls that may have the context.
unsafe impl Send for Opened {}
// SAFETY: as above.
unsafe impl Sync for Opened {}

/// A texture of a swapchain.
pub(crate) struct Texture {
    context: Context,
    /// Name of the texture in the program's context.
    pub name: u32,
    /// `VkImage` handle of its image.
    pub image: u64,
}

impl Drop for Texture {
    fn drop(&mut self) {
        let Opened { gl, context, .. } = &*self.context.0;
        // A program may have closed its display before, so the context is not made current here.
        // SAFETY: the context is current, and the texture is its.
        unsafe {
            if (gl.current_context)() == *context {
                (gl.delete)(1, &raw const self.name);
            }
        }
    }
}

impl Context {
    /// The context of a session, after a check.
    ///
    /// # Safety
    /// A binding with live handles.
    pub unsafe fn of_binding(
        asked: bool,
        binding: &xr::GraphicsBindingOpenGLXlibKHR,
    ) -> Result<Self, Code> {
        if !asked {
            return Err(Code::ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING);
        }
        if binding.x_display.is_null() || binding.glx_context.is_null() || binding.glx_drawable == 0
        {
            return Err(Code::ERROR_GRAPHICS_DEVICE_INVALID);
        }
        Ok(Self(Arc::new(Opened {
            gl: Functions::of_library()?,
            display: binding.x_display.cast(),
            drawable: binding.glx_drawable,
            context: binding.glx_context,
            device: OnceLock::new(),
        })))
    }

    /// Runs a function with the context current, and makes the one before current again.
    fn with<T>(&self, function: impl FnOnce(&Functions) -> T) -> Result<T, Code> {
        let Opened {
            gl,
            display,
            drawable,
            context,
            ..
        } = &*self.0;
        // SAFETY: a call that may have the context, as OpenXR demands of programs.
        unsafe {
            let before = (
                (gl.current_display)(),
                (gl.current_drawable)(),
                (gl.current_context)(),
            );
            if before.2 == *context {
                return Ok(function(gl));
            }
            if (gl.make_current)(*display, *drawable, *context) == 0 {
                return Err(Code::ERROR_GRAPHICS_DEVICE_INVALID);
            }
            let out = function(gl);
            match before.0.is_null() {
                true => (gl.make_current)(*display, 0, std::ptr::null_mut()),
                false => (gl.make_current)(before.0, before.1, before.2),
            };
            Ok(out)
        }
    }

    /// Formats of swapchains.
    pub fn formats(&self) -> Vec<i64> {
        FORMATS.to_vec()
    }

    /// `VkDevice` handle of zink; `None` before the first texture.
    pub fn device(&self) -> Option<u64> {
        self.0.device.get().copied()
    }

    /// Waits until all commands of the program have ended.
    pub fn finish(&self) -> Result<(), Code> {
        // SAFETY: the context is current.
        self.with(|gl| unsafe { (gl.finish)() })
    }

    /// Creates a texture of a swapchain.
    pub fn texture(&self, info: &xr::SwapchainCreateInfo) -> Result<Texture, Code> {
        let name = self.with(|gl| create(gl, info))??;
        let layers = info.array_size * info.face_count;
        let found = recorder::newest_image([info.width, info.height, layers, info.sample_count]);
        let Some(found) = found else {
            eprintln!(
                "parallax: expected Mesa's zink, found another OpenGL, whose textures cannot be recorded"
            );
            return Err(Code::ERROR_RUNTIME_FAILURE);
        };
        self.0.device.get_or_init(|| found.device);
        Ok(Texture {
            context: self.clone(),
            name,
            image: found.image,
        })
    }
}

/// Clears a texture as a target with and without conversion to sRGB. Zink replaces the image of a texture when a view
/// needs another format, so all views that programs need are made here, before the image is looked for.
///
/// # Safety
/// A current context, and a texture of colours.
unsafe fn draw_into(gl: &Functions, name: c_uint) {
    let (mut framebuffer, mut draw, mut read) = (0, 0, 0);
    // SAFETY: as the caller promises; the pointers are valid.
    unsafe {
        (gl.integer)(DRAW_FRAMEBUFFER_BINDING, &raw mut draw);
        (gl.integer)(READ_FRAMEBUFFER_BINDING, &raw mut read);
        let converts = (gl.is_enabled)(FRAMEBUFFER_SRGB) == TRUE;
        (gl.generate_framebuffers)(1, &raw mut framebuffer);
        (gl.bind_framebuffer)(FRAMEBUFFER, framebuffer);
        (gl.framebuffer_texture)(FRAMEBUFFER, COLOR_ATTACHMENT0, name, 0);
        for switch in [gl.enable, gl.disable] {
            switch(FRAMEBUFFER_SRGB);
            (gl.clear)(COLOR_BUFFER_BIT);
            (gl.finish)();
        }
        if converts {
            (gl.enable)(FRAMEBUFFER_SRGB);
        }
        (gl.bind_framebuffer)(DRAW_FRAMEBUFFER, draw as c_uint);
        (gl.bind_framebuffer)(READ_FRAMEBUFFER, read as c_uint);
        (gl.delete_framebuffers)(1, &raw const framebuffer);
    }
}

/// Creates a texture in the current context, which keeps its state.
fn create(gl: &Functions, info: &xr::SwapchainCreateInfo) -> Result<u32, Code> {
    let size = [info.width, info.height, info.array_size].map(|of| of as c_int);
    let (levels, samples) = (info.mip_count as c_int, info.sample_count as c_int);
    let [width, height, layers] = size;
    let format = info.format as c_uint;
    let (target, bound) = TARGETS[match (info.face_count, samples, layers) {
        (6, ..) => 2,
        (_, 1, 1) => 0,
        (_, 1, _) => 1,
        (_, _, 1) => 3,
        _ => 4,
    }];
    let (mut name, mut before) = (0, 0);
    // SAFETY: a current context; the pointers are valid.
    let error = unsafe {
        // An earlier error of the program is the program's. A lost context has one in each call.
        (0..16).find(|_| (gl.error)() == NO_ERROR);
        (gl.integer)(bound, &raw mut before);
        (gl.generate)(1, &raw mut name);
        (gl.bind)(target, name);
        match target {
            TEXTURE_2D | TEXTURE_CUBE_MAP => (gl.storage)(target, levels, format, width, height),
            TEXTURE_2D_ARRAY => (gl.array_storage)(target, levels, format, width, height, layers),
            TEXTURE_2D_MULTISAMPLE => {
                (gl.samples_storage)(target, samples, format, width, height, TRUE)
            }
            _ => (gl.array_samples_storage)(target, samples, format, width, height, layers, TRUE),
        }
        (gl.bind)(target, before as c_uint);
        if FORMATS[..COLORS].contains(&info.format) {
            draw_into(gl, name);
        }
        (gl.error)()
    };
    match error {
        NO_ERROR => Ok(name),
        // SAFETY: as above.
        _ => unsafe {
            (gl.delete)(1, &raw const name);
            Err(Code::ERROR_OUT_OF_MEMORY)
        },
    }
}

api! {
    fn get_requirements(instance: xr::Instance, system: xr::SystemId, of: *mut xr::GraphicsRequirementsOpenGLKHR) |state| {
        let instance = state.instance(instance)?;
        check_system(system)?;
        let of = output(of, StructureType::GRAPHICS_REQUIREMENTS_OPENGL_KHR)?;
        of.min_api_version_supported = xr::Version::new(3, 3, 0);
        of.max_api_version_supported = xr::Version::new(4, 6, 0xfff);
        instance.asked_for_opengl = true;
        DONE
    }
}
