//! The only module that calls the library: safe functions for OpenGL through OSMesa.
//!
//! OpenGL checks names and the sizes of buffers and compressed images, and reports an error instead
//! of acting ([`Gl::check`]). This module ensures the rest: the context is current on the one
//! thread that can reach a [`Gl`] (which is neither `Send` nor `Sync`, and a thread has at most
//! one), slices are as long as the texels that they must hold, and draws stay within their vertex
//! buffers.

use crate::OpenError;
use glow::HasContext;
use libloading::Library;
use raster::error::RasterError;
use std::cell::Cell;
use std::ffi::{CStr, c_char, c_int, c_uchar, c_uint, c_void};
use std::ptr::NonNull;

mod buffers;
mod drawing;
mod textures;

pub use buffers::Buffer;
pub use drawing::{Attribute, State, Vertices};
pub use glow::{
    NativeFramebuffer as Framebuffer, NativeProgram as Program, NativeSampler as Sampler,
    NativeTexture as Texture,
};

/// The library's file name.
const LIBRARY: &str = "libOSMesa.so.8";

type CreateContext = unsafe extern "C" fn(*const c_int, *mut c_void) -> *mut c_void;
type MakeCurrent = unsafe extern "C" fn(*mut c_void, *mut c_void, c_uint, c_int, c_int) -> c_uchar;
type GetProcAddress = unsafe extern "C" fn(*const c_char) -> *const c_void;
type DestroyContext = unsafe extern "C" fn(*mut c_void);
type ClipControl = unsafe extern "C" fn(c_uint, c_uint);
type ProvokingVertex = unsafe extern "C" fn(c_uint);

/// The library's own functions.
struct Functions {
    create: CreateContext,
    make_current: MakeCurrent,
    find: GetProcAddress,
    destroy: DestroyContext,
}

impl Functions {
    fn of(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: the types are those of `osmesa.h`.
        unsafe {
            Ok(Self {
                create: *library.get(b"OSMesaCreateContextAttribs\0")?,
                make_current: *library.get(b"OSMesaMakeCurrent\0")?,
                find: *library.get(b"OSMesaGetProcAddress\0")?,
                destroy: *library.get(b"OSMesaDestroyContext\0")?,
            })
        }
    }
}

/// Attributes of the context, as pairs of `osmesa.h`: RGBA, no depth buffer, core profile, OpenGL
/// 4.5.
const CONTEXT: [c_int; 13] = [
    0x22, 0x1908, 0x30, 0, 0x31, 0, 0x33, 0x34, 0x36, 4, 0x37, 5, 0,
];
/// Edge of the surface that a context requires. Nothing is drawn into it.
const SURFACE_PX: usize = 16;

thread_local! {
    static HAS_CONTEXT: Cell<bool> = const { Cell::new(false) };
}

/// A context of the library, current on this thread.
pub struct Gl {
    gl: glow::Context,
    context: NonNull<c_void>,
    destroy: DestroyContext,
    /// The context draws into it until it has a framebuffer.
    _surface: Box<[u8]>,
    /// Dropped last, because everything above uses its code or memory.
    _library: Library,
}

