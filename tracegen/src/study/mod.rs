//! Studies of stereo rendering techniques: renders a path through a scene with each technique and with the
//! baseline, and writes costs and errors to a folder.

pub mod auto;
pub mod counted;
pub mod folder;
pub mod frames;
pub mod measure;
pub mod memory;
pub mod processor;
pub mod rows;
pub mod timewarp;
pub mod timing;
pub mod world;
