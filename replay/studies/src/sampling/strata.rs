//! Which frames of a path are alike: strata from what is known without drawing.

use formats::textrace::{PlannedFrame, Textrace};
use formats::view::{Eye, FrameViews};
use glam::Vec3;
use std::ops::Range;

/// What a frame's plan knows. All frames of a path have equally many counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// Number of the frame.
    pub number: u32,
    /// Counts that tell frames apart, such as draws, triangles and bytes of texels.
    pub counts: Vec<f64>,
    /// Whether little of the frame before is seen: a cut, a teleport, or the first frame.
    pub cut: bool,
}

/// Turn from the frame before, in degrees, from which on a frame is a cut: at usual fields of view the two share less
/// than half of their pictures.
const CUT_DEG: f32 = 45.0;
/// Step from the frame before, over the path's median step, from which on a frame is a cut.
const CUT_STEPS: f32 = 20.0;

/// The frames of a trace of all frames, with what its index knows: quads, runs of primitives and bytes.
pub fn recorded(trace: &Textrace) -> Vec<Planned> {
    let tables = trace.tables();
    let of_frame = |views: &FrameViews| {
        let mut counts = PlannedFrame::default();
        let passes = tables.passes.iter().enumerate();
        for (number, pass) in passes.filter(|(_, pass)| pass.frame == views.frame) {
            for tile in 0..pass.tile_count() as usize {
                let stats = trace.tile_stats(number, tile);
                counts.draws += u64::from(stats.records);
                counts.triangles += u64::from(stats.runs);
                counts.texels += u64::from(stats.bytes);
            }
        }
        counts
    };
    let counts: Vec<PlannedFrame> = tables.meta.frames.iter().map(of_frame).collect();
    planned(&tables.meta.frames, &counts)
}

/// The frames of a path with what their plan knows.
pub fn planned(views: &[FrameViews], plan: &[PlannedFrame]) -> Vec<Planned> {
    let ahead = |v: &FrameViews| {
        // The third row of a rotation, whose columns are stored.
        let [x, y, z, _] = v.eyes[Eye::Left as usize].world_to_eye;
        -Vec3::new(x[2], y[2], z[2])
    };
    let place = |v: &FrameViews| Vec3::from(v.eyes[Eye::Left as usize].position);
    let step = |pair: &[FrameViews]| Vec3::distance(place(&pair[0]), place(&pair[1]));
    let mut steps: Vec<f32> = views.windows(2).map(step).collect();
    steps.sort_by(f32::total_cmp);
    let median = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let cuts = |at: usize| {
        at == 0 || {
            let pair = &views[at - 1..=at];
            let turned = ahead(&pair[0]).angle_between(ahead(&pair[1])).to_degrees();
            turned > CUT_DEG || median > 0.0 && step(pair) > CUT_STEPS * median
        }
    };
    (views.iter().zip(plan).enumerate())
        .map(|(at, (views, counts))| Planned {
            number: views.frame,
            counts: [counts.draws, counts.triangles, counts.texels]
                .map(|n| n as f64)
                .to_vec(),
            cut: cuts(at),
        })
        .collect()
}

/// A stratum: indices of frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Indices into the plan, ascending.
    pub frames: Vec<usize>,
    /// Whether all of them are captured.
    pub all: bool,
}

/// Most of the frames that are captured because they are cuts.
const MOST_CUTS: f64 = 0.25;
/// Frames per stratum, roughly.
const PER_BLOCK: usize = 10;
/// Most strata of a path; each needs two frames.
const MOST_BLOCKS: usize = 6;

/// Strata of a path: cuts, which are all captured, and blocks of consecutive other frames, whose counts differ least
/// within each block.
pub fn strata(plan: &[Planned]) -> Vec<Block> {
    let (mut cuts, mut rest): (Vec<usize>, Vec<usize>) =
        (0..plan.len()).partition(|&at| plan[at].cut);
    if cuts.len() as f64 > MOST_CUTS * plan.len() as f64 {
        // A path of cuts has no frames like their neighbours, so its cuts are sampled as other frames are.
        rest = (0..plan.len()).filter(|&at| at != cuts[0]).collect();
        cuts.truncate(1);
    }
    let counts: Vec<Vec<f64>> = scaled(rest.iter().map(|&at| plan[at].counts.as_slice()).collect());
    let blocks = (rest.len() / PER_BLOCK).clamp(1, MOST_BLOCKS);
    let mut strata = Vec::new();
    if !cuts.is_empty() {
        strata.push(Block {
            frames: cuts,
            all: true,
        });
    }
    let shots = (rest.windows(2)).scan(0, |shot, pair| {
        *shot += usize::from(pair[1] != pair[0] + 1 || plan[pair[1]].cut);
        Some(*shot)
    });
    let shots: Vec<usize> = std::iter::once(0).chain(shots).collect();
    for range in segments(&counts, &shots, blocks) {
        strata.push(Block {
            all: range.len() <= 2,
            frames: rest[range].to_vec(),
        });
    }
    strata
}

