//! The caches of prepared textures and of captures: location, size limits and use.

use anyhow::Context;
use clap::Args;
use formats::bounded_folder::BoundedFolder;
use std::env;
use std::path::PathBuf;
use textures::Cache;

/// Default size limit of each cache.
const DEFAULT_BYTES: u64 = 2 << 30;

/// `--no-cache`.
#[derive(Args, Clone, Copy, Debug)]
pub struct CacheArgs {
    /// Do not use the caches of prepared textures and of captures. They are in ~/.cache/parallax or the folder
    /// that XDG_CACHE_HOME or PARALLAX_CACHE_DIR sets. Each holds at most 2GiB; PARALLAX_CACHE_SIZE and
    /// PARALLAX_CAPTURE_CACHE_SIZE change that, and 0 turns a cache off.
    #[arg(long)]
    no_cache: bool,
}

impl CacheArgs {
    /// Opens the cache if it is enabled and has a folder.
    ///
    /// # Errors
    /// A size that cannot be read.
    pub fn open(self) -> anyhow::Result<Option<Cache>> {
        let found = self.folder("textures", "PARALLAX_CACHE_SIZE")?;
        Ok(found.map(|(folder, limit)| Cache::new(folder, limit)))
    }

    /// Opens the cache of captures, likewise.
    ///
    /// # Errors
    /// See [`Self::open`].
    pub fn open_captures(self) -> anyhow::Result<Option<BoundedFolder>> {
        let found = self.folder("captures", "PARALLAX_CAPTURE_CACHE_SIZE")?;
        Ok(found.map(|(folder, limit)| BoundedFolder::new(folder, "capture", limit)))
    }

    /// The folder of a cache and its limit in bytes, if the cache is enabled.
    fn folder(self, name: &str, size: &str) -> anyhow::Result<Option<(PathBuf, u64)>> {
        let limit = match env::var(size) {
            Ok(text) if text == "0" => 0,
            Ok(text) => super::values::parse_bytes(&text)
                .map_err(anyhow::Error::msg)
                .with_context(|| size.to_owned())?,
            Err(_) => DEFAULT_BYTES,
        };
        if self.no_cache || limit == 0 {
            return Ok(None);
        }
        let folder = folder(|name| env::var_os(name).map(PathBuf::from));
        Ok(folder.map(|folder| (folder.join(name), limit)))
    }
}

/// The folder of the cache.
fn folder(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    let set = |name| variable(name).filter(|path| !path.as_os_str().is_empty());
    if let Some(folder) = set("PARALLAX_CACHE_DIR") {
        return Some(folder);
    }
    // The XDG specification says that relative paths are ignored.
    let caches = set("XDG_CACHE_HOME").filter(|path| path.is_absolute());
    let caches = caches.or_else(|| Some(set("HOME")?.join(".cache")))?;
    Some(caches.join("parallax"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_the_first_that_the_environment_names() {
        let with = |set: &[(&str, &str)]| {
            folder(|name| {
                let found = set.iter().find(|(known, _)| *known == name)?;
                Some(PathBuf::from(found.1))
            })
        };
        let (home, xdg) = (("HOME", "/h"), ("XDG_CACHE_HOME", "/x"));
        let own = ("PARALLAX_CACHE_DIR", "own");
        assert_eq!(with(&[home, xdg, own]), Some("own".into()));
        assert_eq!(with(&[home, xdg]), Some("/x/parallax".into()));
        assert_eq!(with(&[home]), Some("/h/.cache/parallax".into()));
        let relative = ("XDG_CACHE_HOME", "x");
        assert_eq!(with(&[home, relative]), Some("/h/.cache/parallax".into()));
        assert_eq!(
            with(&[home, ("PARALLAX_CACHE_DIR", "")]),
            Some("/h/.cache/parallax".into())
        );
        assert_eq!(with(&[]), None);
    }
}
