//! The folder of a study, schema `tracegen.techniques/1` (see docs/use/techniques-folder.md).
//!
//! A complete row is stored in its own file, so that an interrupted study resumes.

use super::auto::AutoRecord;
use super::counted::Counted;
use anyhow::{Context, ensure};
use formats::Trace;
use formats::container::{check_regular, checksum, read_regular};
use formats::technique_study;
use formats::text::json_text;
use serde::{Deserialize, Serialize};
use shell::cannot_write;
use std::fs;
use std::path::{Path, PathBuf};
use techniques::Settings;
use techniques::layer::Predicted;
use xxhash_rust::xxh3::xxh3_64;

/// The manifest. Without rows it is the configuration of the study, and stored rows are reused as long as that
/// stays the same.
pub type Manifest = technique_study::Manifest<RowRecord, AutoRecord>;

/// A measured row, see [`super::rows`].
pub type RowRecord = technique_study::Row<Settings, FrameRecord>;

/// A frame of a row.
pub type FrameRecord = technique_study::Frame<Counted, Predicted>;

/// The schema of the JSON object.
#[cfg(test)]
pub(crate) fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<Manifest>(technique_study::SCHEMA)
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
    pub fn create(root: &Path, study: &Manifest) -> anyhow::Result<Self> {
        for folder in ["rows", "images", "traces"] {
            let path = root.join(folder);
            fs::create_dir_all(&path).with_context(|| cannot_write(&path))?;
            remove_temporaries(&path).with_context(|| cannot_write(&path))?;
        }
        Ok(Self {
            root: root.to_owned(),
            key: xxh3_64(&serde_json::to_vec(study)?),
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
        trace
            && frames.all(|f| {
                f.images
                    .iter()
                    .zip(f.image_checksums.iter().flatten())
                    .all(picture)
            })
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

    /// Writes the manifest, which completes the study.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(&self, manifest: &Manifest) -> anyhow::Result<PathBuf> {
        let path = self.root.join("manifest.json");
        write_json(&path, manifest)?;
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
    shell::write_file(path, json_text(value)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subject(frames: &[u32]) -> Manifest {
        Manifest {
            schema: technique_study::SCHEMA.into(),
            tool: "test".into(),
            scene: "test".into(),
            scene_triangles: 1,
            instances: 1,
            camera: "test".into(),
            path: Some("walk".into()),
            path_frames: 72,
            frames: frames.to_vec(),
            fps: 72.0,
            time_s: 0.0,
            animation: None,
            size_px: [4, 4],
            hmd: formats::view::Hmd::default(),
            lens: [formats::view::Lens {
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
            trace_encoding: "delta".into(),
            shadow_cascades: 0,
            input_checksum: String::new(),
            rows: Vec::new(),
            auto: None,
            multiview_defect: None,
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
            texture_bytes: None,
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
