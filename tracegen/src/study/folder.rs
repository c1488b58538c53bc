//! The folder of a study, schema `tracegen.techniques/1` (see docs/use/techniques-folder.md).
//!
//! A complete row is stored in its own file, so that an interrupted study resumes.

use super::auto::AutoRecord;
use super::counted::Counted;
use anyhow::{Context, ensure};
use formats::Trace;
use formats::container::{AtomicFile, check_regular, checksum, read_regular};
use formats::textrace::Encoding;
use formats::view::{Hmd, Lens};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use techniques::Settings;
use techniques::layer::Predicted;
use xxhash_rust::xxh3::xxh3_64;

const SCHEMA: &str = "tracegen.techniques/1";

/// Configuration of a study: the manifest without rows. Stored rows are reused as long as it stays the same.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct StudySetup {
    /// Program and version.
    pub tool: String,
    /// Scene as given.
    pub scene: String,
    /// Triangles, including instances.
    pub scene_triangles: u64,
    /// Instances.
    pub instances: u64,
    /// Name of the camera.
    pub camera: String,
    /// The head's path as given.
    pub path: String,
    /// Frames of that path.
    pub path_frames: u32,
    /// Numbers of the measured frames, ascending.
    pub frames: Vec<u32>,
    /// Frames per second along the path.
    pub fps: f32,
    /// Scene time of the path's first frame.
    #[serde(skip_serializing_if = "is_zero")]
    pub time_s: f64,
    /// The animation that plays, as given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animation: Option<String>,
    /// Width and height of an eye's picture.
    pub size_px: [u32; 2],
    /// The display.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    pub hmd: Hmd,
    /// Visible parts of the left and right eye's pictures.
    #[cfg_attr(
        test,
        schemars(with = "[serde_json::Map<String, serde_json::Value>; 2]")
    )]
    pub lens: [Lens; 2],
    /// At the centre of an eye's picture.
    pub pixels_per_degree: f32,
    /// Device that renders.
    pub adapter: String,
    /// Its driver.
    pub driver: String,
    /// Whether the device is the processor, so that times are processor time.
    pub software_driver: bool,
    /// Technique that the others are compared with.
    pub baseline: String,
    /// Repetitions of each frame's timing.
    pub repeats: u32,
    /// Frames of each row's trace.
    pub trace_frames: Vec<u32>,
    /// How the tiles of the traces are packed.
    #[cfg_attr(test, schemars(with = "String"))]
    pub trace_encoding: Encoding,
    /// Shadow cascades.
    pub shadow_cascades: u32,
    /// Checksum of the files that scene and path are read from.
    pub input_checksum: String,
}

/// Omits a time of zero from manifests.
fn is_zero(time_s: &f64) -> bool {
    *time_s == 0.0
}

/// A measured row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RowRecord {
    /// Name, see [`super::rows`].
    pub technique: String,
    /// Title for readers.
    pub title: String,
    /// Settings of its capture.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    pub settings: Settings,
    /// Techniques that it consists of.
    pub parts: Vec<String>,
    /// Whether no visible pixel may change.
    pub lossless: bool,
    /// One per measured frame.
    pub frames: Vec<FrameRecord>,
    /// Peak memory of the process, if the system reports it.
    pub peak_memory_bytes: Option<u64>,
    /// Texels of the scene, which do not depend on the technique.
    #[serde(default)]
    pub texture_bytes: u64,
    /// Texture trace, relative to the folder.
    pub trace: Option<String>,
    /// Its content checksum.
    pub trace_checksum: Option<String>,
    /// Frames of the trace.
    pub trace_frames: Vec<u32>,
}

