//! Box and triangle tests with AVX2 and FMA: the same operations in the same order as the plain
//! kernel.

use super::count::Counter;
use super::kernel::{Ends, Kernel, Lanes8};
use super::leaf::LeafTest;
use super::node::{BLOCK, Block, Child, Node2, Node8};
use crate::ray::{PreparedRay, line_hits_sheared_f64};
use glam::Vec3A;
use std::arch::x86_64::*;

/// AVX2 and FMA. Requires a processor with both: see `Avx2::available`.
#[derive(Clone, Copy)]
pub struct Avx2;

impl Avx2 {
    /// True if this processor can run the kernel.
    pub fn available() -> bool {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }
}

/// The ray, broadcast into registers.
#[derive(Clone, Copy)]
pub struct Ray {
    two: Two,
    t_min: f32,
    /// By axis, for eight boxes.
    near_reciprocal: [__m256; 3],
    near_shift: [__m256; 3],
    far_reciprocal: [__m256; 3],
    far_shift: [__m256; 3],
    /// By axis, the place of the near planes in a node of eight boxes, in bytes.
    near_at: [usize; 3],
    /// Places of a vertex's coordinates in a block, in the order of the sheared axes.
    sheared_at: [usize; 3],
    /// Lanes of ones for axes along which the direction is negative.
    negative4: [__m128; 3],
    /// Origin in the order of the sheared axes, for four triangles.
    origin4: [__m128; 3],
    shear4: [__m128; 2],
}

/// What the test of two boxes needs.
#[derive(Clone, Copy)]
struct Two {
    /// By axis: minus the near reciprocal twice, then the far reciprocal twice. With entries negated, one minimum serves
    /// both ends.
    scale: [__m128; 3],
    /// Added to the scaled planes.
    offset: [__m128; 3],
    /// Permutation that puts near planes before far planes.
    order: [__m128i; 3],
}

impl Kernel for Avx2 {
    type Ray<'a> = Ray;

    #[inline(always)]
    fn load(ray: &PreparedRay<'_>, for_step2: bool) -> Ray {
        let o: &[f32; 3] = ray.ray.origin.as_ref();
        let (nr, fr) = (ray.near_reciprocal, ray.far_reciprocal);
        let (ns, fs) = (ray.near_shift, ray.far_shift);
        // SAFETY: dispatch ensures AVX2.
        unsafe {
            let mut two = Two {
                scale: [_mm_setzero_ps(); 3],
                offset: [_mm_setzero_ps(); 3],
                order: [_mm_setzero_si128(); 3],
            };
            if for_step2 {
                two = Two {
                    scale: std::array::from_fn(|a| _mm_setr_ps(-nr[a], -nr[a], fr[a], fr[a])),
                    offset: std::array::from_fn(|a| _mm_setr_ps(-ns[a], -ns[a], fs[a], fs[a])),
                    order: std::array::from_fn(|a| {
                        if ray.negative[a] == 1 {
                            _mm_setr_epi32(2, 3, 0, 1)
                        } else {
                            _mm_setr_epi32(0, 1, 2, 3)
                        }
                    }),
                };
            }
            Ray {
                two,
                t_min: ray.ray.t_min,
                near_reciprocal: eight(nr),
                near_shift: eight(ns),
                far_reciprocal: eight(fr),
                far_shift: eight(fs),
                near_at: std::array::from_fn(|a| a * 64 + ray.negative[a] * 32),
                sheared_at: ray.axes.map(|axis| axis * BLOCK),
                negative4: std::array::from_fn(|a| {
                    _mm_castsi128_ps(_mm_set1_epi32(-(ray.negative[a] as i32)))
                }),
                origin4: std::array::from_fn(|k| _mm_set1_ps(o[ray.axes[k]])),
                shear4: std::array::from_fn(|k| _mm_set1_ps(ray.shear[k])),
            }
        }
    }

    #[inline(always)]
    fn step2(ray: &Ray, node: &Node2, t_max: f32) -> ([f32; 2], u32) {
        // SAFETY: dispatch ensures AVX2. Loads are of whole arrays.
        unsafe {
            let ends = _mm_setr_ps(-ray.t_min, -ray.t_min, t_max, t_max);
            let [x, y, z] = std::array::from_fn(|a| {
                let planes = _mm_load_ps(node.bounds[a].as_ptr());
                let planes = _mm_permutevar_ps(planes, ray.two.order[a]);
                _mm_fmadd_ps(planes, ray.two.scale[a], ray.two.offset[a])
            });
            let m = _mm_min_ps(_mm_min_ps(x, y), _mm_min_ps(z, ends));
            // Exit minus entry: a negative sign means a miss.
            let gap = _mm_add_ps(_mm_movehl_ps(m, m), m);
            let mask = !_mm_movemask_ps(gap) as u32 & 3;
            let second = _mm_shuffle_ps::<1>(m, m);
            ([_mm_cvtss_f32(m), _mm_cvtss_f32(second)], mask)
        }
    }

