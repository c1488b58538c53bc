//! Output files that appear under their name completely or not at all.

use super::inputs::replaced_input;
use std::collections::BTreeSet;
use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tempfile::{NamedTempFile, TempPath};

/// Temporary files and folders that a signal handler must remove. They are created, renamed and removed
/// while the lock is held, so the list is always complete.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

pub(super) fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every unfinished file and folder of this process, which must end afterwards: no output can be
/// started or finished any more, and threads that try block forever.
pub fn discard_unfinished() {
    let files = unfinished();
    for file in &*files {
        // Errors are ignored because the process is ending.
        let _gone = fs::remove_file(file).or_else(|_| fs::remove_dir_all(file));
    }
    std::mem::forget(files);
}

/// Whether an output is standard output, which `-` names; a file with that name is `./-`.
pub fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// A file that appears under its name once it is complete. If dropped earlier, it leaves nothing behind. It
/// replaces regular files only, and keeps their permissions.
///
/// The target `-` is standard output; the content is copied there when it is complete.
#[derive(Debug)]
pub struct AtomicFile {
    writer: BufWriter<File>,
    // The file is removed before its entry in the list.
    path: TempPath,
    _listed: Listed,
    target: PathBuf,
}

/// An entry of [`UNFINISHED`].
#[derive(Debug)]
pub(super) struct Listed(pub PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        unfinished().remove(&self.0);
    }
}

impl AtomicFile {
    /// Opens a temporary file in the folder of `target`.
    ///
    /// # Errors
    /// See [`check_target`].
    pub fn create(target: &Path) -> io::Result<Self> {
        if !is_stdout(target) {
            check_name(target)?;
        }
        let mut files = unfinished();
        let (file, path) = temporary(target)?.into_parts();
        let listed = path.to_path_buf();
        files.insert(listed.clone());
        Ok(Self {
            writer: BufWriter::with_capacity(1 << 20, file),
            path,
            _listed: Listed(listed),
            target: target.to_owned(),
        })
    }

    /// Writes a whole file.
    ///
    /// # Errors
    /// The file cannot be written; the target is then unchanged.
    pub fn write_whole(target: &Path, bytes: &[u8]) -> io::Result<()> {
        let mut file = Self::create(target)?;
        file.write_all(bytes)?;
        file.persist()
    }

    /// Appends the next `bytes` bytes of a file, which the system copies without passing them to this process
    /// where it can. Returns how many there were.
    ///
    /// # Errors
    /// A failure of reading or writing.
    pub fn append_from(&mut self, file: &File, bytes: u64) -> io::Result<u64> {
        self.writer.flush()?;
        io::copy(&mut file.take(bytes), self.writer.get_mut())
    }

    /// Flushes and renames the file over its target.
    ///
    /// # Errors
    /// Flushing or renaming failed; the target is then unchanged.
    pub fn persist(self) -> io::Result<()> {
        let mut file = self.writer.into_inner().map_err(io::Error::from)?;
        if is_stdout(&self.target) {
            file.seek(SeekFrom::Start(0))?;
            let mut stdout = io::stdout().lock();
            io::copy(&mut file, &mut stdout)?;
            return stdout.flush();
        }
        if let Some(replaced) = check_name(&self.target)? {
            file.set_permissions(replaced.permissions())?;
        }
        let _held = unfinished();
        self.path.persist(&self.target)?;
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.writer.seek(position)
    }
}

/// Checks whether an [`AtomicFile`] could be written to `target`, without leaving anything there.
///
/// # Errors
/// `target` is not a regular file (a folder, a device, a pipe, a symbolic link, ...), is not writable, is a
/// declared input, or is in a folder that does not exist or is not writable.
pub fn check_target(target: &Path) -> io::Result<()> {
    if !is_stdout(target) {
        check_name(target)?;
        let _held = unfinished();
        temporary(target)?;
    }
    Ok(())
}

