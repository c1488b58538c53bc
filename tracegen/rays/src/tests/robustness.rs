//! Checks the traversal against brute force: no leak, no false hit, no self-hit.

use formats::raytrace::TraversalKind;
use glam::{DVec3, Vec3};
use lab::traversal::reference::{Random, Reference, TestMesh, Verdict};
use rays::bvh::count::NoCounter;
use rays::bvh::{AllOpaque, Bvh, TraversalStack};
use rays::ray::{Ray, barycentrics, brute_force_f32, offset, point_at};

/// Displacement that rounding to `f32` may cause on a mesh of radius 10 seen from a distance of up
/// to 40: half a unit in the last place of each coordinate and of the shear, times a small factor.
const TOLERANCE: f64 = 1e-5;

/// Results of a check.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Findings {
    /// Rays checked.
    pub rays: u64,
    /// Rays that hit according to the reference.
    pub hits: u64,
    /// Rays whose result depends on less than the rounding of the mesh. They are not counted as
    /// errors.
    pub borderline: u64,
    /// Closest-hit or any-hit results, in either tree, that contradict the reference.
    pub disagreements: u64,
    /// Closest hits that differ in any bit from testing every triangle.
    pub not_brute_force: u64,
    /// Distances whose relative error exceeds 1e-4 plus the effect of rounding the mesh.
    pub wrong_distances: u64,
    /// Rays that leave a convex solid and hit it again.
    pub self_hits: u64,
    /// Rays that enter a closed solid and never leave it although they do in the reference.
    pub leaks: u64,
}

impl Findings {
    /// True if no check failed.
    pub fn clean(&self) -> bool {
        self.disagreements == 0
            && self.not_brute_force == 0
            && self.wrong_distances == 0
            && self.self_hits == 0
            && self.leaks == 0
    }

    /// The sum of both.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            hits: self.hits + other.hits,
            borderline: self.borderline + other.borderline,
            disagreements: self.disagreements + other.disagreements,
            not_brute_force: self.not_brute_force + other.not_brute_force,
            wrong_distances: self.wrong_distances + other.wrong_distances,
            self_hits: self.self_hits + other.self_hits,
            leaks: self.leaks + other.leaks,
        }
    }
}

/// A mesh with its hierarchy, for checks from many threads.
pub struct MeshUnderTest {
    /// Relative to the centre, not rounded.
    mesh: TestMesh,
    rounded: Vec<[[f32; 3]; 3]>,
    bounds: (Vec3, Vec3),
    bvh: Bvh,
    /// True if a ray that leaves the surface never returns.
    convex: bool,
}

impl MeshUnderTest {
    /// A closed test mesh, translated away from the world's origin and recentred in the same way as
    /// scenes.
    ///
    /// # Panics
    /// If the mesh has too many triangles.
    pub fn new(mesh: &TestMesh, translation: DVec3) -> Self {
        let moved = mesh.translated(translation);
        let center = moved.center();
        let rounded = moved.rounded(center);
        let points = || rounded.iter().flatten().map(|p| Vec3::from(*p));
        let bounds = points().fold((Vec3::MAX, Vec3::MIN), |b, p| (b.0.min(p), b.1.max(p)));
        let bvh = Bvh::build_for(TraversalKind::Cwbvh8.into(), &rounded, |_| false)
            .expect("a test mesh is small");
        Self {
            convex: mesh.name != "torus",
            mesh: moved.translated(-center),
            rounded,
            bounds,
            bvh,
        }
    }

    /// Checks `count` rays from outside and inside, aimed at random points, at vertices and at
    /// edges.
    pub fn check(&self, count: u64, seed: u64) -> Findings {
        let mut random = Random(seed.wrapping_mul(2_862_933_555_777_941_757) | 1);
        let mut findings = Findings::default();
        let mut stack = TraversalStack::default();
        let reference = Reference::new(&self.mesh);
        for i in 0..count {
            let ray = self.ray(i, &mut random);
            self.check_ray(&ray, &reference, &mut findings, &mut stack, &mut random);
        }
        findings
    }

    fn ray(&self, i: u64, random: &mut Random) -> Ray {
        let inside = i.is_multiple_of(4);
        let origin = if inside && self.convex {
            random.in_ball() * 5.0
        } else if inside {
            // The centre line of the torus's tube.
            let flat = random.in_ball() * Vec3::new(1.0, 0.0, 1.0);
            flat.normalize_or(Vec3::X) * 7.0 + random.in_ball()
        } else {
            random.in_ball().normalize_or(Vec3::X) * (18.0 + 10.0 * random.unit())
        };
        let corners = self.mesh.corners(random.below(self.rounded.len()));
        let aim = match i % 3 {
            0 => random.in_ball() * 12.0,
            1 => corners[random.below(3)].as_vec3(),
            _ => {
                let k = random.below(3);
                let along = f64::from(random.unit());
                corners[k].lerp(corners[(k + 1) % 3], along).as_vec3()
            }
        };
        Ray::new(origin, (aim - origin).normalize_or(Vec3::Z))
    }

