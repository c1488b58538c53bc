//! `tracegen scenes`: lists the built-in scenes, or describes a scene.

use super::cache_args::CacheArgs;
use super::pose_args::PoseArgs;
use super::scene_args::{SceneSpec, load_scene};
use ::scenes::BUILTINS;
use clap::Args;
#[cfg(test)]
use formats::schemas::Published;
use formats::text::json_text;
use glam::Vec3;
use scene::{LoadOptions, Loaded, Scene};
use serde::Serialize;
use std::time::Instant;
use textures::{Cache, TextureSet};

/// Arguments of `tracegen scenes`.
#[derive(Args, Debug)]
pub struct ScenesArgs {
    /// Scene file or built-in scene to describe; without it the built-in scenes are listed.
    #[arg(value_name = "SCENE", value_parser = SceneSpec::parser())]
    scene: Option<SceneSpec>,
    /// Also read and compress the images as a capture does, and print their size.
    #[arg(long, requires = "scene")]
    textures: bool,
    #[command(flatten)]
    pose: PoseArgs,
    #[command(flatten)]
    cache: CacheArgs,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Schema of the list of built-in scenes.
const LIST_SCHEMA: &str = "tracegen.scenes/1";

/// Schema of one scene.
const SCENE_SCHEMA: &str = "tracegen.scene/1";

/// JSON of the list of built-in scenes.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BuiltinList {
    schema: &'static str,
    scenes: Vec<Builtin>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Builtin {
    name: &'static str,
    description: &'static str,
    triangles: u64,
    cameras: &'static [&'static str],
}

/// JSON of one scene.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Description {
    schema: &'static str,
    name: String,
    triangles: u64,
    unique_triangles: u64,
    meshes: usize,
    instances: usize,
    materials: usize,
    images: Vec<ImageEntry>,
    texture_bytes: Option<usize>,
    lights: usize,
    bounds_m: Option<[[f64; 3]; 2]>,
    cameras: Vec<CameraEntry>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    animations: Vec<String>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ImageEntry {
    name: String,
    size: [u32; 2],
    #[cfg_attr(test, schemars(with = "String"))]
    color_space: formats::texture::ColorSpace,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CameraEntry {
    name: String,
    eye: [f64; 3],
    target: [f64; 3],
    up: [f32; 3],
    vfov_deg: f32,
    near_m: f32,
    /// `None` at infinity.
    far_m: Option<f32>,
}

/// Runs `tracegen scenes`.
///
/// # Errors
/// An unreadable scene, or a closed output.
pub fn run(args: ScenesArgs) -> anyhow::Result<()> {
    shell::Threads::default().start()?;
    let text = match args.scene {
        None => list(args.json)?,
        Some(spec) => {
            let options = args.pose.applied_to(&LoadOptions::ALL);
            let description = if args.textures {
                let cache = args.cache.open()?;
                read_textures(&spec, &options, cache.as_ref())?
            } else {
                describe(&load_scene(&spec, &options)?)
            };
            if args.json {
                json_text(&description)?
            } else {
                table(&description)
            }
        }
    };
    shell::print(&text)
}

/// Loads and compresses everything, and prints the time on stderr.
fn read_textures(
    spec: &SceneSpec,
    options: &LoadOptions,
    cache: Option<&Cache>,
) -> anyhow::Result<Description> {
    let start = Instant::now();
    let scene = load_scene(spec, options)?;
    let loaded = start.elapsed();
    let set = TextureSet::prepare(&scene.scene, |_| Some(0), cache)?;
    for note in &set.notes {
        shell::warn(note);
    }
    shell::note(&format!(
        "loaded in {:.2} s, {} textures made ready in {:.2} s, {} of them from the cache",
        loaded.as_secs_f64(),
        set.textures.len(),
        (start.elapsed() - loaded).as_secs_f64(),
        set.cached,
    ));
    Ok(Description {
        texture_bytes: Some(set.bytes()),
        ..describe(&scene)
    })
}

fn list(as_json: bool) -> anyhow::Result<String> {
    if as_json {
        let scenes = BUILTINS
            .iter()
            .map(|b| Builtin {
                name: b.name,
                description: b.description,
                triangles: b.triangles,
                cameras: b.cameras,
            })
            .collect();
        return Ok(json_text(&BuiltinList {
            schema: LIST_SCHEMA,
            scenes,
        })?);
    }
    let width = BUILTINS.iter().map(|b| b.name.len()).max().unwrap_or(0);
    Ok(BUILTINS
        .iter()
        .map(|b| {
            format!(
                "{:width$}  {:>7} triangles  {} (cameras: {})\n",
                b.name,
                b.triangles,
                b.description,
                b.cameras.join(", ")
            )
        })
        .collect())
}

fn describe(loaded: &Loaded) -> Description {
    let scene = &loaded.scene;
    Description {
        schema: SCENE_SCHEMA,
        name: scene.name.clone(),
        triangles: scene.triangle_count(),
        unique_triangles: scene.meshes.iter().map(|m| m.triangles() as u64).sum(),
        meshes: scene.meshes.len(),
        instances: scene.instances.len(),
        materials: scene.materials.len(),
        images: scene
            .images
            .iter()
            .map(|i| ImageEntry {
                name: i.name.clone(),
                size: i.size,
                color_space: i.color_space,
            })
            .collect(),
        texture_bytes: None,
        lights: scene.lights.len(),
        bounds_m: scene
            .bounds()
            .map(|(low, high)| [low, high].map(|corner| in_world(scene, corner))),
        cameras: scene
            .cameras
            .iter()
            .map(|c| CameraEntry {
                name: c.name.clone(),
                eye: in_world(scene, c.eye),
                target: in_world(scene, c.target),
                up: c.up.to_array(),
                vfov_deg: c.vfov_deg,
                near_m: c.near,
                far_m: c.far.is_finite().then_some(c.far),
            })
            .collect(),
        animations: loaded.animations.clone(),
    }
}

/// The schemas of both JSON objects.
#[cfg(test)]
pub(crate) fn schemas() -> [Published; 2] {
    [
        Published::of::<BuiltinList>(LIST_SCHEMA),
        Published::of::<Description>(SCENE_SCHEMA),
    ]
}

/// World coordinates of a point, with the digits that single precision has.
fn in_world(scene: &Scene, point: Vec3) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let written: f64 = point[axis].to_string().parse().unwrap_or(f64::NAN);
        scene.origin[axis] + written
    })
}

