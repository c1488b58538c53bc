//! How the code of a recording shader grows with its sites.

use super::*;

/// A chain of branches with a texture read each, as in shaders of sprites.
fn chain(count: u32) -> Vec<u32> {
    let branch = |i| {
        format!(
            "if in.number == {i}u {{ return textureSampleLevel(color, linear, in.uv * {i}.0, 0.0); }}"
        )
    };
    let all: String = (2..2 + count).map(branch).collect();
    shader(&format!("{all} return vec4<f32>(0.0);"))
}

#[test]
fn recording_adds_no_loops() {
    // Lavapipe counts the iterations of all loops in one variable, and the time in which LLVM analyses it doubles
    // with each loop.
    for words in [chain(1), chain(20), rich(), every_lod()] {
        let loops = number_of(&words, Op::LoopMerge);
        let recording = instrumented(&words);
        assert_eq!(number_of(&recording.words, Op::LoopMerge), loops);
    }
}

#[test]
fn recording_shaders_discard_so_that_lavapipe_compiles_them_once() {
    for words in [
        chain(1),
        rich(),
        shader("return vec4<f32>(in.uv, 0.0, 1.0);"),
    ] {
        let discards = number_of(&words, Op::Kill);
        let recording = instrumented(&words);
        assert_eq!(number_of(&recording.words, Op::Kill), discards + 1);
    }
}

#[test]
fn recording_code_grows_linearly_with_the_sites() {
    let sizes = [10, 20, 40, 80].map(|count| {
        let words = chain(count);
        let recording = instrumented(&words);
        assert_eq!(calls(&recording), 1 + count as usize);
        let added = |wanted| number_of(&recording.words, wanted) - number_of(&words, wanted);
        // Branches are only in the recording functions, which are the same for all sites.
        let branches = added(Op::BranchConditional);
        assert!(branches < 20, "{branches}");
        (recording.words.len() - words.len(), branches)
    });
    let per_site = [(0, 10), (1, 20), (2, 40)].map(|(i, more)| {
        assert_eq!(sizes[i + 1].1, sizes[i].1);
        (sizes[i + 1].0 - sizes[i].0) as f64 / f64::from(more)
    });
    assert!(
        per_site
            .iter()
            .all(|words| *words < 40.0 && (words - per_site[0]).abs() < 1.0),
        "{per_site:?}"
    );
}
