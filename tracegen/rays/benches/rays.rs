//! Speed of the counting traversal: `cargo bench -p tracegen --bench rays -- SCENE [--dump DIR]`.
//!
//! Four streams of single rays (primary, shadow, mirror, diffuse) over a scene's triangles are
//! traversed in both trees with and without counters, by one thread and by two. The cost of
//! counting is measured in slices, in which the variants alternate. A rate uses the best round of
//! every slice, so that a disturbance affects only one slice of one round. The gain of two threads
//! compares the best rounds of whole streams. `--dump` writes triangles and rays as plain
//! little-endian floats for `studies/embree.py`.

use formats::raytrace::{EyeCamera, TraversalKind};
use glam::Vec3;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use rays::bvh::count::{Counter, Counts, NoCounter};
use rays::bvh::{AllOpaque, Bvh, TraversalStack};
use rays::ray::{Ray, barycentrics, offset, point_at};
use rays::soup::Soup;
use scene::{Light, cameras, hmd};
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// Rays of one kind.
struct Stream {
    name: &'static str,
    any_hit: bool,
    rays: Vec<Ray>,
}

struct Options {
    scene: String,
    dump: Option<String>,
    rounds: usize,
    size_px: u32,
    json: bool,
}

fn options() -> anyhow::Result<Options> {
    let mut options = Options {
        scene: "atrium".to_owned(),
        dump: None,
        rounds: 6,
        size_px: 512,
        json: false,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || {
            let missing = || anyhow::anyhow!("{argument} needs a value");
            arguments.next().ok_or_else(missing)
        };
        match argument.as_str() {
            "--dump" => options.dump = Some(value()?),
            "--rounds" => options.rounds = value()?.parse()?,
            "--size" => options.size_px = value()?.parse()?,
            "--json" => options.json = true,
            // Cargo passes this option.
            "--bench" => {}
            other if !other.starts_with('-') => options.scene = other.to_owned(),
            other => anyhow::bail!("unknown argument {other}"),
        }
    }
    Ok(options)
}

