//! What a fuzzer runs: every reader of bytes from outside, and both kernels of the ray tracer.
//!
//! `make fuzz` runs the targets under libFuzzer; `tests/corpus.rs` runs the committed corpus, and
//! changed copies of it, on every `make test`.

pub mod limits;

mod addresses;
mod kernels;
// The file alone: the rest of `tracegen` would bring the graphics driver's crates along.
#[path = "../../tracegen/src/captures.rs"]
#[allow(dead_code)]
mod captures;
mod configurations;
mod gltf;
mod obj;
mod paths;
mod traces;

/// Changes bytes a little, within a length.
pub type Change<'a> = &'a dyn Fn(&mut Vec<u8>, usize);

/// What is fuzzed.
pub struct Target {
    /// Name, and that of its corpus' folder.
    pub name: &'static str,
    /// Does with an input all that the programs do. Panics where an invariant does not hold.
    pub run: fn(&[u8]),
    /// A changed copy of an input, at most about so long, from a seed: what encloses the place that
    /// changes (checksums, lengths, compression) is made right again.
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

    /// The target of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|target| target.name == name)
    }
}

/// The change alone: nothing encloses it.
fn plain(bytes: &[u8], most_bytes: usize, _: u32, change: Change<'_>) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    change(&mut bytes, most_bytes);
    bytes
}
