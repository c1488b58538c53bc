//! The rules of error detection, one per file and one line each in [`RULES`].
//!
//! The paper tests each right pixel against all left pixels of its row (an epipolar line, because the eyes
//! differ only along it). This finds missing pixels and the nearest of overlapping ones. Arrivals can still
//! be wrong: a far surface visible through the gaps of a near one, or a surface hidden only from the right
//! eye. Rules reject suspicious arrivals and can be combined with `+`.

mod depth;
mod gap;
mod object;
mod opaque;
mod oracle;
mod row;
mod shadow_edge;
mod silhouette;
mod triangle;
mod triangles;

use super::frame::{Frame, Sample};
use super::place::{Offset, RightSample};
use super::reads::Reads;
use super::reproject::Reprojection;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// All rules, in the order in which combinations are printed.
pub static RULES: &[&RuleKind] = &[
    &depth::RULE,
    &row::RULE,
    &object::RULE,
    &opaque::RULE,
    &gap::RULE,
    &silhouette::RULE,
    &triangle::RULE,
    &triangles::RULE,
    &shadow_edge::RULE,
    &oracle::RULE,
];

/// Creates the test of a frame from its arrivals and the rule's share.
pub(super) type MakeTest = for<'a> fn(&'a Frame, &'a Reprojection, f32) -> Box<dyn Test + 'a>;

/// A rule of the registry.
pub struct RuleKind {
    /// Name on the command line.
    pub name: &'static str,
    /// What is rejected, briefly.
    pub title: &'static str,
    /// What is rejected, in full.
    pub help: &'static str,
    /// True if the name may be followed by `=SHARE`, a share of the depth.
    pub takes_share: bool,
    /// Reads in addition to [`Reads::ARRIVALS`].
    pub reads: Reads,
    /// Creates the test of a frame; `None` for a rule that only re-tests triangles.
    pub test: Option<MakeTest>,
    /// Neighbours whose triangles are intersected with the right-eye ray in addition to the candidate's.
    /// The nearest hit is reused; a ray that misses all triangles is rejected.
    pub retests: Option<&'static [Offset]>,
}

/// A rule's test of right samples.
pub trait Test: Sync {
    /// True if `hit`, the left sample to be reused, must be rejected. After a re-test, `hit` is the sample
    /// whose triangle was hit, otherwise the candidate's.
    fn rejects(&self, at: RightSample, hit: &Sample) -> bool;

    /// True if the shadow rays of a pixel that reuses the left sample `source` must be traced again.
    fn retraces_shadows(&self, _at: RightSample, _source: u32) -> bool {
        false
    }
}

/// Default depth share of rules that take one.
const DEFAULT_DEPTH_SHARE: f32 = 0.02;

/// The rules of error detection: a combination of [`RULES`], each at most once. The empty one
/// reuses every arrival.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(into = "String", try_from = "String")]
pub struct Rule(Vec<Part>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    /// Index into [`RULES`].
    index: usize,
    share: f32,
}

impl Part {
    fn kind(&self) -> &'static RuleKind {
        RULES[self.index]
    }
}

impl Rule {
    /// The fields that the rule reads.
    pub fn reads(&self) -> Reads {
        let parts = self.0.iter().map(|part| part.kind().reads);
        parts.fold(Reads::ARRIVALS, Reads::and)
    }

    /// The tests of a frame.
    pub fn tests<'a>(
        &self,
        frame: &'a Frame,
        arrived: &'a Reprojection,
    ) -> Vec<Box<dyn Test + 'a>> {
        let test = |part: &Part| Some(part.kind().test?(frame, arrived, part.share));
        self.0.iter().filter_map(test).collect()
    }

    /// The rule with every share multiplied by a factor.
    pub fn scaled(&self, factor: f32) -> Self {
        let scaled = |part: &Part| Part {
            share: part.share * factor,
            ..*part
        };
        Self(self.0.iter().map(scaled).collect())
    }

    /// Neighbours whose triangles are intersected in addition to the candidate's; `None` without re-tests.
    pub fn retests(&self) -> Option<&'static [Offset]> {
        let retests = self.0.iter().filter_map(|part| part.kind().retests);
        retests.max_by_key(|offsets| offsets.len())
    }
}

