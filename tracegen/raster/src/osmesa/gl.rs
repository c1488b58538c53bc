//! The only module that calls the library: safe functions for OpenGL through OSMesa.
//!
//! OpenGL checks names and the sizes of buffers and compressed images, and reports an error instead
//! of acting ([`Gl::check`]). This module ensures the rest: the context is current on the one
//! thread that can reach a [`Gl`] (which is neither `Send` nor `Sync`, and a thread has at most
//! one), slices are as long as the texels that they must hold, and draws stay within their vertex
//! buffers.

use crate::error::RasterError;
use glow::HasContext;
use libloading::Library;
use std::cell::Cell;
use std::ffi::{CStr, c_char, c_int, c_uchar, c_uint, c_void};
use std::ops::Range;
use std::ptr::NonNull;

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

/// A buffer and its length.
#[derive(Clone, Copy, Debug)]
pub struct Buffer {
    name: glow::NativeBuffer,
    /// Length in bytes.
    pub bytes: u64,
}

/// A vertex attribute.
#[derive(Clone, Copy, Debug)]
pub struct Attribute {
    /// Buffer that holds it.
    pub buffer: Buffer,
    /// Location in the shader.
    pub location: u32,
    /// Number of components per value.
    pub components: i32,
    /// `FLOAT`, `UNSIGNED_SHORT` (0 to 1 in the shader) or `UNSIGNED_INT` (unconverted).
    pub kind: u32,
    /// Bytes from one value to the next.
    pub stride: u64,
    /// Bytes before the first value.
    pub offset: u64,
    /// One value per instance instead of one per vertex.
    pub per_instance: bool,
}

/// A vertex array.
#[derive(Clone, Copy, Debug)]
pub struct Vertices {
    name: glow::NativeVertexArray,
    /// Number of vertices. All of them are drawn.
    pub count: u32,
    instances: u32,
}

/// Depth test and blending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Depth comparison.
    pub depth: u32,
    /// Depth is written.
    pub writes_depth: bool,
    /// Colour is written.
    pub writes_color: bool,
    /// Colour is blended by its alpha.
    pub blends: bool,
    /// Back faces are culled.
    pub culls: bool,
    /// Front faces wind clockwise on a screen with y up.
    pub clockwise: bool,
    /// Slope and constant added to depth.
    pub offset: [f32; 2],
}

