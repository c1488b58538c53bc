//! The cost of rays by class: the input of the cycle and energy models.

use formats::raytrace::{NO_PARENT, Outcome, RayKind, RayRecord};

/// Classes of rays that reuse treats differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum RayClass {
    /// From the eye.
    Primary = 0,
    /// From the primary hit to a light, or around it for ambient occlusion. The result does not depend on the eye.
    Shadow = 1,
    /// All other rays and their descendants. The results of reflection and refraction depend on the eye.
    Secondary = 2,
}

impl RayClass {
    /// All classes, in index order.
    pub const ALL: [Self; 3] = [Self::Primary, Self::Shadow, Self::Secondary];

    /// Class of a ray.
    pub fn of(ray: &RayRecord) -> Self {
        match ray.kind {
            RayKind::Primary => Self::Primary,
            RayKind::Shadow | RayKind::AmbientOcclusion if ray.parent == 0 => Self::Shadow,
            // Without parents in the trace, the depth identifies shadow rays of the first level.
            RayKind::Shadow | RayKind::AmbientOcclusion
                if ray.parent == NO_PARENT && ray.depth <= 1 =>
            {
                Self::Shadow
            }
            _ => Self::Secondary,
        }
    }
}

/// Work of a set of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayWork<N> {
    /// Rays.
    pub rays: N,
    /// Inner nodes visited.
    pub steps: N,
    /// Triangles tested.
    pub triangle_tests: N,
    /// Alpha look-ups.
    pub alpha_tests: N,
}

impl RayWork<u64> {
    /// Adds another set.
    pub fn add(&mut self, other: &RayWork<u32>) {
        self.rays += u64::from(other.rays);
        self.steps += u64::from(other.steps);
        self.triangle_tests += u64::from(other.triangle_tests);
        self.alpha_tests += u64::from(other.alpha_tests);
    }
}

/// Work of one pixel's ray tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelWork {
    /// By [`RayClass`].
    pub by_class: [RayWork<u32>; 3],
    /// Reflection, refraction and diffuse rays. Each ends in a shading kernel.
    pub secondary_shaded: u32,
    /// Outcomes of the primary hit's shadow rays, one bit per ray in their order: 1 if blocked. Rays beyond the
    /// 64th fold onto the first bits.
    pub shadows_blocked: u64,
    /// The same of its ambient-occlusion rays.
    pub occlusion_blocked: u64,
}

impl PixelWork {
    /// Sums over a pixel's rays; sums saturate.
    pub fn of(rays: &[RayRecord]) -> Self {
        let mut work = Self::default();
        for ray in rays {
            let class = RayClass::of(ray);
            let w = &mut work.by_class[class as usize];
            w.rays = w.rays.saturating_add(1);
            w.steps = w.steps.saturating_add(ray.steps);
            w.triangle_tests = w.triangle_tests.saturating_add(ray.triangle_tests);
            w.alpha_tests = w.alpha_tests.saturating_add(ray.alpha_tests);
            if class == RayClass::Shadow && ray.outcome == Outcome::Occluded {
                let blocked = match ray.kind {
                    RayKind::AmbientOcclusion => &mut work.occlusion_blocked,
                    _ => &mut work.shadows_blocked,
                };
                *blocked ^= 1u64.rotate_left(w.rays - 1);
            }
            if class == RayClass::Secondary && !ray.kind.ends_at_any_hit() {
                work.secondary_shaded = work.secondary_shaded.saturating_add(1);
            }
        }
        work
    }

    /// Outcomes of the primary hit's shadow rays, and the number of rays of their class.
    pub(super) fn shadow_outcomes(&self) -> (u64, u32) {
        let rays = self.by_class[RayClass::Shadow as usize].rays;
        (self.shadows_blocked, rays)
    }
}

/// Work of a batch (a tile of one eye) on both kinds of hardware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchWork {
    /// Rays traced, by class.
    pub by_class: [RayWork<u64>; 3],
    /// Right-eye rays intersected with triangles that may be reused.
    pub retest_rays: u64,
    /// Triangle tests of these rays.
    pub retest_tests: u64,
    /// Shading kernels run.
    pub shaded: u64,
    /// Left pixels projected.
    pub reprojected: u64,
    /// Right pixels tested.
    pub detected: u64,
    /// Right pixels reused.
    pub reused: u64,
    /// Left pixels that detection tests if it tests each right pixel against its whole row.
    pub row_tests: u64,
    /// Lanes without work while a warp runs the kernels of its traced pixels, if pixels are not compacted.
    pub idle_traced_lanes: u64,
    /// The same for the kernel of its reused pixels.
    pub idle_reused_lanes: u64,
}

