//! Stereo reprojection on a mobile ray-tracing GPU (Lee et al., "Fast Stereoscopic Rendering on Mobile Ray
//! Tracing GPU for Virtual Reality Applications").
//!
//! The left image is completely traced. Its hits are projected into the right eye, where the nearest one
//! per pixel is a candidate ([`reproject`]). Error detection rejects suspicious candidates ([`detect`], by
//! [`rules`]). The others are reused, and the rest is traced ([`compose`]).
//!
//! The trace holds both eyes completely traced, so reuse can be compared with the truth ([`accuracy`]), and
//! the saved work is known for each ray. [`hardware`] sums up work and misses; the module `ways` combines cycles
//! ([`tni`], [`srp`]), bytes ([`dram`]) and energy ([`energy`]) by the closed form. With [`timing::Timing::Cycle`],
//! [`cycles`] simulates the units cycle by cycle instead (`ray_batches`: its input; `timed`: its use). The share of [`gbuffer`] follows from the fields that a rule [`reads`] and from
//! the [`rows`] that hold them. [`loaded`] runs one rule on a trace, [`variations`] many rules or
//! parameters in the default order of tiles ([`tile_orders`]), [`readings`] every reading of the paper, [`temporal`] reuse of the previous frame. [`presets`] name whole settings.

pub mod accuracy;
pub mod cache;
pub mod compose;
pub mod config;
pub mod cycles;
pub mod detect;
pub mod dram;
pub mod energy;
mod energy_bounds;
pub mod frame;
pub mod gbuffer;
pub mod hardware;
pub mod hierarchy_update;
pub mod loaded;
pub mod order_rules;
pub mod picture;
pub mod place;
pub mod prefetch;
pub mod presets;
mod ray_batches;
pub mod ray_kinds;
mod ray_queues;
pub mod ray_sort;
pub mod readings;
pub mod reads;
pub mod reproject;
pub mod result;
pub mod rows;
pub mod rules;
pub mod run;
pub mod srp;
pub mod temporal;
pub mod tile_orders;
pub mod timed;
pub mod timing;
pub mod tni;
pub mod variations;
mod ways;
pub mod work;

#[cfg(any(test, feature = "testing"))]
pub mod testing;

/// The default rule of `replay reproject`: the cheapest measured one with a right image below a FLIP of 0.01 on
/// every scene. Foliage needs `opaque`, because the trace does not record whether a re-tested cut-out lets the
/// ray through. `triangles` reuses more than `triangle` on fine meshes, where the next pixel often shows another
/// triangle. Near content needs `gap`, and reused shadow outcomes need `shadow-edge`.
pub const DEFAULT_RULE: &str = "depth=0.02+row=0.02+object+opaque+gap+triangles+shadow-edge";

/// What `replay reproject` reuses by default.
pub const DEFAULT_REUSE: compose::Reuse = compose::Reuse::Shadow;
