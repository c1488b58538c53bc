//! The cache of captures: the outputs of a command under the hash of its recipe.
//!
//! A recipe is everything that the outputs depend on. The program, the arguments and the driver make the key.
//! Which files a scene consists of is known only after it was loaded, so an entry lists the files that its capture
//! read. Each must still have its path, size, modification time and inode, or else its content, whose hash the
//! entry has. A capture that warned is not stored, because a hit would not warn.
//!
//! An entry is one file: magic number, key, hash of the description, its length, the description as JSON, and the
//! outputs one after the other.

use anyhow::Context;
use formats::bounded_folder::BoundedFolder;
use formats::container::{AtomicFile, declared_inputs, is_stdout};
use serde::{Deserialize, Serialize};
use shell::{Output, cannot_write, lasting_arguments};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

const MAGIC: [u8; 8] = *b"PLXCAPT\x01";
/// Magic number, key, hash and length of the description.
const HEADER_BYTES: usize = 8 + 16 + 16 + 8;
/// The longest description that is read.
const MOST_DESCRIPTION_BYTES: u64 = 64 << 20;

/// Variables of the environment that drivers and the loader of their libraries read start with one of these.
const DRIVER_VARIABLES: [&str; 9] = [
    "GALLIUM_",
    "GALLIVM_",
    "LD_",
    "LIBGL_",
    "LP_",
    "MESA_",
    "SOFTPIPE_",
    "VK_",
    "WGPU_",
];

/// What an entry says of itself.
#[derive(Debug, Serialize, Deserialize)]
struct Description {
    /// Folder in which relative paths were resolved.
    folder: PathBuf,
    inputs: Vec<InputFile>,
    /// The result that the command printed.
    result: String,
    outputs: Vec<StoredOutput>,
}

/// A file that the capture read.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct InputFile {
    path: PathBuf,
    bytes: u64,
    modified_ns: i64,
    inode: u64,
    hash: String,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredOutput {
    flag: String,
    bytes: u64,
    hash: String,
}

/// The recipe of a command's outputs, and the cache to look them up in.
pub struct Recipe {
    cache: BoundedFolder,
    key: u128,
    started: SystemTime,
}

impl Recipe {
    /// The recipe of the running command; `driver` lists the files that its driver consists of.
    ///
    /// # Errors
    /// The program's own file cannot be read, or an argument is not UTF-8.
    pub fn new(cache: BoundedFolder, outputs: &[Output], driver: &[PathBuf]) -> io::Result<Self> {
        if std::env::args_os().any(|argument| argument.to_str().is_none()) {
            return Err(io::ErrorKind::InvalidInput.into());
        }
        let program = identity(&std::env::current_exe()?)?;
        let mut variables: Vec<(OsString, OsString)> = std::env::vars_os()
            .filter(|(name, _)| {
                let name = name.to_string_lossy();
                let is_read = DRIVER_VARIABLES.iter().any(|start| name.starts_with(start));
                // Captures do not depend on the number of threads.
                is_read && name != "LP_NUM_THREADS"
            })
            .collect();
        variables.sort();
        let driver: Vec<_> = driver
            .iter()
            .map(|path| (path, identity(path).ok()))
            .collect();
        let flags: Vec<&str> = outputs.iter().map(Output::flag).collect();
        let arguments = lasting_arguments(std::env::args_os().skip(1));
        let recipe = format!("{program:?} {arguments:?} {flags:?} {variables:?} {driver:?}");
        Ok(Self {
            cache,
            key: xxh3_128(recipe.as_bytes()),
            started: SystemTime::now(),
        })
    }