    #[inline(always)]
    fn step8(ray: &Ray, node: &Node8, t_max: f32, near: &mut Lanes8) -> u32 {
        // SAFETY: dispatch ensures AVX2. Loads and stores are of whole arrays.
        unsafe {
            let planes = node.bounds.as_ptr().cast::<u8>();
            let ends = |a: usize| {
                // The far planes lie beside the near planes.
                let at = ray.near_at[a];
                let near_plane = _mm256_load_ps(planes.add(at).cast());
                let far_plane = _mm256_load_ps(planes.add(at ^ 32).cast());
                (
                    _mm256_fmadd_ps(near_plane, ray.near_reciprocal[a], ray.near_shift[a]),
                    _mm256_fmadd_ps(far_plane, ray.far_reciprocal[a], ray.far_shift[a]),
                )
            };
            let (x, y, z) = (ends(0), ends(1), ends(2));
            // In pairs, because the next node waits for the result.
            let (start, end) = (_mm256_set1_ps(ray.t_min), _mm256_set1_ps(t_max));
            let enter = _mm256_max_ps(_mm256_max_ps(x.0, y.0), _mm256_max_ps(z.0, start));
            let leave = _mm256_min_ps(_mm256_min_ps(x.1, y.1), _mm256_min_ps(z.1, end));
            _mm256_store_ps(near.0.as_mut_ptr(), enter);
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32
        }
    }

    #[inline(always)]
    fn lines_hit(ray: &Ray, block: &Block) -> u32 {
        let [kx, ky, kz] = ray.sheared_at;
        // SAFETY: dispatch ensures AVX2. Loads are of whole arrays.
        unsafe {
            let sheared = |vertex: usize| {
                let v = block.vertices[vertex].as_ptr().cast::<f32>();
                let load = |at: usize, k: usize| _mm_sub_ps(_mm_load_ps(v.add(at)), ray.origin4[k]);
                let z = load(kz, 2);
                (
                    _mm_sub_ps(load(kx, 0), _mm_mul_ps(ray.shear4[0], z)),
                    _mm_sub_ps(load(ky, 1), _mm_mul_ps(ray.shear4[1], z)),
                )
            };
            let (ax, ay) = sheared(0);
            let (bx, by) = sheared(1);
            let (cx, cy) = sheared(2);
            let edge = |px, py, qx, qy| _mm_sub_ps(_mm_mul_ps(px, qy), _mm_mul_ps(py, qx));
            let u = edge(cx, cy, bx, by);
            let v = edge(ax, ay, cx, cy);
            let w = edge(bx, by, ax, ay);
            let zero = _mm_setzero_ps();
            let least = _mm_min_ps(_mm_min_ps(u, v), w);
            let most = _mm_max_ps(_mm_max_ps(u, v), w);
            let all = _mm_or_ps(_mm_cmpgt_ps(least, zero), _mm_cmplt_ps(most, zero));
            let mut mask = _mm_movemask_ps(all) as u32;
            // A lane whose product is zero has a zero edge function, which is evaluated exactly.
            let on_edge = _mm_or_ps(
                _mm_or_ps(_mm_cmpeq_ps(u, zero), _mm_cmpeq_ps(v, zero)),
                _mm_cmpeq_ps(w, zero),
            );
            let mut exact = _mm_movemask_ps(on_edge) as u32;
            while exact != 0 {
                let lane = exact.trailing_zeros() as usize;
                exact &= exact - 1;
                let get = |x, y| {
                    let mut lanes = [[0.0f32; 4]; 2];
                    _mm_storeu_ps(lanes[0].as_mut_ptr(), x);
                    _mm_storeu_ps(lanes[1].as_mut_ptr(), y);
                    [lanes[0][lane & 3], lanes[1][lane & 3]]
                };
                let hit = line_hits_sheared_f64(get(ax, ay), get(bx, by), get(cx, cy));
                mask |= u32::from(hit) << lane;
            }
            mask
        }
    }

    #[inline(always)]
    fn lines_near(ray: &Ray, blocks: [&Block; 2], pad: f32) -> u32 {
        // SAFETY: dispatch ensures AVX2.
        unsafe {
            let a = sheared(ray, blocks, 0);
            let b = sheared(ray, blocks, 1);
            let c = sheared(ray, blocks, 2);
            let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
            let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let sign = _mm256_set1_ps(-0.0);
            let size = _mm256_max_ps(_mm256_max_ps(larger(a), larger(b)), larger(c));
            // As `near_margin`, with its factor on one side.
            let rounding = _mm256_mul_ps(_mm256_set1_ps(4.0 * f32::EPSILON), size);
            let margin = _mm256_mul_ps(
                _mm256_add_ps(size, _mm256_set1_ps(pad)),
                _mm256_add_ps(_mm256_set1_ps(4.0 * pad), rounding),
            );
            let inside = _mm256_or_ps(
                _mm256_cmp_ps::<_CMP_GE_OQ>(least, _mm256_xor_ps(sign, margin)),
                _mm256_cmp_ps::<_CMP_LE_OQ>(most, margin),
            );
            _mm256_movemask_ps(inside) as u32
        }
    }