/// The regular file that `target` would replace, if there is one.
fn check_name(target: &Path) -> io::Result<Option<Metadata>> {
    let refuse = |expected: &str, found: String| {
        let message = format!("expected {expected}, found {found}");
        Err(io::Error::new(ErrorKind::InvalidInput, message))
    };
    let is_folder_name = target.as_os_str().as_encoded_bytes().ends_with(b"/");
    if target.file_name().is_none() || is_folder_name {
        return refuse("the name of a file", format!("\"{}\"", target.display()));
    }
    let folder = folder_of(target);
    if !folder.is_dir() {
        return refuse(&format!("a folder {}", folder.display()), "none".to_owned());
    }
    let found = match fs::symlink_metadata(target) {
        Ok(found) => found,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    if found.is_symlink() {
        let to = fs::read_link(target).unwrap_or_default();
        let found = format!("a symbolic link to {}", to.display());
        return refuse("a regular file or a new name", found);
    }
    if !found.is_file() {
        return refuse("a regular file or a new name", kind_of(&found).to_owned());
    }
    if found.permissions().readonly() {
        return refuse("a file that may be written", "a read-only one".to_owned());
    }
    if let Some(input) = replaced_input(target) {
        let message = format!("it would replace the input {}", input.display());
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    // Replacing a file needs write access only to its folder, but a read-only file should stay.
    fs::OpenOptions::new().write(true).open(target)?;
    Ok(Some(found))
}

/// The kind of a file system entry, as text.
pub fn kind_of(found: &Metadata) -> &'static str {
    if found.is_file() {
        return "a file";
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = found.file_type();
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
        if kind.is_fifo() {
            return "a pipe";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    if found.is_dir() {
        "a folder"
    } else {
        "something else"
    }
}

/// The folder of a file; an absolute or bare name has one, too.
pub(crate) fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Prefix and suffix of an unfinished file's name.
const UNFINISHED_NAME: (&str, &str) = (".", ".part");

/// Removes unfinished files that killed processes left in a folder: those that were not modified for `age`.
/// Returns their number.
///
/// # Errors
/// The folder cannot be read or written.
pub fn remove_abandoned(folder: &Path, age: Duration) -> io::Result<usize> {
    // The folder may be on another machine with another clock, so the time is taken from a new file.
    let now = {
        let _held = unfinished();
        let clock = temporary(&folder.join("clock"))?;
        clock.as_file().metadata()?.modified()?
    };
    let mut removed = 0;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.as_encoded_bytes();
        let is_unfinished = name.starts_with(UNFINISHED_NAME.0.as_bytes())
            && name.ends_with(UNFINISHED_NAME.1.as_bytes());
        if !is_unfinished {
            continue;
        }
        // Another process may have finished or removed the file.
        let Ok(found) = entry.metadata() else {
            continue;
        };
        let written = found.modified()?;
        let is_old = now.duration_since(written).is_ok_and(|since| since >= age);
        if found.is_file() && is_old && fs::remove_file(entry.path()).is_ok() {
            removed += 1;
        }
    }
    Ok(removed)
}

/// A temporary file on the file system of `target`, with the permissions of a normal new file.
fn temporary(target: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED_NAME.0).suffix(UNFINISHED_NAME.1);
    #[cfg(unix)]
    {
        // By default, temporary files are private. The umask still applies.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    if is_stdout(target) {
        builder.tempfile()
    } else {
        builder.tempfile_in(folder_of(target))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o7777
    }

    fn refused(path: &Path) -> String {
        let error = check_target(path).unwrap_err().to_string();
        assert_eq!(
            AtomicFile::create(path).unwrap_err().to_string(),
            error,
            "checked and created differently"
        );
        error
    }

    #[test]
    fn a_file_is_replaced_whole_with_its_permissions_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        check_target(&path).unwrap();
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        file.persist().unwrap();
        assert_eq!(
            (fs::read(&path).unwrap(), mode(&path)),
            (b"new".to_vec(), 0o640)
        );
        drop(AtomicFile::create(&path).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn entries_that_are_not_regular_files_are_refused_with_their_kind() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "").unwrap();
        symlink("file", at("link")).unwrap();
        let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        let name = "expected a regular file or a new name, found";
        assert_eq!(
            refused(&at("link")),
            format!("{name} a symbolic link to file")
        );
        assert_eq!(refused(&at("socket")), format!("{name} a socket"));
        assert_eq!(refused(folder.path()), format!("{name} a folder"));
        assert_eq!(refused(Path::new("/dev/null")), format!("{name} a device"));
        assert!(refused(&at("new/")).contains("the name of a file"));
        assert!(refused(Path::new("")).contains("the name of a file"));
        assert!(refused(&at("none/a")).ends_with("none, found none"));
        assert!(refused(&at("file/a")).ends_with("file, found none"));
    }

    #[test]
    fn a_read_only_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
        assert!(refused(&path).ends_with("found a read-only one"));
    }
    #[test]
    fn abandoned_files_are_removed_and_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let hour = Duration::from_secs(3600);
        for name in [".old.part", ".new.part", "old.part", "old.json"] {
            let file = File::create(at(name)).unwrap();
            if name.contains("old") {
                let written = file.metadata().unwrap().modified().unwrap() - 2 * hour;
                file.set_modified(written).unwrap();
            }
        }
        assert_eq!(remove_abandoned(folder.path(), hour).unwrap(), 1);
        assert!(!at(".old.part").exists() && at(".new.part").exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
        assert!(remove_abandoned(&at("none"), hour).is_err());
    }
}