    /// Writes the outputs from the cache. Returns the result that the command printed, or none if the recipe
    /// is not in the cache.
    ///
    /// # Errors
    /// An output that cannot be written.
    pub fn find(&self, outputs: &[Output]) -> anyhow::Result<Option<String>> {
        let Some((file, description, mut at)) = self.cache.open(self.key).and_then(|file| {
            let (description, at) = self.read(&file)?;
            Some((file, description, at))
        }) else {
            return Ok(None);
        };
        shell::check_outputs(
            outputs,
            description.inputs.iter().map(|input| input.path.as_path()),
        )?;
        let mut complete = Vec::new();
        for (output, stored) in outputs.iter().zip(&description.outputs) {
            let path = output.path();
            let place = || cannot_write(path);
            let mut target = AtomicFile::create(path).with_context(place)?;
            // The file is hashed while the system copies it.
            let (copied, hash) = std::thread::scope(|scope| {
                let hash = scope.spawn(|| hash_of(&file, at, stored.bytes));
                let copied = (&file).seek(SeekFrom::Start(at));
                let copied = copied.and_then(|_| target.append_from(&file, stored.bytes));
                (copied, hash.join())
            });
            let whole = copied.with_context(place)? == stored.bytes;
            if !whole || !matches!(hash, Ok(Ok(hash)) if hash == stored.hash) {
                return Ok(None);
            }
            at += stored.bytes;
            complete.push((path, target));
        }
        for (path, target) in complete {
            target.persist().with_context(|| cannot_write(path))?;
        }
        BoundedFolder::mark_used(&file);
        Ok(Some(description.result))
    }

    /// The description of an entry whose inputs are unchanged, and the position of its first output.
    fn read(&self, mut file: &File) -> Option<(Description, u64)> {
        let mut header = [0; HEADER_BYTES];
        file.read_exact(&mut header).ok()?;
        let length = u64::from_le_bytes(header[40..].try_into().ok()?);
        if header[..24] != [&MAGIC[..], &self.key.to_le_bytes()].concat()
            || length > MOST_DESCRIPTION_BYTES
        {
            return None;
        }
        let mut text = vec![0; usize::try_from(length).ok()?];
        file.read_exact(&mut text).ok()?;
        if header[24..40] != xxh3_128(&text).to_le_bytes() {
            return None;
        }
        let description: Description = serde_json::from_slice(&text).ok()?;
        let at_home = description.inputs.is_empty()
            || std::env::current_dir().is_ok_and(|folder| folder == description.folder);
        let unchanged = at_home && description.inputs.iter().all(InputFile::is_unchanged);
        unchanged.then_some((description, HEADER_BYTES as u64 + length))
    }

    /// Stores the outputs, which are complete. Failures are ignored.
    pub fn store(&self, outputs: &[Output], result: &str) {
        if !shell::has_warned() {
            let _ = self.try_store(outputs, result);
        }
    }

    fn try_store(&self, outputs: &[Output], result: &str) -> io::Result<()> {
        let mut files = Vec::new();
        let mut stored = Vec::new();
        for output in outputs {
            let file = File::open(output.path())?;
            let bytes = file.metadata()?.len();
            if !self.cache.holds(bytes) {
                return Ok(());
            }
            stored.push(StoredOutput {
                flag: output.flag().to_owned(),
                bytes,
                hash: hash_of(&file, 0, bytes)?,
            });
            files.push((file, bytes));
        }
        let inputs = declared_inputs();
        let inputs = inputs.iter().map(|path| InputFile::new(path, self.started));
        let Some(inputs) = inputs.collect::<io::Result<Option<Vec<_>>>>()? else {
            return Ok(());
        };
        let description = Description {
            folder: std::env::current_dir()?,
            inputs,
            result: result.to_owned(),
            outputs: stored,
        };
        let text = serde_json::to_vec(&description)?;
        let bytes: u64 = files.iter().map(|(_, bytes)| bytes).sum();
        let bytes = (HEADER_BYTES + text.len()) as u64 + bytes;
        self.cache.store(self.key, bytes, |entry| {
            entry.write_all(&MAGIC)?;
            entry.write_all(&self.key.to_le_bytes())?;
            entry.write_all(&xxh3_128(&text).to_le_bytes())?;
            entry.write_all(&(text.len() as u64).to_le_bytes())?;
            entry.write_all(&text)?;
            for (file, bytes) in &files {
                if entry.append_from(file, *bytes)? != *bytes {
                    return Err(io::Error::other("an output became shorter"));
                }
            }
            Ok(())
        });
        Ok(())
    }
}

impl InputFile {
    /// Reads a file; none if it has changed since the command started.
    fn new(path: &Path, started: SystemTime) -> io::Result<Option<Self>> {
        let file = File::open(path)?;
        let found = file.metadata()?;
        if found.modified()? >= started {
            return Ok(None);
        }
        Ok(Some(Self {
            path: path.to_owned(),
            bytes: found.len(),
            modified_ns: modified_ns(&found),
            inode: found.ino(),
            hash: hash_of(&file, 0, found.len())?,
        }))
    }