/// A frame of a row. Names with `_s` are times, which differ from run to run; nothing else does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct FrameRecord {
    /// Number.
    pub frame: u32,
    /// Boxes tested against volumes.
    pub cull_tests: u64,
    /// Time of culling, the median of the repeats.
    pub cull_s: f64,
    /// Draws that were culled although they are visible through the lens, both eyes.
    pub false_negatives: Option<u64>,
    /// Draws that were submitted although they are not visible through the lens, both eyes.
    pub false_positives: Option<u64>,
    /// Draws submitted.
    pub draws: u64,
    /// Calls that submitted them.
    pub draw_calls: u64,
    /// Pipelines, materials and meshes set.
    pub state_changes: u64,
    /// Vertices of the draws' meshes.
    pub vertices: u64,
    /// Triangles of the draws.
    pub triangles: u64,
    /// Covered 2x2 quads.
    pub quads: Option<u64>,
    /// Shaded fragments.
    pub fragments: Option<u64>,
    /// Bytes written to the device for views and lists of draws.
    pub bytes_uploaded: u64,
    /// Memory traffic by counts; none if the device cannot capture.
    #[serde(default)]
    pub counted: Option<Counted>,
    /// The sum of these bytes.
    #[serde(default)]
    pub memory_bytes: Option<u64>,
    /// Energy of the counts.
    #[serde(default)]
    pub energy_mj: Option<f64>,
    /// Bytes of pictures read and written, if the frame was reprojected from the one before.
    #[serde(default)]
    pub bytes_reprojected: u64,
    /// Bytes of the colour that the frame is rendered into.
    #[serde(default)]
    pub target_color_bytes: u64,
    /// Bytes of its depth buffers that exist at the same time.
    #[serde(default)]
    pub target_depth_bytes: u64,
    /// Times of the frame without capture, one per repetition.
    pub frame_s: Vec<f64>,
    /// Times of the baseline's frame, each measured next to the repetition.
    pub baseline_s: Vec<f64>,
    /// Processor time of the frame in each repetition over all threads, if the system reports it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub processor_s: Vec<f64>,
    /// Processor time of the baseline next to it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub baseline_processor_s: Vec<f64>,
    /// Processor time by stage, the median of the repetitions.
    pub stages_s: BTreeMap<String, f64>,
    /// Left and right picture, relative to the folder.
    pub images: [String; 2],
    /// CRC-32 of their files.
    pub image_checksums: [String; 2],
    /// Errors that the techniques predict.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    pub predicted: Predicted,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Manifest<'a> {
    schema: &'static str,
    #[serde(flatten)]
    subject: &'a StudySetup,
    rows: &'a [RowRecord],
    #[serde(skip_serializing_if = "Option::is_none")]
    auto: Option<&'a AutoRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    multiview_defect: Option<&'a str>,
}

/// The schema of the JSON object.
#[cfg(test)]
pub(crate) fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<Manifest<'_>>(SCHEMA)
}

/// A finished row with the key of its study.
#[derive(Serialize, Deserialize)]
struct Kept<T> {
    key: String,
    row: T,
}

/// The folder of a study.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    /// Key of the study's configuration.
    key: u64,
}

/// Checks before the measurements that `root` is a folder of a study, or can become one.
///
/// # Errors
/// A file in its place, a folder with other content, or one that holds an input.
pub fn check(root: &Path, inputs: &[PathBuf]) -> anyhow::Result<()> {
    ensure!(
        !root.as_os_str().is_empty() && !formats::container::is_stdout(root),
        "--output: expected a folder, found '{}'",
        root.display()
    );
    if !root.exists() {
        return Ok(());
    }
    let named = || format!("--output {}", root.display());
    ensure!(
        root.is_dir(),
        "{}: expected a folder, found a file",
        named()
    );
    let whole = root.canonicalize().with_context(named)?;
    for input in inputs {
        let inside = input
            .canonicalize()
            .is_ok_and(|input| input.starts_with(&whole));
        ensure!(!inside, "{}: holds the input {}", named(), input.display());
    }
    let mut entries = fs::read_dir(root).with_context(named)?;
    ensure!(
        entries.next().is_none()
            || root.join("manifest.json").exists()
            || root.join("rows").is_dir(),
        "{}: expected an empty folder or that of an earlier study, found other files",
        named()
    );
    let own = ["manifest.json", "rows", "images", "traces"].map(|name| root.join(name));
    own.iter().try_for_each(|path| check_regular_below(path))
}