/// Logarithms of counts, each scaled to a deviation of 1, so that no count outweighs the others.
fn scaled(counts: Vec<&[f64]>) -> Vec<Vec<f64>> {
    let width = counts.first().map_or(0, |first| first.len());
    let mut out = vec![Vec::new(); counts.len()];
    for column in 0..width {
        let logs: Vec<f64> = counts
            .iter()
            .map(|row| row[column].max(0.0).ln_1p())
            .collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        let deviation =
            (logs.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / logs.len() as f64).sqrt();
        // Counts that hardly change say nothing; scaling them would turn noise into a difference.
        let scale = if deviation > 1e-3 {
            1.0 / deviation
        } else {
            0.0
        };
        for (row, value) in out.iter_mut().zip(&logs) {
            row.push((value - mean) * scale);
        }
    }
    out
}

/// Cost of a range that spans a cut: more than all counts of a path can differ, so that ranges end at cuts where there
/// are enough of them.
const SPANS_CUT: f64 = 1e6;

/// The division of `rows` into consecutive ranges of at least two rows with the least sum of squared distances to the
/// means of the ranges (Fisher 1958, by dynamic programming). `shots` has the number of cuts before each row.
fn segments(rows: &[Vec<f64>], shots: &[usize], ranges: usize) -> Vec<Range<usize>> {
    let n = rows.len();
    if n == 0 {
        return Vec::new();
    }
    let ranges = ranges.min(n / 2).max(1);
    let width = rows[0].len();
    // Prefix sums of values and of squares.
    let mut sums = vec![vec![0.0; width + 1]];
    for row in rows {
        let mut next = sums[sums.len() - 1].clone();
        for (sum, value) in next.iter_mut().zip(row) {
            *sum += value;
        }
        next[width] += row.iter().map(|v| v * v).sum::<f64>();
        sums.push(next);
    }
    let cost = |from: usize, to: usize| {
        let square: f64 = (0..width)
            .map(|c| (sums[to][c] - sums[from][c]).powi(2))
            .sum();
        // A weak pull towards equal lengths decides where counts do not.
        let length = (to - from) as f64;
        let cuts = (shots[to - 1] - shots[from]) as f64;
        sums[to][width] - sums[from][width] - square / length
            + 1e-3 * length * length / n as f64
            + SPANS_CUT * cuts
    };
    let mut best = vec![vec![(f64::INFINITY, 0); n + 1]; ranges + 1];
    best[0][0] = (0.0, 0);
    for count in 1..=ranges {
        for to in 2 * count.min(n / 2)..=n {
            for from in 0..to {
                let before = best[count - 1][from].0;
                if (to - from >= 2 || n == 1) && before.is_finite() {
                    let total = before + cost(from, to);
                    if total < best[count][to].0 {
                        best[count][to] = (total, from);
                    }
                }
            }
        }
    }
    let mut out = Vec::new();
    let mut to = n;
    for count in (1..=ranges).rev() {
        let from = best[count][to].1;
        out.push(from..to);
        to = from;
    }
    out.reverse();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(counts: &[f64], cuts: &[usize]) -> Vec<Planned> {
        (0..counts.len())
            .map(|at| Planned {
                number: at as u32,
                counts: vec![counts[at]],
                cut: cuts.contains(&at),
            })
            .collect()
    }

    #[test]
    fn blocks_end_where_counts_change_and_cuts_are_a_stratum_of_their_own() {
        let mut counts = vec![100.0; 13];
        counts.extend([900.0; 17]);
        let blocks = strata(&plan(&counts, &[0]));
        assert_eq!(
            blocks[0],
            Block {
                frames: vec![0],
                all: true
            }
        );
        let second: Vec<usize> = (1..13).collect();
        assert_eq!(blocks[1].frames, second);
        let frames: usize = blocks.iter().map(|block| block.frames.len()).sum();
        assert_eq!((blocks.len(), frames), (3, 30));
    }

    #[test]
    fn no_block_spans_a_cut_where_blocks_are_enough() {
        let counts: Vec<f64> = (0..60).map(|at| 100.0 + f64::from(at)).collect();
        let blocks = strata(&plan(&counts, &[0, 7, 22, 50]));
        let shot = |at: usize| [7, 22, 50].iter().filter(|&&cut| at > cut).count();
        for block in &blocks[1..] {
            let ends = [block.frames[0], block.frames[block.frames.len() - 1]];
            assert_eq!(shot(ends[0]), shot(ends[1]), "{block:?}");
        }
        assert!(blocks.len() >= 5, "{blocks:?}");
    }

    /// A brute force over all divisions finds none that is better.
    #[test]
    fn segments_have_the_least_squares() {
        let mut random = formats::random::Random(3);
        for _ in 0..50 {
            let rows: Vec<Vec<f64>> = (0..9).map(|_| vec![(random.bits() % 100) as f64]).collect();
            let cost = |range: Range<usize>| {
                let part = &rows[range];
                let mean = part.iter().map(|r| r[0]).sum::<f64>() / part.len() as f64;
                let length = part.len() as f64;
                part.iter().map(|r| (r[0] - mean).powi(2)).sum::<f64>()
                    + 1e-3 * length * length / 9.0
            };
            let found: f64 = segments(&rows, &[0; 9], 3).into_iter().map(cost).sum();
            let mut least = f64::INFINITY;
            for a in 2..=5 {
                for b in a + 2..=7 {
                    least = least.min(cost(0..a) + cost(a..b) + cost(b..9));
                }
            }
            assert!((found - least).abs() < 1e-6, "{found} {least}");
        }
    }

    #[test]
    fn a_path_of_one_frame_has_one_stratum() {
        assert_eq!(
            strata(&plan(&[5.0], &[0])),
            [Block {
                frames: vec![0],
                all: true
            }]
        );
    }
}