impl Gl {
    /// Loads the library and makes a context current on this thread.
    ///
    /// # Errors
    /// No library, a library without OpenGL 4.5, or a thread that already has a context.
    pub fn open() -> Result<Self, RasterError> {
        // SAFETY: loading runs only the initialisers of Mesa and LLVM.
        let library = unsafe { Library::new(LIBRARY) }
            .map_err(|e| RasterError::NoLibrary(LIBRARY, e.to_string()))?;
        let lacks = |what: &str| RasterError::Unsupported {
            driver: LIBRARY.to_owned(),
            what: what.to_owned(),
        };
        let missing = |e: libloading::Error| lacks(&e.to_string());
        // SAFETY: the types are those of `osmesa.h`.
        let (create, make_current, find, destroy) = unsafe {
            (
                *library
                    .get::<CreateContext>(b"OSMesaCreateContextAttribs\0")
                    .map_err(missing)?,
                *library
                    .get::<MakeCurrent>(b"OSMesaMakeCurrent\0")
                    .map_err(missing)?,
                *library
                    .get::<GetProcAddress>(b"OSMesaGetProcAddress\0")
                    .map_err(missing)?,
                *library
                    .get::<DestroyContext>(b"OSMesaDestroyContext\0")
                    .map_err(missing)?,
            )
        };
        if HAS_CONTEXT.get() {
            return Err(lacks("a second context on one thread"));
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
            return Err(lacks("a context that can be made current"));
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

    /// Creates a buffer with contents.
    ///
    /// # Errors
    /// Driver errors.
    pub fn buffer(&self, contents: &[u8]) -> Result<Buffer, RasterError> {
        let buffer = self.empty_buffer(contents.len() as u64)?;
        self.write(buffer, 0, contents);
        self.check("filling a buffer")?;
        Ok(buffer)
    }

    /// Creates a buffer of this size.
    ///
    /// # Errors
    /// Driver errors, and sizes beyond the driver's integer type.
    pub fn empty_buffer(&self, bytes: u64) -> Result<Buffer, RasterError> {
        let size = i32::try_from(bytes).map_err(|_| RasterError::TooLarge {
            what: "bytes of a buffer".into(),
            found: bytes,
            limit: i32::MAX as u64,
        })?;
        // SAFETY: see the module.
        let name = unsafe {
            let name = self.gl.create_buffer().map_err(made("a buffer"))?;
            self.gl.bind_buffer(glow::COPY_WRITE_BUFFER, Some(name));
            self.gl
                .buffer_data_size(glow::COPY_WRITE_BUFFER, size, glow::DYNAMIC_DRAW);
            name
        };
        self.check("making a buffer")?;
        Ok(Buffer { name, bytes })
    }

    /// Writes into a buffer.
    pub fn write(&self, buffer: Buffer, offset: u64, bytes: &[u8]) {
        // SAFETY: see the module. The driver refuses writes beyond the end.
        unsafe {
            self.gl
                .bind_buffer(glow::COPY_WRITE_BUFFER, Some(buffer.name));
            (self.gl).buffer_sub_data_u8_slice(glow::COPY_WRITE_BUFFER, offset as i32, bytes);
        }
    }

    /// Reads the start of a buffer after all draws have written it.
    pub fn read(&self, buffer: Buffer, into: &mut [u8]) {
        // SAFETY: see the module. The driver refuses reads beyond the end.
        unsafe {
            self.gl.memory_barrier(glow::BUFFER_UPDATE_BARRIER_BIT);
            self.gl
                .bind_buffer(glow::COPY_READ_BUFFER, Some(buffer.name));
            self.gl.get_buffer_sub_data(glow::COPY_READ_BUFFER, 0, into);
        }
    }

    /// Binds a uniform block.
    pub fn bind_uniform(&self, binding: u32, buffer: Buffer) {
        self.bind_buffer(glow::UNIFORM_BUFFER, binding, buffer);
    }

    /// Binds a storage block.
    pub fn bind_storage(&self, binding: u32, buffer: Buffer) {
        self.bind_buffer(glow::SHADER_STORAGE_BUFFER, binding, buffer);
    }

    fn bind_buffer(&self, target: u32, binding: u32, buffer: Buffer) {
        // SAFETY: see the module. Mesa bounds-checks buffer accesses of shaders.
        unsafe { self.gl.bind_buffer_base(target, binding, Some(buffer.name)) };
    }

    /// Creates a texture without contents, an array if `layers` is given.
    ///
    /// # Errors
    /// Driver errors.
    pub fn texture(
        &self,
        format: u32,
        [width, height]: [u32; 2],
        levels: u32,
        layers: Option<u32>,
    ) -> Result<Texture, RasterError> {
        let (width, height, levels) = (width as i32, height as i32, levels as i32);
        // SAFETY: see the module.
        let texture = unsafe {
            let texture = self.gl.create_texture().map_err(made("a texture"))?;
            let target = target(layers.is_some());
            self.gl.bind_texture(target, Some(texture));
            match layers {
                None => self
                    .gl
                    .tex_storage_2d(target, levels, format, width, height),
                Some(n) => {
                    (self.gl).tex_storage_3d(target, levels, format, width, height, n as i32)
                }
            }
            texture
        };
        self.check("making a texture")?;
        Ok(texture)
    }

    /// Fills a level of a texture, row by row: RGBA8, or blocks of a compressed `format`.
    ///
    /// # Errors
    /// Driver errors, and compressed blocks whose size does not match.
    ///
    /// # Panics
    /// If the number of RGBA8 texels does not match the size.
    pub fn fill(
        &self,
        texture: Texture,
        level: u32,
        [width, height]: [u32; 2],
        compressed: Option<u32>,
        texels: &[u8],
    ) -> Result<(), RasterError> {
        let (at, w, h) = (level as i32, width as i32, height as i32);
        // SAFETY: see the module. The driver checks the length of compressed levels.
        unsafe {
            self.gl.bind_texture(glow::TEXTURE_2D, Some(texture));
            if let Some(format) = compressed {
                let blocks = glow::CompressedPixelUnpackData::Slice(texels);
                (self.gl).compressed_tex_sub_image_2d(
                    glow::TEXTURE_2D,
                    at,
                    0,
                    0,
                    w,
                    h,
                    format,
                    blocks,
                );
            } else {
                assert_eq!(
                    texels.len() as u64,
                    4 * u64::from(width) * u64::from(height)
                );
                let texels = glow::PixelUnpackData::Slice(Some(texels));
                let (format, kind) = (glow::RGBA, glow::UNSIGNED_BYTE);
                (self.gl).tex_sub_image_2d(glow::TEXTURE_2D, at, 0, 0, w, h, format, kind, texels);
            }
        }
        self.check("uploading a texture")
    }

    /// Creates a sampler with integer parameters and the highest level that it reads.
    ///
    /// # Errors
    /// Driver errors.
    pub fn sampler(&self, parameters: &[(u32, u32)], max_lod: f32) -> Result<Sampler, RasterError> {
        // SAFETY: see the module.
        let sampler = unsafe {
            let sampler = self.gl.create_sampler().map_err(made("a sampler"))?;
            for &(name, value) in parameters {
                self.gl.sampler_parameter_i32(sampler, name, value as i32);
            }
            self.gl
                .sampler_parameter_f32(sampler, glow::TEXTURE_MAX_LOD, max_lod);
            sampler
        };
        self.check("making a sampler")?;
        Ok(sampler)
    }

    /// Binds a texture and a sampler to a unit.
    pub fn bind_texture(&self, unit: u32, is_array: bool, texture: Texture, sampler: Sampler) {
        // SAFETY: see the module.
        unsafe {
            self.gl.active_texture(glow::TEXTURE0 + unit);
            self.gl.bind_texture(target(is_array), Some(texture));
            self.gl.bind_sampler(unit, Some(sampler));
        }
    }

    /// Creates a framebuffer from an optional colour texture and a depth texture or a layer of one.
    ///
    /// # Errors
    /// Driver errors.
    pub fn framebuffer(
        &self,
        color: Option<Texture>,
        depth: Texture,
        layer: Option<u32>,
    ) -> Result<Framebuffer, RasterError> {
        let target = glow::FRAMEBUFFER;
        // SAFETY: see the module.
        let (framebuffer, status) = unsafe {
            let framebuffer = self
                .gl
                .create_framebuffer()
                .map_err(made("a framebuffer"))?;
            self.gl.bind_framebuffer(target, Some(framebuffer));
            match layer {
                None => {
                    (self.gl).framebuffer_texture(target, glow::DEPTH_ATTACHMENT, Some(depth), 0)
                }
                Some(layer) => (self.gl).framebuffer_texture_layer(
                    target,
                    glow::DEPTH_ATTACHMENT,
                    Some(depth),
                    0,
                    layer as i32,
                ),
            }
            if color.is_some() {
                (self.gl).framebuffer_texture(target, glow::COLOR_ATTACHMENT0, color, 0);
            }
            let drawn = color.map_or(glow::NONE, |_| glow::COLOR_ATTACHMENT0);
            self.gl.draw_buffers(&[drawn]);
            (framebuffer, self.gl.check_framebuffer_status(target))
        };
        self.check("making a framebuffer")?;
        if status == glow::FRAMEBUFFER_COMPLETE {
            return Ok(framebuffer);
        }
        Err(made("a framebuffer")(format!("status {status:#x}")))
    }

    /// Sets the framebuffer, its size, and the rectangle for later draws.
    pub fn target(&self, framebuffer: Framebuffer, size_px: [u32; 2], scissor: [[u32; 2]; 2]) {
        let [[x, y], [width, height]] = scissor.map(|pair| pair.map(|px| px as i32));
        // SAFETY: see the module.
        unsafe {
            self.gl
                .bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            self.gl.viewport(0, 0, size_px[0] as i32, size_px[1] as i32);
            self.gl.scissor(x, y, width, height);
        }
    }

    /// Clears the depth of the current target to the farthest value.
    pub fn clear_depth(&self) {
        // SAFETY: see the module.
        unsafe {
            self.gl.depth_mask(true);
            self.gl.clear_buffer_f32_slice(glow::DEPTH, 0, &[1.0]);
        }
    }

    /// The colours of a framebuffer: sRGB RGBA8, row by row.
    pub fn pixels(&self, framebuffer: Framebuffer, [width, height]: [u32; 2]) -> Vec<u8> {
        let mut pixels = vec![0; 4 * width as usize * height as usize];
        let into = glow::PixelPackData::Slice(Some(&mut pixels));
        let (width, height) = (width as i32, height as i32);
        // SAFETY: see the module. The vector has four bytes per pixel.
        unsafe {
            self.gl
                .bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            self.gl
                .read_pixels(0, 0, width, height, glow::RGBA, glow::UNSIGNED_BYTE, into);
        }
        pixels
    }

    /// Depth of a framebuffer, row by row.
    pub fn depths(&self, framebuffer: Framebuffer, [width, height]: [u32; 2]) -> Vec<f32> {
        let mut depths = vec![0.0_f32; width as usize * height as usize];
        let into = glow::PixelPackData::Slice(Some(bytemuck::cast_slice_mut(&mut depths)));
        let (width, height) = (width as i32, height as i32);
        // SAFETY: see the module. The vector has one float per pixel.
        unsafe {
            self.gl
                .bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            (self.gl).read_pixels(
                0,
                0,
                width,
                height,
                glow::DEPTH_COMPONENT,
                glow::FLOAT,
                into,
            );
        }
        depths
    }

    /// Compiles and links a program. Without a fragment shader it writes only depth.
    ///
    /// # Errors
    /// The compiler's message.
    pub fn program(&self, vertex: &str, fragment: Option<&str>) -> Result<Program, RasterError> {
        let stages = [
            (glow::VERTEX_SHADER, Some(vertex)),
            (glow::FRAGMENT_SHADER, fragment),
        ];
        // SAFETY: see the module.
        unsafe {
            let program = self.gl.create_program().map_err(made("a program"))?;
            for (stage, source) in stages {
                let Some(source) = source else { continue };
                let shader = self.gl.create_shader(stage).map_err(made("a shader"))?;
                self.gl.shader_source(shader, source);
                self.gl.compile_shader(shader);
                if !self.gl.get_shader_compile_status(shader) {
                    return Err(made("a shader")(self.gl.get_shader_info_log(shader)));
                }
                self.gl.attach_shader(program, shader);
            }
            self.gl.link_program(program);
            if !self.gl.get_program_link_status(program) {
                return Err(made("a program")(self.gl.get_program_info_log(program)));
            }
            Ok(program)
        }
    }

    /// Creates a vertex array with as many vertices as all attributes hold.
    ///
    /// # Errors
    /// Driver errors.
    pub fn vertices(&self, attributes: &[Attribute]) -> Result<Vertices, RasterError> {
        // SAFETY: see the module.
        let name = unsafe {
            let name = self.gl.create_vertex_array().map_err(made("vertices"))?;
            self.gl.bind_vertex_array(Some(name));
            for a in attributes {
                let (stride, offset) = (a.stride as i32, a.offset as i32);
                self.gl.bind_buffer(glow::ARRAY_BUFFER, Some(a.buffer.name));
                self.gl.enable_vertex_attrib_array(a.location);
                if a.kind == glow::UNSIGNED_INT {
                    (self.gl).vertex_attrib_pointer_i32(
                        a.location,
                        a.components,
                        a.kind,
                        stride,
                        offset,
                    );
                } else {
                    let normalised = a.kind != glow::FLOAT;
                    (self.gl).vertex_attrib_pointer_f32(
                        a.location,
                        a.components,
                        a.kind,
                        normalised,
                        stride,
                        offset,
                    );
                }
                self.gl
                    .vertex_attrib_divisor(a.location, u32::from(a.per_instance));
            }
            name
        };
        self.check("describing vertices")?;
        // Only whole strides count: an attribute's last value ends within its stride.
        let held = |per_instance: bool| {
            let of_kind = attributes.iter().filter(|a| a.per_instance == per_instance);
            of_kind
                .map(|a| a.buffer.bytes / a.stride)
                .min()
                .unwrap_or(0)
        };
        Ok(Vertices {
            name,
            count: held(false).min(u64::from(u32::MAX)) as u32,
            instances: held(true).min(u64::from(u32::MAX)) as u32,
        })
    }

    /// Sets depth test and blending.
    pub fn set(&self, state: &State) {
        let switch = |name, on: bool| {
            // SAFETY: see the module.
            unsafe {
                if on {
                    self.gl.enable(name)
                } else {
                    self.gl.disable(name)
                }
            }
        };
        switch(glow::BLEND, state.blends);
        switch(glow::CULL_FACE, state.culls);
        switch(glow::POLYGON_OFFSET_FILL, state.offset != [0.0; 2]);
        let color = state.writes_color;
        // SAFETY: see the module.
        unsafe {
            self.gl.depth_func(state.depth);
            self.gl.depth_mask(state.writes_depth);
            self.gl.color_mask(color, color, color, color);
            // Reversed, because rows are reversed.
            self.gl
                .front_face(if state.clockwise { glow::CCW } else { glow::CW });
            self.gl.polygon_offset(state.offset[0], state.offset[1]);
        }
    }

    /// Sets the program for later draws.
    pub fn use_program(&self, program: Program) {
        // SAFETY: see the module.
        unsafe { self.gl.use_program(Some(program)) };
    }

    /// Draws triangles from all vertices, once per instance of the range.
    ///
    /// # Panics
    /// If there are fewer instances.
    pub fn draw(&self, vertices: &Vertices, instances: Range<u32>) {
        assert!(instances.end <= vertices.instances, "{instances:?}");
        let (count, number) = (vertices.count as i32, instances.len() as i32);
        // SAFETY: see the module. The attributes hold all of them.
        unsafe {
            self.gl.bind_vertex_array(Some(vertices.name));
            (self.gl).draw_arrays_instanced_base_instance(
                glow::TRIANGLES,
                0,
                count,
                number,
                instances.start,
            );
        }
    }

    /// Draws one triangle whose shader needs no vertices.
    pub fn draw_whole(&self, nothing: &Vertices) {
        // SAFETY: see the module. Without attributes nothing is read.
        unsafe {
            self.gl.bind_vertex_array(Some(nothing.name));
            self.gl.draw_arrays(glow::TRIANGLES, 0, 3);
        }
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

fn target(is_array: bool) -> u32 {
    if is_array {
        glow::TEXTURE_2D_ARRAY
    } else {
        glow::TEXTURE_2D
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
