//! Programs, vertices, state and draws.

use super::{Buffer, Gl, Program, made};
use glow::HasContext;
use raster::error::RasterError;
use std::ops::Range;

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
}
