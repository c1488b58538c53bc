//! The rows of a trace as typed columns: records, samples, rays and their accesses.
//!
//! [`Tabular::FIELDS`] is the only list of the columns of a row type. Parquet, NPY and the Python package
//! use it. Values are those of the file, so fixed-point numbers stay integers.

use super::plain::PlainAccess;
use super::{Access, Origin, RayAccess, RaySample};
use crate::raytrace::{Hit, PixelRecord, RayGeometry, RayRecord};
use crate::textrace::{QuadRecord, Tile};
use crate::view::Eye;
use std::io::{self, Write};

macro_rules! column_types {
    ($($variant:ident $type:ident $numpy:literal $doc:literal)*) => {
        /// Reads a value of a row. The variant is the column's type.
        #[derive(Debug)]
        pub enum Get<R> {
            $(#[doc = $doc] $variant(fn(&R) -> $type),)*
        }

        /// The values of a column.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Values {
            $(#[doc = $doc] $variant(Vec<$type>),)*
        }

        impl Values {
            /// The values of several parts of a column, one after the other. All parts have the same type.
            pub fn joined(parts: &[&Self]) -> Option<Self> {
                Some(match parts.first()? {
                    $(Self::$variant(_) => Self::$variant(parts.iter().flat_map(|part| match part {
                        Self::$variant(values) => values.as_slice(),
                        _ => &[],
                    }).copied().collect()),)*
                })
            }
        }

        impl<R> Get<R> {
            /// The values of `rows`.
            pub fn values(&self, rows: &[R]) -> Values {
                match self {
                    $(Self::$variant(get) => Values::$variant(rows.iter().map(get).collect()),)*
                }
            }

            /// Appends the little-endian bytes of a row's value.
            pub fn append_bytes(&self, row: &R, bytes: &mut Vec<u8>) {
                match self {
                    $(Self::$variant(get) => bytes.extend(get(row).to_le_bytes()),)*
                }
            }

            /// The type as NumPy writes it.
            pub const fn numpy_type(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $numpy,)*
                }
            }
        }
    };
}
column_types! {
    U8 u8 "|u1" "Unsigned, 8 bits."
    U16 u16 "<u2" "Unsigned, 16 bits."
    U32 u32 "<u4" "Unsigned, 32 bits."
    U64 u64 "<u8" "Unsigned, 64 bits."
    I32 i32 "<i4" "Signed, 32 bits."
    F32 f32 "<f4" "Floating point, 32 bits."
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

impl<R> Field<R> {
    /// Writes a row's value as text in its shortest form: codes as names, numbers that are not finite as `NaN`.
    ///
    /// # Errors
    /// Errors of the underlying writer.
    pub fn write_text(&self, row: &R, out: &mut impl Write) -> io::Result<()> {
        match &self.get {
            Get::U8(get) => match self.codes.get(usize::from(get(row))) {
                Some(name) => out.write_all(name.as_bytes()),
                None => write!(out, "{}", get(row)),
            },
            Get::U16(get) => write!(out, "{}", get(row)),
            Get::U32(get) => write!(out, "{}", get(row)),
            Get::U64(get) => write!(out, "{}", get(row)),
            Get::I32(get) => write!(out, "{}", get(row)),
            Get::F32(get) if !get(row).is_finite() => out.write_all(b"NaN"),
            Get::F32(get) => Ok(serde_json::to_writer(out, &get(row))?),
        }
    }
}

/// A type of rows.
pub trait Tabular: Sized + Send + Sync + 'static {
    /// The columns, in order.
    const FIELDS: &'static [Field<Self>];

    /// The row without its texture or ray, if it is an access.
    fn plain(&self) -> Option<PlainAccess> {
        None
    }
}

