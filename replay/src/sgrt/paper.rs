//! What the paper reports (figure 3 and section IV).

/// A scene of the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperScene {
    /// Name in the figures.
    pub name: &'static str,
    /// Names under which our scenes stand for it, in lower case.
    pub aliases: &'static [&'static str],
    /// Triangles, thousands.
    pub kilo_triangles: u32,
    /// Frames per second over the reference's.
    pub relative_performance: f64,
    /// Energy over the reference's.
    pub relative_energy: f64,
}

/// Right pixels that could be shaded with the left image's results, average over the six scenes.
pub const REUSE_PCT: f64 = 91.54;
/// Work that the units were spared.
pub const TNI_REDUCTION_PCT: f64 = 68.0;
/// Work that the kernels added.
pub const SRP_OVERHEAD_PCT: f64 = 10.0;

const fn scene(
    name: &'static str,
    aliases: &'static [&'static str],
    kilo_triangles: u32,
    relative_performance: f64,
    relative_energy: f64,
) -> PaperScene {
    PaperScene {
        name,
        aliases,
        kilo_triangles,
        relative_performance,
        relative_energy,
    }
}

/// Figure 3.
pub const SCENES: [PaperScene; 6] = [
    scene("Teapot", &["teapot"], 15, 1.64, 0.96),
    scene("Chess", &["chess"], 42, 1.13, 1.02),
    scene("BMW", &["bmw", "car"], 55, 1.42, 0.97),
    scene("Chemical lab", &["lab"], 98, 1.11, 0.99),
    scene("Music box", &["music"], 106, 1.28, 0.98),
    scene("Provence", &["meadow", "provence"], 600, 1.51, 0.80),
];

/// The paper's scene that a scene of this name stands for.
#[must_use]
pub fn counterpart(scene: &str) -> Option<&'static PaperScene> {
    let name = scene.to_lowercase();
    let file = name.rsplit(['/', '\\']).next().unwrap_or(&name);
    SCENES
        .iter()
        .find(|s| s.aliases.iter().any(|alias| file.contains(alias)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_find_their_counterparts_by_name() {
        let find = |name| counterpart(name).map(|s| s.name);
        assert_eq!(find("teapot"), Some("Teapot"));
        assert_eq!(find("../scenes/bmw27/bmw_55k.obj"), Some("BMW"));
        assert_eq!(find("music-box"), Some("Music box"));
        assert_eq!(find("meadow"), Some("Provence"));
        assert_eq!(find("crytek-sponza/sponza.gltf"), None);
    }
}