    /// True if the file is the same, or has the same content.
    fn is_unchanged(&self) -> bool {
        let Ok(found) = fs::metadata(&self.path) else {
            return false;
        };
        if !found.is_file() || found.len() != self.bytes {
            return false;
        }
        if (modified_ns(&found), found.ino()) == (self.modified_ns, self.inode) {
            return true;
        }
        let hash = File::open(&self.path).and_then(|file| hash_of(&file, 0, self.bytes));
        hash.is_ok_and(|hash| hash == self.hash)
    }
}

fn modified_ns(found: &fs::Metadata) -> i64 {
    let seconds = found.mtime().saturating_mul(1_000_000_000);
    seconds.saturating_add(found.mtime_nsec())
}

/// What tells a program or a driver from another version of it.
fn identity(path: &Path) -> io::Result<(u64, i64, u64)> {
    let found = fs::metadata(path)?;
    Ok((found.len(), modified_ns(&found), found.ino()))
}

/// The hash of a part of a file.
fn hash_of(file: &File, mut at: u64, bytes: u64) -> io::Result<String> {
    let mut hasher = Xxh3::new();
    let mut buffer = vec![0; 1 << 20];
    let end = at + bytes;
    while at < end {
        let most = buffer
            .len()
            .min(usize::try_from(end - at).unwrap_or(usize::MAX));
        match file.read_at(&mut buffer[..most], at)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            read => {
                hasher.update(&buffer[..read]);
                at += read as u64;
            }
        }
    }
    Ok(format!("{:032x}", hasher.digest128()))
}

/// Runs a capture unless its recipe is in the cache, and prints its result.
///
/// # Errors
/// Those of the capture, and an output that cannot be written.
pub fn cached(
    cache: Option<BoundedFolder>,
    outputs: &[Output],
    driver: &[PathBuf],
    capture: impl FnOnce() -> anyhow::Result<String>,
) -> anyhow::Result<()> {
    let in_files = !outputs.iter().any(|output| is_stdout(output.path()));
    let recipe = cache
        .filter(|_| in_files)
        .map(|cache| Recipe::new(cache, outputs, driver));
    // A program that cannot tell its recipe captures anew.
    let recipe = recipe.and_then(Result::ok);
    if let Some(recipe) = &recipe
        && let Some(result) = recipe.find(outputs)?
    {
        shell::print_beside(outputs, &result)?;
        shell::note("from the cache of captures (--no-cache captures anew)");
        return Ok(());
    }
    let result = capture()?;
    shell::print_beside(outputs, &result)?;
    if let Some(recipe) = recipe {
        recipe.store(outputs, &result);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::Cli;
    use clap::CommandFactory;
    use shell::{WITHOUT_EFFECT, lasting_arguments};
    use std::ffi::OsString;

    /// Every flag of the commands that keep captures is in the key, or listed as one without effect.
    #[test]
    fn every_flag_is_part_of_the_recipe_or_has_no_effect_on_the_outputs() {
        const LISTED: [&str; 9] = [
            "--help",
            "--image",
            "--no-cache",
            "--no-plain",
            "--no-skip",
            "--output",
            "--quiet",
            "--record-budget",
            "--threads",
        ];
        let mut cli = Cli::command();
        cli.build();
        for name in ["raster", "rays"] {
            let command = cli.find_subcommand(name).expect("a command");
            let mut flags = 0;
            for argument in command.get_arguments() {
                let Some(long) = argument.get_long() else {
                    assert!(argument.is_positional(), "{name}: {argument:?}");
                    continue;
                };
                let flag = format!("--{long}");
                let mut words = vec![name.to_owned(), "scene".to_owned(), flag.clone()];
                if argument.get_action().takes_values() {
                    words.push("value".to_owned());
                }
                let kept = lasting_arguments(words.iter().map(OsString::from));
                let is_kept = kept == words;
                let is_dropped = kept == words[..2];
                assert!(is_kept != is_dropped, "{name} {flag}: {kept:?}");
                let may_drop = LISTED.contains(&&*flag) && WITHOUT_EFFECT.contains(&&*flag);
                assert!(is_kept || may_drop, "{name} {flag} is not part of the key");
                flags += 1;
            }
            assert!(flags > 20, "{name}: {flags}");
        }
    }
}
