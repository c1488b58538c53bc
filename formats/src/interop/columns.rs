//! The rows of a trace as typed columns: records, samples, rays and their accesses.
//!
//! [`Tabular::FIELDS`] is the only list of the columns of a row type. Parquet, NPY and the Python package
//! use it. Values are those of the file, so fixed-point numbers stay integers.

use super::{Access, Entry, Origin, RayAccess, RaySample};
use crate::raytrace::{Hit, Outcome, PixelRecord, RayGeometry, RayKind, RayRecord};
use crate::textrace::{QuadRecord, Tile};
use crate::view::Eye;

/// Reads a value of a row. The variant is the column's type.
#[derive(Debug)]
pub enum Get<R> {
    /// Unsigned, 8 bits.
    U8(fn(&R) -> u8),
    /// Unsigned, 16 bits.
    U16(fn(&R) -> u16),
    /// Unsigned, 32 bits.
    U32(fn(&R) -> u32),
    /// Unsigned, 64 bits.
    U64(fn(&R) -> u64),
    /// Signed, 32 bits.
    I32(fn(&R) -> i32),
    /// Floating point, 32 bits.
    F32(fn(&R) -> f32),
}

/// A column.
#[derive(Debug)]
pub struct Field<R> {
    /// Name.
    pub name: &'static str,
    /// Names of the values of a column of codes, from 0; empty for numbers.
    pub codes: &'static [&'static str],
    /// Its values.
    pub get: Get<R>,
}

pub(super) const fn field<R>(name: &'static str, get: Get<R>) -> Field<R> {
    Field {
        name,
        codes: &[],
        get,
    }
}

pub(super) const fn coded<R>(
    name: &'static str,
    codes: &'static [&'static str],
    get: fn(&R) -> u8,
) -> Field<R> {
    Field {
        name,
        codes,
        get: Get::U8(get),
    }
}

/// A type of rows.
pub trait Tabular: Sized + Send + Sync + 'static {
    /// The columns, in order.
    const FIELDS: &'static [Field<Self>];
}

/// The values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Unsigned, 8 bits.
    U8(Vec<u8>),
    /// Unsigned, 16 bits.
    U16(Vec<u16>),
    /// Unsigned, 32 bits.
    U32(Vec<u32>),
    /// Unsigned, 64 bits.
    U64(Vec<u64>),
    /// Signed, 32 bits.
    I32(Vec<i32>),
    /// Floating point, 32 bits.
    F32(Vec<f32>),
}

/// Joins the vectors of the first part's variant.
macro_rules! joined {
    ($parts:expr, $first:expr, $($variant:ident)*) => {
        match $first {
            $(Values::$variant(_) => {
                let parts: Vec<&[_]> = $parts
                    .iter()
                    .filter_map(|part| match part {
                        Values::$variant(values) => Some(values.as_slice()),
                        _ => None,
                    })
                    .collect();
                Values::$variant(parts.concat())
            })*
        }
    };
}

impl Values {
    /// The values of several parts of a column, one after the other. All parts have the same type.
    #[must_use]
    pub fn joined(parts: &[&Self]) -> Option<Self> {
        let first = parts.first()?;
        Some(joined!(parts, first, U8 U16 U32 U64 I32 F32))
    }
}

impl<R> Get<R> {
    /// The values of `rows`.
    #[must_use]
    pub fn values(&self, rows: &[R]) -> Values {
        match self {
            Self::U8(get) => Values::U8(rows.iter().map(get).collect()),
            Self::U16(get) => Values::U16(rows.iter().map(get).collect()),
            Self::U32(get) => Values::U32(rows.iter().map(get).collect()),
            Self::U64(get) => Values::U64(rows.iter().map(get).collect()),
            Self::I32(get) => Values::I32(rows.iter().map(get).collect()),
            Self::F32(get) => Values::F32(rows.iter().map(get).collect()),
        }
    }

