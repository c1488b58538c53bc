//! Records, rays and samples of whole traces as columns, decoded in parallel.

use anyhow::{Result, bail};
use formats::interop::{
    GeometryRow, RayAccess, RayRow, RaySample, RecordRow, SampleRow, Tabular, Values,
    geometry_rows, ray_rows, ray_samples, record_rows, record_to_json,
};
use formats::raytrace::{BvhSummary, Hierarchy, RayTile, Raytrace, RaytraceTables};
use formats::textrace::{Pass, Textrace, Tile};
use formats::view::Eye;
use rayon::prelude::*;

/// Tiles that a thread decodes per task.
const CHUNK: usize = 64;

/// Pass and tile numbers of a trace, in file order.
pub fn tiles(passes: &[Pass]) -> impl Iterator<Item = (usize, usize)> + use<'_> {
    passes
        .iter()
        .enumerate()
        .flat_map(|(pass, info)| (0..info.tile_count() as usize).map(move |tile| (pass, tile)))
}

/// Eye and tile number of every tile of a ray trace, in file order.
pub fn ray_tiles(tables: &RaytraceTables) -> impl Iterator<Item = (Eye, u32)> + use<> {
    let tiles = tables.tile_count();
    let of_eye = move |eye| (0..tiles).map(move |tile| (eye, tile));
    [Eye::Left, Eye::Right].into_iter().flat_map(of_eye)
}

/// A trace as tiles.
pub trait Tiles: Sync {
    /// Identifies a tile.
    type Place: Copy + Send + Sync + PartialEq;
    /// A decoded tile.
    type Content: Default + PartialEq;
    /// What a line of a tile is called.
    const LINE: &'static str;

    /// All tiles, in file order.
    fn places(&self) -> Vec<Self::Place>;

    /// Number of the pass or eye, and of the tile.
    fn numbers(at: Self::Place) -> (usize, usize);

    /// Name of the pass or eye.
    fn pass_name(at: Self::Place) -> String;

    /// Decodes everything of a tile.
    ///
    /// # Errors
    /// A damaged tile.
    fn decode(&self, at: Self::Place, tile: &mut Self::Content) -> formats::Result<()>;

    /// A tile as JSON Lines.
    ///
    /// # Errors
    /// None in practice; the signature is the serialiser's.
    fn lines(&self, at: Self::Place, tile: &Self::Content) -> serde_json::Result<Vec<String>>;
}

impl Tiles for Textrace {
    type Place = (usize, usize);
    type Content = Tile;
    const LINE: &'static str = "record";

    fn places(&self) -> Vec<Self::Place> {
        tiles(&self.tables().passes).collect()
    }

    fn numbers(at: Self::Place) -> (usize, usize) {
        at
    }

    fn pass_name((pass, _): Self::Place) -> String {
        format!("pass {pass}")
    }

    fn decode(&self, (pass, index): Self::Place, tile: &mut Tile) -> formats::Result<()> {
        self.decode_tile(pass, index, tile)
    }

    fn lines(&self, (pass, index): Self::Place, tile: &Tile) -> serde_json::Result<Vec<String>> {
        let rows = record_rows(pass as u32, index as u32, tile);
        let line = |row: RecordRow| record_to_json(row.origin, &row.record).to_string();
        Ok(rows.map(line).collect())
    }
}

impl Tiles for Raytrace {
    type Place = (Eye, u32);
    type Content = RayTile;
    const LINE: &'static str = "sample";

    fn places(&self) -> Vec<Self::Place> {
        ray_tiles(self.tables()).collect()
    }

    fn numbers((eye, tile): Self::Place) -> (usize, usize) {
        (eye as usize, tile as usize)
    }

    fn pass_name((eye, _): Self::Place) -> String {
        format!("{eye} eye")
    }

    fn decode(&self, (eye, index): Self::Place, tile: &mut RayTile) -> formats::Result<()> {
        self.decode_tile_with_geometry(eye, index, tile)
    }

    fn lines(&self, (eye, index): Self::Place, tile: &RayTile) -> serde_json::Result<Vec<String>> {
        let tables = self.tables();
        let samples = ray_samples(tables, eye, index, tile);
        samples.map(|sample| sample.to_json(&tables.bvh)).collect()
    }
}

/// A trace with rows of type `R`.
pub trait Rows<R>: Tiles {
    /// Appends the rows of a tile. `tile` is reused.
    ///
    /// # Errors
    /// A damaged tile.
    fn append(
        &self,
        at: Self::Place,
        tile: &mut Self::Content,
        rows: &mut Vec<R>,
    ) -> formats::Result<()>;
}

impl Rows<RecordRow> for Textrace {
    fn append(
        &self,
        at: Self::Place,
        tile: &mut Tile,
        rows: &mut Vec<RecordRow>,
    ) -> formats::Result<()> {
        self.decode(at, tile)?;
        rows.extend(record_rows(at.0 as u32, at.1 as u32, tile));
        Ok(())
    }
}

