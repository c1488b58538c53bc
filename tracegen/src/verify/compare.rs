//! How well a captured pass agrees with the reference.

use super::reference::Fragment;
use formats::textrace::{Draw, NO_GROUP, SUBTEXELS, Tile};
use glam::DVec2;
use std::collections::BTreeMap;

/// Agreement of a captured pass with the reference, fragment by fragment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Fragments (pixel and primitive) in both.
    pub both: u64,
    /// Fragments only in the reference.
    pub only_reference: u64,
    /// Fragments only in the capture.
    pub only_capture: u64,
    /// Largest distance of coordinates, texels of the group's extent.
    pub max_uv_error_texels: f64,
    /// Mean distance of coordinates, texels of the group's extent.
    pub mean_uv_error_texels: f64,
    /// Common fragments whose mip level (from the quad's top-left derivatives) differs.
    pub level_differs: u64,
}

impl Agreement {
    /// Common fragments over all fragments.
    #[must_use]
    pub fn coverage_iou(&self) -> f64 {
        self.both as f64 / (self.both + self.only_reference + self.only_capture).max(1) as f64
    }
}

/// A captured lane in group 0.
#[derive(Clone, Copy, Debug)]
pub struct Lane {
    /// Coordinates.
    pub uv: DVec2,
    /// Horizontal derivative of the quad's top row.
    pub dx: DVec2,
    /// Vertical derivative of the quad's left column.
    pub dy: DVec2,
    /// Texels per unit.
    pub extent: DVec2,
}

/// Pixel and primitive of a fragment.
pub type FragmentKey = ([u32; 2], u32);

/// The lanes of a pass's tiles by pixel and primitive, those of group 0 and of draws without
/// groups; `tiles` yields column, row and content. A lane that is recorded twice is an error.
///
/// # Errors
/// Names the first duplicate.
pub fn lanes<'a>(
    draws: &[Draw],
    tiles: impl Iterator<Item = ([u32; 2], &'a Tile)>,
) -> Result<BTreeMap<FragmentKey, Lane>, String> {
    let mut found = BTreeMap::new();
    for ([column, row], tile) in tiles {
        for run in &tile.runs {
            let records = &tile.records[run.first as usize..(run.first + run.count) as usize];
            let groups = &draws[run.draw as usize].groups;
            for record in records
                .iter()
                .filter(|r| r.group == 0 || r.group == NO_GROUP)
            {
                let extent = groups.first().map_or(DVec2::ONE, |g| {
                    DVec2::new(f64::from(g.extent[0]), f64::from(g.extent[1]))
                });
                let scale = f64::from(SUBTEXELS) * extent;
                let fixed = |v: [i32; 2]| DVec2::new(f64::from(v[0]), f64::from(v[1])) / scale;
                for lane in (0..4).filter(|lane| record.mask >> lane & 1 == 1) {
                    let pixel = [
                        column * 16 + u32::from(record.x) * 2 + (lane & 1),
                        row * 16 + u32::from(record.y) * 2 + (lane >> 1),
                    ];
                    let content = Lane {
                        uv: fixed(record.lane_uv(lane)),
                        dx: fixed(record.dx),
                        dy: fixed(record.dy),
                        extent,
                    };
                    if found.insert((pixel, run.primitive), content).is_some() {
                        return Err(format!(
                            "pixel {pixel:?} of primitive {} is recorded twice",
                            run.primitive
                        ));
                    }
                }
            }
        }
    }
    Ok(found)
}

/// Compares captured lanes with the reference's fragments.
#[must_use]
pub fn compare(reference: &[Fragment], lanes: &BTreeMap<FragmentKey, Lane>) -> Agreement {
    let mut agreement = Agreement::default();
    let mut total = 0.0;
    for fragment in reference {
        let Some(lane) = lanes.get(&(fragment.pixel, fragment.primitive)) else {
            agreement.only_reference += 1;
            continue;
        };
        agreement.both += 1;
        let error = ((fragment.uv - lane.uv) * lane.extent).length();
        total += error;
        agreement.max_uv_error_texels = agreement.max_uv_error_texels.max(error);
        let levels = [(fragment.dx, fragment.dy), (lane.dx, lane.dy)]
            .map(|(dx, dy)| level(dx * lane.extent, dy * lane.extent));
        agreement.level_differs += u64::from(levels[0] != levels[1]);
    }
    agreement.only_capture = lanes.len() as u64 - agreement.both;
    agreement.mean_uv_error_texels = total / agreement.both.max(1) as f64;
    agreement
}

/// First mip level that trilinear filtering reads: `floor(log2(rho))`, at least 0. The level does
/// not depend on whether the logarithm is llvmpipe's approximation.
fn level(dx: DVec2, dy: DVec2) -> i32 {
    let rho = dx.length().max(dy.length());
    rho.log2().max(0.0).floor() as i32
}