    #[inline(always)]
    fn boxes_hit(ray: &Ray, block: &Block, t_max: f32, ends: &mut Ends) -> u32 {
        // SAFETY: dispatch ensures AVX2. Loads and stores are of whole arrays.
        unsafe {
            let mut near = _mm_set1_ps(f32::MIN);
            let mut far = _mm_set1_ps(f32::MAX);
            for a in 0..3 {
                let [p, q, r] = [0, 1, 2].map(|v| _mm_load_ps(block.vertices[v][a].as_ptr()));
                let min = _mm_min_ps(_mm_min_ps(p, q), r);
                let max = _mm_max_ps(_mm_max_ps(p, q), r);
                let four = |x| _mm256_castps256_ps128(x);
                let entered = _mm_blendv_ps(min, max, ray.negative4[a]);
                let left = _mm_blendv_ps(max, min, ray.negative4[a]);
                let (nr, ns) = (four(ray.near_reciprocal[a]), four(ray.near_shift[a]));
                let (fr, fs) = (four(ray.far_reciprocal[a]), four(ray.far_shift[a]));
                near = _mm_max_ps(near, _mm_fmadd_ps(entered, nr, ns));
                far = _mm_min_ps(far, _mm_fmadd_ps(left, fr, fs));
            }
            _mm_store_ps(ends.0[0].as_mut_ptr(), near);
            _mm_store_ps(ends.0[1].as_mut_ptr(), far);
            let ahead = _mm_cmpgt_ps(far, _mm_set1_ps(ray.t_min));
            let before = _mm_cmple_ps(near, _mm_min_ps(far, _mm_set1_ps(t_max)));
            _mm_movemask_ps(_mm_and_ps(ahead, before)) as u32
        }
    }

    #[inline(always)]
    fn load_ahead(at: *const i8) {
        // SAFETY: dispatch ensures SSE. A prefetch of an invalid address has no effect.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(at);
            _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(128));
        }
    }

    #[inline(always)]
    fn leaf_out_of_line<C: Counter, L: LeafTest<Self>>(
        test: &mut L,
        ray: &Ray,
        counter: &mut C,
        leaf: Child,
    ) -> Option<f32> {
        // SAFETY: dispatch ensures AVX2.
        unsafe { leaf_out_of_line(test, ray, counter, leaf) }
    }
}

/// A vertex of two blocks' triangles in the sheared space.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn sheared(ray: &Ray, blocks: [&Block; 2], vertex: usize) -> [__m256; 2] {
    let [first, second] = blocks.map(|block| block.vertices[vertex].as_ptr().cast::<f32>());
    let [kx, ky, kz] = ray.sheared_at;
    // SAFETY: see above. Loads are of whole arrays.
    unsafe {
        let x = _mm256_set_m128(_mm_load_ps(second.add(kx)), _mm_load_ps(first.add(kx)));
        let y = _mm256_set_m128(_mm_load_ps(second.add(ky)), _mm_load_ps(first.add(ky)));
        let z = _mm256_set_m128(_mm_load_ps(second.add(kz)), _mm_load_ps(first.add(kz)));
        let [ox, oy, oz] = ray.origin4;
        let [sx, sy] = ray.shear4;
        let z = _mm256_sub_ps(z, _mm256_set_m128(oz, oz));
        let (x, y) = (
            _mm256_sub_ps(x, _mm256_set_m128(ox, ox)),
            _mm256_sub_ps(y, _mm256_set_m128(oy, oy)),
        );
        [
            _mm256_sub_ps(x, _mm256_mul_ps(_mm256_set_m128(sx, sx), z)),
            _mm256_sub_ps(y, _mm256_mul_ps(_mm256_set_m128(sy, sy), z)),
        ]
    }
}

/// Edge functions.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn edge([px, py]: [__m256; 2], [qx, qy]: [__m256; 2]) -> __m256 {
    // SAFETY: see above.
    unsafe { _mm256_sub_ps(_mm256_mul_ps(px, qy), _mm256_mul_ps(py, qx)) }
}

/// The larger magnitude.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn larger([x, y]: [__m256; 2]) -> __m256 {
    // SAFETY: see above.
    unsafe {
        let sign = _mm256_set1_ps(-0.0);
        _mm256_max_ps(_mm256_andnot_ps(sign, x), _mm256_andnot_ps(sign, y))
    }
}

/// Each element of a vector in eight lanes.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn eight(v: Vec3A) -> [__m256; 3] {
    let v = __m128::from(v);
    // SAFETY: see above.
    unsafe {
        [
            _mm256_broadcastss_ps(v),
            _mm256_broadcastss_ps(_mm_permute_ps::<1>(v)),
            _mm256_broadcastss_ps(_mm_permute_ps::<2>(v)),
        ]
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn leaf_out_of_line<C: Counter, L: LeafTest<Avx2>>(
    test: &mut L,
    ray: &Ray,
    counter: &mut C,
    leaf: Child,
) -> Option<f32> {
    test.test(ray, counter, leaf)
}