    /// Appends the little-endian bytes of a row's value.
    pub fn append_bytes(&self, row: &R, bytes: &mut Vec<u8>) {
        match self {
            Self::U8(get) => bytes.push(get(row)),
            Self::U16(get) => bytes.extend(get(row).to_le_bytes()),
            Self::U32(get) => bytes.extend(get(row).to_le_bytes()),
            Self::U64(get) => bytes.extend(get(row).to_le_bytes()),
            Self::I32(get) => bytes.extend(get(row).to_le_bytes()),
            Self::F32(get) => bytes.extend(get(row).to_le_bytes()),
        }
    }

    /// The type as NumPy writes it.
    #[must_use]
    pub const fn numpy_type(&self) -> &'static str {
        match self {
            Self::U8(_) => "|u1",
            Self::U16(_) => "<u2",
            Self::U32(_) => "<u4",
            Self::U64(_) => "<u8",
            Self::I32(_) => "<i4",
            Self::F32(_) => "<f4",
        }
    }
}

/// A quad record and its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordRow {
    /// Its place.
    pub origin: Origin,
    /// The record.
    pub record: QuadRecord,
}

impl Tabular for RecordRow {
    const FIELDS: &'static [Field<Self>] = &[
        field("pass", Get::U32(|r: &Self| r.origin.pass)),
        field("tile", Get::U32(|r: &Self| r.origin.tile)),
        field("draw", Get::U32(|r: &Self| r.origin.draw)),
        field("primitive", Get::U32(|r: &Self| r.origin.primitive)),
        field("x", Get::U8(|r: &Self| r.record.x)),
        field("y", Get::U8(|r: &Self| r.record.y)),
        field("mask", Get::U8(|r: &Self| r.record.mask)),
        field("group", Get::U8(|r: &Self| r.record.group)),
        field("uv_u", Get::I32(|r: &Self| r.record.uv[0])),
        field("uv_v", Get::I32(|r: &Self| r.record.uv[1])),
        field("dx_u", Get::I32(|r: &Self| r.record.dx[0])),
        field("dx_v", Get::I32(|r: &Self| r.record.dx[1])),
        field("dy_u", Get::I32(|r: &Self| r.record.dy[0])),
        field("dy_v", Get::I32(|r: &Self| r.record.dy[1])),
        field("cross_u", Get::I32(|r: &Self| r.record.cross[0])),
        field("cross_v", Get::I32(|r: &Self| r.record.cross[1])),
    ];
}

/// The records of a tile, in file order.
pub fn record_rows(pass: u32, index: u32, tile: &Tile) -> impl Iterator<Item = RecordRow> {
    tile.runs.iter().flat_map(move |run| {
        let origin = Origin {
            pass,
            tile: index,
            draw: run.draw,
            primitive: run.primitive,
        };
        let records = tile.records.iter().skip(run.first as usize);
        let records = records.take(run.count as usize);
        records.map(move |&record| RecordRow { origin, record })
    })
}

/// The place of a sample in a ray trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplePlace {
    /// Eye.
    pub eye: Eye,
    /// Tile of the eye's image.
    pub tile: u32,
    /// Column and row in the image.
    pub pixel: [u32; 2],
    /// Number of the sample in its pixel.
    pub sample: u32,
}

impl From<&RaySample<'_>> for SamplePlace {
    fn from(sample: &RaySample<'_>) -> Self {
        Self {
            eye: sample.eye,
            tile: sample.tile,
            pixel: sample.pixel,
            sample: sample.sample,
        }
    }
}

/// Names of the eyes.
pub const EYES: &[&str] = &["left", "right"];
const RAY_KINDS: &[&str] = &[
    "primary",
    "shadow",
    "reflection",
    "refraction",
    "ambient-occlusion",
    "diffuse",
];
const OUTCOMES: &[&str] = &["miss", "hit", "occluded"];
const ENTRIES: &[&str] = &["node", "triangle"];

const fn eye_code(eye: Eye) -> u8 {
    match eye {
        Eye::Left => 0,
        Eye::Right => 1,
    }
}

const fn kind_code(kind: RayKind) -> u8 {
    kind as u8
}

const fn outcome_code(outcome: Outcome) -> u8 {
    outcome as u8
}

/// A ray and its sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayRow {
    /// Its sample.
    pub place: SamplePlace,
    /// Number of the ray within its sample.
    pub ray: u32,
    /// The ray.
    pub record: RayRecord,
}

