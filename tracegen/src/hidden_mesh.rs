//! Files of hidden-area meshes: this project's format, and recordings of a headset's runtime by hmdq.
//!
//! Coordinates are fractions of the picture's width and height. They start at the left and, unless a file in
//! this project's format says `"origin": "top-left"`, at the bottom, as in OpenVR.

use anyhow::{Context, bail, ensure};
use serde::Deserialize;
use serde_json::Value;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use techniques::hidden_mesh::{HiddenMesh, Triangle};

/// Larger files are refused.
const LONGEST_BYTES: u64 = 16 << 20;

/// Schema of this project's format.
pub const SCHEMA: &str = "parallax.hidden-area/1";

/// A file in this project's format.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    schema: String,
    #[serde(default)]
    origin: Corner,
    left: Vec<Triangle>,
    right: Vec<Triangle>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum Corner {
    #[default]
    BottomLeft,
    TopLeft,
}

/// An eye's mesh as hmdq writes it; other keys are ignored.
#[derive(Deserialize)]
struct Recorded {
    /// Corners of the triangles, three per triangle.
    verts_raw: Option<Vec<[f32; 2]>>,
    /// Distinct corners, and the convex polygons of their indices.
    verts_opt: Option<Vec<[f32; 2]>>,
    faces_opt: Option<Vec<Vec<usize>>>,
}

/// Reads a file in either format.
///
/// # Errors
/// A file that cannot be read, is too long, or holds no mesh; the message names the file and the key.
pub fn read(path: &Path) -> anyhow::Result<HiddenMesh> {
    let name = || format!("hidden-area mesh {}", path.display());
    // Opening a pipe would wait for a writer.
    let metadata = std::fs::metadata(path).with_context(name)?;
    ensure!(
        metadata.is_file(),
        "{}: expected a regular file, found another kind",
        name()
    );
    let mut bytes = Vec::new();
    let file = File::open(path).with_context(name)?;
    (file.take(LONGEST_BYTES + 1).read_to_end(&mut bytes)).with_context(name)?;
    ensure!(
        bytes.len() as u64 <= LONGEST_BYTES,
        "{}: expected at most {LONGEST_BYTES} bytes of JSON, found more",
        name()
    );
    parse(&bytes).with_context(name)
}

fn parse(bytes: &[u8]) -> anyhow::Result<HiddenMesh> {
    let value: Value = serde_json::from_slice(bytes).context("expected JSON")?;
    let places = [
        "/openvr/geometry/ham_mesh",
        "/oculus/geometry/default_fov/ham_mesh",
        "/geometry/ham_mesh",
        "/ham_mesh",
    ];
    if let Some(mesh) = places.iter().find_map(|place| value.pointer(place)) {
        return Ok(HiddenMesh {
            left: recorded(mesh, "Left")?,
            right: recorded(mesh, "Right")?,
        });
    }
    ensure!(
        value.get("schema").is_some(),
        "expected the key schema ({SCHEMA}) or ham_mesh (a recording of hmdq), found neither"
    );
    let own: Own = serde_json::from_value(value).with_context(|| {
        format!("expected left and right, lists of triangles [[x, y], [x, y], [x, y]], as {SCHEMA}")
    })?;
    ensure!(
        own.schema == SCHEMA,
        "schema: expected {SCHEMA}, found {}",
        own.schema
    );
    let upwards = |triangles: Vec<Triangle>| match own.origin {
        Corner::BottomLeft => triangles,
        Corner::TopLeft => {
            let turn = |triangle: Triangle| triangle.map(|[x, y]| [x, 1.0 - y]);
            triangles.into_iter().map(turn).collect()
        }
    };
    Ok(HiddenMesh {
        left: upwards(own.left),
        right: upwards(own.right),
    })
}

