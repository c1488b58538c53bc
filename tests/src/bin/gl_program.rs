//! A small OpenGL program that renders a stereo picture without a window, for the tests of `tracegen app --gl`.
//!
//! Every texel holds its own coordinates and the filter is nearest, so the colour of each pixel identifies the
//! texel that it shows.
//!
//!     gl_program FRAMES PICTURE

use glow::HasContext;
use std::error::Error;
use std::ffi::{CString, c_char, c_int, c_void};
use std::io::Write;

/// Size of an eye's half of the picture.
const EYE_PX: [i32; 2] = [240, 200];
/// Width and height of the texture.
const TEXELS: i32 = 64;

const VERTEX_SHADER: &str = "#version 330 core
uniform vec4 place; // offset in x and y, scale, slope
out vec2 at;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    at = corner * 1.5 - 0.2;
    vec2 position = (corner * 2.0 - 1.0) * place.z + place.xy;
    float w = 1.0 + place.w * corner.y;
    gl_Position = vec4(position * w, place.z * w, w);
}";

const FRAGMENT_SHADER: &str = "#version 330 core
uniform sampler2D texels;
in vec2 at;
out vec4 color;
void main() { color = texture(texels, at); }";

/// Entry point of EGL that looks up functions.
type GetProcAddress = unsafe extern "C" fn(*const c_char) -> *const c_void;

/// Creates an OpenGL context without a surface and makes it current.
///
/// # Safety
/// The library stays loaded as long as the context is used.
unsafe fn context(egl: &libloading::Library) -> Result<glow::Context, Box<dyn Error>> {
    type Handle = *const c_void;
    const NONE: c_int = 0x3038;
    const SURFACELESS: c_int = 0x31DD;
    const OPENGL_API: c_int = 0x30A2;
    const PBUFFER: [c_int; 4] = [0x3033, 1, 0x3040, 8];
    const VERSION_3_3: [c_int; 4] = [0x3098, 3, 0x30FB, 3];
    let mut config: Handle = std::ptr::null();
    let mut count = 0;
    let list = |pairs: [c_int; 4]| [pairs[0], pairs[1], pairs[2], pairs[3], NONE];
    // SAFETY: the signatures are those of EGL 1.5, and all pointers are valid for the calls.
    unsafe {
        let display: libloading::Symbol<'_, unsafe extern "C" fn(c_int, Handle, Handle) -> Handle> =
            egl.get(b"eglGetPlatformDisplay\0")?;
        let initialize: libloading::Symbol<
            '_,
            unsafe extern "C" fn(Handle, *mut c_int, *mut c_int) -> c_int,
        > = egl.get(b"eglInitialize\0")?;
        let bind: libloading::Symbol<'_, unsafe extern "C" fn(c_int) -> c_int> =
            egl.get(b"eglBindAPI\0")?;
        let choose: libloading::Symbol<
            '_,
            unsafe extern "C" fn(Handle, *const c_int, *mut Handle, c_int, *mut c_int) -> c_int,
        > = egl.get(b"eglChooseConfig\0")?;
        let create: libloading::Symbol<
            '_,
            unsafe extern "C" fn(Handle, Handle, Handle, *const c_int) -> Handle,
        > = egl.get(b"eglCreateContext\0")?;
        let current: libloading::Symbol<
            '_,
            unsafe extern "C" fn(Handle, Handle, Handle, Handle) -> c_int,
        > = egl.get(b"eglMakeCurrent\0")?;
        let address: libloading::Symbol<'_, GetProcAddress> = egl.get(b"eglGetProcAddress\0")?;
        let null = std::ptr::null();
        let display = display(SURFACELESS, null, null);
        if initialize(display, std::ptr::null_mut(), std::ptr::null_mut()) == 0 {
            return Err("EGL has no display without a surface".into());
        }
        let configs = list(PBUFFER);
        if bind(OPENGL_API) == 0
            || choose(display, configs.as_ptr(), &mut config, 1, &mut count) == 0
            || count == 0
        {
            return Err("EGL has no configuration for OpenGL".into());
        }
        let context = create(display, config, null, list(VERSION_3_3).as_ptr());
        if context.is_null() || current(display, null, null, context) == 0 {
            return Err("EGL has no context of OpenGL 3.3".into());
        }
        Ok(glow::Context::from_loader_function(|name| {
            CString::new(name).map_or(null, |name| address(name.as_ptr()))
        }))
    }
}

/// Compiles the shaders.
///
/// # Safety
/// The context is current.
unsafe fn program(gl: &glow::Context) -> Result<glow::Program, String> {
    // SAFETY: as the caller promises.
    unsafe {
        let program = gl.create_program()?;
        for (kind, source) in [
            (glow::VERTEX_SHADER, VERTEX_SHADER),
            (glow::FRAGMENT_SHADER, FRAGMENT_SHADER),
        ] {
            let shader = gl.create_shader(kind)?;
            gl.shader_source(shader, source);
            gl.compile_shader(shader);
            if !gl.get_shader_compile_status(shader) {
                return Err(gl.get_shader_info_log(shader));
            }
            gl.attach_shader(program, shader);
        }
        gl.link_program(program);
        if !gl.get_program_link_status(program) {
            return Err(gl.get_program_info_log(program));
        }
        gl.use_program(Some(program));
        Ok(program)
    }
}

