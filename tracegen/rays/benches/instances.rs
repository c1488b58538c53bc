//! Trees of instances against flattened scenes and Embree:
//! `cargo bench -p rays --bench instances -- hits|memory|speed [--count N] [--rounds N] [--embree LIBRARY]`.
//!
//! `hits` compares `--count` rays (a million) for each way to place instances. `memory` and `speed`
//! use a forest of `--count` instances (10,000) of a tree of 20,000 triangles. `speed` needs Embree 4
//! as a dynamic library (the Python package embreex has one); both take turns on each stream of
//! single rays, and the best round counts. Results are JSON, a line each. The exit code is 1 if a
//! hit differs without a cause.

use embree::{Embree, Forest};
use formats::raytrace::{InstanceNodes, TraversalKind};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use instances::{Findings, InstancesUnderTest, Places};
use lab::traversal::reference::Random;
use rayon::prelude::*;
use rays::bvh::count::{Counter, NoCounter};
use rays::bvh::{AllOpaque, Bvh, Placement, TraversalStack};
use rays::ray::{Ray, barycentrics, offset, point_at};
use std::process::ExitCode;
use std::time::Instant;

mod embree;
#[path = "../src/tests/instances.rs"]
mod instances;

type Triangle = [[f32; 3]; 3];

const TREE_TRIANGLES: usize = 20_000;
const KINDS: [TraversalKind; 2] = [TraversalKind::Bvh2, TraversalKind::Bvh8];

fn main() -> anyhow::Result<ExitCode> {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let part = arguments.next().unwrap_or_default();
    let (mut count, mut rounds, mut library) = (None::<u64>, 5, None);
    while let Some(option) = arguments.next() {
        let value = arguments.next().unwrap_or_default();
        match option.as_str() {
            "--count" => count = Some(value.parse()?),
            "--rounds" => rounds = value.parse()?,
            "--embree" => library = Some(value),
            _ => anyhow::bail!("unknown argument {option}"),
        }
    }
    match part.as_str() {
        "hits" => return Ok(hits(count.unwrap_or(1_000_000))),
        "memory" => memory(count.unwrap_or(10_000) as usize)?,
        "speed" => {
            let library = library.ok_or_else(|| anyhow::anyhow!("speed needs --embree LIBRARY"))?;
            speed(count.unwrap_or(10_000) as usize, rounds, &library)?;
        }
        _ => anyhow::bail!("expected hits, memory or speed, found `{part}`"),
    }
    Ok(ExitCode::SUCCESS)
}

fn hits(rays: u64) -> ExitCode {
    const CHUNK: u64 = 10_000;
    let mut unexplained = 0;
    for places in Places::ALL {
        let subject = InstancesUnderTest::new(places, 60);
        let found = (0..rays.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| subject.check(CHUNK.min(rays - chunk * CHUNK), chunk + 1))
            .reduce(Findings::default, |a, b| Findings {
                rays: a.rays + b.rays,
                hits: a.hits + b.hits,
                different: a.different + b.different,
                unexplained: a.unexplained + b.unexplained,
            });
        let Findings {
            rays,
            hits,
            different,
            ..
        } = found;
        println!(
            "{{\"places\":\"{places:?}\",\"rays\":{rays},\"hits\":{hits},\"different\":{different},\"unexplained\":{}}}",
            found.unexplained
        );
        unexplained += found.unexplained;
    }
    ExitCode::from(u8::from(unexplained > 0))
}

