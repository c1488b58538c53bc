//! The sweeps: a row each, and a function that lists the cases.

mod cameras;
mod geometry;
mod textures;

use super::{Bounds, Case, Sweep};

/// Cases in the order of their runs, made when they run, because some are large.
pub(super) type Cases = Box<dyn Iterator<Item = Case>>;

/// A view into the clutter from its middle.
const AMID_CLUTTER: &str = "--size 128x128 --eye 0,0,0 --target 1,0.2,-1";
/// A view of a square from in front of it.
const BEFORE_SQUARE: &str = "--size 128x128 --hfov 60 --eye 0.2,0.3,1.5 --target 0,0,0";

const fn sweep(
    name: &'static str,
    about: &'static str,
    [fragments_pct, uv_texels]: [f64; 2],
    warning: Option<&'static str>,
    cases: fn(bool) -> Cases,
) -> Sweep {
    Sweep {
        name,
        about,
        bounds: Bounds {
            fragments_pct,
            uv_texels,
        },
        warning,
        cases,
    }
}

/// Every sweep, in the order in which they run.
pub const SWEEPS: &[Sweep] = &[
    sweep(
        "translation",
        "A unit sphere at 0 to 10^7 m on each axis, by its node (glTF) and by its vertices (OBJ), against the same at 0.",
        [0.0, 0.0],
        None,
        geometry::translation,
    ),
    sweep(
        "scale",
        "A sphere of 10^-6 to 10^6 m, seen from as many radii with eyes as many radii apart, against the one of 1 m.",
        [0.1, 0.01],
        None,
        geometry::scale,
    ),
    sweep(
        "near-far",
        "Clutter through a camera whose planes are up to 10^12 apart, against the reference; its depth is rounded to 32 bits, too.",
        [0.2, 0.05],
        None,
        cameras::planes,
    ),
    sweep(
        "field-of-view",
        "Clutter through 0.01 to 180 degrees, against the reference.",
        [0.2, 0.05],
        None,
        cameras::fields,
    ),
    sweep(
        "eyes",
        "Clutter through eyes up to 10 m apart, canted and strongly asymmetric ones, against the reference.",
        [0.2, 0.05],
        None,
        cameras::eyes,
    ),
    sweep(
        "uv-offset",
        "A square with a texture of 1024 x 1024 and coordinates from -10^6 to 10^6, against the reference in double precision.",
        [0.05, 0.25],
        Some("texture coordinates of"),
        textures::uv_offsets,
    ),
    sweep(
        "texture-size",
        "A square with textures of 1 x 1 to 16384 x 16384, powers of two or not, against the reference.",
        [0.05, 0.02],
        None,
        textures::sizes,
    ),
    sweep(
        "triangles",
        "Degenerate and huge triangles, exact duplicates (the first one wins), one plane close before another, NaN and infinity, against the reference. No renderer distinguishes planes that are less than a few steps of 32-bit depth apart (z^2 / near / 2^24, here 10^-5 m), or duplicates with reversed winding.",
        [0.2, 0.05],
        Some("lie upon others"),
        geometry::triangles,
    ),
    sweep(
        "slivers",
        "Rows of triangles of 0.3, 0.03 and 0.003 pixels high, against the reference. All of their fragments lie at edges, where a vertex that rounds to the next \
         of 1/256 of a pixel decides, and moves coordinates that run through a whole texture within the height; those thinner than that are drawn or not as their rounding falls.",
        [10.0, 0.1],
        Some("thinner than 1/256 pixel"),
        geometry::slivers,
    ),
    sweep(
        "grazing",
        "A floor of 2000 m with 1000 repeats of a texture, seen from 10 m down to a centimetre above it, against the reference.",
        [0.2, 0.25],
        None,
        cameras::grazing,
    ),
    sweep(
        "transparency",
        "Clutter that is masked by a texture's alpha or blended, against the reference. At the border of a hole, alpha within rounding of the cutoff decides.",
        [0.2, 0.05],
        None,
        textures::transparency,
    ),
    sweep(
        "mirrored",
        "Clutter mirrored left to right, seen by mirrored eyes: the left one's fragments against those of the right one of the scene as it was, mirrored. Vertices in the middle between two steps of the rasteriser's grid round the other way.",
        [0.2, 0.05],
        None,
        cameras::mirrored,
    ),
    sweep(
        "triangle-count",
        "A square of up to 2 million triangles (10 million with --full), most of them smaller than a pixel, against the reference.",
        [0.2, 0.05],
        None,
        geometry::triangle_counts,
    ),
    sweep(
        "viewport",
        "Clutter in pictures of 1 x 1 to 8192 x 8192 pixels, multiples of a tile or not, against the reference. In a picture of one column every fragment lies at an edge.",
        [0.5, 0.05],
        None,
        cameras::viewports,
    ),
];