/// An invalid rule.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error(
    "rule: expected none, or {} joined by '+'; found '{found}'",
    synopsis()
)]
pub struct RuleError {
    found: String,
}

/// `depth[=SHARE], row[=SHARE], ...`
fn synopsis() -> String {
    let name = |kind: &&RuleKind| match kind.takes_share {
        true => format!("{}[=SHARE]", kind.name),
        false => kind.name.to_owned(),
    };
    RULES.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Describes the choices of `--rule`.
pub fn help() -> String {
    let mut text = "Which reprojected pixels are rejected and traced: `none` (every \
                    arrival is reused), or some of these joined by `+`:"
        .to_owned();
    for kind in RULES {
        let share = if kind.takes_share { "[=SHARE]" } else { "" };
        text += &format!("\n  {}{share}: {}", kind.name, kind.title);
    }
    text
}

impl FromStr for Rule {
    type Err = RuleError;

    fn from_str(text: &str) -> Result<Self, RuleError> {
        let mut parts: Vec<Part> = Vec::new();
        if text == "none" {
            return Ok(Self(parts));
        }
        for part in text.split('+') {
            let bad = || RuleError {
                found: part.to_owned(),
            };
            let (name, value) = match part.split_once('=') {
                Some((name, value)) => (name, Some(value)),
                None => (part, None),
            };
            let index = RULES.iter().position(|kind| kind.name == name);
            let index = index.ok_or_else(bad)?;
            let share = match value {
                None => DEFAULT_DEPTH_SHARE,
                Some(v) if RULES[index].takes_share => v
                    .parse()
                    .ok()
                    .filter(|s: &f32| s.is_finite() && *s >= 0.0)
                    .ok_or_else(bad)?,
                Some(_) => return Err(bad()),
            };
            parts.retain(|other| other.index != index);
            parts.push(Part { index, share });
        }
        parts.sort_by_key(|part| part.index);
        Ok(Self(parts))
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("none");
        }
        for (i, part) in self.0.iter().enumerate() {
            let kind = part.kind();
            f.write_str(if i > 0 { "+" } else { "" })?;
            f.write_str(kind.name)?;
            if kind.takes_share {
                write!(f, "={}", part.share)?;
            }
        }
        Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_prints_in_the_form_that_it_is_parsed_from() {
        for text in [
            "none",
            "depth=0.05+object",
            "row=0.02+silhouette+triangle",
            "object+opaque+triangles",
        ] {
            assert_eq!(text.parse::<Rule>().expect(text).to_string(), text);
        }
        let rule: Rule = "object+depth".parse().expect("a rule");
        assert_eq!(rule.to_string(), "depth=0.02+object");
    }

    #[test]
    fn an_unknown_rule_is_refused_with_the_choices() {
        for text in [
            "",
            "dept=1",
            "depth=x",
            "depth=-1",
            "object=2",
            "none+object",
        ] {
            let error = text.parse::<Rule>().unwrap_err().to_string();
            assert!(
                error.starts_with("rule: expected none, or depth[=SHARE], row[=SHARE], object")
                    && error.contains(
                        "gap, silhouette, triangle, triangles, shadow-edge, oracle[=SHARE] joined by '+'; found"
                    ),
                "{error}"
            );
        }
    }

    #[test]
    fn every_rule_is_in_the_help_and_in_the_documentation() {
        let page = include_str!("../../../../docs/models/reprojection-rules.md");
        for kind in RULES {
            assert!(help().contains(kind.title), "{}", kind.name);
            assert!(page.contains(&format!("| `{}", kind.name)), "{}", kind.name);
            assert!(page.contains(kind.help), "{}", kind.name);
        }
    }
}
