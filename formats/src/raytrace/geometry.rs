//! Geometry of rays: origin, direction, limits and hit of each, and the depth of its stack.
//!
//! The geometry is optional and has chunks of its own. [`Raytrace::decode_geometry`] reads it after the
//! tile's records.
//!
//! [`Raytrace::decode_geometry`]: super::Raytrace::decode_geometry

use serde::Serialize;

/// The hit of a ray on a triangle of the hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SlotHit {
    /// Distance in metres. Directions have unit length.
    pub t: f32,
    /// Slot of the triangle (leaf order, not the primitive number).
    pub slot: u32,
}

/// The segment of a ray, and what it met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RayGeometry {
    /// Start, relative to the trace's origin, metres.
    pub origin: [f32; 3],
    /// Unit direction.
    pub direction: [f32; 3],
    /// Minimum distance of hits, exclusive.
    pub t_min: f32,
    /// Maximum distance of hits, inclusive; `f32::MAX` for an unlimited ray.
    pub t_max: f32,
    /// The nearest hit, or for a shadow ray the first blocking triangle that was found; `None` for a miss.
    pub hit: Option<SlotHit>,
    /// Most entries on the traversal stack after any step.
    pub stack_depth: u32,
}

/// Largest deviation of a direction's squared length from 1.
pub const UNIT_TOLERANCE: f32 = 0.001;
