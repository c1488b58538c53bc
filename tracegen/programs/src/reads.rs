//! Counts texture reads by shaders of stages that are not recorded.

use formats::textrace::UnrecordedReads;
use spool::{DispatchInfo, DrawInfo, INDIRECT, StageReads};
use std::collections::BTreeMap;

/// Counts of a frame by stage and kind of texture.
type OfFrame = BTreeMap<(String, String), UnrecordedReads>;

/// Counts of the frames of a session.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reads(BTreeMap<u32, OfFrame>);

impl Reads {
    /// Adds an executed draw into a number of views.
    pub fn draw(&mut self, frame: u32, draw: &DrawInfo, views: u32) {
        let indirect = draw.caveats.iter().any(|caveat| caveat == INDIRECT);
        let vertices = u64::from(draw.vertices)
            .saturating_mul(u64::from(draw.instances))
            .saturating_mul(u64::from(views));
        self.add(frame, &draw.reads, vertices, indirect);
    }

    /// Adds an executed dispatch.
    pub fn dispatch(&mut self, frame: u32, dispatch: &DispatchInfo) {
        let size = |of: [u32; 3]| of.iter().fold(1, |n: u64, s| n.saturating_mul((*s).into()));
        let groups = dispatch.groups.map_or(0, size);
        let invocations = groups.saturating_mul(size(dispatch.workgroup));
        self.add(
            frame,
            &dispatch.reads,
            invocations,
            dispatch.groups.is_none(),
        );
    }

    /// Adds recorded reads of the vertices of a draw that a trace cannot have, of a kind of texture.
    pub fn lost_vertices(&mut self, frame: u32, what: &str, reads: u64) {
        let of = StageReads {
            stage: "vertex".to_owned(),
            what: what.to_owned(),
            instructions: 1,
        };
        self.add(frame, &[of], reads, false);
    }

    fn add(&mut self, frame: u32, reads: &[StageReads], invocations: u64, indirect: bool) {
        for of in reads {
            let key = (of.stage.clone(), of.what.clone());
            let new = UnrecordedReads {
                stage: of.stage.clone(),
                what: of.what.clone(),
                ..UnrecordedReads::default()
            };
            let into = self.0.entry(frame).or_default().entry(key).or_insert(new);
            into.commands += 1;
            into.indirect += u64::from(indirect);
            into.invocations = into.invocations.saturating_add(invocations);
            let reads = invocations.saturating_mul(of.instructions.into());
            into.reads = into.reads.saturating_add(reads);
        }
    }

    /// Sums over frames, sorted by stage and kind of texture.
    pub fn of_frames(&self, frames: &[u32]) -> Vec<UnrecordedReads> {
        let mut sums = OfFrame::new();
        for of in frames.iter().filter_map(|frame| self.0.get(frame)) {
            for (key, counts) in of {
                match sums.get_mut(key) {
                    Some(sum) => sum.add(counts),
                    None => drop(sums.insert(key.clone(), counts.clone())),
                }
            }
        }
        sums.into_values().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reads(stage: &str, instructions: u32) -> Vec<StageReads> {
        vec![StageReads {
            stage: stage.to_owned(),
            what: "two-dimensional textures".to_owned(),
            instructions,
        }]
    }

    #[test]
    fn reads_are_instructions_times_vertices_instances_and_views_or_invocations() {
        let draw = DrawInfo {
            vertices: 6,
            instances: 5,
            reads: reads("vertex", 2),
            ..DrawInfo::default()
        };
        let mut all = Reads::default();
        all.draw(3, &draw, 1);
        all.draw(3, &draw, 2);
        all.draw(4, &draw, 1);
        let indirect = DrawInfo {
            vertices: 0,
            instances: 0,
            caveats: vec![INDIRECT.to_owned()],
            ..draw
        };
        all.draw(4, &indirect, 1);
        let dispatch = DispatchInfo {
            groups: Some([32, 32, 1]),
            workgroup: [8, 8, 1],
            reads: reads(UnrecordedReads::COMPUTE, 1),
        };
        all.dispatch(4, &dispatch);
        all.dispatch(
            4,
            &DispatchInfo {
                groups: None,
                ..dispatch
            },
        );
        all.lost_vertices(7, "textures of format 1", 5);
        let counts = |frames: &[u32]| -> Vec<_> {
            let of = all.of_frames(frames).into_iter();
            of.map(|r| (r.stage, [r.commands, r.indirect, r.invocations, r.reads]))
                .collect()
        };
        let vertex = |of: [u64; 4]| ("vertex".to_owned(), of);
        let compute = ("compute".to_owned(), [2, 1, 65_536, 65_536]);
        assert_eq!(counts(&[3]), [vertex([2, 0, 90, 180])]);
        assert_eq!(counts(&[3, 4, 9]), [compute, vertex([4, 1, 120, 240])]);
        assert_eq!(counts(&[7]), [vertex([1, 0, 5, 5])]);
        assert!(counts(&[]).is_empty());
    }
}