impl BatchWork {
    /// Adds a pixel whose ray tree is completely traced.
    pub(super) fn add_traced(&mut self, pixel: &PixelWork) {
        for class in RayClass::ALL {
            self.add_class(pixel, class);
        }
        self.shaded += 1 + u64::from(pixel.secondary_shaded);
    }

    /// Adds the rays of one class of a pixel's ray tree.
    pub(super) fn add_class(&mut self, pixel: &PixelWork, class: RayClass) {
        self.by_class[class as usize].add(&pixel.by_class[class as usize]);
    }

    /// Adds another batch.
    pub fn add(&mut self, other: &Self) {
        for (sum, part) in self.by_class.iter_mut().zip(&other.by_class) {
            formats::add_fields!(sum, part, rays, steps, triangle_tests, alpha_tests);
        }
        formats::add_fields!(
            self,
            other,
            retest_rays,
            retest_tests,
            shaded,
            reprojected,
            detected,
            reused,
            row_tests,
            idle_traced_lanes,
            idle_reused_lanes
        );
    }

    /// Adds the idle lanes of a warp with these numbers of traced and reused pixels.
    pub(super) fn add_warp(&mut self, traced: u64, reused: u64) {
        if traced > 0 && reused > 0 {
            self.idle_traced_lanes += reused;
            self.idle_reused_lanes += traced;
        }
    }

    /// Rays traced.
    pub fn rays(&self) -> u64 {
        self.by_class.iter().map(|w| w.rays).sum()
    }

    /// Traversal steps.
    pub fn steps(&self) -> u64 {
        self.by_class.iter().map(|w| w.steps).sum()
    }

    /// Triangle tests, including re-tests.
    pub fn triangle_tests(&self) -> u64 {
        self.retest_tests + self.by_class.iter().map(|w| w.triangle_tests).sum::<u64>()
    }

    /// Alpha look-ups.
    pub fn alpha_tests(&self) -> u64 {
        self.by_class.iter().map(|w| w.alpha_tests).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(kind: RayKind, parent: u32, depth: u8) -> RayRecord {
        RayRecord {
            kind,
            parent,
            depth,
            steps: 10,
            triangle_tests: 3,
            ..RayRecord::default()
        }
    }

    #[test]
    fn shadow_rays_of_a_reflection_are_secondary() {
        let rays = [
            ray(RayKind::Primary, NO_PARENT, 0),
            ray(RayKind::Shadow, 0, 1),
            ray(RayKind::Reflection, 0, 1),
            ray(RayKind::Shadow, 2, 2),
        ];
        let work = PixelWork::of(&rays);
        assert_eq!(work.by_class.map(|w| w.rays), [1, 1, 2]);
        assert_eq!(work.by_class.map(|w| w.steps), [10, 10, 20]);
        assert_eq!(work.secondary_shaded, 1);
    }

    #[test]
    fn only_warps_with_both_kinds_of_pixels_have_idle_lanes() {
        let mut batch = BatchWork::default();
        batch.add_warp(32, 0);
        batch.add_warp(0, 32);
        batch.add_warp(5, 27);
        let idle = (batch.idle_traced_lanes, batch.idle_reused_lanes);
        assert_eq!(idle, (27, 5));
    }

    #[test]
    fn shadow_outcomes_are_a_bit_per_ray_of_the_primary_hit() {
        let shadow = |parent, depth, outcome| RayRecord {
            outcome,
            ..ray(RayKind::Shadow, parent, depth)
        };
        let rays = [
            ray(RayKind::Primary, NO_PARENT, 0),
            shadow(0, 1, Outcome::Miss),
            shadow(0, 1, Outcome::Occluded),
            ray(RayKind::Reflection, 0, 1),
            shadow(3, 2, Outcome::Occluded),
        ];
        assert_eq!(PixelWork::of(&rays).shadow_outcomes(), (0b10, 2));
    }

    #[test]
    fn a_traced_pixel_counts_every_ray_once() {
        let pixel = PixelWork::of(&[
            ray(RayKind::Primary, NO_PARENT, 0),
            ray(RayKind::Refraction, 0, 1),
        ]);
        let mut batch = BatchWork::default();
        batch.add_traced(&pixel);
        assert_eq!(
            (batch.rays(), batch.steps(), batch.triangle_tests()),
            (2, 20, 6)
        );
        assert_eq!(batch.shaded, 2);
    }
}