/// A trunk with branches of six sides and leaves of two triangles, 8 m high.
fn tree() -> Vec<Triangle> {
    let mut random = Random(7);
    let mut triangles = Vec::new();
    let mut branch = |from: Vec3, to: Vec3, radius: f32| {
        let along = (to - from).normalize_or(Vec3::Y);
        let (u, v) = along.any_orthonormal_pair();
        let ring = |at: Vec3, radius: f32, i: usize| {
            let (sin, cos) = (i as f32 * std::f32::consts::TAU / 6.0).sin_cos();
            (at + (u * cos + v * sin) * radius).to_array()
        };
        for i in 0..6 {
            let [a, b] = [i, i + 1].map(|i| ring(from, radius, i % 6));
            let [c, d] = [i, i + 1].map(|i| ring(to, radius * 0.6, i % 6));
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    };
    branch(Vec3::ZERO, Vec3::Y * 7.0, 0.25);
    let mut tips = Vec::new();
    for _ in 0..60 {
        let from = Vec3::Y * (2.5 + 4.5 * random.unit());
        let out = random.in_ball().normalize_or(Vec3::X) + Vec3::Y * 0.4;
        let to = from + out * (2.4 - 0.25 * from.y);
        branch(from, to, 0.07);
        for _ in 0..7 {
            let from = from.lerp(to, 0.3 + 0.7 * random.unit());
            let to = from + random.in_ball() * 0.8;
            branch(from, to, 0.025);
            tips.push(to);
        }
    }
    while triangles.len() < TREE_TRIANGLES {
        let middle = tips[random.below(tips.len())] + random.in_ball() * 0.35;
        let u = random.in_ball().normalize_or(Vec3::X) * 0.06;
        let v = random.in_ball().cross(u).normalize_or(Vec3::Y) * 0.04;
        let [a, b, c, d] = [middle - u, middle + v, middle + u, middle - v].map(|p| p.to_array());
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    triangles
}

/// Trees on a jittered grid with 5 m between them, turned, leant and scaled; every seventh is mirrored.
fn forest(count: usize) -> Vec<Placement> {
    let mut random = Random(11);
    let side = (count as f64).sqrt().ceil() as usize;
    let place = |i: usize| {
        let mut signed = || f64::from(random.unit()) * 2.0 - 1.0;
        let at = DVec3::new((i % side) as f64, 0.0, (i / side) as f64)
            - side as f64 / 2.0 * (DVec3::X + DVec3::Z);
        let turn = DQuat::from_rotation_y(signed() * 3.2) * DQuat::from_rotation_x(signed() * 0.08);
        let scale = DVec3::splat(1.0 + 0.3 * signed())
            * DVec3::new(if i.is_multiple_of(7) { -1.0 } else { 1.0 }, 1.0, 1.0);
        let at = at * 5.0 + DVec3::new(signed(), 0.0, signed()) * 1.5;
        // As scenes hold it.
        let transform = DAffine3::from_scale_rotation_translation(scale, turn, at).as_affine3a();
        let transform = DAffine3 {
            matrix3: transform.matrix3.as_dmat3(),
            translation: transform.translation.as_dvec3(),
        };
        Placement {
            mesh: 0,
            transform,
            mirrored: i.is_multiple_of(7),
        }
    };
    (0..count).map(place).collect()
}

fn instanced(meshes: &[Vec<Triangle>], placements: &[Placement]) -> anyhow::Result<Bvh> {
    let kind = TraversalKind::Bvh2.into();
    Ok(Bvh::build_instanced(
        kind,
        DVec3::ZERO,
        meshes,
        placements,
        |_| false,
    )?)
}

/// Bytes of both hierarchies. Those of the flattened one follow from forests that fit.
fn memory(count: usize) -> anyhow::Result<()> {
    let meshes = [tree()];
    let placements = forest(count);
    let start = Instant::now();
    let bvh = instanced(&meshes, &placements)?;
    let built_s = start.elapsed().as_secs_f64();
    let flat = |trees: usize| {
        let all = placements[..trees]
            .iter()
            .flat_map(|p| meshes[0].iter().map(|t| p.triangle(DVec3::ZERO, *t)));
        let triangles: Vec<Triangle> = all.collect();
        Bvh::build(&triangles, |_| false)
    };
    let start = Instant::now();
    let [few, more] = [flat(10)?, flat(20)?];
    let flat_s = start.elapsed().as_secs_f64() / 30.0 * count as f64;
    for kind in KINDS {
        let bytes = |bvh: &Bvh| bvh.summary(kind).bytes();
        // The part that grows with each tree.
        let flattened = (bytes(&more) - bytes(&few)) / 10 * count as u64;
        let s = bvh.summary(kind);
        println!(
            "{{\"tree\":\"{}\",\"instances\":{count},\"triangles\":{},\"nodes\":{},\"bytes\":{},\"host_bytes\":{},\
             \"flattened_bytes\":{flattened},\"flattened_host_bytes\":{},\"built_s\":{built_s:.2},\"flattened_s\":{flat_s:.0}}}",
            formats::text::name_of(&kind),
            s.triangles,
            s.nodes,
            s.bytes(),
            bvh.host_bytes(),
            (more.host_bytes() - few.host_bytes()) / 10 * count,
        );
    }
    Ok(())
}

/// Steps in both levels, entered instances, and tests.
struct Levels {
    /// Number of the first instance as a node, and of the first node below.
    at: [u32; 2],
    counts: [u64; 4],
}

impl Counter for Levels {
    fn step(&mut self, node: u32) {
        self.counts[self.at.partition_point(|at| *at <= node)] += 1;
    }
    fn triangles(&mut self, _: impl FnOnce() -> u32, count: u32) {
        self.counts[3] += u64::from(count);
    }
    fn alpha(&mut self) {}
}

/// Rays of a walker's and of a bird's view, and rays from what the walker sees.
fn streams(bvh: &Bvh, size: u32) -> Vec<(&'static str, bool, Vec<Ray>)> {
    let mut random = Random(3);
    let mut stack = TraversalStack::default();
    let [mut walker, mut bird, mut shadow, mut diffuse] = [const { Vec::new() }; 4];
    let sun = Vec3::new(0.4, 0.8, 0.3).normalize();
    for pixel in 0..size * size {
        let [x, y] =
            [pixel % size, pixel / size].map(|p| (p as f32 + 0.5) / size as f32 * 2.0 - 1.0);
        let ahead = Vec3::new(x * 1.2, -y * 1.2, -1.0).normalize();
        walker.push(Ray::new(Vec3::new(2.5, 1.7, 2.5), ahead));
        bird.push(Ray::new(
            Vec3::new(0.0, 60.0, 0.0),
            (ahead - Vec3::Y).normalize(),
        ));
        let ray = walker[pixel as usize];
        let Some(hit) = bvh.closest(
            TraversalKind::Bvh8,
            &ray,
            &mut stack,
            &mut NoCounter,
            &AllOpaque,
        ) else {
            continue;
        };
        let [a, b, c] = hit.vertices.map(Vec3::from);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let normal = if normal.dot(ahead) > 0.0 {
            -normal
        } else {
            normal
        };
        let from = offset(
            point_at(&hit.vertices, barycentrics(&ray, &hit.vertices)),
            normal,
        );
        shadow.push(Ray::new(from, sun));
        diffuse.push(Ray::new(
            from,
            (normal + random.in_ball().normalize_or(Vec3::X)).normalize_or(normal),
        ));
    }
    vec![
        ("primary, walker", false, walker),
        ("primary, bird", false, bird),
        ("shadow", true, shadow),
        ("diffuse", false, diffuse),
    ]
}

fn speed(count: usize, rounds: usize, library: &str) -> anyhow::Result<()> {
    let meshes = [tree()];
    let placements = forest(count);
    let bvh = instanced(&meshes, &placements)?;
    let embree = Embree::load(library)?;
    let peers = [1, 2].map(|quality| Forest::new(&embree, &meshes[0], &placements, quality));
    for (name, any_hit, rays) in streams(&bvh, 512) {
        // The best round of every slice, so that a disturbance affects one slice of one round.
        let slices: Vec<&[Ray]> = rays.chunks(1 << 12).collect();
        let mut best_s = vec![[f64::INFINITY; 4]; slices.len()];
        let mut hits = [0; 4];
        for round in 0..rounds {
            for (slice, best_s) in slices.iter().zip(&mut best_s) {
                for program in 0..4 {
                    let start = Instant::now();
                    let found = match KINDS.get(program) {
                        Some(kind) => ours(&bvh, *kind, any_hit, slice),
                        None => {
                            let peer = &peers[program - 2];
                            slice.iter().filter(|ray| peer.hits(ray, any_hit)).count()
                        }
                    };
                    best_s[program] = best_s[program].min(start.elapsed().as_secs_f64());
                    hits[program] += if round == 0 { found } else { 0 };
                }
            }
        }
        let best_s: [f64; 4] = std::array::from_fn(|at| best_s.iter().map(|slice| slice[at]).sum());
        let rate = best_s.map(|s| rays.len() as f64 / s / 1e6);
        let levels = KINDS.map(|kind| {
            let InstanceNodes { first, count } = bvh.summary(kind).instances.unwrap_or_default();
            let at = [first, first + count];
            let mut levels = Levels { at, counts: [0; 4] };
            let mut stack = TraversalStack::default();
            for ray in &rays {
                if any_hit {
                    bvh.blocker(kind, ray, &mut stack, &mut levels, &AllOpaque);
                } else {
                    bvh.closest(kind, ray, &mut stack, &mut levels, &AllOpaque);
                }
            }
            levels.counts.map(|n| n as f64 / rays.len() as f64)
        });
        println!(
            "{{\"stream\":\"{name}\",\"rays\":{},\"hits\":{hits:?},\"bvh2\":{:.4},\"bvh8\":{:.4},\"embree\":{:.4},\"embree_high\":{:.4},\
             \"bvh2_counts\":{:.2?},\"bvh8_counts\":{:.2?}}}",
            rays.len(),
            rate[0],
            rate[1],
            rate[2],
            rate[3],
            levels[0],
            levels[1],
        );
    }
    Ok(())
}

fn ours(bvh: &Bvh, kind: TraversalKind, any_hit: bool, rays: &[Ray]) -> usize {
    let mut stack = TraversalStack::default();
    let hit = |ray: &&Ray| {
        let found = if any_hit {
            bvh.blocker(kind, ray, &mut stack, &mut NoCounter, &AllOpaque)
        } else {
            bvh.closest(kind, ray, &mut stack, &mut NoCounter, &AllOpaque)
        };
        found.is_some()
    };
    rays.iter().filter(hit).count()
}