fn run() -> anyhow::Result<()> {
    let options = options()?;
    let mut loaded = scenes::load(&options.scene)?;
    // The benchmark does not use textures.
    loaded.images.clear();
    let soup = Soup::new(&loaded);
    let start = Instant::now();
    let bvh = Bvh::build(&soup.triangles, |_| false)?;
    let built_s = start.elapsed().as_secs_f64();
    let streams = streams(&loaded, &soup, &bvh, options.size_px)?;
    if let Some(folder) = &options.dump {
        write_dump(Path::new(folder), &soup, &streams)?;
    }
    if !options.json {
        let s = bvh.summary(TraversalKind::Bvh2);
        println!(
            "{}: {} triangles, {} leaves, SAH cost {:.2}, depth {}, built in {built_s:.2} s",
            options.scene, s.triangles, s.leaves, s.sah_cost, s.depth
        );
        println!(
            "{:8} {:>8} {:>12} {:>6} {:>15} {:>7} {:>15} {:>6} {:>7} {:>6} {:>11}",
            "stream",
            "rays",
            "bvh2 Mray/s",
            "bvh8",
            "counting bvh2",
            "bvh8",
            "2 threads bvh2",
            "bvh8",
            "steps",
            "tests",
            "bvh8 steps"
        );
    }
    let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = [pool(1)?, pool(2)?];
    for stream in &streams {
        if options.json {
            // Whole streams, as in the other program.
            let f = measure(
                &bvh,
                stream,
                options.rounds,
                &[Variant::Two, Variant::Eight],
                usize::MAX,
            );
            println!(
                "{{\"stream\":\"{}\",\"rays\":{},\"bvh2\":{:.4},\"bvh8\":{:.4}}}",
                stream.name,
                f.rays,
                f.rate(Variant::Two),
                f.rate(Variant::Eight),
            );
            continue;
        }
        let f = measure(&bvh, stream, options.rounds, &VARIANTS, SLICE);
        let gain = |tree| gain(&bvh, tree, stream, &pools, options.rounds);
        let cost = |counted, plain| 100.0 * (f.rate(plain) / f.rate(counted) - 1.0);
        println!(
            "{:8} {:8} {:12.2} {:6.2} {:13.1} % {:5.1} % {:14.2}x {:5.2}x {:7.1} {:6.1} {:11.1}",
            stream.name,
            f.rays,
            f.rate(Variant::Two),
            f.rate(Variant::Eight),
            cost(Variant::Two, Variant::TwoPlain),
            cost(Variant::Eight, Variant::EightPlain),
            gain(TraversalKind::Bvh2),
            gain(TraversalKind::Bvh8),
            f.per_ray(f.counts2.0),
            f.per_ray(f.counts2.1),
            f.per_ray(f.counts8.0),
        );
    }
    Ok(())
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Variant {
    Two,
    TwoPlain,
    Eight,
    EightPlain,
}

const VARIANTS: [Variant; 4] = [
    Variant::Two,
    Variant::TwoPlain,
    Variant::Eight,
    Variant::EightPlain,
];

/// Rays per slice: a few milliseconds of work.
const SLICE: usize = 1 << 15;

struct Figures {
    rays: usize,
    /// Seconds by variant, summed over the best round of each slice.
    best_s: [f64; VARIANTS.len()],
    counts2: (u64, u64),
    counts8: (u64, u64),
}

impl Figures {
    /// Million rays per second.
    fn rate(&self, variant: Variant) -> f64 {
        self.rays as f64 / self.best_s[variant as usize] / 1e6
    }

    fn per_ray(&self, n: u64) -> f64 {
        n as f64 / self.rays as f64
    }
}

fn measure(
    bvh: &Bvh,
    stream: &Stream,
    rounds: usize,
    variants: &[Variant],
    slice: usize,
) -> Figures {
    let slices: Vec<&[Ray]> = stream.rays.chunks(slice).collect();
    let mut best_s = vec![[f64::INFINITY; VARIANTS.len()]; slices.len()];
    let mut figures = Figures {
        rays: stream.rays.len(),
        best_s: [0.0; VARIANTS.len()],
        counts2: (0, 0),
        counts8: (0, 0),
    };
    let (two, eight) = (TraversalKind::Bvh2, TraversalKind::Bvh8);
    let any = stream.any_hit;
    for round in 0..rounds {
        (figures.counts2, figures.counts8) = ((0, 0), (0, 0));
        for (slice, best_s) in slices.iter().zip(&mut best_s) {
            for turn in 0..variants.len() {
                // The second variant on a slice finds its nodes cached, so the variants alternate.
                let variant = variants[if round % 2 == 0 {
                    turn
                } else {
                    variants.len() - 1 - turn
                }];
                let start = Instant::now();
                match variant {
                    Variant::Two => add(&mut figures.counts2, counted(bvh, two, any, slice)),
                    Variant::TwoPlain => plain(bvh, two, any, slice),
                    Variant::Eight => add(&mut figures.counts8, counted(bvh, eight, any, slice)),
                    Variant::EightPlain => plain(bvh, eight, any, slice),
                }
                let best = &mut best_s[variant as usize];
                *best = best.min(start.elapsed().as_secs_f64());
            }
        }
    }
    for (variant, total) in figures.best_s.iter_mut().enumerate() {
        *total = best_s.iter().map(|slice| slice[variant]).sum();
    }
    figures
}

/// Ratio of the time of one thread to that of two for a stream.
fn gain(
    bvh: &Bvh,
    tree: TraversalKind,
    stream: &Stream,
    pools: &[ThreadPool; 2],
    rounds: usize,
) -> f64 {
    let mut best_s = [f64::INFINITY; 2];
    for _ in 0..rounds {
        for (best, pool) in best_s.iter_mut().zip(pools) {
            let start = Instant::now();
            walk_in(pool, bvh, tree, stream);
            *best = best.min(start.elapsed().as_secs_f64());
        }
    }
    best_s[0] / best_s[1]
}

fn add(total: &mut (u64, u64), more: (u64, u64)) {
    *total = (total.0 + more.0, total.1 + more.1);
}

/// Traverses the rays. The number of hits keeps the work from being optimised away.
fn walk<C: Counter + Default>(
    bvh: &Bvh,
    tree: TraversalKind,
    any_hit: bool,
    rays: &[Ray],
    stack: &mut TraversalStack,
    mut done: impl FnMut(C),
) -> usize {
    rays.iter()
        .filter(|ray| {
            let mut counter = C::default();
            let hit = if any_hit {
                bvh.blocker(tree, ray, stack, &mut counter, &AllOpaque)
                    .is_some()
            } else {
                let hit = bvh.closest(tree, ray, stack, &mut counter, &AllOpaque);
                hit.is_some()
            };
            done(counter);
            hit
        })
        .count()
}

fn counted(bvh: &Bvh, tree: TraversalKind, any_hit: bool, rays: &[Ray]) -> (u64, u64) {
    let mut stack = TraversalStack::default();
    let (mut steps, mut tests) = (0, 0);
    let done = |c: Counts| {
        steps += u64::from(c.steps);
        tests += u64::from(c.triangle_tests);
    };
    let hits = walk(bvh, tree, any_hit, rays, &mut stack, done);
    std::hint::black_box(hits);
    (steps, tests)
}

fn plain(bvh: &Bvh, tree: TraversalKind, any_hit: bool, rays: &[Ray]) {
    let mut stack = TraversalStack::default();
    let done = |_: NoCounter| ();
    let hits = walk(bvh, tree, any_hit, rays, &mut stack, done);
    std::hint::black_box(hits);
}

fn walk_in(pool: &ThreadPool, bvh: &Bvh, tree: TraversalKind, stream: &Stream) {
    let chunks = stream.rays.par_chunks(1024);
    let steps: u64 = pool.install(|| {
        chunks
            .map_init(TraversalStack::default, |stack, rays| {
                let mut steps = 0;
                let done = |c: Counts| steps += u64::from(c.steps);
                std::hint::black_box(walk(bvh, tree, stream.any_hit, rays, stack, done));
                steps
            })
            .sum()
    });
    std::hint::black_box(steps);
}

/// Rays of both eyes' pixels and the rays that their hits spawn.
fn streams(scene: &scene::Scene, soup: &Soup, bvh: &Bvh, size: u32) -> anyhow::Result<Vec<Stream>> {
    let size_px = [size, size];
    let mut display = hmd::preset("symmetric-100")?;
    display.eye_size_px = size_px;
    display.fov = [hmd::symmetric(100.0, size_px); 2];
    let camera = cameras::find(scene, None)?;
    let frames = cameras::still_frame(camera, &display)?;
    let origin = soup.origin.to_array();
    let to_light = scene
        .lights
        .iter()
        .find_map(|light| match light {
            Light::Directional { direction, .. } => Some(-*direction),
            Light::Point { .. } => None,
        })
        .unwrap_or(Vec3::new(0.3, 1.0, 0.2).normalize());
    let mut seed = 1u64;
    let mut random = || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut stack = TraversalStack::default();
    let [mut primary, mut shadow, mut mirror, mut diffuse] = [const { Vec::new() }; 4];
    for view in &frames[0].eyes {
        let eye = EyeCamera::new(view, display.fov[0], size_px, origin);
        for pixel in 0..size * size {
            let at = [(pixel % size) as f32 + 0.5, (pixel / size) as f32 + 0.5];
            let direction = Vec3::from(eye.direction(at));
            let ray = Ray::new(eye.position.into(), direction);
            primary.push(ray);
            let tree = TraversalKind::Bvh8;
            let hit = bvh.closest(tree, &ray, &mut stack, &mut NoCounter, &AllOpaque);
            let Some(hit) = hit else { continue };
            let bary = barycentrics(&ray, &hit.vertices);
            let normal = soup.attributes(scene, hit.primitive, bary).geometric_normal;
            let normal = if normal.dot(direction) > 0.0 {
                -normal
            } else {
                normal
            };
            let from = offset(point_at(&hit.vertices, bary), normal);
            shadow.push(Ray::new(from, to_light));
            mirror.push(Ray::new(
                from,
                direction - 2.0 * direction.dot(normal) * normal,
            ));
            // Cosine-weighted: the normal plus a point of the unit sphere.
            let z = 1.0 - 2.0 * random();
            let (sin, cos) = (random() * std::f32::consts::TAU).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            let out = (normal + Vec3::new(r * cos, r * sin, z)).normalize_or(normal);
            diffuse.push(Ray::new(from, out));
        }
    }
    let stream = |name, any_hit, rays| Stream {
        name,
        any_hit,
        rays,
    };
    Ok(vec![
        stream("primary", false, primary),
        stream("shadow", true, shadow),
        stream("mirror", false, mirror),
        stream("diffuse", false, diffuse),
    ])
}

/// Triangles as 9 floats each; rays as origin, t_min, direction, t_max.
fn write_dump(folder: &Path, soup: &Soup, streams: &[Stream]) -> anyhow::Result<()> {
    fs::create_dir_all(folder)?;
    let mut file = io::BufWriter::new(fs::File::create(folder.join("triangles.f32"))?);
    for x in soup.triangles.as_flattened().as_flattened() {
        file.write_all(&x.to_le_bytes())?;
    }
    file.flush()?;
    for stream in streams {
        let path = folder.join(format!("{}.f32", stream.name));
        let mut file = io::BufWriter::new(fs::File::create(path)?);
        for ray in &stream.rays {
            let [o, d] = [ray.origin.to_array(), ray.direction.to_array()];
            for x in [o[0], o[1], o[2], ray.t_min, d[0], d[1], d[2], ray.t_max] {
                file.write_all(&x.to_le_bytes())?;
            }
        }
        file.flush()?;
    }
    Ok(())
}
