//! The programs for a scene's draws, all from one shader source.

use crate::gl::{Gl, Program, State};
use crate::glsl::Module;
use naga::ShaderStage::{Fragment, Vertex};
use raster::error::RasterError;
use raster::roles::{PipelineKey, Role};
use std::collections::BTreeMap;

/// A program with its depth test and blending.
#[derive(Clone, Copy)]
pub struct Pipeline {
    program: Program,
    state: State,
}

impl Pipeline {
    /// Sets the program and the state for later draws.
    pub fn set(&self, gl: &Gl) {
        gl.use_program(self.program);
        gl.set(&self.state);
    }
}

/// The shader and the programs created from it so far.
pub struct Programs {
    /// Draws the background and clears the region's depth.
    pub background: Pipeline,
    module: Module,
    made: BTreeMap<PipelineKey, Pipeline>,
}

impl Programs {
    /// Translates the shader.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn new(gl: &Gl) -> Result<Self, RasterError> {
        let module = Module::new()?;
        let vertex = module.translate(Vertex, "vertex_background", &[])?;
        let fragment = module.translate(Fragment, "fragment_background", &[])?;
        let background = Pipeline {
            program: gl.program(&vertex, Some(&fragment))?,
            state: State {
                depth: glow::ALWAYS,
                writes_depth: true,
                writes_color: true,
                blends: false,
                culls: false,
                clockwise: false,
                offset: [0.0; 2],
            },
        };
        Ok(Self {
            background,
            module,
            made: BTreeMap::new(),
        })
    }

    /// A prepared pipeline.
    pub fn get(&self, key: &PipelineKey) -> Option<&Pipeline> {
        self.made.get(key)
    }

    /// Creates the pipeline for `key` unless it exists.
    ///
    /// # Errors
    /// Driver and validation errors.
    pub fn prepare(&mut self, gl: &Gl, key: &PipelineKey) -> Result<(), RasterError> {
        if self.made.contains_key(key) {
            return Ok(());
        }
        let constants = key.constants();
        let vertex = if key.colored {
            "vertex_numbered_colored"
        } else {
            "vertex_numbered"
        };
        let vertex = self.module.translate(Vertex, vertex, &constants)?;
        let fragment = (key.role.fragment_entry_point())
            .map(|name| self.module.translate(Fragment, name, &constants))
            .transpose()?;
        let pipeline = Pipeline {
            program: gl.program(&vertex, fragment.as_deref())?,
            state: state(key),
        };
        self.made.insert(*key, pipeline);
        Ok(())
    }

    /// Number of programs created.
    pub fn count(&self) -> u64 {
        self.made.len() as u64
    }
}

/// Depth test and blending of a pipeline, like lavapipe's.
fn state(key: &PipelineKey) -> State {
    let role = key.role;
    State {
        depth: match role {
            role if role.casts() => glow::LESS,
            role if role.marks() => glow::GEQUAL,
            _ => glow::GREATER,
        },
        writes_depth: !role.keeps_depth(),
        writes_color: !(key.colorless || role.keeps_color()),
        blends: role == Role::Blended,
        culls: !key.double_sided,
        clockwise: key.mirrored,
        offset: if role.casts() { [2.0; 2] } else { [0.0; 2] },
    }
}
