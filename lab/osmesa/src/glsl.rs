//! The shader in GLSL, entry point by entry point.

use naga::ShaderStage;
use naga::back::PipelineConstants;
use naga::back::glsl::{Options, PipelineOptions, Version, Writer, WriterFlags};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use raster::error::RasterError;
use raster::shader::{
    self, AlphaSource, Granularity, MATERIAL_BINDING, SAMPLERS_BINDING, TEXTURES_BINDING,
    VIEW_BINDINGS,
};
use scene::TextureSlot;
use std::collections::BTreeMap;

/// Uniform block of the view.
pub const VIEW_BLOCK: u32 = 0;
/// Uniform block of the material.
pub const MATERIAL_BLOCK: u32 = 1;
/// First of the material's texture units.
pub const MATERIAL_UNITS: u32 = 0;
/// Texture unit of the shadow maps.
pub const SHADOW_UNIT: u32 = TextureSlot::COUNT as u32;

/// The validated shader.
pub struct Module {
    module: naga::Module,
    info: ModuleInfo,
    options: Options,
}

impl Module {
    /// Parses and validates the shader.
    ///
    /// # Errors
    /// The translator's message.
    pub fn new() -> Result<Self, RasterError> {
        let source = shader::source(Granularity::NumberedFragments, AlphaSource::Color);
        let module = naga::front::wgsl::parse_str(&source)
            .map_err(|e| failed("reading the shader", e.emit_to_string(&source)))?;
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
        let info = (validator.validate(&module))
            .map_err(|e| failed("checking the shader", e.emit_to_string(&source)))?;
        let options = Options {
            version: Version::Desktop(450),
            // Coordinates already follow WGSL's conventions; see `gl`.
            writer_flags: WriterFlags::empty(),
            binding_map: bindings(),
            zero_initialize_workgroup_memory: false,
        };
        Ok(Self {
            module,
            info,
            options,
        })
    }

    /// An entry point in GLSL 4.50, with overrides.
    ///
    /// # Errors
    /// Features that GLSL cannot express.
    pub fn translate(
        &self,
        stage: ShaderStage,
        entry_point: &str,
        constants: &[(&str, f64)],
    ) -> Result<String, RasterError> {
        let doing = "translating the shader";
        let constants: PipelineConstants = (constants.iter())
            .map(|&(name, value)| (name.to_owned(), value))
            .collect();
        let chosen = Some((stage, entry_point));
        let (module, info) = naga::back::pipeline_constants::process_overrides(
            &self.module,
            &self.info,
            chosen,
            &constants,
        )
        .map_err(|e| failed(doing, e.to_string()))?;
        let pipeline = PipelineOptions {
            shader_stage: stage,
            entry_point: entry_point.to_owned(),
            multiview: None,
        };
        let mut text = String::new();
        let policies = naga::proc::BoundsCheckPolicies::default();
        Writer::new(
            &mut text,
            &module,
            &info,
            &self.options,
            &pipeline,
            policies,
        )
        .and_then(|mut writer| writer.write())
        .map_err(|e| failed(doing, e.to_string()))?;
        Ok(text)
    }
}

/// The block or unit of each of the shader's bindings. A sampler shares its texture's unit.
fn bindings() -> BTreeMap<naga::ResourceBinding, u8> {
    let of_view = (0_u32..).zip(VIEW_BINDINGS).map(|(binding, name)| {
        let place = match name {
            "VIEW" => VIEW_BLOCK,
            "SHADOW_MAP" | "SHADOW_SAMPLER" => SHADOW_UNIT,
            // Storage blocks have the numbers of their bindings.
            _ => binding,
        };
        (0, binding, place)
    });
    let textures = (TEXTURES_BINDING..SAMPLERS_BINDING)
        .map(|binding| (1, binding, MATERIAL_UNITS + binding - TEXTURES_BINDING));
    of_view
        .chain([(1, MATERIAL_BINDING, MATERIAL_BLOCK)])
        .chain(textures)
        .map(|(group, binding, place)| (naga::ResourceBinding { group, binding }, place as u8))
        .collect()
}

fn failed(doing: &'static str, message: String) -> RasterError {
    RasterError::Driver { doing, message }
}
