//! Compares the portable kernel of the ray tracer with the AVX2 kernel and with tests of all triangles one
//! by one.
//!
//! An input has rays and triangles: a byte that selects the form of numbers, a byte with the number of
//! rays, then numbers, six for each ray and nine for each triangle.

use formats::raytrace::TraversalKind;
use glam::Vec3;
use rays::bvh::count::Counts;
use rays::bvh::{AllOpaque, AlphaTest, Bvh, Instructions, RayHit, TraversalStack};
use rays::ray::{LARGEST_COORDINATE, Ray, brute_force_f32};

/// More triangles would take longer without finding more.
const MOST_TRIANGLES: usize = 24;
const MOST_RAYS: usize = 8;

/// Ignores every other triangle.
struct EveryOther;

impl AlphaTest for EveryOther {
    fn opaque(&self, primitive: u32, _: [f32; 2]) -> bool {
        primitive.is_multiple_of(2)
    }
}

/// Numbers of an input.
struct Numbers<'a>(&'a [u8], u8);

impl Numbers<'_> {
    /// The next number: any bits, or small integers (which hit edges and vertices exactly), or such
    /// integers far from the origin or close together.
    fn next(&mut self) -> Option<f32> {
        match self.1 % 4 {
            0 => {
                let (bytes, rest) = self.0.split_first_chunk()?;
                self.0 = rest;
                Some(f32::from_le_bytes(*bytes))
            }
            way => {
                let (byte, rest) = self.0.split_first()?;
                self.0 = rest;
                let small = f32::from(*byte as i8);
                Some(match way {
                    1 => small,
                    2 => small / 16.0,
                    _ => small * 7e15,
                })
            }
        }
    }

    fn vector(&mut self) -> Option<[f32; 3]> {
        Some([self.next()?, self.next()?, self.next()?])
    }
}

type Found = (Option<(u32, u32)>, bool, Counts);

fn found(bvh: &Bvh, tree: TraversalKind, ray: &Ray, alpha: &impl AlphaTest) -> Found {
    let mut stack = TraversalStack::default();
    let mut counts = Counts::default();
    let hit = bvh.closest(tree, ray, &mut stack, &mut counts, alpha);
    let hit = hit.map(|h: RayHit| (h.t.to_bits(), h.primitive));
    let any = bvh
        .blocker(tree, ray, &mut stack, &mut counts, alpha)
        .is_some();
    (hit, any, counts)
}

/// Checks that hits are bit-identical and counts are equal.
pub fn run(bytes: &[u8]) {
    let [way, rays, rest @ ..] = bytes else {
        return;
    };
    let mut numbers = Numbers(rest, *way);
    let rays: Vec<Ray> = (0..usize::from(*rays) % MOST_RAYS + 1)
        .map_while(|_| {
            let origin = numbers.vector()?.into();
            Some(Ray::new(origin, numbers.vector()?.into()))
        })
        .collect();
    let triangles: Vec<[[f32; 3]; 3]> = (0..MOST_TRIANGLES)
        .map_while(|_| Some([numbers.vector()?, numbers.vector()?, numbers.vector()?]))
        .collect();
    let masked = |number: u32| way & 4 != 0 && number.is_multiple_of(3);
    let third = if way & 8 != 0 {
        TraversalKind::Bvh4
    } else {
        TraversalKind::Cwbvh8
    };
    let fast = Bvh::build_for(third.into(), &triangles, masked).expect("few triangles");
    let trees = [TraversalKind::Bvh2, TraversalKind::Bvh8, third];
    let all = |bvh: &Bvh| -> Vec<[Found; 2]> {
        let each = rays.iter().flat_map(|ray| trees.map(|tree| (ray, tree)));
        each.map(|(ray, tree)| {
            [
                found(bvh, tree, ray, &AllOpaque),
                found(bvh, tree, ray, &EveryOther),
            ]
        })
        .collect()
    };
    let with_best = all(&fast);
    let plain = fast.with_instructions(Instructions::Scalar);
    let with_plain = all(&plain);
    assert_eq!(with_best, with_plain, "{rays:?} {triangles:?}");
    for (ray, found) in rays.iter().zip(with_plain.chunks_exact(trees.len())) {
        let expected = one_by_one(&triangles, ray);
        for (tree, found) in trees.iter().zip(found) {
            assert_eq!(found[0].0, expected, "{tree:?}: {ray:?} {triangles:?}");
        }
    }
}

/// The nearest hit among the triangles of the hierarchy.
fn one_by_one(triangles: &[[[f32; 3]; 3]], ray: &Ray) -> Option<(u32, u32)> {
    let fits = |t: &[[f32; 3]; 3]| {
        let numbers = t.as_flattened().iter();
        numbers.clone().all(|x| x.abs() <= LARGEST_COORDINATE)
    };
    let kept = || (0..).zip(triangles).filter(|(_, t)| fits(t));
    let points = kept().flat_map(|(_, t)| t.map(Vec3::from));
    let bounds = points
        .map(|p| (p, p))
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    if !ray.is_valid() {
        return None;
    }
    let hits = kept().filter_map(|(number, t)| {
        let (t, _) = brute_force_f32(&[*t], bounds, ray)?;
        Some((t, number))
    });
    let nearest = hits.reduce(|a, b| if b < a { b } else { a });
    nearest.map(|(t, number)| (t.to_bits(), number))
}
