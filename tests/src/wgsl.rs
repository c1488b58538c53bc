//! WGSL to SPIR-V, for the programs.

use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Compiles WGSL to SPIR-V.
pub fn compile(text: &str) -> Result<Vec<u32>, String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|e| e.emit_to_string(text))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator
        .validate(&module)
        .map_err(|e| e.emit_to_string(text))?;
    let options = naga::back::spv::Options::default();
    naga::back::spv::write_vec(&module, &info, &options, None).map_err(|e| e.to_string())
}
