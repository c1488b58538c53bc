//! Embree 4, by the functions of its C interface that a scene of instances needs.

use libloading::Library;
use rays::bvh::Placement;
use rays::ray::Ray;
use std::ffi::c_void;
use std::ptr::null;

type Handle = *mut c_void;

/// The library and a device.
pub struct Embree {
    library: Library,
    device: Handle,
}

impl Embree {
    /// Opens the library.
    ///
    /// # Errors
    /// It cannot be opened or is not Embree 4.
    pub fn load(path: &str) -> anyhow::Result<Self> {
        // SAFETY: initialisers of Embree have no requirements, and the signature is that of its header.
        unsafe {
            let library = Library::new(path)?;
            let new = *library.get::<unsafe extern "C" fn(*const u8) -> Handle>(b"rtcNewDevice")?;
            let device = new(c"threads=1".as_ptr().cast());
            Ok(Self { library, device })
        }
    }

    /// A function by name.
    ///
    /// # Safety
    /// `F` is its type.
    unsafe fn function<F: Copy>(&self, name: &str) -> F {
        // SAFETY: see above.
        *unsafe { self.library.get::<F>(name.as_bytes()) }.expect("a function of Embree 4")
    }
}

/// `RTCRayHit`, with room for any number of instance levels.
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal_u_v: [f32; 5],
    primitive: u32,
    geometry: u32,
    rest: [u32; 25],
}

type Query = unsafe extern "C" fn(Handle, *mut RayHit, *const c_void);

/// A scene of instances of one mesh.
pub struct Forest {
    scene: Handle,
    intersect: Query,
    occluded: Query,
}

impl Forest {
    /// Builds it with the flag ROBUST and a quality (`RTCBuildQuality`: 1 medium, the default; 2 high).
    pub fn new(
        embree: &Embree,
        mesh: &[[[f32; 3]; 3]],
        placements: &[Placement],
        level: u32,
    ) -> Self {
        const INSTANCE: u32 = 121;
        // SAFETY: types and numbers are those of Embree 4's headers. Buffers belong to Embree.
        unsafe {
            let new_scene: unsafe extern "C" fn(Handle) -> Handle = embree.function("rtcNewScene");
            let flags: unsafe extern "C" fn(Handle, u32) = embree.function("rtcSetSceneFlags");
            let quality: unsafe extern "C" fn(Handle, u32) =
                embree.function("rtcSetSceneBuildQuality");
            let commit_scene: unsafe extern "C" fn(Handle) = embree.function("rtcCommitScene");
            let new: unsafe extern "C" fn(Handle, u32) -> Handle =
                embree.function("rtcNewGeometry");
            let commit: unsafe extern "C" fn(Handle) = embree.function("rtcCommitGeometry");
            let attach: unsafe extern "C" fn(Handle, Handle) -> u32 =
                embree.function("rtcAttachGeometry");
            let buffer: unsafe extern "C" fn(Handle, u32, u32, u32, usize, usize) -> *mut c_void =
                embree.function("rtcSetNewGeometryBuffer");
            let instanced: unsafe extern "C" fn(Handle, Handle) =
                embree.function("rtcSetGeometryInstancedScene");
            let transform: unsafe extern "C" fn(Handle, u32, u32, *const f32) =
                embree.function("rtcSetGeometryTransform");
            let scene = || {
                let scene = new_scene(embree.device);
                flags(scene, 1 << 2);
                quality(scene, level);
                scene
            };
            let inner = scene();
            let triangles = new(embree.device, 0);
            let corners = mesh.as_flattened().as_flattened();
            let indices = buffer(triangles, 0, 0, 0x5003, 12, mesh.len()).cast::<u32>();
            let vertices = buffer(triangles, 1, 0, 0x9003, 12, 3 * mesh.len()).cast::<f32>();
            for i in 0..3 * mesh.len() {
                *indices.add(i) = i as u32;
            }
            corners.as_ptr().copy_to(vertices, corners.len());
            commit(triangles);
            attach(inner, triangles);
            commit_scene(inner);
            let outer = scene();
            for placement in placements {
                let instance = new(embree.device, INSTANCE);
                instanced(instance, inner);
                let columns = placement.transform.to_cols_array().map(|x| x as f32);
                // Columns of a 3x4 matrix.
                transform(instance, 0, 0x9234, columns.as_ptr());
                commit(instance);
                attach(outer, instance);
            }
            commit_scene(outer);
            Self {
                scene: outer,
                intersect: embree.function("rtcIntersect1"),
                occluded: embree.function("rtcOccluded1"),
            }
        }
    }

    /// Whether a ray hits a triangle: the nearest is found, or with `any_hit` the first.
    pub fn hits(&self, ray: &Ray, any_hit: bool) -> bool {
        const NONE: u32 = u32::MAX;
        let mut query = RayHit {
            origin: ray.origin.to_array(),
            near: ray.t_min,
            direction: ray.direction.to_array(),
            time: 0.0,
            far: ray.t_max,
            mask: NONE,
            id: 0,
            flags: 0,
            normal_u_v: [0.0; 5],
            primitive: NONE,
            geometry: NONE,
            rest: [NONE; 25],
        };
        let function = if any_hit {
            self.occluded
        } else {
            self.intersect
        };
        // SAFETY: the scene is committed, and the query has the layout of `RTCRayHit`. Without
        // arguments, Embree takes its defaults.
        unsafe { function(self.scene, &raw mut query, null()) };
        if any_hit {
            query.far < 0.0
        } else {
            query.geometry != NONE
        }
    }
}
