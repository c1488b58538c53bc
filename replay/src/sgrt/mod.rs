//! Stereo reprojection on a mobile ray-tracing GPU (Lee et al., "Fast Stereoscopic Rendering on
//! Mobile Ray Tracing GPU for Virtual Reality Applications").
//!
//! The left image is traced in full. Its hits are projected into the right eye, where the nearest
//! one a pixel is a candidate ([`reproject`]); error detection rejects doubtful candidates
//! ([`detect`], by [`rules`]); what stands is reused, the rest is traced ([`compose`]). The trace
//! holds both eyes traced in full, so each reuse is held against the truth ([`accuracy`]), and the
//! work that it saves is known ray by ray: [`hardware`] puts together what [`tni`] and [`srp`] make
//! of it in cycles, [`dram`] in bytes ([`gbuffer`]'s share follows from what a rule [`reads`] and
//! from the [`rows`] that hold it) and [`energy`] in joules. [`loaded`] runs a rule on a trace,
//! [`variations`] many rules or parameters.

pub mod accuracy;
pub mod cache;
pub mod compose;
pub mod config;
pub mod detect;
pub mod dram;
pub mod energy;
pub mod frame;
pub mod gbuffer;
pub mod hardware;
pub mod loaded;
pub mod picture;
pub mod place;
pub mod reads;
pub mod reproject;
pub mod result;
pub mod rows;
pub mod rules;
pub mod srp;
pub mod tni;
pub mod variations;
pub mod work;

#[cfg(test)]
pub(crate) mod synthetic;

/// The rule of `replay reproject` unless told otherwise: the cheapest of those measured whose right
/// image stays well below a FLIP of 0.01 on every scene. Foliage needs `opaque`, since the trace
/// cannot tell whether a re-tested cut-out lets the ray through; `triangles` reuses more than
/// `triangle` on fine meshes, where the next pixel's triangle is often another one.
pub const DEFAULT_RULE: &str = "depth=0.02+row=0.02+object+opaque+triangles";
