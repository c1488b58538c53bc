//! To be filled: textures.
