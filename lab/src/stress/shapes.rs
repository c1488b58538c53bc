//! Small scenes as text, and files of their textures.

use serde_json::json;
use std::f64::consts::PI;
use std::fmt::Write;

/// Triangles with texture coordinates.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    pub positions: Vec<[f64; 3]>,
    /// One per position.
    pub uvs: Vec<[f64; 2]>,
    pub triangles: Vec<[usize; 3]>,
}

impl Shape {
    /// A unit sphere; vertices and coordinates are multiples of 2^-20.
    pub fn sphere() -> Self {
        const COLUMNS: usize = 48;
        const ROWS: usize = 24;
        let snap = |x: f64| (x * f64::from(1 << 20)).round() / f64::from(1 << 20);
        let mut sphere = Self::default();
        for row in 0..=ROWS {
            let v = row as f64 / ROWS as f64;
            let (sine, cosine) = (PI * v).sin_cos();
            for column in 0..=COLUMNS {
                let u = column as f64 / COLUMNS as f64;
                let (z, x) = (2.0 * PI * u).sin_cos();
                sphere
                    .positions
                    .push([sine * x, cosine, sine * z].map(snap));
                sphere.uvs.push([u, v].map(snap));
            }
        }
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let a = row * (COLUMNS + 1) + column;
                let (b, c) = (a + 1, a + COLUMNS + 1);
                sphere.triangles.extend([[a, b, c + 1], [a, c + 1, c]]);
            }
        }
        sphere
    }

    /// A square of 2 by 2 that faces +z, of `cells` by `cells` squares; coordinates 0 to 1.
    pub fn square(cells: usize) -> Self {
        let mut square = Self::default();
        let part = |k: usize| k as f64 / cells as f64;
        for row in 0..=cells {
            for column in 0..=cells {
                let (x, y) = (2.0 * part(column) - 1.0, 2.0 * part(row) - 1.0);
                square.positions.push([x, y, 0.0]);
                square.uvs.push([part(column), part(row)]);
            }
        }
        for row in 0..cells {
            for column in 0..cells {
                let a = row * (cells + 1) + column;
                let d = a + cells + 2;
                square.triangles.extend([[a, a + 1, d], [a, d, d - 1]]);
            }
        }
        square
    }

    /// Triangles of all sizes around the origin: some close to it, some across the eyes, none beyond `reach`.
    pub fn clutter(count: usize, reach: f64) -> Self {
        let mut state = 1_u64;
        let mut random = || {
            state = (state.wrapping_mul(6_364_136_223_846_793_005))
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let mut clutter = Self::default();
        for _ in 0..count {
            let mut around = |size: f64| [(); 3].map(|()| (2.0 * random() - 1.0) * size);
            let (center, far) = (around(1.0), around(1.0)[0].abs());
            let center = center.map(|x| x * reach * far);
            let corners = [
                around(0.3 * reach * far),
                around(0.3 * reach * far),
                around(0.3 * reach * far),
            ];
            let first = clutter.positions.len();
            for corner in corners {
                clutter
                    .positions
                    .push([0, 1, 2].map(|axis| center[axis] + corner[axis]));
                clutter.uvs.push([2.0 * random(), 2.0 * random()]);
            }
            clutter.triangles.push([first, first + 1, first + 2]);
        }
        clutter
    }

    /// Applies functions to every position and coordinate.
    pub fn map(
        mut self,
        position: impl Fn([f64; 3]) -> [f64; 3],
        uv: impl Fn([f64; 2]) -> [f64; 2],
    ) -> Self {
        self.positions.iter_mut().for_each(|p| *p = position(*p));
        self.uvs.iter_mut().for_each(|c| *c = uv(*c));
        self
    }

    /// Enlarged by `scale` from the origin, then moved.
    pub fn placed(self, scale: f64, at: [f64; 3]) -> Self {
        self.map(
            |p| [0, 1, 2].map(|axis| at[axis] + scale * p[axis]),
            |uv| uv,
        )
    }

    /// OBJ text; `material` refers to `stress.mtl`, if given.
    pub fn obj(&self, material: Option<&str>) -> String {
        let mut obj = String::new();
        if let Some(name) = material {
            let _ = writeln!(obj, "mtllib stress.mtl\nusemtl {name}");
        }
        for ([x, y, z], [u, v]) in self.positions.iter().zip(&self.uvs) {
            let _ = writeln!(obj, "v {x} {y} {z}\nvt {u} {v}");
        }
        for [a, b, c] in self.triangles.iter().map(|t| t.map(|v| v + 1)) {
            let _ = writeln!(obj, "f {a}/{a} {b}/{b} {c}/{c}");
        }
        obj
    }

    /// glTF text with the shape in a node, a camera in another, and its buffer.
    pub fn gltf(&self, node: &serde_json::Value, camera: &serde_json::Value) -> String {
        let positions = self.positions.iter().flatten().map(|&v| v as f32);
        let uvs = self.uvs.iter().flatten().map(|&v| v as f32);
        let indices = self.triangles.iter().flatten().map(|&v| v as u32);
        let bytes: Vec<u8> = (positions.chain(uvs).flat_map(f32::to_le_bytes))
            .chain(indices.flat_map(u32::to_le_bytes))
            .collect();
        let uri = bytes.iter().fold(
            "data:application/octet-stream,".to_owned(),
            |mut uri, byte| {
                let _ = write!(uri, "%{byte:02x}");
                uri
            },
        );
        let count = self.positions.len();
        let mut node = node.clone();
        node["mesh"] = json!(0);
        json!({
            "asset": {"version": "2.0"},
            "nodes": [node, camera["node"]],
            "cameras": [{"type": "perspective", "perspective": camera["perspective"]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"},
                {"bufferView": 0, "byteOffset": 12 * count, "componentType": 5126, "count": count, "type": "VEC2"},
                {"bufferView": 0, "byteOffset": 20 * count, "componentType": 5125, "count": 3 * self.triangles.len(), "type": "SCALAR"}
            ],
            "bufferViews": [{"buffer": 0, "byteLength": bytes.len()}],
            "buffers": [{"byteLength": bytes.len(), "uri": uri}]
        })
        .to_string()
    }
}

/// A material library: `checker` repeats `stress.png`, `clamped` does not; `masked` has the holes of
/// `holes.png`, `blended` transmits half of the light.
pub(super) const MATERIALS: &str = "newmtl checker\nmap_Kd stress.png\n\
                                    newmtl clamped\nmap_Kd -clamp on stress.png\n\
                                    newmtl masked\nmap_Kd holes.png\nmap_d holes.png\n\
                                    newmtl blended\nmap_Kd stress.png\nd 0.5\n";

/// A PNG of this size.
pub(super) fn checker(size: [u32; 2]) -> anyhow::Result<Vec<u8>> {
    let texel = |x: u32, y: u32| {
        image::Luma([if (x / 4 + y / 4).is_multiple_of(2) {
            220
        } else {
            40
        }])
    };
    png(image::GrayImage::from_fn(size[0], size[1], texel))
}

/// A PNG of this size with round holes.
pub(super) fn holes(size: [u32; 2]) -> anyhow::Result<Vec<u8>> {
    let texel = |x: u32, y: u32| {
        let off = |v: u32| f64::from(v % 16) - 7.5;
        let solid = off(x).hypot(off(y)) > 5.0;
        image::Rgba([200, 120, 60, if solid { 255 } else { 0 }])
    };
    png(image::RgbaImage::from_fn(size[0], size[1], texel))
}

fn png(picture: impl Into<image::DynamicImage>) -> anyhow::Result<Vec<u8>> {
    let mut png = std::io::Cursor::new(Vec::new());
    let picture: image::DynamicImage = picture.into();
    picture.write_to(&mut png, image::ImageFormat::Png)?;
    Ok(png.into_inner())
}
