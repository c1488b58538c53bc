//! Displays by name, one row each, with the source of their figures.
//!
//! Rows that cite the HMD Geometry Database (<https://risa2000.github.io/hmdgdb/>) hold the values
//! that the headset's runtime reported to the tool hmdq, both eyes as recorded. Sizes are the
//! panel's pixels per eye. Runtimes request larger images, from which the lens warp samples. The
//! distance between the eyes is a user's setting and not part of a row.

use formats::view::FovTangents;

/// A display.
pub(super) struct Preset {
    pub name: &'static str,
    pub eye_size_px: [u32; 2],
    pub fov: Fov,
    /// Outward turn of each eye.
    pub cant_deg: f32,
    pub source: &'static str,
}

/// The form in which a source states the frusta.
pub(super) enum Fov {
    /// Horizontal field of view of an on-axis frustum with square pixels.
    SymmetricDeg(f32),
    /// Half-angles of the left eye: left, right, up, down; the right eye mirrors them.
    LeftDeg([f32; 4]),
    /// Tangents of the left eye; the right eye mirrors them.
    Left(FovTangents),
    /// Tangents of each eye, where they are not mirror images.
    Both([FovTangents; 2]),
}

const fn tangents(left: f32, right: f32, up: f32, down: f32) -> FovTangents {
    FovTangents::new(left, right, up, down)
}

/// The first one is the default.
#[rustfmt::skip]
pub(super) const ROWS: &[Preset] = &[
    Preset {
        name: "symmetric-100", eye_size_px: [960, 1080], cant_deg: 0.0,
        fov: Fov::SymmetricDeg(100.0),
        source: "Z2 paper, section 4.2: 2 x 960x1080 and a 100 degree field of view; on-axis eyes with square pixels are this tool's reading",
    },
    Preset {
        name: "dk2", eye_size_px: [960, 1080], cant_deg: 0.0,
        fov: Fov::Left(tangents(1.06, 1.09, 1.33, 1.33)),
        source: "unverified: Oculus Rift DK2 panel; tangents as the Oculus library's defaults are quoted",
    },
    Preset {
        name: "vive", eye_size_px: [1080, 1200], cant_deg: 0.0,
        fov: Fov::Left(tangents(1.397, 1.246, 1.473, 1.466)),
        source: "unverified: HTC Vive panel; OpenVR raw projection of one headset as quoted",
    },
    Preset {
        name: "quest2", eye_size_px: [1832, 1920], cant_deg: 0.0,
        fov: Fov::LeftDeg([52.0, 42.0, 44.0, 49.0]),
        source: "unverified: Meta Quest 2 panel; approximate OpenXR half-angles",
    },
    Preset {
        name: "rift-cv1", eye_size_px: [1080, 1200], cant_deg: 0.0,
        fov: Fov::Left(tangents(0.964_925_9, 0.715_263_8, 0.889_498_1, 1.110_925_3)),
        source: "Oculus Rift CV1 panel; OpenVR raw projection quoted in ValveSoftware/openvr issue 266, up and down as libOVR has them (issue 110)",
    },
    Preset {
        name: "rift-s", eye_size_px: [1280, 1440], cant_deg: 0.0,
        fov: Fov::Left(tangents(0.965_689, 1.035_53, 1.0, 1.150_368)),
        source: "Oculus Rift S panel; HMD Geometry Database, OculusRiftS_Native_R80, Oculus runtime 1.82.0, default field of view",
    },
    Preset {
        name: "index", eye_size_px: [1440, 1600], cant_deg: 5.0,
        fov: Fov::Both([
            tangents(1.279_12, 1.258_676, 1.413_973, 1.408_557),
            tangents(1.257_541, 1.281_748, 1.415_72, 1.407_222),
        ]),
        source: "Valve Index panel; HMD Geometry Database, Index_Native_R144, OpenVR 1.7.12",
    },
    Preset {
        name: "pimax-5k-plus", eye_size_px: [2560, 1440], cant_deg: 10.0,
        fov: Fov::Left(tangents(1.742_203, 1.346_154, 1.269_841, 1.269_841)),
        source: "Pimax 5K Plus panel; HMD Geometry Database, Pimax5KPlus_Normal_Native_R90 (field of view 'normal', canted views), OpenVR 1.15.19",
    },
    Preset {
        name: "pimax-8k", eye_size_px: [3840, 2160], cant_deg: 10.0,
        fov: Fov::Left(tangents(1.742_203, 1.346_154, 1.306_135, 1.306_135)),
        source: "Pimax 8K panel (its input is scaled up from 2560x1440); HMD Geometry Database, Pimax8K_Normal_Native_R80 (field of view 'normal', canted views)",
    },
    Preset {
        name: "quest3", eye_size_px: [2064, 2208], cant_deg: 0.0,
        fov: Fov::Left(tangents(1.376_382, 0.839_100, 0.965_689, 1.428_148)),
        source: "Meta Quest 3 panel; HMD Geometry Database, MetaQuest3_Native_R72, Oculus runtime 1.89.0, default field of view",
    },
];
