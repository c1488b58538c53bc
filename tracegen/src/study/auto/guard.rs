//! Checks an error budget on the frames that the search did not measure.

use super::search::Tried;
use crate::study::rows::{Part, Row};

/// The combination of every frame of the path, and its error.
#[derive(Clone, Debug)]
pub struct Held {
    /// The chosen combination, then safer ones, down to the baseline.
    pub chain: Vec<Row>,
    /// Position in `chain` by frame of the path.
    pub of_frame: Vec<usize>,
    /// Error by frame of the path, in the budget's unit.
    pub errors: Vec<f64>,
}

impl Held {
    /// Every frame with `row`, unchecked, for budgets without an error limit.
    pub fn everywhere(row: Row, frames: usize) -> Self {
        Self {
            chain: vec![row],
            of_frame: vec![0; frames],
            errors: Vec::new(),
        }
    }

    /// The combination of a frame.
    pub fn row(&self, frame: u32) -> &Row {
        &self.chain[self.of_frame[frame as usize]]
    }

    /// Frames in which the chosen combination exceeded the budget.
    pub fn fallen_back(&self) -> Vec<u32> {
        let frames = (0_u32..).zip(&self.of_frame);
        frames
            .filter(|(_, position)| **position > 0)
            .map(|(frame, _)| frame)
            .collect()
    }
}

/// Assigns each of the path's `frames` frames the first combination among `chosen` and safer ones whose error
/// is at most `limit`. `error` measures a combination's error in a frame and is called for frames in
/// ascending order. `tried` holds the error of each single technique; the one with the largest error is
/// removed first.
///
/// # Errors
/// Those of `error`.
pub fn hold<E>(
    chosen: &Row,
    tried: &[Tried],
    frames: u32,
    limit: f64,
    mut error: impl FnMut(&Row, u32) -> Result<f64, E>,
) -> Result<Held, E> {
    let chain = chain(chosen, tried);
    let mut held = Held {
        of_frame: Vec::new(),
        errors: Vec::new(),
        chain,
    };
    for frame in 0..frames {
        let last = held.chain.len() - 1;
        for (position, row) in held.chain.iter().enumerate() {
            // Errors are measured against the baseline, so its own error is 0.
            let found = if position == last {
                0.0
            } else {
                error(row, frame)?
            };
            if found <= limit {
                held.of_frame.push(position);
                held.errors.push(found);
                break;
            }
        }
    }
    Ok(held)
}

/// `chosen` with one lossy part removed at a time, the one with the largest error alone first, and finally
/// the baseline.
fn chain(chosen: &Row, tried: &[Tried]) -> Vec<Row> {
    let error = |part: &Part| {
        let alone = tried.iter().find(|t| t.row.parts == [part.clone()]);
        alone.map_or(0.0, |alone| alone.verdict.error)
    };
    let mut chain = vec![chosen.clone()];
    let mut parts = chosen.parts.clone();
    loop {
        let lossy = (0..parts.len()).filter(|&i| !parts[i].lossless);
        let Some(worst) = lossy.max_by(|&a, &b| error(&parts[a]).total_cmp(&error(&parts[b])))
        else {
            break;
        };
        parts.remove(worst);
        chain.extend(Row::of(parts.clone()));
    }
    let baseline = Row::baseline();
    if chain
        .last()
        .is_some_and(|row| row.settings != baseline.settings)
    {
        chain.push(baseline);
    }
    chain
}
