//! Compares captures through lavapipe with the reference.

use super::agreement::Agreement;
use super::classes::Class;
use super::compare::{Comparison, lanes, pixel_of};
use super::geometry::Geometry;
use super::reference::AlphaTest;
use formats::footprint::LodFormula;
use formats::textrace::{SUBTEXELS, Tables, Textrace, TextraceWriter, Tile, TraceMeta};
use formats::texture::{ColorSpace, Filter, MipFilter, Sampler};
use formats::view::{Eye, FrameViews, Hmd, Lens, TILE_SIZE_PX};
use glam::{Affine3A, DVec2, Vec2, Vec3, Vec4};
use raster::backend::{CaptureBackend, Fragments, View, Work};
use raster::capture::{CaptureJob, CapturedFrame};
use raster::draws::{DrawCall, DrawList, SHADOW_SIZE};
use raster::error::RasterError;
use raster::frame::{Frame, Skipped};
use raster::lavapipe::{Lavapipe, device};
use raster::lighting::Lighting;
use record::{CaptureCounts, Recorder};
use scene::{AlphaMode, Camera, Image, Instance, Material, Mesh, Scene, TextureRef, cameras, hmd};
use std::collections::BTreeSet;
use techniques::layer::Predicted;
use techniques::{Layer, Planner, Settings, Skips};
use textures::TextureSet;

mod captured;
mod culling;
mod depth;
mod every_fragment;
mod far_field;
mod fragments;
mod highlights;
mod layers;
mod motion;
mod parts;
mod records;
mod shading_reuse;
mod skips;

use captured::*;
use parts::*;