/// The columns of a row type: name, type or `[names of codes]`, and value of a row.
macro_rules! columns {
    ($row:ident: $($name:literal $type:tt $value:expr),* $(,)?) => {
        &[$($crate::interop::columns::column!($name, $type, |$row: &Self| $value)),*]
    };
}
macro_rules! column {
    ($name:literal, [$codes:expr], $get:expr) => {
        $crate::interop::columns::Field {
            name: $name,
            codes: $codes,
            get: $crate::interop::columns::Get::U8($get),
        }
    };
    ($name:literal, $type:ident, $get:expr) => {
        $crate::interop::columns::Field {
            name: $name,
            codes: &[],
            get: $crate::interop::columns::Get::$type($get),
        }
    };
}
pub(super) use {column, columns};

/// A quad record and its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordRow {
    /// Its place.
    pub origin: Origin,
    /// The record.
    pub record: QuadRecord,
}

impl Tabular for RecordRow {
    const FIELDS: &'static [Field<Self>] = columns![r:
        "pass" U32 r.origin.pass,
        "tile" U32 r.origin.tile,
        "draw" U32 r.origin.draw,
        "primitive" U32 r.origin.primitive,
        "x" U8 r.record.x,
        "y" U8 r.record.y,
        "mask" U8 r.record.mask,
        "group" U8 r.record.group,
        "uv_u" I32 r.record.uv[0],
        "uv_v" I32 r.record.uv[1],
        "dx_u" I32 r.record.dx[0],
        "dx_v" I32 r.record.dx[1],
        "dy_u" I32 r.record.dy[0],
        "dy_v" I32 r.record.dy[1],
        "cross_u" I32 r.record.cross[0],
        "cross_v" I32 r.record.cross[1],
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

/// The columns of a row with a sample's place, and more columns.
macro_rules! place_columns {
    ($r:ident: $($more:tt)*) => {
        columns![$r:
            "eye" [EYES] $r.place.eye as u8,
            "tile" U32 $r.place.tile,
            "x" U32 $r.place.pixel[0],
            "y" U32 $r.place.pixel[1],
            "sample" U32 $r.place.sample,
            $($more)*
        ]
    };
}

/// The columns of a row with a ray, and more columns.
macro_rules! ray_columns {
    ($r:ident: $($more:tt)*) => {
        place_columns![$r:
            "ray" U32 $r.ray,
            "kind" [RAY_KINDS] $r.record.kind as u8,
            "outcome" [OUTCOMES] $r.record.outcome as u8,
            "depth" U8 $r.record.depth,
            "parent" U32 $r.record.parent,
            "steps" U32 $r.record.steps,
            "triangle_tests" U32 $r.record.triangle_tests,
            "alpha_tests" U32 $r.record.alpha_tests,
            $($more)*
        ]
    };
}

impl Tabular for RayRow {
    const FIELDS: &'static [Field<Self>] = ray_columns![r:];
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
    const FIELDS: &'static [Field<Self>] = ray_columns![r:
        "origin_x" F32 r.geometry.origin[0],
        "origin_y" F32 r.geometry.origin[1],
        "origin_z" F32 r.geometry.origin[2],
        "direction_x" F32 r.geometry.direction[0],
        "direction_y" F32 r.geometry.direction[1],
        "direction_z" F32 r.geometry.direction[2],
        "t_min" F32 r.geometry.t_min,
        "t_max" F32 r.geometry.t_max,
        "t" F32 r.geometry.hit.map_or(f32::NAN, |hit| hit.t),
        "slot" U32 r.geometry.hit.map_or(u32::MAX, |hit| hit.slot),
        "stack_depth" U32 r.geometry.stack_depth,
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

impl Tabular for SampleRow {
    const FIELDS: &'static [Field<Self>] = place_columns![r:
        "hit" U8 u8::from(r.record.hit.is_some()),
        "t" F32 r.measure(|hit| hit.t),
        "position_x" F32 r.measure(|hit| hit.position[0]),
        "position_y" F32 r.measure(|hit| hit.position[1]),
        "position_z" F32 r.measure(|hit| hit.position[2]),
        "geometric_normal_x" F32 r.measure(|hit| hit.geometric_normal[0]),
        "geometric_normal_y" F32 r.measure(|hit| hit.geometric_normal[1]),
        "geometric_normal_z" F32 r.measure(|hit| hit.geometric_normal[2]),
        "shading_normal_x" F32 r.measure(|hit| hit.shading_normal[0]),
        "shading_normal_y" F32 r.measure(|hit| hit.shading_normal[1]),
        "shading_normal_z" F32 r.measure(|hit| hit.shading_normal[2]),
        "uv_u" F32 r.measure(|hit| hit.uv[0]),
        "uv_v" F32 r.measure(|hit| hit.uv[1]),
        "primitive" U32 r.number(|hit| hit.primitive),
        "object" U32 r.number(|hit| hit.object),
        "material" U32 r.number(|hit| hit.material),
        "view_independent_r" F32 r.record.view_independent[0],
        "view_independent_g" F32 r.record.view_independent[1],
        "view_independent_b" F32 r.record.view_independent[2],
        "view_dependent_r" F32 r.record.view_dependent[0],
        "view_dependent_g" F32 r.record.view_dependent[1],
        "view_dependent_b" F32 r.record.view_dependent[2],
        "rays" U32 r.record.ray_count,
    ];
}

impl Tabular for Access {
    const FIELDS: &'static [Field<Self>] = columns![a:
        "address" U64 a.address,
        "pass" U32 a.pass,
        "tile" U32 a.tile,
        "draw" U32 a.draw,
        "primitive" U32 a.primitive,
        "pixel_x" U8 a.pixel_x,
        "pixel_y" U8 a.pixel_y,
        "texture" U32 a.texture,
        "layer" U16 a.layer,
        "level" U8 a.level,
        "x" U32 a.x,
        "y" U32 a.y,
    ];

