//! Records of draws against occlusion queries of the driver.

use crate::session::{Session, coverage_group, survival_group};
use parallax_layer::inject::{DepthTests, RawSample};
use parallax_layer::spool::ReadError;
use std::collections::{BTreeMap, HashMap};

/// How the records of frames compare with what the driver counted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Check {
    /// Draws with as many fragments as the driver counted.
    pub equal: u64,
    /// Draws with another number.
    pub different: u64,
    /// The first of them.
    pub first: Option<Difference>,
    /// Draws that were not compared, by reason.
    pub apart: BTreeMap<String, u64>,
}

/// A draw whose records differ from its query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Frame.
    pub frame: u32,
    /// Number of the draw.
    pub draw: u32,
    /// Fragments by its records.
    pub recorded: u64,
    /// Samples by the driver.
    pub counted: u64,
}

/// Compares the draws of frames.
///
/// # Errors
/// Records that cannot be read.
pub fn check(session: &mut Session, frames: &[u32]) -> Result<Check, ReadError> {
    let mut check = Check::default();
    for &number in frames {
        let Some(frame) = session.frames.get(&number).cloned() else {
            continue;
        };
        let records = session.records(number)?;
        for executed in &frame.draws {
            let recorded = recorded(session, executed.draw, &records);
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

/// Fragments of a draw by its records: those that started, and those that were not discarded. Of a draw that tests depth
/// before its shader, Mesa 22.3 counts the latter and Mesa 25 the former.
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