/// The columns of a row with a ray, and more columns.
macro_rules! ray_fields {
    ($($more:expr),* $(,)?) => {
        &[
            coded("eye", EYES, |r: &Self| eye_code(r.place.eye)),
            field("tile", Get::U32(|r: &Self| r.place.tile)),
            field("x", Get::U32(|r: &Self| r.place.pixel[0])),
            field("y", Get::U32(|r: &Self| r.place.pixel[1])),
            field("sample", Get::U32(|r: &Self| r.place.sample)),
            field("ray", Get::U32(|r: &Self| r.ray)),
            coded("kind", RAY_KINDS, |r: &Self| kind_code(r.record.kind)),
            coded("outcome", OUTCOMES, |r: &Self| {
                outcome_code(r.record.outcome)
            }),
            field("depth", Get::U8(|r: &Self| r.record.depth)),
            field("parent", Get::U32(|r: &Self| r.record.parent)),
            field("steps", Get::U32(|r: &Self| r.record.steps)),
            field(
                "triangle_tests",
                Get::U32(|r: &Self| r.record.triangle_tests),
            ),
            field("alpha_tests", Get::U32(|r: &Self| r.record.alpha_tests)),
            $($more),*
        ]
    };
}

impl Tabular for RayRow {
    const FIELDS: &'static [Field<Self>] = ray_fields![];
}

/// A ray of a trace with geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometryRow {
    /// Its sample.
    pub place: SamplePlace,
    /// Number of the ray within its sample.
    pub ray: u32,
    /// The ray.
    pub record: RayRecord,
    /// Its geometry.
    pub geometry: RayGeometry,
}

impl Tabular for GeometryRow {
    const FIELDS: &'static [Field<Self>] = ray_fields![
        field("origin_x", Get::F32(|r: &Self| r.geometry.origin[0])),
        field("origin_y", Get::F32(|r: &Self| r.geometry.origin[1])),
        field("origin_z", Get::F32(|r: &Self| r.geometry.origin[2])),
        field("direction_x", Get::F32(|r: &Self| r.geometry.direction[0])),
        field("direction_y", Get::F32(|r: &Self| r.geometry.direction[1])),
        field("direction_z", Get::F32(|r: &Self| r.geometry.direction[2])),
        field("t_min", Get::F32(|r: &Self| r.geometry.t_min)),
        field("t_max", Get::F32(|r: &Self| r.geometry.t_max)),
        field(
            "t",
            Get::F32(|r: &Self| r.geometry.hit.map_or(f32::NAN, |hit| hit.t))
        ),
        field(
            "slot",
            Get::U32(|r: &Self| r.geometry.hit.map_or(u32::MAX, |hit| hit.slot))
        ),
        field("stack_depth", Get::U32(|r: &Self| r.geometry.stack_depth)),
    ];
}

/// The rays of a sample with their geometry; none if it was not read.
pub fn geometry_rows(sample: &RaySample<'_>) -> impl Iterator<Item = GeometryRow> {
    let rays = ray_rows(sample).zip(sample.geometry.unwrap_or_default());
    rays.map(|(row, &geometry)| GeometryRow {
        place: row.place,
        ray: row.ray,
        record: row.record,
        geometry,
    })
}

/// The rays of a sample.
pub fn ray_rows(sample: &RaySample<'_>) -> impl Iterator<Item = RayRow> {
    let place = SamplePlace::from(sample);
    let rays = (0..).zip(sample.rays);
    rays.map(move |(ray, &record)| RayRow { place, ray, record })
}

/// A sample of a pixel: its primary hit and its colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleRow {
    /// Its place.
    pub place: SamplePlace,
    /// The sample.
    pub record: PixelRecord,
}

impl SampleRow {
    /// A floating-point value of the hit; NaN without a hit.
    fn measure(&self, of: impl Fn(&Hit) -> f32) -> f32 {
        self.record.hit.as_ref().map_or(f32::NAN, of)
    }

    /// An integer of the hit; the largest value without a hit.
    fn number(&self, of: impl Fn(&Hit) -> u32) -> u32 {
        self.record.hit.as_ref().map_or(u32::MAX, of)
    }
}

