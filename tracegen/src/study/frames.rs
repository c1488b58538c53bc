//! Which frames of a path are measured.

/// Consecutive frames per run: flicker is a difference of neighbouring frames, and techniques with state show
/// it in the next frame.
pub const RUN: u32 = 2;

/// Runs of [`RUN`] frames, spread evenly over a path of `path_frames` from its first frame to its last:
/// `frames` in all, at most the whole path. The last run is shorter if they do not divide evenly.
pub fn runs(frames: u32, path_frames: u32) -> Vec<Vec<u32>> {
    let frames = frames.min(path_frames);
    let count = frames.div_ceil(RUN);
    let mut runs: Vec<Vec<u32>> = Vec::new();
    for number in 0..count {
        let length = RUN.min(frames - number * RUN);
        let last_start = path_frames - frames.min(RUN).max(length);
        let spread = match count {
            1 => 0,
            _ => (u64::from(last_start) * u64::from(number) / u64::from(count - 1)) as u32,
        };
        // Runs do not overlap if there is little space between them.
        let after = runs
            .last()
            .and_then(|run| run.last())
            .map_or(0, |last| last + 1);
        let start = spread.max(after).min(path_frames - length);
        runs.push((start..start + length).collect());
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_spread_from_the_first_frame_to_the_last() {
        assert_eq!(runs(1, 72), [[0]]);
        assert_eq!(runs(2, 72), [[0, 1]]);
        assert_eq!(runs(4, 72), [[0, 1], [70, 71]]);
        assert_eq!(runs(6, 60), [[0, 1], [29, 30], [58, 59]]);
        assert_eq!(runs(3, 72), [vec![0, 1], vec![70]]);
        assert_eq!(runs(9, 2), [[0, 1]]);
    }

    #[test]
    fn every_count_of_frames_gives_that_many_ascending_frames_of_the_path() {
        for path in 1..30 {
            for frames in 1..=path {
                let all = runs(frames, path).concat();
                assert_eq!(all.len(), frames as usize, "{frames} of {path}: {all:?}");
                assert!(
                    all.is_sorted_by(|a, b| a < b) && all[all.len() - 1] < path,
                    "{all:?}"
                );
            }
        }
    }
}
