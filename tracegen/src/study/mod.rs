//! Studies of stereo rendering techniques: a path through a scene is rendered with each technique
//! and with none, and what that takes and shows goes into a folder.

pub mod auto;
pub mod counted;
pub mod folder;
pub mod frames;
pub mod measure;
pub mod memory;
pub mod processor;
pub mod rows;
pub mod timewarp;
pub mod world;