/// Creates the texture whose texels hold their coordinates.
///
/// # Safety
/// The context is current.
unsafe fn texture(
    gl: &glow::Context,
    texels: Option<&[u8]>,
    size: [i32; 2],
) -> Result<glow::Texture, String> {
    // SAFETY: as the caller promises.
    unsafe {
        let texture = gl.create_texture()?;
        gl.bind_texture(glow::TEXTURE_2D, Some(texture));
        gl.tex_image_2d(
            glow::TEXTURE_2D,
            0,
            glow::RGBA8 as i32,
            size[0],
            size[1],
            0,
            glow::RGBA,
            glow::UNSIGNED_BYTE,
            glow::PixelUnpackData::Slice(texels),
        );
        for filter in [glow::TEXTURE_MIN_FILTER, glow::TEXTURE_MAG_FILTER] {
            gl.tex_parameter_i32(glow::TEXTURE_2D, filter, glow::NEAREST as i32);
        }
        gl.tex_parameter_i32(glow::TEXTURE_2D, glow::TEXTURE_MAX_LEVEL, 0);
        Ok(texture)
    }
}

/// A framebuffer with a colour texture. It stays bound.
///
/// # Safety
/// The context is current.
unsafe fn framebuffer_of(
    gl: &glow::Context,
    color: glow::Texture,
) -> Result<glow::Framebuffer, String> {
    let to = glow::COLOR_ATTACHMENT0;
    // SAFETY: as the caller promises.
    unsafe {
        let framebuffer = gl.create_framebuffer()?;
        gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
        gl.framebuffer_texture_2d(glow::FRAMEBUFFER, to, glow::TEXTURE_2D, Some(color), 0);
        Ok(framebuffer)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let frames: i32 = arguments.next().ok_or("FRAMES is missing")?.parse()?;
    let picture = arguments.next().ok_or("PICTURE is missing")?;
    let [width, height] = [2 * EYE_PX[0], EYE_PX[1]];
    let mut pixels = vec![0; (4 * width * height) as usize];
    // SAFETY: the library stays loaded to the end of this block, and the context is current in it.
    unsafe {
        let egl = libloading::Library::new("libEGL.so.1")?;
        let gl = context(&egl)?;
        println!("{}", gl.get_parameter_string(glow::RENDERER));
        let program = program(&gl)?;
        let target = texture(&gl, None, [width, height])?;
        let framebuffer = framebuffer_of(&gl, target)?;
        let depth = gl.create_renderbuffer()?;
        gl.bind_renderbuffer(glow::RENDERBUFFER, Some(depth));
        gl.renderbuffer_storage(glow::RENDERBUFFER, glow::DEPTH_COMPONENT24, width, height);
        gl.framebuffer_renderbuffer(
            glow::FRAMEBUFFER,
            glow::DEPTH_ATTACHMENT,
            glow::RENDERBUFFER,
            Some(depth),
        );
        let window = texture(&gl, None, [width, height])?;
        let window_framebuffer = framebuffer_of(&gl, window)?;
        let color = |texel: i32| [(texel % TEXELS) as u8, (texel / TEXELS) as u8, 1, 255];
        let texels: Vec<u8> = (0..TEXELS * TEXELS).flat_map(color).collect();
        let texels = texture(&gl, Some(&texels), [TEXELS; 2])?;
        let place = gl.get_uniform_location(program, "place");
        gl.bind_vertex_array(Some(gl.create_vertex_array()?));
        for frame in 0..frames {
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
            gl.bind_texture(glow::TEXTURE_2D, Some(texels));
            gl.enable(glow::DEPTH_TEST);
            gl.clear_color(0.0, 0.0, 0.0, 0.0);
            gl.clear(glow::COLOR_BUFFER_BIT | glow::DEPTH_BUFFER_BIT);
            for eye in 0..2 {
                gl.viewport(eye * EYE_PX[0], 0, EYE_PX[0], EYE_PX[1]);
                let shift = 0.05 * (eye as f32 - 0.5) + 0.01 * frame as f32;
                for (number, scale) in [0.8, 0.4].into_iter().enumerate() {
                    let slope = 0.7 * number as f32;
                    gl.uniform_4_f32(place.as_ref(), shift, -0.1, scale, slope);
                    gl.draw_arrays(glow::TRIANGLE_STRIP, 0, 4);
                }
            }
            // As a browser does, copy the picture to a window by a draw without a depth test.
            gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, Some(window_framebuffer));
            gl.bind_texture(glow::TEXTURE_2D, Some(target));
            gl.disable(glow::DEPTH_TEST);
            gl.viewport(0, 0, width, height);
            gl.uniform_4_f32(place.as_ref(), 0.0, 0.0, 1.0, 0.0);
            gl.draw_arrays(glow::TRIANGLE_STRIP, 0, 4);
            let into = glow::PixelPackData::Slice(Some(&mut pixels));
            gl.read_pixels(0, 0, width, height, glow::RGBA, glow::UNSIGNED_BYTE, into);
        }
    }
    std::fs::File::create(picture)?.write_all(&pixels)?;
    Ok(())
}