/// The triangles of an eye in a recording; none if the headset has no mesh.
fn recorded(mesh: &Value, eye: &str) -> anyhow::Result<Vec<Triangle>> {
    let place = || format!("ham_mesh.{eye}");
    let Some(value) = mesh.get(eye).filter(|value| !value.is_null()) else {
        return Ok(Vec::new());
    };
    let own: Recorded = serde_json::from_value(value.clone()).with_context(place)?;
    if let Some(corners) = own.verts_raw {
        let (triangles, rest) = corners.as_chunks::<3>();
        ensure!(
            rest.is_empty(),
            "{}.verts_raw: expected three corners a triangle, found {} corners",
            place(),
            corners.len()
        );
        return Ok(triangles.to_vec());
    }
    let (Some(corners), Some(faces)) = (own.verts_opt, own.faces_opt) else {
        bail!(
            "{}: expected verts_raw, or verts_opt and faces_opt",
            place()
        );
    };
    let mut triangles = Vec::new();
    for (number, face) in faces.iter().enumerate() {
        let corner = |at: &usize| {
            corners.get(*at).copied().with_context(|| {
                format!(
                    "{}.faces_opt[{number}]: expected corners below {}, found {at}",
                    place(),
                    corners.len()
                )
            })
        };
        // A convex polygon is a fan of triangles.
        let points = face
            .iter()
            .map(corner)
            .collect::<anyhow::Result<Vec<_>>>()?;
        if let [first, rest @ ..] = &points[..] {
            triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        }
    }
    Ok(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNER: Triangle = [[0.0, 0.0], [0.25, 0.0], [0.0, 0.5]];

    #[test]
    fn both_kinds_of_files_give_the_same_triangles() {
        let own = r#"{"schema": "parallax.hidden-area/1", "left": [[[0,0],[0.25,0],[0,0.5]]], "right": []}"#;
        let expected = HiddenMesh {
            left: vec![CORNER],
            right: Vec::new(),
        };
        assert_eq!(parse(own.as_bytes()).unwrap(), expected);
        let raw = r#"{"openvr": {"geometry": {"ham_mesh": {"Left": {"ham_area": 0.1, "verts_raw": [[0,0],[0.25,0],[0,0.5]]}, "Right": null}}}}"#;
        assert_eq!(parse(raw.as_bytes()).unwrap(), expected);
        let faces = r#"{"geometry": {"ham_mesh": {"Left": {"verts_opt": [[0,0.5],[0,0],[0.25,0]], "faces_opt": [[1,2,0]]}}}}"#;
        assert_eq!(parse(faces.as_bytes()).unwrap(), expected);
        let down = r#"{"schema": "parallax.hidden-area/1", "origin": "top-left", "left": [[[0,1],[0.25,1],[0,0.5]]], "right": []}"#;
        assert_eq!(parse(down.as_bytes()).unwrap(), expected);
    }

    #[test]
    fn a_polygon_is_a_fan_of_triangles() {
        let square = r#"{"ham_mesh": {"Left": {"verts_opt": [[0,0],[1,0],[1,1],[0,1]], "faces_opt": [[0,1,2,3]]}}}"#;
        let mesh = parse(square.as_bytes()).unwrap();
        assert_eq!(mesh.left.len(), 2);
        assert_eq!(mesh.shown(0, [8, 8]).count(), 0);
    }

    #[test]
    fn faults_of_a_file_are_reported() {
        for (text, part) in [
            ("", "expected JSON"),
            ("[]", "ham_mesh"),
            (
                r#"{"schema": "parallax.hidden-area/2", "left": [], "right": []}"#,
                "found parallax.hidden-area/2",
            ),
            (
                r#"{"schema": "parallax.hidden-area/1", "left": [[[0,0],[1,0]]], "right": []}"#,
                "lists of triangles",
            ),
            (
                r#"{"schema": "parallax.hidden-area/1", "left": [], "rigth": []}"#,
                "lists of triangles",
            ),
            (
                r#"{"ham_mesh": {"Left": {"verts_raw": [[0,0],[1,0]]}}}"#,
                "found 2 corners",
            ),
            (
                r#"{"ham_mesh": {"Left": {"ham_area": 0}}}"#,
                "expected verts_raw",
            ),
            (
                r#"{"ham_mesh": {"Left": {"verts_opt": [[0,0]], "faces_opt": [[0,1,2]]}}}"#,
                "found 1",
            ),
        ] {
            let error = format!("{:#}", parse(text.as_bytes()).unwrap_err());
            assert!(error.contains(part), "{text}: {error}");
        }
        let folder = tempfile::tempdir().unwrap();
        let error = format!("{:#}", read(folder.path()).unwrap_err());
        assert!(error.contains("regular file"), "{error}");
    }
}
