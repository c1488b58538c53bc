//! Error detection: which candidates are reused.
//!
//! The paper tests each right pixel against all pixels of its row (an epipolar line, since the eyes
//! differ only along it): that finds what arrives where, hence missing pixels and the nearest of
//! overlapping ones. What arrives may still be wrong: a far surface that shows through the gaps of
//! a near one, or one that something hides from the right eye only. Rules reject what looks
//! suspicious; they combine with `+`.

use super::frame::{Frame, SKY, Sample};
use super::reproject::{Candidate, Reprojection};
use formats::raytrace::RayTriangle;
use formats::raytrace::camera::sample_position_px;
use formats::view::Eye;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

mod retest;
mod row;

pub use retest::intersect;

/// Which candidates error detection rejects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Rule {
    /// Rejects a candidate that is farther than an arrived 4-neighbour by more than this share.
    pub depth: Option<f32>,
    /// Rejects a candidate behind a surface that two adjacent left pixels span across it in the
    /// row, by more than this share of the surface's depth.
    pub row: Option<f32>,
    /// Rejects a candidate none of whose 4-neighbours is of its object.
    pub object: bool,
    /// Rejects a hit on a material with alpha cut-outs, where a ray beside it may pass through.
    pub opaque: bool,
    /// Rejects a candidate any of whose 8 neighbours is missing or of another object.
    pub silhouette: bool,
    /// Intersects the right-eye ray with triangles.
    pub retest: Retest,
}

/// Triangles that the right-eye ray is intersected with before reuse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Retest {
    /// None: the left hit is taken as it is.
    #[default]
    None,
    /// The candidate's; a ray that misses it rejects.
    Same,
    /// Those of the 3x3 neighbourhood's candidates; the nearest hit is reused, a ray that misses
    /// them all rejects.
    Around,
}

/// Depth share of `depth` and `row` without a value.
pub const DEFAULT_DEPTH_SHARE: f32 = 0.02;

/// A rule that cannot be understood.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error(
    "rule: expected none, or depth[=SHARE], row[=SHARE], object, opaque, silhouette, triangle, \
     triangles joined by '+'; found '{0}'"
)]
pub struct RuleError(String);

impl FromStr for Rule {
    type Err = RuleError;

    fn from_str(text: &str) -> Result<Self, RuleError> {
        let mut rule = Self::default();
        if text == "none" {
            return Ok(rule);
        }
        for part in text.split('+') {
            let bad = || RuleError(part.to_owned());
            let (name, value) = match part.split_once('=') {
                Some((name, value)) => (name, Some(value)),
                None => (part, None),
            };
            let share = match value {
                None => DEFAULT_DEPTH_SHARE,
                Some(v) => v
                    .parse()
                    .ok()
                    .filter(|s: &f32| s.is_finite() && *s >= 0.0)
                    .ok_or_else(bad)?,
            };
            match (name, value) {
                ("depth", _) => rule.depth = Some(share),
                ("row", _) => rule.row = Some(share),
                ("object", None) => rule.object = true,
                ("opaque", None) => rule.opaque = true,
                ("silhouette", None) => rule.silhouette = true,
                ("triangle", None) => rule.retest = Retest::Same,
                ("triangles", None) => rule.retest = Retest::Around,
                _ => return Err(bad()),
            }
        }
        Ok(rule)
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        parts.extend(self.depth.map(|t| format!("depth={t}")));
        parts.extend(self.row.map(|t| format!("row={t}")));
        parts.extend(self.object.then(|| "object".to_owned()));
        parts.extend(self.opaque.then(|| "opaque".to_owned()));
        parts.extend(self.silhouette.then(|| "silhouette".to_owned()));
        match self.retest {
            Retest::None => {}
            Retest::Same => parts.push("triangle".to_owned()),
            Retest::Around => parts.push("triangles".to_owned()),
        }
        if parts.is_empty() {
            parts.push("none".to_owned());
        }
        f.write_str(&parts.join("+"))
    }
}

impl From<Rule> for String {
    fn from(rule: Rule) -> Self {
        rule.to_string()
    }
}

impl TryFrom<String> for Rule {
    type Error = RuleError;

    fn try_from(text: String) -> Result<Self, RuleError> {
        text.parse()
    }
}

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

impl Decision {
    const MISSING: Self = Self {
        class: PixelClass::Missing,
        source: super::reproject::NONE,
        primitive: SKY,
        exact: None,
        tests: 0,
    };
}

/// Decides on every right sample.
#[must_use]
pub fn decide(frame: &Frame, arrived: &Reprojection, rule: &Rule) -> Vec<Decision> {
    let spans = rule.row.map(|share| (share, row::spans(frame, arrived)));
    let judge = Judge {
        frame,
        candidates: &arrived.candidates,
        rule,
        width: frame.size_px[0] as usize,
        height: frame.size_px[1] as usize,
        spp: frame.samples_per_px as usize,
    };
    (0..frame.sample_count())
        .into_par_iter()
        .map(|index| {
            let candidate = &arrived.candidates[index];
            if candidate.is_missing() {
                return Decision::MISSING;
            }
            let hidden = spans
                .as_ref()
                .is_some_and(|(share, nearest)| candidate.depth > nearest[index] * (1.0 + share));
            judge.decide(index, candidate, hidden)
        })
        .collect()
}

