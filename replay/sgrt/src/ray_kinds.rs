//! A ray trace reduced to rays of some kinds, to measure each kind's share of the caches.

use super::frame::{RaySource, TileError};
use formats::raytrace::{Hierarchy, RayKind, RayTile, RaytraceTables};
use formats::view::Eye;

/// A source without the rays of other kinds. Pixels keep their hits and colours.
pub struct OfKinds<'a> {
    /// All rays.
    pub source: &'a dyn RaySource,
    /// Empty for all kinds.
    pub kinds: &'a [RayKind],
}

impl RaySource for OfKinds<'_> {
    fn tables(&self) -> &RaytraceTables {
        self.source.tables()
    }

    fn tile(&self, eye: Eye, index: u32, tile: &mut RayTile) -> Result<(), TileError> {
        self.source.tile(eye, index, tile)?;
        self.keep(tile);
        Ok(())
    }

    fn tile_with_geometry(
        &self,
        eye: Eye,
        index: u32,
        tile: &mut RayTile,
    ) -> Result<(), TileError> {
        self.source.tile_with_geometry(eye, index, tile)?;
        self.keep(tile);
        Ok(())
    }

    fn has_geometry(&self) -> bool {
        self.source.has_geometry()
    }

    fn hierarchy(&self) -> Result<Option<Hierarchy>, TileError> {
        self.source.hierarchy()
    }
}

impl OfKinds<'_> {
    /// Removes the rays of other kinds.
    fn keep(&self, tile: &mut RayTile) {
        if self.kinds.is_empty() {
            return;
        }
        let rays = std::mem::take(&mut tile.rays);
        let visits = std::mem::take(&mut tile.visits);
        let geometry = std::mem::take(&mut tile.geometry);
        let (mut ray, mut at) = (0usize, 0usize);
        for pixel in &mut tile.pixels {
            let first = tile.rays.len();
            for (number, record) in rays
                .iter()
                .enumerate()
                .skip(ray)
                .take(pixel.ray_count as usize)
            {
                let end = at.saturating_add(record.visit_count() as usize);
                if self.kinds.contains(&record.kind) {
                    tile.rays.push(*record);
                    tile.geometry.extend(geometry.get(number));
                    tile.visits.extend(visits.get(at..end).unwrap_or(&[]));
                }
                at = end;
            }
            ray += pixel.ray_count as usize;
            pixel.first_ray = first as u32;
            pixel.ray_count = (tile.rays.len() - first) as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{View, trace, wall};

    #[test]
    fn kinds_together_have_the_rays_and_visits_of_the_whole() {
        let source = trace(&wall(2.0, [5.0, 5.0], 0.0, 1), View::default()).with_visits();
        let mut all = RayTile::default();
        source.tile(Eye::Right, 3, &mut all).expect("a tile");
        let mut parts = [0, 0];
        for kind in RayKind::ALL {
            let of_kind = OfKinds {
                source: &source,
                kinds: &[kind],
            };
            let mut tile = RayTile::default();
            of_kind.tile(Eye::Right, 3, &mut tile).expect("a tile");
            let of_pixels = tile.pixels.iter().flat_map(|pixel| tile.rays_of(pixel));
            assert_eq!(of_pixels.count(), tile.rays.len());
            assert!(tile.rays.iter().all(|ray| ray.kind == kind));
            parts = [parts[0] + tile.rays.len(), parts[1] + tile.visits.len()];
        }
        assert_eq!(parts, [all.rays.len(), all.visits.len()]);
        assert!(parts[1] > 0);
    }
}