impl From<&RaySample<'_>> for SampleRow {
    fn from(sample: &RaySample<'_>) -> Self {
        Self {
            place: sample.into(),
            record: *sample.record,
        }
    }
}

/// Columns with one floating-point value of the hit each.
macro_rules! hit_fields {
    ($($name:literal: $hit:ident => $value:expr;)*) => {
        [$(field($name, Get::F32(|r: &SampleRow| r.measure(|$hit| $value)))),*]
    };
}

const HIT_MEASURES: [Field<SampleRow>; 12] = hit_fields! {
    "t": hit => hit.t;
    "position_x": hit => hit.position[0];
    "position_y": hit => hit.position[1];
    "position_z": hit => hit.position[2];
    "geometric_normal_x": hit => hit.geometric_normal[0];
    "geometric_normal_y": hit => hit.geometric_normal[1];
    "geometric_normal_z": hit => hit.geometric_normal[2];
    "shading_normal_x": hit => hit.shading_normal[0];
    "shading_normal_y": hit => hit.shading_normal[1];
    "shading_normal_z": hit => hit.shading_normal[2];
    "uv_u": hit => hit.uv[0];
    "uv_v": hit => hit.uv[1];
};

impl Tabular for SampleRow {
    const FIELDS: &'static [Field<Self>] = {
        let [t, px, py, pz, gx, gy, gz, sx, sy, sz, u, v] = HIT_MEASURES;
        &[
            coded("eye", EYES, |r: &Self| eye_code(r.place.eye)),
            field("tile", Get::U32(|r: &Self| r.place.tile)),
            field("x", Get::U32(|r: &Self| r.place.pixel[0])),
            field("y", Get::U32(|r: &Self| r.place.pixel[1])),
            field("sample", Get::U32(|r: &Self| r.place.sample)),
            field("hit", Get::U8(|r: &Self| u8::from(r.record.hit.is_some()))),
            t,
            px,
            py,
            pz,
            gx,
            gy,
            gz,
            sx,
            sy,
            sz,
            u,
            v,
            field(
                "primitive",
                Get::U32(|r: &Self| r.number(|hit| hit.primitive)),
            ),
            field("object", Get::U32(|r: &Self| r.number(|hit| hit.object))),
            field(
                "material",
                Get::U32(|r: &Self| r.number(|hit| hit.material)),
            ),
            field(
                "view_independent_r",
                Get::F32(|r: &Self| r.record.view_independent[0]),
            ),
            field(
                "view_independent_g",
                Get::F32(|r: &Self| r.record.view_independent[1]),
            ),
            field(
                "view_independent_b",
                Get::F32(|r: &Self| r.record.view_independent[2]),
            ),
            field(
                "view_dependent_r",
                Get::F32(|r: &Self| r.record.view_dependent[0]),
            ),
            field(
                "view_dependent_g",
                Get::F32(|r: &Self| r.record.view_dependent[1]),
            ),
            field(
                "view_dependent_b",
                Get::F32(|r: &Self| r.record.view_dependent[2]),
            ),
            field("rays", Get::U32(|r: &Self| r.record.ray_count)),
        ]
    };
}

impl Tabular for Access {
    const FIELDS: &'static [Field<Self>] = &[
        field("address", Get::U64(|a: &Self| a.address)),
        field("pass", Get::U32(|a: &Self| a.pass)),
        field("tile", Get::U32(|a: &Self| a.tile)),
        field("draw", Get::U32(|a: &Self| a.draw)),
        field("primitive", Get::U32(|a: &Self| a.primitive)),
        field("pixel_x", Get::U8(|a: &Self| a.pixel_x)),
        field("pixel_y", Get::U8(|a: &Self| a.pixel_y)),
        field("texture", Get::U32(|a: &Self| a.texture)),
        field("layer", Get::U16(|a: &Self| a.layer)),
        field("level", Get::U8(|a: &Self| a.level)),
        field("x", Get::U32(|a: &Self| a.x)),
        field("y", Get::U32(|a: &Self| a.y)),
    ];
}

