//! An OpenXR runtime without a headset: it gives an unmodified program a display, a head path and a clock, and
//! passes the images that the program shows to the eyes to the recording layer of the same process.
//!
//! ```text
//! loader -> negotiate -> functions: name -> function
//! instance, system, session, frames, spaces, swapchains, actions, extensions: the functions
//! state: what a program has created -> recorder: a frame's eyes to the layer
//! ```

#[macro_use]
mod state;
mod actions;
mod chain;
mod extensions;
mod frames;
mod functions;
mod graphics;
mod instance;
mod negotiate;
mod opengl;
mod paths;
mod pose;
mod recorder;
mod session;
mod spaces;
mod swapchains;
mod system;
mod views;
mod vulkan;

pub use negotiate::xrNegotiateLoaderRuntimeInterface;
