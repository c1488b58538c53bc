//! Checks hits and work of a scene's rays against independent searches:
//! `cargo bench -p rays --bench ray_hits -- FOLDER [RAYS]`.
//!
//! FOLDER has triangles and streams of rays as written by `rays --dump`, and what Embree found for
//! them (see `studies/embree.py`, which runs this). RAYS of each stream are checked, evenly
//! spread, by default 300,000. A line per stream has the counts of rays that differ, as JSON. The
//! exit code is 1 if a difference has no cause.

use anyhow::Context;
use formats::raytrace::{Hierarchy, TraversalKind};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rays::bvh::count::Counts;
use rays::bvh::{AllOpaque, Bvh, Instructions, TraversalStack};
use rays::ray::Ray;
use reference_tree::{Cause, ReferenceTree, cause, exact};
use reference_walk::ReferenceWalk;
use std::path::Path;
use std::process::ExitCode;

#[path = "../src/tests/reference_tree.rs"]
mod reference_tree;
#[path = "../src/tests/reference_walk.rs"]
mod reference_walk;

type Triangle = [[f32; 3]; 3];

const STREAMS: [&str; 4] = ["primary", "shadow", "mirror", "diffuse"];
/// What rounding may displace, relative to the farthest corner seen from the origin: a few
/// operations of half a unit in the last place each.
const TOLERANCE: f64 = 8.0 * f32::EPSILON as f64;

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// Values of four bytes in a file.
fn words<T>(path: &Path, of: impl Fn([u8; 4]) -> T) -> anyhow::Result<Vec<T>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let (words, rest) = bytes.as_chunks();
    anyhow::ensure!(
        rest.is_empty(),
        "{}: {} bytes, expected a multiple of four",
        path.display(),
        bytes.len()
    );
    Ok(words.iter().map(|word| of(*word)).collect())
}

/// Rays that differ from another search, by cause.
#[derive(Clone, Copy, Default)]
struct Differences {
    edge: u64,
    start: u64,
    tie: u64,
    unexplained: u64,
}

impl Differences {
    fn count(&mut self, cause: Option<Cause>) {
        *match cause {
            Some(Cause::Edge) => &mut self.edge,
            Some(Cause::Start) => &mut self.start,
            Some(Cause::Tie) => &mut self.tie,
            None => &mut self.unexplained,
        } += 1;
    }

    fn plus(self, other: Self) -> Self {
        Self {
            edge: self.edge + other.edge,
            start: self.start + other.start,
            tie: self.tie + other.tie,
            unexplained: self.unexplained + other.unexplained,
        }
    }

    fn json(self, name: &str) -> String {
        let Self {
            edge,
            start,
            tie,
            unexplained,
        } = self;
        format!(
            "\"{name}\":{{\"edge\":{edge},\"start\":{start},\"tie\":{tie},\"unexplained\":{unexplained}}}"
        )
    }
}

#[derive(Clone, Copy, Default)]
struct Findings {
    hits: u64,
    /// Rays whose hit is not the same, bit for bit, in all trees and with plain Rust.
    trees: u64,
    /// Rays whose steps or tests differ from the walk by FORMAT.md, by tree.
    work: [u64; 4],
    double: Differences,
    embree: Differences,
}

impl Findings {
    fn plus(self, other: Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            trees: self.trees + other.trees,
            work: std::array::from_fn(|tree| self.work[tree] + other.work[tree]),
            double: self.double.plus(other.double),
            embree: self.embree.plus(other.embree),
        }
    }
}

/// One of our trees: the tracer with the best instructions and in plain Rust, and the walk by
/// FORMAT.md.
struct Tree<'a> {
    kind: TraversalKind,
    bvhs: [&'a Bvh; 2],
    walk: ReferenceWalk<'a>,
}

/// A scene's triangles in all searches.
struct Searches<'a> {
    triangles: &'a [Triangle],
    trees: [Tree<'a>; 4],
    double: ReferenceTree,
}

/// A ray, and what Embree found: the nearest triangle, and whether there is any.
#[derive(Clone, Copy)]
struct Checked {
    ray: Ray,
    embree: (Option<u32>, bool),
}