impl Tabular for RayAccess {
    const FIELDS: &'static [Field<Self>] = &[
        field("address", Get::U64(|a: &Self| a.address)),
        field("bytes", Get::U32(|a: &Self| a.bytes)),
        coded("eye", EYES, |a: &Self| eye_code(a.eye)),
        field("tile", Get::U32(|a: &Self| a.tile)),
        field("x", Get::U32(|a: &Self| a.x)),
        field("y", Get::U32(|a: &Self| a.y)),
        field("sample", Get::U32(|a: &Self| a.sample)),
        field("ray", Get::U32(|a: &Self| a.ray)),
        coded("kind", RAY_KINDS, |a: &Self| kind_code(a.kind)),
        coded("entry", ENTRIES, |a: &Self| match a.entry {
            Entry::Node => 0,
            Entry::Triangle => 1,
        }),
        field("index", Get::U32(|a: &Self| a.index)),
    ];
}

#[cfg(test)]
mod tests {
    use super::super::CsvWriter;
    use super::*;
    use crate::textrace::NO_GROUP;

    fn names<R: Tabular>() -> Vec<&'static str> {
        R::FIELDS.iter().map(|field| field.name).collect()
    }

    #[test]
    fn accesses_have_the_columns_of_csv() {
        let mut header = Vec::new();
        CsvWriter::new(&mut header).unwrap();
        assert_eq!(
            String::from_utf8(header).unwrap().trim(),
            names::<Access>().join(",")
        );
        assert_eq!(RayAccess::CSV_HEADER, names::<RayAccess>().join(","));
    }

    #[test]
    fn codes_have_the_names_used_in_json() {
        let text = |value: serde_json::Value| value.as_str().unwrap().to_owned();
        for eye in [Eye::Left, Eye::Right] {
            assert_eq!(EYES[usize::from(eye_code(eye))], eye.to_string());
        }
        for kind in RayKind::ALL {
            assert_eq!(RAY_KINDS[usize::from(kind_code(kind))], kind.to_string());
        }
        for outcome in [Outcome::Miss, Outcome::Hit, Outcome::Occluded] {
            let name = OUTCOMES[usize::from(outcome_code(outcome))];
            assert_eq!(name, text(serde_json::to_value(outcome).unwrap()));
        }
    }

    #[test]
    fn values_and_bytes_of_a_record_agree() {
        let record = QuadRecord {
            x: 3,
            y: 7,
            mask: 15,
            group: NO_GROUP,
            uv: [-1, i32::MAX],
            dx: [2, -3],
            dy: [4, i32::MIN],
            cross: [6, 7],
        };
        let row = RecordRow {
            origin: Origin {
                pass: 1,
                tile: 258,
                draw: u32::MAX,
                primitive: 5,
            },
            record,
        };
        let mut bytes = Vec::new();
        for field in RecordRow::FIELDS {
            field.get.append_bytes(&row, &mut bytes);
        }
        assert_eq!(bytes.len(), 4 * 4 + 4 + 8 * 4);
        assert_eq!(bytes[4..8], [2, 1, 0, 0]);
        assert_eq!(bytes[16..20], [3, 7, 15, NO_GROUP]);
        assert_eq!(bytes[20..24], [255; 4]);
        let of = |name: &str| {
            let mut fields = RecordRow::FIELDS.iter();
            let found = fields.find(|field| field.name == name).unwrap();
            found.get.values(&[row])
        };
        assert_eq!(of("dy_v"), Values::I32(vec![i32::MIN]));
        assert_eq!(of("tile"), Values::U32(vec![258]));
    }

    #[test]
    fn a_sample_without_a_hit_has_no_measures() {
        let sample = SampleRow {
            place: SamplePlace {
                eye: Eye::Right,
                tile: 0,
                pixel: [4, 5],
                sample: 0,
            },
            record: PixelRecord::default(),
        };
        for field in SampleRow::FIELDS {
            match field.get.values(&[sample]) {
                Values::F32(values) if !field.name.starts_with("view_") => {
                    assert!(values[0].is_nan(), "{}", field.name);
                }
                Values::U32(values) if field.name == "object" => assert_eq!(values, [u32::MAX]),
                _ => {}
            }
        }
    }
}
