//! What captures know of lavapipe, Mesa's Vulkan driver on the processor.

use std::path::PathBuf;

/// Lanes of a subgroup at llvmpipe's native 256-bit vectors: two quads. At 128 bits, ballots of Mesa 22.3
/// corrupt memory, so with any other size fragments are recorded one by one.
pub const SUBGROUP_LANES: u32 = 8;

/// Folders of the files in which drivers name their library.
const DRIVER_FOLDERS: [&str; 3] = [
    "/usr/share/vulkan/icd.d",
    "/etc/vulkan/icd.d",
    "/usr/local/share/vulkan/icd.d",
];

/// The installed driver files of lavapipe, sorted.
pub fn driver_files() -> Vec<PathBuf> {
    let folders = DRIVER_FOLDERS
        .iter()
        .filter_map(|f| std::fs::read_dir(f).ok());
    let files = folders.flatten().flatten().map(|entry| entry.path());
    let is_lavapipe = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("lvp_icd") && name.ends_with(".json") && !name.contains("i686")
    };
    let mut found: Vec<PathBuf> = files.filter(is_lavapipe).collect();
    found.sort();
    found
}