/// Rows of a ray trace's samples.
trait OfSample: Sized {
    /// Whether the rows need the geometry of the rays.
    const GEOMETRY: bool = false;

    fn append(sample: &RaySample<'_>, bvh: &BvhSummary, rows: &mut Vec<Self>);
}

impl OfSample for RayRow {
    fn append(sample: &RaySample<'_>, _: &BvhSummary, rows: &mut Vec<Self>) {
        rows.extend(ray_rows(sample));
    }
}

impl OfSample for GeometryRow {
    const GEOMETRY: bool = true;

    fn append(sample: &RaySample<'_>, _: &BvhSummary, rows: &mut Vec<Self>) {
        rows.extend(geometry_rows(sample));
    }
}

impl OfSample for SampleRow {
    fn append(sample: &RaySample<'_>, _: &BvhSummary, rows: &mut Vec<Self>) {
        rows.push(sample.into());
    }
}

/// Visits, one row each.
impl OfSample for RayAccess {
    fn append(sample: &RaySample<'_>, bvh: &BvhSummary, rows: &mut Vec<Self>) {
        let pushed = sample.accesses(bvh, |access| {
            rows.push(*access);
            Ok(())
        });
        debug_assert!(pushed.is_ok(), "pushing does not fail");
    }
}

impl<R: OfSample> Rows<R> for Raytrace {
    fn append(
        &self,
        (eye, index): Self::Place,
        tile: &mut RayTile,
        rows: &mut Vec<R>,
    ) -> formats::Result<()> {
        if R::GEOMETRY {
            self.decode_tile_with_geometry(eye, index, tile)?;
        } else {
            self.decode_tile(eye, index, tile)?;
        }
        for sample in ray_samples(self.tables(), eye, index, tile) {
            R::append(&sample, &self.tables().bvh, rows);
        }
        Ok(())
    }
}

/// The content of a trace's hierarchy.
///
/// # Errors
/// The trace does not have it, or it is damaged.
pub fn hierarchy(trace: &Raytrace) -> Result<Hierarchy> {
    match trace.read_hierarchy()? {
        Some((hierarchy, _)) => Ok(hierarchy),
        None => bail!(
            "{}: expected a trace with the content of its hierarchy (captured with `tracegen rays --hierarchy`), found none",
            trace.container().file()
        ),
    }
}

/// The values of rows, column by column in the order of [`Tabular::FIELDS`].
pub fn columns_of<R: Tabular>(rows: &[R]) -> Vec<Values> {
    R::FIELDS
        .iter()
        .map(|field| field.get.values(rows))
        .collect()
}

/// All rows of a trace, column by column in the order of [`Tabular::FIELDS`].
///
/// # Errors
/// The first damaged tile.
pub fn columns<R: Tabular, T: Rows<R>>(trace: &T) -> formats::Result<Vec<Values>> {
    let of_chunk = |places: &[T::Place]| -> formats::Result<Vec<Values>> {
        let (mut tile, mut rows) = (T::Content::default(), Vec::new());
        for &at in places {
            trace.append(at, &mut tile, &mut rows)?;
        }
        Ok(columns_of(&rows))
    };
    let parts: Vec<formats::Result<Vec<Values>>> =
        trace.places().par_chunks(CHUNK).map(of_chunk).collect();
    let parts: Vec<Vec<Values>> = parts.into_iter().collect::<formats::Result<_>>()?;
    let join = |column: usize| {
        let of_column: Vec<&Values> = parts.iter().map(|part| &part[column]).collect();
        Values::joined(&of_column).unwrap_or_else(|| R::FIELDS[column].get.values(&[]))
    };
    Ok((0..R::FIELDS.len()).into_par_iter().map(join).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::stream::testing::Synthetic;

    #[test]
    fn a_trace_without_records_has_empty_columns_of_the_right_types() {
        let mut memory = Synthetic::default().generate();
        memory
            .tiles
            .iter_mut()
            .flatten()
            .for_each(|tile| *tile = Tile::default());
        let file = crate::cli::testing::file_of(&memory);
        let trace = Textrace::open(file.path()).unwrap();
        let columns = columns::<RecordRow, _>(&trace).unwrap();
        for (field, values) in RecordRow::FIELDS.iter().zip(columns) {
            assert_eq!(values, field.get.values(&[]), "{}", field.name);
        }
    }

    #[test]
    fn columns_hold_every_record_in_file_order() {
        let memory = Synthetic::default().generate();
        let file = crate::cli::testing::file_of(&memory);
        let trace = Textrace::open(file.path()).unwrap();
        let columns = columns::<RecordRow, _>(&trace).unwrap();
        let mut rows = Vec::new();
        for (pass, tile) in tiles(&memory.tables.passes) {
            rows.extend(record_rows(
                pass as u32,
                tile as u32,
                &memory.tiles[pass][tile],
            ));
        }
        assert!(rows.len() > 100);
        for (field, values) in RecordRow::FIELDS.iter().zip(columns) {
            assert_eq!(values, field.get.values(&rows), "{}", field.name);
        }
    }
}
