//! Error detection: decides whether each right sample is reused or traced.

use super::frame::{Frame, SKY};
use super::place::RightSample;
use super::reproject::{NONE, Reprojection};
use super::rules::{Rule, Test};
use rayon::prelude::*;

mod retest;

pub use retest::intersect;

/// The class of a right sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum PixelClass {
    /// Reused; a single arrival.
    Reused,
    /// Reused; the nearest of several arrivals.
    Overlapped,
    /// Traced; no arrival.
    #[default]
    Missing,
    /// Traced; rejected by the rule.
    Bad,
}

impl PixelClass {
    /// True for the reused classes.
    pub fn is_reused(self) -> bool {
        matches!(self, Self::Reused | Self::Overlapped)
    }
}

/// The decision on a right sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Its class.
    pub class: PixelClass,
    /// The reused left sample; undefined for traced classes.
    pub source: u32,
    /// The reused primitive ([`SKY`] for the sky).
    pub primitive: u32,
    /// The right-eye ray's hit on that primitive; `None` if the left hit is reused.
    pub exact: Option<[f32; 3]>,
    /// Triangles that the ray was intersected with.
    pub tests: u8,
    /// True if the shadow rays of a reused pixel are traced again, even if shadow outcomes are reused.
    pub retraces_shadows: bool,
    /// True if the material of the reused hit looks the same from everywhere.
    pub looks_alike: bool,
}

/// Decides on every right sample.
pub fn decide(frame: &Frame, arrived: &Reprojection, rule: &Rule) -> Vec<Decision> {
    let tests = rule.tests(frame, arrived);
    let retests = rule.retests();
    (0..frame.sample_count())
        .into_par_iter()
        .map(|index| {
            let at = RightSample {
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
            if decision.class.is_reused() {
                let source = decision.source;
                decision.retraces_shadows = tests.iter().any(|t| t.retraces_shadows(at, source));
                decision.looks_alike = looks_alike(frame, source);
            }
            decision
        })
        .collect()
}

/// Whether a left hit looks the same from everywhere.
fn looks_alike(frame: &Frame, source: u32) -> bool {
    let left = &frame.left().samples[source as usize];
    let material = frame.tables.materials.get(left.material as usize);
    !left.is_sky() && material.is_some_and(|m| !m.view_dependent())
}

/// The decision if no test rejects the arrival.
fn candidate(at: RightSample) -> Decision {
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
        retraces_shadows: false,
        looks_alike: false,
    }
}

fn rejected(tests: &[Box<dyn Test + '_>], at: RightSample, source: u32) -> bool {
    let hit = &at.frame.left().samples[source as usize];
    tests.iter().any(|test| test.rejects(at, hit))
}

#[cfg(test)]
mod tests;
