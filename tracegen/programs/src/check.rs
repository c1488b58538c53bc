//! Compares the records of draws with occlusion queries of the driver.

use crate::session::{REPEATED, Session, coverage_group, survival_group};
use spool::ReadError;
use spool::{DepthTests, RawSample};
use std::collections::{BTreeMap, HashMap};

/// Result of the comparison of recorded fragments with the driver's counts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Check {
    /// Number of draws for which both counts are equal.
    pub equal: u64,
    /// Number of draws for which they differ.
    pub different: u64,
    /// The first draw with a difference.
    pub first: Option<Difference>,
    /// Number of draws that could not be compared, by reason.
    pub apart: BTreeMap<String, u64>,
}

/// A draw whose records and query differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Frame.
    pub frame: u32,
    /// Number of the draw.
    pub draw: u32,
    /// Number of fragments in the records.
    pub recorded: u64,
    /// Number of samples counted by the driver.
    pub counted: u64,
}

/// Compares the draws of frames.
///
/// # Errors
/// The records cannot be read.
pub fn check(session: &mut Session, frames: &[u32]) -> Result<Check, ReadError> {
    let mut check = Check::default();
    for &number in frames {
        let Some(frame) = session.frames.get(&number).cloned() else {
            continue;
        };
        let records = session.records(number)?;
        for executed in &frame.draws {
            let recorded = match executed.repeated {
                true => Err(REPEATED.to_owned()),
                false => recorded(session, executed.draw, &records),
            };
            match (recorded, executed.occlusion) {
                (Err(why), _) => *check.apart.entry(why).or_default() += 1,
                (Ok(_), None) => {
                    let why = "a query of the program was under way".to_owned();
                    *check.apart.entry(why).or_default() += 1;
                }
                (Ok(recorded), Some(counted)) if recorded.contains(&counted) => check.equal += 1,
                (Ok([recorded, _]), Some(counted)) => {
                    check.different += 1;
                    check.first.get_or_insert(Difference {
                        frame: number,
                        draw: executed.draw,
                        recorded,
                        counted,
                    });
                }
            }
        }
    }
    Ok(check)
}

/// Number of fragments in a draw's records: those that started, and those that were not discarded. If depth
/// is tested before the shader, Mesa 22.3 counts the second kind and Mesa 25 the first kind.
fn recorded(
    session: &Session,
    draw: u32,
    records: &HashMap<u32, Vec<RawSample>>,
) -> Result<[u64; 2], String> {
    let info = session.draw(draw).ok_or("draws that are not known")?;
    if let Some(why) = &info.unrecorded {
        return Err(why.clone());
    }
    let shader = session.shader_of(info).ok_or("no fragment shader")?;
    if info.samples > 1 {
        return Err("several samples a pixel".to_owned());
    }
    if shader.tests == DepthTests::Late {
        return Err("shaders that are tested for depth after they ran".to_owned());
    }
    let started = coverage_group(shader).ok_or("no site that every fragment passes")?;
    let survived = survival_group(shader).unwrap_or(started);
    let of = records.get(&draw).map_or(&[][..], Vec::as_slice);
    let fragments = |group: u16| {
        let of_group = of.iter().filter(|record| record.group() == group);
        of_group
            .map(|record| u64::from(record.lanes().count_ones()))
            .sum()
    };
    Ok([started, survived].map(fragments))
}
