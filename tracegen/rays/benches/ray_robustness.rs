//! Checks the traversal against brute force with many rays:
//! `cargo bench -p tracegen --bench ray_robustness [-- RAYS]`, by default a million rays per mesh
//! and place.
//!
//! The exit code is 1 if a check fails.

use glam::DVec3;
use rayon::prelude::*;
use robustness::{Findings, MeshUnderTest, TRANSLATIONS, meshes};
use std::process::ExitCode;

#[path = "../src/tests/robustness.rs"]
mod robustness;

fn main() -> ExitCode {
    const CHUNK: u64 = 10_000;
    let given = std::env::args().skip(1).find_map(|a| a.parse::<u64>().ok());
    let rays = given.unwrap_or(1_000_000);
    let mut clean = true;
    println!(
        "mesh    at m      rays     hits  borderline  disagree  not brute  wrong t  self-hit  leak"
    );
    for mesh in meshes() {
        for distance in TRANSLATIONS {
            let subject = MeshUnderTest::new(&mesh, DVec3::new(1.0, 0.7, -0.9) * distance);
            let f = (0..rays.div_ceil(CHUNK))
                .into_par_iter()
                .map(|chunk| subject.check(CHUNK.min(rays - chunk * CHUNK), chunk + 1))
                .reduce(Findings::default, |a, b| a.plus(&b));
            clean &= f.clean();
            println!(
                "{:7} {distance:<7} {:8} {:8}  {:10}  {:8}  {:9}  {:7}  {:8}  {:4}",
                mesh.name,
                f.rays,
                f.hits,
                f.borderline,
                f.disagreements,
                f.not_brute_force,
                f.wrong_distances,
                f.self_hits,
                f.leaks
            );
        }
    }
    if clean {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}
