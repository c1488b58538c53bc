//! Opening files that programs find by themselves, in a folder or by a reference in another file. Only
//! regular files are opened: a pipe would wait for a writer, and a device may have no end.

use super::kind_of;
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

/// The metadata of a regular file, links followed; nothing is opened.
///
/// # Errors
/// There is none, or something else than a regular file.
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
/// As [`check_regular`]; it cannot be opened.
pub fn open_regular(path: &Path) -> io::Result<File> {
    check_regular(path)?;
    File::open(path)
}

/// The bytes of a regular file.
///
/// # Errors
/// As [`open_regular`]; it cannot be read.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// CRC-32 of a file's bytes in 8 hexadecimal digits, as manifests keep it.
#[must_use]
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
