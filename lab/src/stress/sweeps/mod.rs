//! The sweeps: one file and one row each.

mod eyes;
mod fields;
mod grazing;
mod mirrored;
mod planes;
mod scale;
mod slivers;
mod textures;
mod translation;
mod transparency;
mod triangle_counts;
mod triangles;
mod uv_offsets;
mod viewports;

use super::Sweep;

/// Every sweep, in the order in which they run.
pub const SWEEPS: [Sweep; 14] = [
    translation::SWEEP,
    scale::SWEEP,
    planes::SWEEP,
    fields::SWEEP,
    eyes::SWEEP,
    uv_offsets::SWEEP,
    textures::SWEEP,
    triangles::SWEEP,
    slivers::SWEEP,
    grazing::SWEEP,
    transparency::SWEEP,
    mirrored::SWEEP,
    triangle_counts::SWEEP,
    viewports::SWEEP,
];
