//! The capture of a program: how it was divided, and which texture reads it lacks.

use super::VertexDraw;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How the capture of a program was divided into frames and eyes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProgramCapture {
    /// Whether the eyes' matrices and frusta are the program's. Otherwise they are placeholders.
    pub cameras_known: bool,
    /// Rule that separated the frames.
    pub frames_by: String,
    /// Rule that separated the eyes.
    pub views_by: String,
    /// Texture accesses of recorded fragments that are not in the trace.
    pub left_out: Vec<LeftOut>,
    /// Texture reads by shaders of other stages, which are not in the trace; missing in older traces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unrecorded_reads: Vec<UnrecordedReads>,
    /// Counts of the vertex reads that are in the trace; absent if it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertex_reads: Option<VertexReadCounts>,
}

/// Counts of texture reads by vertex shaders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct VertexReadCounts {
    /// Executed draws, each once for each view.
    pub draws: u64,
    /// Vertices that read.
    pub vertices: u64,
    /// Reads.
    pub reads: u64,
}

impl VertexReadCounts {
    /// Counts of draws; `None` if there are none.
    pub fn of(draws: &[VertexDraw]) -> Option<Self> {
        let first = draws.first().map(|_| Self::default())?;
        Some(draws.iter().fold(first, |sum, draw| Self {
            draws: sum.draws + 1,
            vertices: sum.vertices + draw.vertices(),
            reads: sum.reads + draw.reads.len() as u64,
        }))
    }
}

impl ProgramCapture {
    /// A sentence for each kind of texture access that the trace lacks or holds less exactly.
    pub fn notices(&self) -> Vec<String> {
        let reads = self.unrecorded_reads.iter();
        let reads = reads.map(|reads| format!("not in the trace: {reads}"));
        let accesses = self.left_out.iter();
        let accesses = accesses.map(|of| format!("not in the trace, or less exactly: {of}"));
        let recorded = self.vertex_reads.map(|of| {
            format!(
                "in no cache: reads by vertex shaders, which the trace has ({} draws, {} vertices, {} reads)",
                of.draws, of.vertices, of.reads
            )
        });
        reads.chain(recorded).chain(accesses).collect()
    }
}

/// A kind of texture access that is not in the trace.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Description of the access.
    pub what: String,
    /// Number of draws with such accesses.
    pub draws: u64,
    /// Number of fragments with such accesses.
    pub fragments: u64,
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} draws", self.what, self.draws)?;
        if self.fragments > 0 {
            write!(f, ", {} fragments", self.fragments)?;
        }
        write!(f, ")")
    }
}

/// Texture reads by the shaders of a stage that is not recorded, for one kind of texture.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnrecordedReads {
    /// Stage: `vertex`, `tessellation control`, `tessellation evaluation`, `geometry` or `compute`.
    pub stage: String,
    /// Kind of texture.
    pub what: String,
    /// Number of draws or dispatches whose shader has such reads.
    pub commands: u64,
    /// Number of these whose size the device chose, so that it is in no other count.
    pub indirect: u64,
    /// Vertices of these draws times their instances and views, or invocations of these dispatches.
    pub invocations: u64,
    /// Image instructions of the shader times `invocations`. An instruction in a loop or branch counts once.
    pub reads: u64,
}

impl UnrecordedReads {
    /// Stage whose commands are dispatches.
    pub const COMPUTE: &str = "compute";

    /// Adds the counts of further commands.
    pub fn add(&mut self, other: &Self) {
        crate::add_fields!(self, other, commands, indirect, invocations, reads);
    }
}

impl fmt::Display for UnrecordedReads {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (commands, invocations) = match self.stage == Self::COMPUTE {
            true => ("dispatches", "invocations"),
            false => ("draws", "vertices"),
        };
        write!(
            f,
            "reads by {} shaders of {} ({} {commands}, {} {invocations}, {} reads without loops",
            self.stage, self.what, self.commands, self.invocations, self.reads
        )?;
        if self.indirect > 0 {
            write!(f, "; {} indirect {commands} of unknown size", self.indirect)?;
        }
        write!(f, ")")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_missing_access_has_a_sentence() {
        let vertices = UnrecordedReads {
            stage: "vertex".to_owned(),
            what: "two-dimensional textures".to_owned(),
            commands: 2,
            invocations: 6,
            reads: 12,
            ..UnrecordedReads::default()
        };
        let dispatches = UnrecordedReads {
            stage: UnrecordedReads::COMPUTE.to_owned(),
            indirect: 1,
            ..vertices.clone()
        };
        let program = ProgramCapture {
            left_out: vec![LeftOut {
                what: "cube map arrays".to_owned(),
                draws: 1,
                fragments: 0,
            }],
            unrecorded_reads: vec![vertices, dispatches],
            vertex_reads: None,
            ..ProgramCapture::default()
        };
        assert_eq!(
            program.notices(),
            [
                "not in the trace: reads by vertex shaders of two-dimensional textures (2 draws, 6 vertices, 12 reads \
                 without loops)",
                "not in the trace: reads by compute shaders of two-dimensional textures (2 dispatches, 6 invocations, \
                 12 reads without loops; 1 indirect dispatches of unknown size)",
                "not in the trace, or less exactly: cube map arrays (1 draws)",
            ]
        );
    }

    #[test]
    fn a_trace_without_unrecorded_reads_is_written_as_before() {
        let text = serde_json::to_string(&ProgramCapture::default()).unwrap();
        assert!(!text.contains("unrecorded_reads"), "{text}");
        let read: ProgramCapture = serde_json::from_str(&text).unwrap();
        assert_eq!(read, ProgramCapture::default());
    }
}
