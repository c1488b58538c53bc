//! Published savings of stereo rendering techniques, from the thesis and from vendors: Preissner,
//! "Rendering optimisations for virtual reality", TUM 2020, and the sources that it names.

/// The quantity of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Bounds tested against a frustum.
    CullTests,
    /// Draws of both eyes.
    Draws,
    /// Fragments shaded.
    Fragments,
    /// Time of a frame.
    FrameTime,
}

impl Quantity {
    /// Name in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::CullTests => "frustum tests",
            Self::Draws => "draws",
            Self::Fragments => "fragments",
            Self::FrameTime => "frame time",
        }
    }
}

/// A published saving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claim {
    /// Setting of the technique here, as a JSON pointer, and its value.
    pub setting: (&'static str, &'static str),
    /// The quantity saved.
    pub quantity: Quantity,
    /// Minimum and maximum saving, percent.
    pub saved_pct: [f64; 2],
    /// Source and measured scene.
    pub source: &'static str,
}

impl Claim {
    /// True if these settings match the technique.
    pub fn is_about(&self, settings: &serde_json::Value) -> bool {
        let (pointer, expected) = self.setting;
        let found = settings.pointer(pointer);
        found.is_some_and(|value| match value.as_str() {
            Some(text) => text == expected,
            None => serde_json::from_str(expected)
                .is_ok_and(|expected: serde_json::Value| *value == expected),
        })
    }

    /// The saving as text.
    pub fn text(&self) -> String {
        let [low, high] = self.saved_pct;
        if low == high {
            format!("{low:.0}")
        } else if low == 0.0 {
            format!("up to {high:.0}")
        } else {
            format!("{low:.0} to {high:.0}")
        }
    }
}

const fn claim(
    setting: (&'static str, &'static str),
    quantity: Quantity,
    saved_pct: [f64; 2],
    source: &'static str,
) -> Claim {
    Claim {
        setting,
        quantity,
        saved_pct,
        source,
    }
}

/// The published savings.
pub const CLAIMS: [Claim; 8] = [
    claim(
        ("/culling", "superfrustum"),
        Quantity::CullTests,
        [0.0, 50.0],
        "by construction: one frustum for two",
    ),
    claim(
        ("/hidden-area-mask", "true"),
        Quantity::Fragments,
        [17.0, 17.0],
        "Vlachos, GDC 2015: pixels of the HTC Vive",
    ),
    claim(
        ("/far-field/variant", "plain"),
        Quantity::FrameTime,
        [100.0 * (1.0 - 34.0 / 45.0); 2],
        "Unreal Engine, Sun Temple: 45 to 34 ms",
    ),
    claim(
        ("/far-field/variant", "plain"),
        Quantity::Draws,
        [100.0 * (1.0 - 8_583.0 / 10_846.0); 2],
        "a synthetic scene: 10 846 to 8583 draws",
    ),
    claim(
        ("/foveation/kind", "rings"),
        Quantity::FrameTime,
        [25.0, 25.0],
        "Meta, fixed foveation of pixel-heavy programs",
    ),
    claim(
        ("/foveation/kind", "rings"),
        Quantity::FrameTime,
        [100.0 * (1.0 - 1.0 / 5.0), 100.0 * (1.0 - 1.0 / 6.0)],
        "Guenter 2012: 5 to 6 times faster, gaze tracked, three monitors' field of view",
    ),
    claim(
        ("/foveation/kind", "multi-resolution"),
        Quantity::Fragments,
        [50.0, 50.0],
        "NVIDIA, multi-resolution shading: about half of the pixels",
    ),
    claim(
        ("/foveation/kind", "radial-density"),
        Quantity::FrameTime,
        [30.0, 35.0],
        "Vlachos, GDC 2016: on two GPUs",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_claim_is_listed_with_the_settings_of_its_technique() {
        let settings = json!({ "culling": "per-eye", "hidden-area-mask": true, "foveation": { "kind": "rings" } });
        let about: Vec<&str> = CLAIMS
            .iter()
            .filter(|claim| claim.is_about(&settings))
            .map(|claim| claim.setting.0)
            .collect();
        assert_eq!(
            about,
            ["/hidden-area-mask", "/foveation/kind", "/foveation/kind"]
        );
    }

    #[test]
    fn savings_are_written_as_published() {
        let texts: Vec<String> = CLAIMS.iter().map(Claim::text).collect();
        assert_eq!(
            texts,
            [
                "up to 50", "17", "24", "21", "25", "80 to 83", "50", "30 to 35"
            ]
        );
    }
}