/// Refuses pipes and devices where the study reads and writes files. Otherwise they would only be found after
/// minutes of measuring.
fn check_regular_below(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path).with_context(|| path.display().to_string())? {
            check_regular_below(&entry?.path())?;
        }
    } else if path.exists() {
        check_regular(path).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Removes the temporary files (see `formats::container::atomic`) below a folder.
fn remove_temporaries(folder: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let (name, kind) = (entry.file_name(), entry.file_type()?);
        let name = name.to_string_lossy();
        if kind.is_dir() {
            remove_temporaries(&entry.path())?;
        } else if kind.is_file() && name.starts_with('.') && name.ends_with(".part") {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

impl Folder {
    /// Creates the folder of a study, or opens an earlier one and removes unfinished files.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn create(root: &Path, subject: &StudySetup) -> anyhow::Result<Self> {
        for folder in ["rows", "images", "traces"] {
            let path = root.join(folder);
            fs::create_dir_all(&path).with_context(|| cannot_write(&path))?;
            remove_temporaries(&path).with_context(|| cannot_write(&path))?;
        }
        Ok(Self {
            root: root.to_owned(),
            key: xxh3_64(&serde_json::to_vec(subject)?),
        })
    }

    /// The trace of a row: its path in the folder, and the file.
    pub fn trace(&self, row: &str) -> (String, PathBuf) {
        let name = format!("traces/{row}.textrace");
        let path = self.root.join(&name);
        (name, path)
    }

    /// Writes both eyes' pictures of a frame (sRGB RGBA8). Returns their paths in the folder and the
    /// checksums of the files.
    ///
    /// # Errors
    /// The files cannot be written.
    pub fn write_images(
        &self,
        row: &str,
        frame: u32,
        pictures: &[Vec<u8>],
        size_px: [u32; 2],
    ) -> anyhow::Result<[[String; 2]; 2]> {
        let folder = self.root.join("images").join(row);
        fs::create_dir_all(&folder).with_context(|| cannot_write(&folder))?;
        let names = ["left", "right"].map(|eye| format!("images/{row}/{frame:04}-{eye}.png"));
        let mut checksums = [String::new(), String::new()];
        for ((name, picture), sum) in names.iter().zip(pictures).zip(&mut checksums) {
            let path = self.root.join(name);
            crate::picture::prepare_side_by_side(&path, std::slice::from_ref(picture), size_px)
                .and_then(|file| Ok(file.persist()?))
                .with_context(|| cannot_write(&path))?;
            *sum = checksum(&read_regular(&path).with_context(|| path.display().to_string())?);
        }
        Ok([names, checksums])
    }

    /// A finished row of this study, if it and all its files exist unchanged.
    pub fn finished(&self, name: &str, settings: &Settings) -> Option<RowRecord> {
        let row: RowRecord = self.kept(name, settings)?;
        self.is_whole(&row).then_some(row)
    }

    /// Whether the row's pictures and its trace have the checksums in the row.
    pub fn is_whole(&self, row: &RowRecord) -> bool {
        let picture = |(file, sum): (&String, &String)| {
            read_regular(&self.root.join(file)).is_ok_and(|bytes| checksum(&bytes) == *sum)
        };
        let trace = match &row.trace {
            Some(file) => trace_checksum(&self.root.join(file)).ok() == row.trace_checksum,
            None => true,
        };
        let mut frames = row.frames.iter();
        trace && frames.all(|f| f.images.iter().zip(&f.image_checksums).all(picture))
    }

    /// Stores a finished row.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn keep(&self, row: &RowRecord) -> anyhow::Result<()> {
        self.write_kept(&row.technique, &row.settings, row)
    }

    /// The result that an earlier run of this study stored for a question under a name.
    pub fn kept<T: for<'de> Deserialize<'de>>(
        &self,
        name: &str,
        question: &impl Serialize,
    ) -> Option<T> {
        let bytes = read_regular(&self.row_path(name)).ok()?;
        let kept: Kept<T> = serde_json::from_slice(&bytes).ok()?;
        (kept.key == self.row_key(question)).then_some(kept.row)
    }

    /// Stores the result for a question under a name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_kept(
        &self,
        name: &str,
        question: &impl Serialize,
        row: &impl Serialize,
    ) -> anyhow::Result<()> {
        let kept = Kept {
            key: self.row_key(question),
            row,
        };
        write_json(&self.row_path(name), &kept)
    }

    /// Writes the manifest, which completes the study. `multiview_defect` is the reason why the device drew
    /// one view after the other although both were to be drawn at once.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(
        &self,
        subject: &StudySetup,
        rows: &[RowRecord],
        auto: Option<&AutoRecord>,
        multiview_defect: Option<&str>,
    ) -> anyhow::Result<PathBuf> {
        let path = self.root.join("manifest.json");
        let schema = SCHEMA;
        write_json(
            &path,
            &Manifest {
                schema,
                subject,
                rows,
                auto,
                multiview_defect,
            },
        )?;
        Ok(path)
    }

    fn row_path(&self, name: &str) -> PathBuf {
        self.root.join("rows").join(format!("{name}.json"))
    }

    /// Hash of everything that a row depends on: the study and the row's settings.
    fn row_key(&self, question: &impl Serialize) -> String {
        let text = serde_json::to_string(question).unwrap_or_default();
        format!(
            "{:016x}",
            xxh3_64(format!("{:016x}{text}", self.key).as_bytes())
        )
    }
}

