//! The fragments of a captured pass.

use formats::textrace::{Draw, NO_GROUP, SUBTEXELS, Tile};
use glam::DVec2;
use std::collections::BTreeMap;

/// A captured lane of group 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lane {
    /// Coordinates.
    pub uv: DVec2,
    /// Texels per unit.
    pub extent: DVec2,
}

/// Pixel and primitive of a fragment.
pub(super) type FragmentKey = ([u32; 2], u32);

/// The lanes of a pass's tiles by pixel and primitive: lanes of group 0 and of draws without groups. `tiles`
/// yields column, row and content. A lane that is recorded twice is an error.
///
/// # Errors
/// The error names the first duplicate.
pub(super) fn lanes<'a>(
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
