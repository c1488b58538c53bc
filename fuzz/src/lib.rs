//! Fuzz targets: every reader of external bytes, and both kernels of the ray tracer.
//!
//! `make fuzz` runs the targets with libFuzzer; `tests/corpus.rs` runs the committed corpus, and changed
//! copies of it, in every `make test`.

pub mod limits;

mod addresses;
mod kernels;
// Only this file, because the rest of `tracegen` depends on the graphics driver's crates.
#[path = "../../tracegen/src/captures.rs"]
#[allow(dead_code)]
mod captures;
mod configurations;
mod gltf;
mod images;
mod obj;
mod paths;
mod traces;

/// Changes a few bytes, up to a maximum length.
pub type Change<'a> = &'a dyn Fn(&mut Vec<u8>, usize);

/// A fuzz target.
pub struct Target {
    /// Name of the target and of its corpus folder.
    pub name: &'static str,
    /// Processes an input as the programs do. Panics if an invariant is violated.
    pub run: fn(&[u8]),
    /// A changed copy of an input, of about this maximum length, from a seed. Checksums, lengths and
    /// compression around the change are corrected.
    pub mutate: fn(&[u8], usize, u32, Change<'_>) -> Vec<u8>,
}

impl Target {
    /// Every target.
    pub const ALL: &[Self] = &[
        Self {
            name: "textrace",
            run: traces::run,
            mutate: traces::mutate,
        },
        Self {
            name: "raytrace",
            run: traces::run,
            mutate: traces::mutate,
        },
        Self {
            name: "addresses",
            run: addresses::run,
            mutate: addresses::mutate,
        },
        Self {
            name: "gltf",
            run: gltf::run,
            mutate: gltf::mutate,
        },
        Self {
            name: "images",
            run: images::run,
            mutate: plain,
        },
        Self {
            name: "obj",
            run: obj::run,
            mutate: plain,
        },
        Self {
            name: "configurations",
            run: configurations::run,
            mutate: plain,
        },
        Self {
            name: "manifests",
            run: configurations::manifest,
            mutate: plain,
        },
        Self {
            name: "paths",
            run: paths::run,
            mutate: plain,
        },
        Self {
            name: "kernels",
            run: kernels::run,
            mutate: plain,
        },
    ];

    /// The target with a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|target| target.name == name)
    }
}

/// Applies only the change, for inputs without checksums or lengths.
fn plain(bytes: &[u8], most_bytes: usize, _: u32, change: Change<'_>) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    change(&mut bytes, most_bytes);
    bytes
}
