//! What the thesis and vendors say that techniques of stereo rendering save: Preissner,
//! "Rendering optimisations for virtual reality", TUM 2020, and the sources that it names.

/// What a claim counts.
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
    /// As a table writes it.
    #[must_use]
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
    /// Name of our technique.
    pub technique: &'static str,
    /// What is saved.
    pub quantity: Quantity,
    /// Least and most that is saved, percent.
    pub saved_pct: [f64; 2],
    /// Where, and on what.
    pub source: &'static str,
}

impl Claim {
    /// The saving as a table writes it.
    #[must_use]
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
    technique: &'static str,
    quantity: Quantity,
    saved_pct: [f64; 2],
    source: &'static str,
) -> Claim {
    Claim {
        technique,
        quantity,
        saved_pct,
        source,
    }
}

/// The published savings.
pub const CLAIMS: [Claim; 8] = [
    claim(
        "superfrustum",
        Quantity::CullTests,
        [0.0, 50.0],
        "by construction: one frustum for two",
    ),
    claim(
        "hidden-area-mask",
        Quantity::Fragments,
        [17.0, 17.0],
        "Vlachos, GDC 2015: pixels of the HTC Vive",
    ),
    claim(
        "far-field",
        Quantity::FrameTime,
        [100.0 * (1.0 - 34.0 / 45.0); 2],
        "Unreal Engine, Sun Temple: 45 to 34 ms",
    ),
    claim(
        "far-field",
        Quantity::Draws,
        [100.0 * (1.0 - 8_583.0 / 10_846.0); 2],
        "a synthetic scene: 10 846 to 8583 draws",
    ),
    claim(
        "foveation-rings",
        Quantity::FrameTime,
        [25.0, 25.0],
        "Meta, fixed foveation of pixel-heavy programs",
    ),
    claim(
        "foveation-rings",
        Quantity::FrameTime,
        [100.0 * (1.0 - 1.0 / 5.0), 100.0 * (1.0 - 1.0 / 6.0)],
        "Guenter 2012: 5 to 6 times faster, gaze tracked, three monitors' field of view",
    ),
    claim(
        "multi-resolution",
        Quantity::Fragments,
        [50.0, 50.0],
        "NVIDIA, multi-resolution shading: about half of the pixels",
    ),
    claim(
        "radial-density",
        Quantity::FrameTime,
        [30.0, 35.0],
        "Vlachos, GDC 2016: on two GPUs",
    ),
];