    fn plain(&self) -> Option<PlainAccess> {
        Some(PlainAccess::read(self.address, self.bytes))
    }
}

impl Tabular for RayAccess {
    const FIELDS: &'static [Field<Self>] = columns![a:
        "address" U64 a.address,
        "bytes" U32 a.bytes,
        "eye" [EYES] a.eye as u8,
        "tile" U32 a.tile,
        "x" U32 a.x,
        "y" U32 a.y,
        "sample" U32 a.sample,
        "ray" U32 a.ray,
        "kind" [RAY_KINDS] a.kind as u8,
        "entry" [ENTRIES] a.entry as u8,
        "index" U32 a.index,
    ];

    fn plain(&self) -> Option<PlainAccess> {
        Some(PlainAccess::read(self.address, self.bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::super::CsvWriter;
    use super::*;
    use crate::raytrace::{Outcome, RayKind};
    use crate::textrace::NO_GROUP;

    fn names<R: Tabular>() -> Vec<&'static str> {
        R::FIELDS.iter().map(|field| field.name).collect()
    }

    #[test]
    fn accesses_have_the_columns_of_csv() {
        let (mut texture, mut ray) = (Vec::new(), Vec::new());
        CsvWriter::<_, Access>::new(&mut texture).unwrap();
        CsvWriter::<_, RayAccess>::new(&mut ray).unwrap();
        let text = |header| String::from_utf8(header).unwrap().trim().to_owned();
        assert_eq!(text(texture), names::<Access>().join(","));
        assert_eq!(text(ray), names::<RayAccess>().join(","));
    }

    #[test]
    fn codes_have_the_names_used_in_json() {
        let text = |value: serde_json::Value| value.as_str().unwrap().to_owned();
        for eye in [Eye::Left, Eye::Right] {
            assert_eq!(EYES[eye as usize], eye.to_string());
        }
        for kind in RayKind::ALL {
            assert_eq!(RAY_KINDS[kind as usize], kind.to_string());
        }
        for outcome in [Outcome::Miss, Outcome::Hit, Outcome::Occluded] {
            let name = OUTCOMES[outcome as usize];
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
