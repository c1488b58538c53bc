//! Look-up of the files that scene files name, whichever system wrote the names.

use crate::files::latin1;
use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

/// Longest name that is looked for in other folders and letter cases.
const MAX_PATH_BYTES: usize = 4096;

/// A file that was found, and whether its name matches exactly.
#[derive(Debug, PartialEq)]
pub(crate) struct Found {
    pub path: PathBuf,
    /// True if letter case, encoding or folder differ from the name in the file.
    pub inexact: bool,
}

/// Looks names up. Each folder is listed once.
#[derive(Debug, Default)]
pub(crate) struct Lookup {
    /// The names in each folder, by their lower-case text.
    listings: HashMap<PathBuf, HashMap<String, OsString>>,
    /// All files found so far.
    found: BTreeSet<PathBuf>,
}

impl Lookup {
    /// The first of `names` that exists: as written, else in another letter case, else without its
    /// first folders. Backslashes separate folders.
    pub fn find(&mut self, folder: &Path, names: &[String]) -> Option<Found> {
        let found = self.search(folder, names)?;
        self.found.insert(found.path.clone());
        Some(found)
    }

    /// Every file that was found, in the order of their paths.
    pub fn into_found(self) -> impl Iterator<Item = PathBuf> {
        self.found.into_iter()
    }

    fn search(&mut self, folder: &Path, names: &[String]) -> Option<Found> {
        let paths: Vec<PathBuf> = names
            .iter()
            .map(|name| name.replace('\\', "/").into())
            .collect();
        let exact = |paths: &[PathBuf]| {
            let mut paths = paths.iter().map(|path| folder.join(path));
            paths.find(|path| is_no_folder(path))
        };
        if let Some(path) = exact(&paths) {
            let inexact = false;
            return Some(Found { path, inexact });
        }
        let mut any_case =
            |path: &PathBuf| self.walk(folder, path).filter(|path| is_no_folder(path));
        // The folders of another machine are removed one by one. No system has longer paths, and each
        // ending of one is a copy.
        let short = paths
            .iter()
            .filter(|p| p.as_os_str().len() <= MAX_PATH_BYTES);
        let path = short.flat_map(|path| endings(path)).find_map(|ending| {
            exact(std::slice::from_ref(&ending)).or_else(|| any_case(&ending))
        })?;
        let inexact = true;
        Some(Found { path, inexact })
    }

    /// Follows the path part by part, in any letter case.
    fn walk(&mut self, folder: &Path, path: &Path) -> Option<PathBuf> {
        path.components()
            .try_fold(folder.to_owned(), |at, part| match part {
                Component::Normal(name) => {
                    let exact = at.join(name);
                    if exact.exists() {
                        return Some(exact);
                    }
                    let names = (self.listings.entry(at.clone())).or_insert_with_key(|at| list(at));
                    let name = names.get(&name.to_string_lossy().to_lowercase())?;
                    Some(at.join(name))
                }
                other => Some(at.join(other)),
            })
    }
}

/// The path without its first parts, from the whole path to the last part.
fn endings(path: &Path) -> impl Iterator<Item = PathBuf> {
    let mut parts = path.components();
    std::iter::once(path.to_owned()).chain(std::iter::from_fn(move || {
        parts.next();
        Some(parts.as_path().to_owned()).filter(|rest| rest.file_name().is_some())
    }))
}

fn is_no_folder(path: &Path) -> bool {
    path.metadata().is_ok_and(|metadata| !metadata.is_dir())
}

/// The folder's names, by their lower-case text. Of several equal ones, the first in byte order.
fn list(folder: &Path) -> HashMap<String, OsString> {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<OsString> = entries.map(|entry| entry.file_name()).collect();
    names.sort_by(|a, b| b.cmp(a));
    (names.into_iter())
        .map(|name| (text(&name).to_lowercase(), name))
        .collect()
}

/// A file name as text. A name that is not UTF-8 comes from a system that wrote Latin-1.
fn text(name: &OsString) -> String {
    match name.to_str() {
        Some(name) => name.to_owned(),
        None => latin1(name.as_encoded_bytes()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(folder: &Path, name: &str) -> Option<(PathBuf, bool)> {
        let found = Lookup::default().find(folder, &[name.to_owned()])?;
        let path = found.path.strip_prefix(folder).unwrap().to_owned();
        Some((path, found.inexact))
    }

    #[test]
    fn names_are_found_in_any_case_with_either_slash_and_beside_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::create_dir(folder.join("Maps")).unwrap();
        for file in ["Maps/Brick Wall.PNG", "wood.png", "Wood.png", "größe.png"] {
            std::fs::write(folder.join(file), "").unwrap();
        }
        for (name, path, inexact) in [
            ("Maps/Brick Wall.PNG", "Maps/Brick Wall.PNG", false),
            ("Maps\\Brick Wall.PNG", "Maps/Brick Wall.PNG", false),
            ("maps\\brick wall.png", "Maps/Brick Wall.PNG", true),
            ("wood.png", "wood.png", false),
            ("WOOD.png", "Wood.png", true),
            ("C:\\Users\\me\\wood.png", "wood.png", true),
            ("/nowhere/GRÖSSE.png", "", false),
            ("/nowhere/GRÖßE.png", "größe.png", true),
            (
                "D:\\work\\MAPS\\Brick Wall.PNG",
                "Maps/Brick Wall.PNG",
                true,
            ),
            ("maps", "", false),
        ] {
            let expected = Some((path.into(), inexact)).filter(|_| !path.is_empty());
            assert_eq!(find(folder, name), expected, "{name}");
        }
    }

    #[test]
    fn a_name_of_a_million_folders_is_not_searched_for() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("wood.png"), "").unwrap();
        let long = "a/".repeat(1 << 20) + "wood.png";
        assert_eq!(find(folder.path(), &long), None);
        let short = "a/".repeat(1 << 10) + "wood.png";
        assert_eq!(find(folder.path(), &short), Some(("wood.png".into(), true)));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_name_on_disk_in_latin_1_is_found() {
        use std::os::unix::ffi::OsStringExt;
        let folder = tempfile::tempdir().unwrap();
        let name = OsString::from_vec(b"caf\xe9.png".to_vec());
        std::fs::write(folder.path().join(&name), "").unwrap();
        assert_eq!(find(folder.path(), "café.png"), Some((name.into(), true)));
    }
}