/// Content checksum of a trace, read to its end.
///
/// # Errors
/// The file cannot be read, or is not a whole trace.
pub fn trace_checksum(path: &Path) -> anyhow::Result<String> {
    check_regular(path).with_context(|| path.display().to_string())?;
    Ok(format!("{:08x}", Trace::open(path)?.content_checksum()))
}

fn write_json(path: &Path, value: &impl Serialize) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(value)? + "\n";
    AtomicFile::write_whole(path, text.as_bytes()).with_context(|| cannot_write(path))
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subject(frames: &[u32]) -> StudySetup {
        StudySetup {
            tool: "test".into(),
            scene: "test".into(),
            scene_triangles: 1,
            instances: 1,
            camera: "test".into(),
            path: "walk".into(),
            path_frames: 72,
            frames: frames.to_vec(),
            fps: 72.0,
            time_s: 0.0,
            animation: None,
            size_px: [4, 4],
            hmd: Hmd::default(),
            lens: [Lens {
                center: [0.0; 2],
                radius: 1.0,
            }; 2],
            pixels_per_degree: 7.0,
            adapter: "test".into(),
            driver: "test".into(),
            software_driver: true,
            baseline: "per-eye".into(),
            repeats: 1,
            trace_frames: Vec::new(),
            trace_encoding: Encoding::Delta,
            shadow_cascades: 0,
            input_checksum: String::new(),
        }
    }

    fn row(trace: Option<&str>) -> RowRecord {
        RowRecord {
            technique: "conical".into(),
            title: "Conical culling".into(),
            settings: Settings::default(),
            parts: vec!["conical".into()],
            lossless: true,
            frames: Vec::new(),
            peak_memory_bytes: None,
            texture_bytes: 0,
            trace: trace.map(str::to_owned),
            trace_checksum: trace.map(|_| "0badcafe".to_owned()),
            trace_frames: Vec::new(),
        }
    }

    #[test]
    fn a_row_is_reused_by_the_same_study_with_the_same_settings_and_all_files_there() {
        let root = tempfile::tempdir().unwrap();
        let folder = Folder::create(root.path(), &subject(&[0])).unwrap();
        let settings = Settings::default();
        assert_eq!(folder.finished("conical", &settings), None);
        let kept = row(None);
        folder.keep(&kept).unwrap();
        assert_eq!(folder.finished("conical", &settings), Some(kept));
        let other = Folder::create(root.path(), &subject(&[0, 1])).unwrap();
        assert_eq!(other.finished("conical", &settings), None);
        let masked = Settings {
            hidden_area_mask: true,
            ..Settings::default()
        };
        assert_eq!(folder.finished("conical", &masked), None);
        let (name, path) = folder.trace("conical");
        folder.keep(&row(Some(&name))).unwrap();
        assert_eq!(folder.finished("conical", &settings), None);
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../traces/atrium.textrace");
        let whole = fs::read(golden).unwrap();
        fs::write(&path, &whole).unwrap();
        // Another trace than the row's.
        assert_eq!(folder.finished("conical", &settings), None);
        let mut kept = row(Some(&name));
        kept.trace_checksum = Some(trace_checksum(&path).unwrap());
        folder.keep(&kept).unwrap();
        assert_eq!(folder.finished("conical", &settings), Some(kept));
        fs::write(&path, &whole[..whole.len() - 100]).unwrap();
        assert_eq!(folder.finished("conical", &settings), None);
        fs::write(folder.row_path("conical"), "{\"key\":").unwrap();
        assert_eq!(folder.finished("conical", &settings), None);
    }

    #[test]
    fn a_folder_of_something_else_is_left_alone() {
        let root = tempfile::tempdir().unwrap();
        let refused =
            |path: &Path, inputs: &[PathBuf]| check(path, inputs).unwrap_err().to_string();
        check(root.path(), &[]).unwrap();
        check(&root.path().join("new"), &[]).unwrap();
        let file = root.path().join("file.obj");
        fs::write(&file, "").unwrap();
        assert!(refused(&file, &[]).contains("found a file"));
        assert!(refused(root.path(), &[]).contains("found other files"));
        assert!(refused(root.path(), std::slice::from_ref(&file)).contains("holds the input"));
        assert!(refused(Path::new("-"), &[]).contains("expected a folder"));
        Folder::create(root.path(), &subject(&[0])).unwrap();
        check(root.path(), &[]).unwrap();
    }
}