struct Judge<'a> {
    frame: &'a Frame,
    candidates: &'a [Candidate],
    rule: &'a Rule,
    width: usize,
    height: usize,
    spp: usize,
}

impl Judge<'_> {
    fn decide(&self, index: usize, candidate: &Candidate, hidden: bool) -> Decision {
        let source = &self.frame.left().samples[candidate.source as usize];
        let reused = if candidate.arrivals > 1 {
            PixelClass::Overlapped
        } else {
            PixelClass::Reused
        };
        let mut decision = Decision {
            class: reused,
            source: candidate.source,
            primitive: source.primitive,
            exact: None,
            tests: 0,
        };
        let material = self.frame.tables.materials.get(source.material as usize);
        let cut_out = !source.is_sky() && material.is_some_and(|m| m.alpha_masked);
        if hidden
            || (self.rule.opaque && cut_out)
            || self.is_suspicious(index, candidate, source.object)
        {
            decision.class = PixelClass::Bad;
            return decision;
        }
        if self.rule.retest != Retest::None {
            self.retest(index, candidate, &mut decision);
        }
        decision
    }

    fn has_cut_outs(&self, sample: &Sample) -> bool {
        let material = self.frame.tables.materials.get(sample.material as usize);
        !sample.is_sky() && material.is_some_and(|m| m.alpha_masked)
    }

    fn is_suspicious(&self, index: usize, candidate: &Candidate, object: u32) -> bool {
        let rule = self.rule;
        let arrived = |n: &usize| !self.candidates[*n].is_missing();
        let object_of =
            |n: usize| self.frame.left().samples[self.candidates[n].source as usize].object;
        if let Some(share) = rule.depth {
            let behind = |n: usize| candidate.depth > self.candidates[n].depth * (1.0 + share);
            if self.neighbours(index, &FOUR).filter(arrived).any(behind) {
                return true;
            }
        }
        if rule.object
            && !self
                .neighbours(index, &FOUR)
                .filter(arrived)
                .any(|n| object_of(n) == object)
        {
            return true;
        }
        rule.silhouette
            && self
                .neighbours(index, &EIGHT)
                .any(|n| !arrived(&n) || object_of(n) != object)
    }

    fn retest(&self, index: usize, candidate: &Candidate, decision: &mut Decision) {
        let eye = self.frame.tables.camera(Eye::Right);
        let (pixel, s) = (index / self.spp, (index % self.spp) as u32);
        let (x, y) = ((pixel % self.width) as u32, (pixel / self.width) as u32);
        let direction = eye.direction(sample_position_px(x, y, s, self.spp as u32));

        let mut tested = [SKY; 9];
        let mut tests = 0usize;
        let mut nearest: Option<(f32, u32, u32)> = None;
        let mut test = |source: u32| {
            let primitive = self.frame.left().samples[source as usize].primitive;
            if primitive == SKY || tested[..tests].contains(&primitive) {
                return;
            }
            let Some(triangle) = self.frame.tables.triangle(primitive) else {
                return;
            };
            tested[tests] = primitive;
            tests += 1;
            let RayTriangle { vertices, .. } = triangle;
            if let Some(t) = intersect(eye.position, direction, vertices)
                && nearest.is_none_or(|(best, ..)| t < best)
            {
                nearest = Some((t, source, primitive));
            }
        };
        test(candidate.source);
        if self.rule.retest == Retest::Around {
            for n in self.neighbours(index, &EIGHT) {
                if !self.candidates[n].is_missing() {
                    test(self.candidates[n].source);
                }
            }
        }
        decision.tests = tests as u8;
        match nearest {
            Some((_, source, _))
                if self.rule.opaque
                    && self.has_cut_outs(&self.frame.left().samples[source as usize]) =>
            {
                decision.class = PixelClass::Bad;
            }
            Some((t, source, primitive)) => {
                decision.source = source;
                decision.primitive = primitive;
                decision.exact = Some(eye.at(direction, t));
            }
            // The sky has no triangle; it stands where nothing around it was hit.
            None if decision.primitive == SKY => {}
            None => decision.class = PixelClass::Bad,
        }
    }

    fn neighbours<'a>(
        &'a self,
        index: usize,
        offsets: &'static [(i32, i32)],
    ) -> impl Iterator<Item = usize> + 'a {
        let (pixel, s) = (index / self.spp, index % self.spp);
        let (x, y) = ((pixel % self.width) as i32, (pixel / self.width) as i32);
        offsets.iter().filter_map(move |(dx, dy)| {
            let (nx, ny) = (x + dx, y + dy);
            let inside =
                nx >= 0 && ny >= 0 && (nx as usize) < self.width && (ny as usize) < self.height;
            inside.then(|| (ny as usize * self.width + nx as usize) * self.spp + s)
        })
    }
}

const FOUR: [(i32, i32); 4] = [(0, -1), (-1, 0), (1, 0), (0, 1)];
const EIGHT: [(i32, i32); 8] = [
    (0, -1),
    (-1, 0),
    (1, 0),
    (0, 1),
    (-1, -1),
    (1, -1),
    (-1, 1),
    (1, 1),
];

#[cfg(test)]
mod tests;