impl Searches<'_> {
    /// Compares a nearest hit with another search's.
    fn compare(
        &self,
        ray: &Ray,
        ours: Option<u32>,
        other: Option<u32>,
        differences: &mut Differences,
    ) {
        if ours == other {
            return;
        }
        let [ours, other] =
            [ours, other].map(|hit| hit.map(|at| exact(&self.triangles[at as usize])));
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let far = ours.iter().chain(&other).flatten();
        let far = far
            .map(|corner: &DVec3| corner.distance(o))
            .fold(0.0, f64::max);
        let causes = [(ours, other), (other, ours)]
            .map(|(one, two)| one.and_then(|one| cause(&one, two.as_ref(), o, d, TOLERANCE * far)));
        differences.count(causes[0].or(causes[1]));
    }

    fn check(&self, checked: &Checked, any_hit: bool, stack: &mut TraversalStack) -> Findings {
        let Checked { ray, embree } = checked;
        let mut findings = Findings::default();
        let mut found = Vec::new();
        for (number, tree) in self.trees.iter().enumerate() {
            let kind = tree.kind;
            let (walked, slot) = tree.walk.walk(ray, any_hit);
            for bvh in tree.bvhs {
                let mut counts = Counts::default();
                let hit = if any_hit {
                    bvh.blocker(kind, ray, stack, &mut counts, &AllOpaque)
                } else {
                    bvh.closest(kind, ray, stack, &mut counts, &AllOpaque)
                };
                let same = walked == counts && slot == hit.map(|hit| bvh.slot(kind, &hit));
                findings.work[number] |= u64::from(!same);
                found.push(hit.map(|hit| (hit.t.to_bits(), hit.primitive)));
            }
        }
        let same = |a: &Option<(u32, u32)>, b: &Option<(u32, u32)>| {
            a == b || any_hit && a.is_some() == b.is_some()
        };
        findings.trees = u64::from(found.iter().any(|other| !same(&found[0], other)));
        findings.hits = u64::from(found[0].is_some());
        let ours = found[0].map(|(_, primitive)| primitive);
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let double = self.double.closest(o, d).map(|hit| hit.primitive);
        if !any_hit {
            self.compare(ray, ours, double, &mut findings.double);
            self.compare(ray, ours, embree.0, &mut findings.embree);
            return findings;
        }
        if ours.is_some() != double.is_some() {
            self.compare(ray, ours, double, &mut findings.double);
        }
        if ours.is_some() != embree.1 {
            let other = embree.0.filter(|_| embree.1);
            self.compare(ray, ours, other, &mut findings.embree);
        }
        findings
    }
}

fn run() -> anyhow::Result<bool> {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let folder = Path::new(arguments.first().context("a folder is missing")?);
    let most = match arguments.get(1) {
        Some(rays) => rays.parse()?,
        None => 300_000,
    };
    let coordinates = words(&folder.join("triangles.f32"), f32::from_le_bytes)?;
    let triangles: Vec<Triangle> = coordinates
        .as_chunks::<9>()
        .0
        .iter()
        .map(|[a, b, c, d, e, f, g, h, i]| [[*a, *b, *c], [*d, *e, *f], [*g, *h, *i]])
        .collect();
    let built = |instructions| -> anyhow::Result<Vec<Bvh>> {
        let build = |kind: TraversalKind| -> anyhow::Result<Bvh> {
            let bvh = Bvh::build_for(kind.into(), &triangles, |_| false)?;
            Ok(bvh.with_instructions(instructions))
        };
        TraversalKind::ALL.into_iter().map(build).collect()
    };
    let (fast, plain) = (built(Instructions::best())?, built(Instructions::Scalar)?);
    let contents: [Hierarchy; 4] =
        std::array::from_fn(|tree| fast[tree].contents(TraversalKind::ALL[tree]));
    let searches = Searches {
        triangles: &triangles,
        trees: std::array::from_fn(|tree| {
            let kind = TraversalKind::ALL[tree];
            Tree {
                kind,
                bvhs: [&fast[tree], &plain[tree]],
                walk: ReferenceWalk::new(&contents[tree], kind.width()),
            }
        }),
        double: ReferenceTree::new(&triangles),
    };
    let mut clean = true;
    for stream in STREAMS {
        let any_hit = stream == "shadow";
        let rays = rays_of(folder, stream, most)?;
        let f = rays
            .par_iter()
            .map_init(TraversalStack::default, |stack, ray| {
                searches.check(ray, any_hit, stack)
            })
            .reduce(Findings::default, Findings::plus);
        clean &=
            f.trees + f.work.iter().sum::<u64>() + f.double.unexplained + f.embree.unexplained == 0;
        println!(
            "{{\"stream\":\"{stream}\",\"triangles\":{},\"rays\":{},\"hits\":{},\"trees\":{},\"work\":{},{},{}}}",
            triangles.len(),
            rays.len(),
            f.hits,
            f.trees,
            f.work.iter().sum::<u64>(),
            f.double.json("double"),
            f.embree.json("embree")
        );
    }
    Ok(clean)
}

/// Rays of a stream, evenly spread, with what Embree found.
fn rays_of(folder: &Path, stream: &str, most: usize) -> anyhow::Result<Vec<Checked>> {
    let file = |end: &str| folder.join(format!("{stream}.{end}"));
    let values = words(&file("f32"), f32::from_le_bytes)?;
    let found = words(&file("embree"), i32::from_le_bytes)?;
    let (values, found) = (values.as_chunks::<8>().0, found.as_chunks::<2>().0);
    anyhow::ensure!(
        values.len() == found.len(),
        "{stream}: Embree's results are of {} rays, expected {}",
        found.len(),
        values.len()
    );
    let step = values.len().div_ceil(most).max(1);
    let rays = values.iter().zip(found).step_by(step);
    let ray =
        |([x, y, z, t_min, dx, dy, dz, t_max], [nearest, any]): (&[f32; 8], &[i32; 2])| Checked {
            ray: Ray {
                origin: Vec3::new(*x, *y, *z),
                direction: Vec3::new(*dx, *dy, *dz),
                t_min: *t_min,
                t_max: *t_max,
            },
            embree: (u32::try_from(*nearest).ok(), *any != 0),
        };
    Ok(rays.map(ray).collect())
}