fn table(d: &Description) -> String {
    let texels: u64 = (d.images.iter())
        .map(|i| u64::from(i.size[0]) * u64::from(i.size[1]))
        .sum();
    let point = |p: [f64; 3]| format!("({:.2}, {:.2}, {:.2})", p[0], p[1], p[2]);
    let mut text = format!(
        "scene      {}\ntriangles  {} ({} unique) in {} meshes, {} instances\n\
         materials  {}\nimages     {} ({:.1} Mtexel)\nlights     {}\n",
        d.name,
        d.triangles,
        d.unique_triangles,
        d.meshes,
        d.instances,
        d.materials,
        d.images.len(),
        texels as f64 / 1e6,
        d.lights,
    );
    if let Some(bytes) = d.texture_bytes {
        text += &format!(
            "textures   {:.1} MiB block-compressed\n",
            bytes as f64 / 1048576.0
        );
    }
    if let Some([low, high]) = d.bounds_m {
        text += &format!("bounds     {} to {} m\n", point(low), point(high));
    }
    text += "cameras\n";
    let width = d.cameras.iter().map(|c| c.name.len()).max().unwrap_or(0);
    for c in &d.cameras {
        text += &format!(
            "  {:width$}  eye {}  target {}  vfov {:.1}  near {} far {}\n",
            c.name,
            point(c.eye),
            point(c.target),
            c.vfov_deg,
            c.near_m,
            c.far_m.map_or("infinite".to_owned(), |far| far.to_string()),
        );
    }
    if !d.animations.is_empty() {
        text += "animations\n";
    }
    for name in &d.animations {
        text += &format!("  {name}\n");
    }
    text
}
