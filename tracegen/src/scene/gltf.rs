//! To be filled: gltf.