impl Gl {
    /// Loads the library and makes a context current on this thread.
    ///
    /// # Errors
    /// No library, a library without OpenGL 4.5, or a thread that already has a context.
    pub fn open() -> Result<Self, OpenError> {
        // SAFETY: loading runs only the initialisers of Mesa and LLVM.
        let library = unsafe { Library::new(LIBRARY) }
            .map_err(|e| OpenError::NoLibrary(LIBRARY, e.to_string()))?;
        let lacks = |what: &str| RasterError::Unsupported {
            driver: LIBRARY.to_owned(),
            what: what.to_owned(),
        };
        let Functions {
            create,
            make_current,
            find,
            destroy,
        } = Functions::of(&library).map_err(|e| lacks(&e.to_string()))?;
        if HAS_CONTEXT.get() {
            return Err(lacks("a second context on one thread").into());
        }
        // SAFETY: the list ends with 0, and no context is shared.
        let context = unsafe { create(CONTEXT.as_ptr(), std::ptr::null_mut()) };
        let context = NonNull::new(context).ok_or_else(|| {
            lacks("a context of OpenGL 4.5 (GALLIUM_DRIVER=softpipe needs MESA_GL_VERSION_OVERRIDE=4.5 and MESA_GLSL_VERSION_OVERRIDE=450)")
        })?;
        let mut surface = vec![0; 4 * SURFACE_PX * SURFACE_PX].into_boxed_slice();
        let edge = SURFACE_PX as c_int;
        // SAFETY: the surface has four bytes per pixel and lives as long as the context.
        let is_current = unsafe {
            make_current(
                context.as_ptr(),
                surface.as_mut_ptr().cast(),
                glow::UNSIGNED_BYTE,
                edge,
                edge,
            )
        };
        if is_current == 0 {
            // SAFETY: the context is not current anywhere.
            unsafe { destroy(context.as_ptr()) };
            return Err(lacks("a context that can be made current").into());
        }
        // SAFETY: the context is current, and the functions are those of its library.
        let gl = unsafe { glow::Context::from_loader_function_cstr(|name| find(name.as_ptr())) };
        HAS_CONTEXT.set(true);
        let gl = Self {
            gl,
            context,
            destroy,
            _surface: surface,
            _library: library,
        };
        let function = |name: &CStr| {
            // SAFETY: the context is current.
            let found = unsafe { find(name.as_ptr()) };
            if found.is_null() {
                return Err(lacks(&name.to_string_lossy()));
            }
            Ok(found)
        };
        let clip_control = function(c"glClipControl")?;
        let provoking_vertex = function(c"glProvokingVertex")?;
        // SAFETY: as above; functions of OpenGL 4.5, which the context has, with the types of its specification.
        unsafe {
            // Depth from 0 to 1, as in the other APIs. The shader reverses the rows
            // (conventions_opengl.wgsl).
            std::mem::transmute::<*const c_void, ClipControl>(clip_control)(
                glow::LOWER_LEFT,
                glow::ZERO_TO_ONE,
            );
            // The first vertex, as in the other APIs. llvmpipe interpolates starting there, so
            // another one changes the last bits of coordinates and depths.
            std::mem::transmute::<*const c_void, ProvokingVertex>(provoking_vertex)(
                glow::FIRST_VERTEX_CONVENTION,
            );
            gl.gl.enable(glow::FRAMEBUFFER_SRGB);
            gl.gl.enable(glow::DEPTH_TEST);
            gl.gl.enable(glow::SCISSOR_TEST);
            gl.gl.blend_func_separate(
                glow::SRC_ALPHA,
                glow::ONE_MINUS_SRC_ALPHA,
                glow::ONE,
                glow::ONE_MINUS_SRC_ALPHA,
            );
            gl.gl.pixel_store_i32(glow::UNPACK_ALIGNMENT, 1);
            gl.gl.pixel_store_i32(glow::PACK_ALIGNMENT, 1);
        }
        gl.check("opening the context")?;
        Ok(gl)
    }

    /// Renderer and version strings of the driver.
    pub fn driver(&self) -> String {
        // SAFETY: see the module.
        let [renderer, version] = [glow::RENDERER, glow::VERSION]
            .map(|name| unsafe { self.gl.get_parameter_string(name) });
        format!("{renderer}, {version}")
    }

    /// A limit of the driver.
    pub fn limit(&self, name: u32) -> u64 {
        // SAFETY: see the module.
        let limit = unsafe { self.gl.get_parameter_i32(name) };
        limit.max(0) as u64
    }

    /// The driver's errors since the last call.
    ///
    /// # Errors
    /// [`RasterError::Driver`].
    pub fn check(&self, doing: &'static str) -> Result<(), RasterError> {
        // SAFETY: see the module.
        let error = unsafe { self.gl.get_error() };
        let message = match error {
            glow::NO_ERROR => return Ok(()),
            glow::INVALID_ENUM => "invalid enumerant".to_owned(),
            glow::INVALID_VALUE => "invalid value".to_owned(),
            glow::INVALID_OPERATION => "invalid operation".to_owned(),
            glow::INVALID_FRAMEBUFFER_OPERATION => "incomplete framebuffer".to_owned(),
            glow::OUT_OF_MEMORY => "out of memory".to_owned(),
            other => format!("error {other:#x}"),
        };
        Err(RasterError::Driver { doing, message })
    }

    /// Waits for everything drawn.
    pub fn finish(&self) {
        // SAFETY: see the module.
        unsafe { self.gl.finish() };
    }
}

impl Drop for Gl {
    fn drop(&mut self) {
        // SAFETY: the library created the context, and it is not used any more.
        unsafe { (self.destroy)(self.context.as_ptr()) };
        HAS_CONTEXT.set(false);
    }
}

/// The error for an object that could not be created.
fn made(what: &'static str) -> impl Fn(String) -> RasterError {
    move |message| RasterError::Driver {
        doing: match what {
            "a shader" => "compiling a shader",
            "a program" => "linking a program",
            _ => "making an object",
        },
        message: format!("{what}: {message}"),
    }
}
