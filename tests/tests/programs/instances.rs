//! Instances of a draw are recorded like draws of one instance each.

use super::capture;
use super::pixels::records;
use formats::textrace::Textrace;
use formats::view::Eye;
use parallax_tests::has_lavapipe;

#[test]
fn instances_that_overlap_have_the_records_of_single_draws() {
    if !has_lavapipe() {
        return;
    }
    let objects = ["--objects", "plain,pair,discard,branch"];
    for stereo in ["targets", "halves"] {
        let [instanced, single] = ["--instances", "--draws"].map(|option| {
            let folder = tempfile::tempdir().expect("a temporary folder");
            let arguments = [&objects[..], &[option, "3"]].concat();
            let captured = capture(folder.path(), stereo, &[], &arguments);
            let message = &captured.message;
            assert!(message.contains("0 different"), "{message}");
            let trace = Textrace::open(&captured.trace).expect("a trace");
            let draws = trace.tables().draws.len();
            let of_eyes = [Eye::Left, Eye::Right].map(|eye| {
                let mut of_pixels: Vec<_> = records(&trace, eye).into_iter().collect();
                of_pixels.sort_unstable_by_key(|(at, _)| *at);
                (of_pixels.into_iter())
                    .map(|(at, all)| {
                        let all = all.into_iter().map(|of| of.record);
                        (at, all.collect::<Vec<_>>())
                    })
                    .collect::<Vec<_>>()
            });
            (draws, of_eyes)
        });
        assert_eq!((instanced.0, single.0), (4, 12), "{stereo}");
        assert!(instanced.1 == single.1, "{stereo}: the records differ");
        // Objects hide parts of their own earlier instances.
        let most = instanced.1.iter().flatten().map(|(_, all)| all.len()).max();
        assert!(most >= Some(6), "{stereo}: {most:?}");
    }
}
