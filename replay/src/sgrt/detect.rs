//! Error detection: what becomes of each right sample.

use super::frame::{Frame, SKY};
use super::place::Place;
use super::reproject::{NONE, Reprojection};
use super::rules::{Rule, Test};
use rayon::prelude::*;

mod retest;

pub use retest::intersect;

/// What becomes of a right sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum PixelClass {
    /// The only arrival, reused.
    Reused,
    /// The nearest of several arrivals, reused.
    Overlapped,
    /// Nothing arrived: traced.
    #[default]
    Missing,
    /// Rejected by the rule: traced.
    Bad,
}

impl PixelClass {
    /// True for the classes that are reused.
    #[must_use]
    pub fn is_reused(self) -> bool {
        matches!(self, Self::Reused | Self::Overlapped)
    }
}

/// Decision on a right sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// What becomes of it.
    pub class: PixelClass,
    /// Left sample that is reused; of no meaning for traced classes.
    pub source: u32,
    /// Primitive that is reused ([`SKY`] for the sky).
    pub primitive: u32,
    /// Where the right-eye ray hit that primitive; `None` where the left hit is taken as it is.
    pub exact: Option<[f32; 3]>,
    /// Triangles that the ray was intersected with.
    pub tests: u8,
}

/// Decides on every right sample.
#[must_use]
pub fn decide(frame: &Frame, arrived: &Reprojection, rule: &Rule) -> Vec<Decision> {
    let tests = rule.tests(frame, arrived);
    let retests = rule.retests();
    (0..frame.sample_count())
        .into_par_iter()
        .map(|index| {
            let at = Place {
                frame,
                arrived,
                index,
            };
            let mut decision = candidate(at);
            if decision.class != PixelClass::Missing {
                if rejected(&tests, at, decision.source) {
                    decision.class = PixelClass::Bad;
                } else if let Some(offsets) = retests {
                    let before = decision.source;
                    retest::retest(at, offsets, &mut decision);
                    let moved = decision.source != before;
                    if moved && rejected(&tests, at, decision.source) {
                        decision.class = PixelClass::Bad;
                    }
                }
            }
            decision
        })
        .collect()
}

/// The decision where no test rejects what arrived.
fn candidate(at: Place) -> Decision {
    let candidate = at.candidate();
    let (class, primitive) = match candidate.arrivals {
        0 => (PixelClass::Missing, SKY),
        1 => (PixelClass::Reused, at.source().primitive),
        _ => (PixelClass::Overlapped, at.source().primitive),
    };
    debug_assert_eq!(candidate.source == NONE, class == PixelClass::Missing);
    Decision {
        class,
        source: candidate.source,
        primitive,
        exact: None,
        tests: 0,
    }
}

fn rejected(tests: &[Box<dyn Test + '_>], at: Place, source: u32) -> bool {
    let hit = &at.frame.left().samples[source as usize];
    tests.iter().any(|test| test.rejects(at, hit))
}

#[cfg(test)]
mod tests;
