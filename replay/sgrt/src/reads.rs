//! The left pixels' fields that error detection reads. They determine its DMA traffic, its share of a
//! G-buffer record and its look-ups in the row buffers.

use super::config::Gbuffer;
use serde::{Deserialize, Serialize};

/// Left pixels around the arrived one of which detection reads a field, per right pixel. Each variant
/// includes the previous ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Around {
    /// The arrived pixel.
    Own,
    /// Also the next pixel of its row.
    Next,
    /// Also its four neighbours.
    Cross,
    /// Also its eight neighbours.
    Square,
}

impl Around {
    /// Pixels read per right pixel.
    pub fn pixels(self) -> u64 {
        match self {
            Self::Own => 1,
            Self::Next => 2,
            Self::Cross => 5,
            Self::Square => 9,
        }
    }

    /// True if the rows above and below are read as well.
    fn has_neighbour_rows(self) -> bool {
        self >= Self::Cross
    }
}

/// The fields that detection reads, and of which pixels; `None` for unread fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Reads {
    /// Hit position.
    pub position: Option<Around>,
    /// Object number, which implies the material.
    pub object: Option<Around>,
    /// Triangle number.
    pub triangle: Option<Around>,
    /// Outcomes of the shadow rays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shadow: Option<Around>,
}

impl Reads {
    /// No field.
    pub const NOTHING: Self = Self {
        position: None,
        object: None,
        triangle: None,
        shadow: None,
    };

    /// The reads of every rule: positions along the row determine which pixel arrives.
    pub const ARRIVALS: Self = Self {
        position: Some(Around::Own),
        ..Self::NOTHING
    };

    /// The union of two tests' reads.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            position: self.position.max(other.position),
            object: self.object.max(other.object),
            triangle: self.triangle.max(other.triangle),
            shadow: self.shadow.max(other.shadow),
        }
    }

    /// Bytes and pixels of each field.
    fn fields(self, g: &Gbuffer) -> impl Iterator<Item = (u64, Around)> {
        [
            (g.detect_position_bytes, self.position),
            (g.object_bytes, self.object),
            (g.triangle_bytes, self.triangle),
            (g.shadow_bytes, self.shadow),
        ]
        .into_iter()
        .filter_map(|(bytes, around)| Some((u64::from(bytes), around?)))
    }

    /// Bytes per left pixel that detection reads: through DRAM, or kept on chip.
    pub fn pixel_bytes(self, g: &Gbuffer) -> u64 {
        self.fields(g).map(|(bytes, _)| bytes).sum()
    }

    /// True if detection reads rows above and below a pixel's.
    pub(super) fn has_neighbour_rows(self) -> bool {
        let all = [self.position, self.object, self.triangle, self.shadow];
        all.into_iter().flatten().any(Around::has_neighbour_rows)
    }

    /// Bytes that DMA fetches for a band of rows. The band's arrivals come from `rows` left rows, and those
    /// of the band and its adjacent rows from `with_neighbours`, of `row_px` pixels each.
    pub(super) fn fetched_bytes(
        self,
        g: &Gbuffer,
        rows: u64,
        with_neighbours: u64,
        row_px: u64,
    ) -> u64 {
        self.fields(g)
            .map(|(bytes, around)| {
                let rows = if around.has_neighbour_rows() {
                    with_neighbours
                } else {
                    rows
                };
                bytes * rows * row_px
            })
            .sum()
    }

    /// Bytes read from the row buffers per tested right pixel.
    pub(super) fn looked_up_bytes(self, g: &Gbuffer) -> u64 {
        self.fields(g)
            .map(|(bytes, around)| bytes * around.pixels())
            .sum()
    }

    /// Bytes per G-buffer record: the paper's fields, and the numbers that detection reads.
    pub(super) fn record_bytes(self, g: &Gbuffer) -> u64 {
        let numbers = [
            (g.object_bytes, self.object),
            (g.triangle_bytes, self.triangle),
            (g.shadow_bytes, self.shadow),
        ];
        let read = numbers.into_iter().filter(|(_, around)| around.is_some());
        [
            g.color_bytes,
            g.normal_bytes,
            g.texcoord_bytes,
            g.position_bytes,
        ]
        .into_iter()
        .chain(read.map(|(bytes, _)| bytes))
        .map(u64::from)
        .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::SgrtConfig;
    use super::super::rules::Rule;
    use super::super::testing::rows_in_dram;
    use super::*;

    fn reads(rule: &str) -> Reads {
        rule.parse::<Rule>().expect("a rule").reads()
    }

    #[test]
    fn a_rule_is_charged_for_the_fields_and_the_rows_that_it_reads() {
        let g = rows_in_dram().gbuffer;
        // Bytes per left pixel, bytes per record, and whether adjacent rows are fetched.
        for (rule, pixel, record, rows_beside) in [
            ("none", 12, 28, false),
            ("depth", 12, 28, true),
            ("row", 16, 32, false),
            ("object", 16, 32, true),
            ("opaque", 16, 32, false),
            ("silhouette", 16, 32, true),
            ("triangle", 16, 32, false),
            ("triangles", 16, 32, true),
            (crate::DEFAULT_RULE, 21, 37, true),
        ] {
            let r = reads(rule);
            assert_eq!(r.pixel_bytes(&g), pixel, "{rule}");
            assert_eq!(r.record_bytes(&g), record, "{rule}");
            let band = r.fetched_bytes(&g, 16, 18, 10);
            assert_eq!(band > pixel * 160, rows_beside, "{rule}");
        }
        assert_eq!(
            reads(crate::DEFAULT_RULE).fetched_bytes(&g, 16, 18, 1),
            21 * 18
        );
        // A depth, a short object number, a triangle number and shadow outcomes.
        let packed = SgrtConfig::default().gbuffer;
        assert_eq!(
            reads(crate::DEFAULT_RULE).pixel_bytes(&packed),
            4 + 2 + 4 + 1
        );
    }

    #[test]
    fn concurrent_tests_read_a_pixel_once() {
        let g = rows_in_dram().gbuffer;
        assert_eq!(reads("depth+row").looked_up_bytes(&g), 5 * 12 + 2 * 4);
        assert_eq!(reads("none").looked_up_bytes(&g), 12);
    }
}