    fn check_ray(
        &self,
        ray: &Ray,
        reference: &Reference<'_>,
        findings: &mut Findings,
        stack: &mut TraversalStack,
        random: &mut Random,
    ) {
        findings.rays += 1;
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let verdict = reference.verdict(o, d, TOLERANCE);
        let plain = brute_force_f32(&self.rounded, self.bounds, ray);
        let trees = [
            TraversalKind::Bvh2,
            TraversalKind::Bvh8,
            TraversalKind::Cwbvh8,
        ];
        let closest = trees.map(|t| {
            let hit = self.bvh.closest(t, ray, stack, &mut NoCounter, &AllOpaque);
            hit.map(|h| (h.t, h.primitive))
        });
        let any = trees.map(|t| {
            self.bvh
                .blocker(t, ray, stack, &mut NoCounter, &AllOpaque)
                .is_some()
        });
        findings.not_brute_force += u64::from(closest.iter().any(|c| *c != plain));
        let says =
            |hit: bool| closest.iter().any(|c| c.is_some() != hit) || any.iter().any(|a| *a != hit);
        match verdict {
            Verdict::Borderline => findings.borderline += 1,
            Verdict::Miss => findings.disagreements += u64::from(says(false)),
            Verdict::Hit(distance) => {
                findings.hits += 1;
                findings.disagreements += u64::from(says(true));
                if let Some(((t, _), (distance, shift))) = plain.zip(distance) {
                    let allowed = 1e-4 * distance.max(1.0) + shift;
                    let t = f64::from(t) * d.length();
                    findings.wrong_distances += u64::from((t - distance).abs() > allowed);
                }
                self.check_spawned(ray, reference, findings, stack, random);
            }
        }
    }

    /// Checks two rays that start at the hit, one away from the solid and one into it.
    fn check_spawned(
        &self,
        ray: &Ray,
        reference: &Reference<'_>,
        findings: &mut Findings,
        stack: &mut TraversalStack,
        random: &mut Random,
    ) {
        let tree = TraversalKind::Bvh2;
        let found = self
            .bvh
            .closest(tree, ray, stack, &mut NoCounter, &AllOpaque);
        let Some(hit) = found else { return };
        let [a, b, c] = hit.vertices.map(Vec3::from);
        let outward = (b - a).cross(c - a).normalize_or_zero();
        let point = point_at(&hit.vertices, barycentrics(ray, &hit.vertices));
        // Directions at up to half a degree from the surface.
        let tangent = random.in_ball().cross(outward).normalize_or_zero();
        let slope = 0.01 + random.unit();
        let away = (tangent + outward * slope).normalize_or(outward);
        let mut hits = |from: Vec3, to: Vec3| {
            let ray = Ray::new(from, to);
            self.bvh
                .blocker(tree, &ray, stack, &mut NoCounter, &AllOpaque)
                .is_some()
        };
        if self.convex && hits(offset(point, outward), away) {
            findings.self_hits += 1;
        }
        // A ray from a point on an edge may leave at once through the adjacent face, so the
        // reference decides.
        let within = offset(point, -outward);
        let exits = reference.verdict(within.as_dvec3(), -away.as_dvec3(), TOLERANCE);
        if !hits(within, -away) && matches!(exits, Verdict::Hit(_)) {
            findings.leaks += 1;
        }
    }
}

/// The meshes for checking the traversal.
pub fn meshes() -> [TestMesh; 3] {
    [
        TestMesh::sphere(3),
        TestMesh::grid_box(8),
        TestMesh::torus(48, 20),
    ]
}

/// Distances from the world's origin along a diagonal.
pub const TRANSLATIONS: [f64; 4] = [0.0, 1e3, 1e5, 1e6];

// A bench without a test harness leaves the tests out, not their imports.
#[cfg(test)]
#[allow(unused_imports)]
mod tests {
    use super::*;

    #[test]
    fn no_ray_leaks_or_hits_falsely_at_any_distance_from_the_origin() {
        for mesh in meshes() {
            for distance in TRANSLATIONS {
                let subject = MeshUnderTest::new(&mesh, DVec3::new(1.0, 0.7, -0.9) * distance);
                let findings = subject.check(1200, 7);
                assert!(
                    findings.clean(),
                    "{} at {distance}: {findings:?}",
                    mesh.name
                );
                assert!(findings.hits > 600, "{findings:?}");
                assert!(findings.borderline < 60, "{findings:?}");
            }
        }
    }
}
