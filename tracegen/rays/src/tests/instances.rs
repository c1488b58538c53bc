//! Checks hits in trees of instances against those of the flattened scene.

use formats::raytrace::TraversalKind;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use lab::traversal::reference::{Random, TestMesh};
use rays::bvh::count::NoCounter;
use rays::bvh::{AllOpaque, Bvh, Instructions, Placement, RayHit, TraversalStack};
use rays::ray::{Ray, barycentrics, offset, point_at};

type Triangle = [[f32; 3]; 3];

/// How instances are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Places {
    /// Axes permuted and mirrored, each scaled by a power of two, and moved by quarters.
    Exact,
    /// Any matrix, a third of them with an axis scaled to almost nothing or to nothing.
    Affine,
    /// The same, a hundred kilometres from the world's origin.
    Far,
}

impl Places {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Exact, Self::Affine, Self::Far];

    fn placement(self, mesh: usize, i: usize, origin: DVec3, random: &mut Random) -> Placement {
        let mut signed = |size: f64| (f64::from(random.unit()) * 2.0 - 1.0) * size;
        let (matrix3, translation) = if self == Self::Exact {
            let mut axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                let size = signed(2.5);
                axis * size.round().exp2().copysign(signed(1.0))
            });
            axes.rotate_left(i % 3);
            axes.swap(0, i / 3 % 3);
            let moved = DVec3::from([0; 3].map(|_| (signed(60.0) * 4.0).round() / 4.0));
            (
                DMat3::from_cols_array_2d(&axes.map(|a| a.to_array())),
                moved,
            )
        } else {
            let flat = [1.0, 1e-3, 1.0, 0.0, 1.0, 1.0][i % 6];
            let mut column = |size| DVec3::from([0; 3].map(|_| signed(size)));
            let matrix = DMat3::from_cols(column(1.5), column(1.5), column(1.5) * flat);
            (matrix, column(60.0))
        };
        let transform = DAffine3 {
            matrix3,
            translation: translation + origin,
        };
        let mirrored = transform.matrix3.determinant() < 0.0;
        Placement {
            mesh,
            transform,
            mirrored,
        }
    }
}

/// Results of a check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// Rays checked.
    pub rays: u64,
    /// Rays that hit the flattened scene.
    pub hits: u64,
    /// Rays for which triangle, distance or vertices differ in any bit, in any tree.
    pub different: u64,
    /// Those that pass no edge of either triangle within the error bound.
    pub unexplained: u64,
}

/// A scene with both hierarchies.
pub struct InstancesUnderTest {
    triangles: Vec<Triangle>,
    flat: Bvh,
    instanced: [Bvh; 2],
}

impl InstancesUnderTest {
    /// Places meshes of many triangles often, and one of them once.
    ///
    /// # Panics
    /// The scene has too many triangles.
    pub fn new(places: Places, count: usize) -> Self {
        let meshes = [
            TestMesh::sphere(3),
            TestMesh::torus(24, 12),
            TestMesh::grid_box(6),
            TestMesh::sphere(1),
        ]
        .map(|mesh| mesh.rounded(DVec3::ZERO));
        let origin = match places {
            Places::Far => DVec3::new(1e5, -3e4, 7.0),
            _ => DVec3::ZERO,
        };
        let mut random = Random(count as u64);
        let mut placements: Vec<Placement> = (0..count)
            .map(|i| places.placement(if i == 4 { 3 } else { i % 3 }, i, origin, &mut random))
            .collect();
        // Coincident instances.
        placements.push(placements[0]);
        let triangles: Vec<Triangle> = (placements.iter())
            .flat_map(|p| meshes[p.mesh].iter().map(move |t| p.triangle(origin, *t)))
            .collect();
        let options = TraversalKind::Cwbvh8.into();
        let instanced = || {
            Bvh::build_instanced(options, origin, &meshes, &placements, |_| false)
                .expect("is small")
        };
        Self {
            flat: Bvh::build_for(options, &triangles, |_| false).expect("is small"),
            instanced: [
                instanced(),
                instanced().with_instructions(Instructions::Scalar),
            ],
            triangles,
        }
    }

