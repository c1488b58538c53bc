//! Opens files that a program finds by itself, in a folder or by a reference in another file. Only regular
//! files are opened, because a pipe would block until it has a writer, and a device may have no end.

use super::kind_of;
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

/// The metadata of a regular file, following links; the file is not opened.
///
/// # Errors
/// The file is missing or not a regular file.
pub fn check_regular(path: &Path) -> io::Result<Metadata> {
    let found = std::fs::metadata(path)?;
    if found.is_file() {
        return Ok(found);
    }
    let found = kind_of(&found);
    Err(io::Error::other(format!(
        "expected a regular file, found {found}"
    )))
}

/// Opens a regular file.
///
/// # Errors
/// See [`check_regular`]; or the file cannot be opened.
pub fn open_regular(path: &Path) -> io::Result<File> {
    check_regular(path)?;
    File::open(path)
}

/// The bytes of a regular file.
///
/// # Errors
/// See [`open_regular`]; or the file cannot be read.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// CRC-32 of a file's bytes as 8 hexadecimal digits, the form used in manifests.
pub fn checksum(bytes: &[u8]) -> String {
    format!("{:08x}", crc32fast::hash(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("file"), b"abc").unwrap();
        std::os::unix::fs::symlink("file", path("link")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", path("zero")).unwrap();
        let made = std::process::Command::new("mkfifo")
            .arg(path("pipe"))
            .status();
        assert!(made.unwrap().success());
        for name in ["file", "link"] {
            assert_eq!(read_regular(&path(name)).unwrap(), b"abc");
        }
        for (name, kind) in [("pipe", "a pipe"), ("zero", "a device"), (".", "a folder")] {
            let error = open_regular(&path(name)).unwrap_err().to_string();
            assert_eq!(error, format!("expected a regular file, found {kind}"));
        }
    }
}