    /// Checks rays that are aimed at random points, vertices and edges, along axes, and from surfaces.
    pub fn check(&self, count: u64, seed: u64) -> Findings {
        let mut random = Random(seed.wrapping_mul(2_862_933_555_777_941_757) | 1);
        let (mut stack, mut findings) = (TraversalStack::default(), Findings::default());
        let mut from = None;
        for i in 0..count {
            let origin = match from.take() {
                Some(surface) if i % 2 == 0 => surface,
                _ => random.in_ball() * 90.0,
            };
            let v = self.triangles[random.below(self.triangles.len())].map(Vec3::from);
            let aim = match i % 4 {
                0 => random.in_ball() * 70.0,
                1 => v[random.below(3)],
                2 => v[0].lerp(v[1], random.unit()),
                _ => origin + [Vec3::X, Vec3::NEG_Y, Vec3::Z][random.below(3)],
            };
            let ray = Ray::new(origin, aim - origin);
            let flat = self.flat.closest(
                TraversalKind::Bvh8,
                &ray,
                &mut stack,
                &mut NoCounter,
                &AllOpaque,
            );
            findings.rays += 1;
            findings.hits += u64::from(flat.is_some());
            let trees = [
                TraversalKind::Bvh2,
                TraversalKind::Bvh8,
                TraversalKind::Cwbvh8,
            ];
            // Plain Rust is slow.
            let bvhs = &self.instanced[..if i % 8 == 0 { 2 } else { 1 }];
            for (bvh, kind) in bvhs.iter().flat_map(|bvh| trees.map(|kind| (bvh, kind))) {
                let hit = bvh.closest(kind, &ray, &mut stack, &mut NoCounter, &AllOpaque);
                let any = bvh.blocker(kind, &ray, &mut stack, &mut NoCounter, &AllOpaque);
                let bits =
                    |hit: Option<RayHit>| hit.map(|h| (h.t.to_bits(), h.primitive, h.vertices));
                if bits(hit) != bits(flat) || any.is_some() != flat.is_some() {
                    findings.different += 1;
                    let near = [hit, flat]
                        .iter()
                        .flatten()
                        .any(|hit| passes_an_edge(&ray, hit));
                    findings.unexplained += u64::from(!near);
                    break;
                }
            }
            from = flat.map(|hit| {
                let [a, b, c] = hit.vertices.map(Vec3::from);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let point = point_at(&hit.vertices, barycentrics(&ray, &hit.vertices));
                offset(
                    point,
                    if normal.dot(ray.direction) > 0.0 {
                        -normal
                    } else {
                        normal
                    },
                )
            });
        }
        findings
    }
}

/// Whether a ray passes an edge of a triangle by less than rounding may move it: 16 roundings of the
/// largest coordinate (PBRT's gamma).
fn passes_an_edge(ray: &Ray, hit: &RayHit) -> bool {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
    let corners = hit.vertices.map(|p| Vec3::from(p).as_dvec3());
    let reach = corners
        .iter()
        .map(|p| p.distance(o))
        .fold(o.length(), f64::max);
    let units = 16.0 * f64::from(f32::EPSILON) / 2.0;
    let bound = reach * units / (1.0 - units);
    // In the plane across the ray.
    let [a, b, c] = corners.map(|p| (p - o).reject_from(d));
    [(a, b), (b, c), (c, a)].iter().any(|(p, q)| {
        let along = (-*p).dot(*q - *p) / (*q - *p).length_squared().max(f64::MIN_POSITIVE);
        p.lerp(*q, along.clamp(0.0, 1.0)).length() <= bound
    })
}

#[test]
fn hits_of_instances_equal_the_flattened_scene() {
    for places in Places::ALL {
        let found = InstancesUnderTest::new(places, 24).check(20_000, 1);
        println!("{places:?}: {found:?}");
        assert!(
            found.hits > 8_000 && found.different == 0,
            "{places:?}: {found:?}"
        );
    }
}
