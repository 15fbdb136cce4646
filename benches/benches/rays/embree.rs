//! The few calls of Embree 4's C interface that the comparison needs, from a library loaded at run
//! time.

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::path::Path;

use glam::Vec3;
use libloading::Library;
use pathspace_core::math::Ray;

type Handle = *mut c_void;

/// RTCRay followed by RTCHit, with room for every optional member of the latter.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub struct RayHit {
    org: [f32; 3],
    tnear: f32,
    dir: [f32; 3],
    time: f32,
    tfar: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    uv: [f32; 2],
    prim: u32,
    geom: u32,
    instance: [u32; 5],
}

impl RayHit {
    pub fn new(ray: &Ray) -> Self {
        RayHit {
            org: ray.o.to_array(),
            tnear: ray.tmin,
            dir: ray.d.to_array(),
            time: 0.0,
            tfar: ray.tmax,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            uv: [0.0; 2],
            prim: u32::MAX,
            geom: u32::MAX,
            instance: [u32::MAX; 5],
        }
    }
}

/// The library's entry points.
pub struct Embree {
    device: Handle,
    new_scene: unsafe extern "C" fn(Handle) -> Handle,
    set_flags: unsafe extern "C" fn(Handle, c_int),
    new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    new_buffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void,
    commit_geometry: unsafe extern "C" fn(Handle),
    attach: unsafe extern "C" fn(Handle, Handle) -> c_uint,
    commit_scene: unsafe extern "C" fn(Handle),
    intersect: unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void),
    occluded: unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void),
}

/// A built scene.
pub struct Scene {
    handle: Handle,
    intersect: unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void),
    occluded: unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void),
}

// SAFETY: a committed Embree scene may be queried from any number of threads; that is all we do.
unsafe impl Sync for Scene {}

impl Embree {
    /// Loads the shared library, which is never unloaded: its worker threads outlive every handle.
    pub fn load(path: &Path) -> Result<Self, libloading::Error> {
        // SAFETY: the file is Embree 4 by the user's word (PATHSPACE_EMBREE); the types below are
        // those of its header rtcore.h.
        unsafe {
            let library = Box::leak(Box::new(Library::new(path)?));
            let new_device: unsafe extern "C" fn(*const c_char) -> Handle =
                *library.get(b"rtcNewDevice\0")?;
            Ok(Embree {
                device: new_device(c"".as_ptr()),
                new_scene: *library.get(b"rtcNewScene\0")?,
                set_flags: *library.get(b"rtcSetSceneFlags\0")?,
                new_geometry: *library.get(b"rtcNewGeometry\0")?,
                new_buffer: *library.get(b"rtcSetNewGeometryBuffer\0")?,
                commit_geometry: *library.get(b"rtcCommitGeometry\0")?,
                attach: *library.get(b"rtcAttachGeometry\0")?,
                commit_scene: *library.get(b"rtcCommitScene\0")?,
                intersect: *library.get(b"rtcIntersect1\0")?,
                occluded: *library.get(b"rtcOccluded1\0")?,
            })
        }
    }

    /// Builds a scene of indexed triangles at medium quality.
    pub fn scene(&self, vertices: &[Vec3], indices: &[[u32; 3]], robust: bool) -> Scene {
        const TRIANGLE: c_int = 0;
        const INDEX: c_int = 0;
        const VERTEX: c_int = 1;
        const UINT3: c_int = 0x5003;
        const FLOAT3: c_int = 0x9003;
        const ROBUST: c_int = 1 << 2;
        // SAFETY: the calls follow Embree's manual; each buffer has `count` items of `stride` bytes
        // and is filled exactly.
        unsafe {
            let scene = (self.new_scene)(self.device);
            (self.set_flags)(scene, if robust { ROBUST } else { 0 });
            let mesh = (self.new_geometry)(self.device, TRIANGLE);
            let v = (self.new_buffer)(mesh, VERTEX, 0, FLOAT3, 12, vertices.len());
            std::ptr::copy_nonoverlapping(vertices.as_ptr(), v.cast(), vertices.len());
            let i = (self.new_buffer)(mesh, INDEX, 0, UINT3, 12, indices.len());
            std::ptr::copy_nonoverlapping(indices.as_ptr(), i.cast(), indices.len());
            (self.commit_geometry)(mesh);
            (self.attach)(scene, mesh);
            (self.commit_scene)(scene);
            Scene { handle: scene, intersect: self.intersect, occluded: self.occluded }
        }
    }
}

impl Scene {
    /// Primitive of the closest hit.
    #[inline]
    pub fn closest(&self, ray: &RayHit) -> Option<u32> {
        let mut r = *ray;
        // SAFETY: the scene is committed and `r` is a valid, aligned RTCRayHit.
        unsafe { (self.intersect)(self.handle, &mut r, std::ptr::null_mut()) };
        (r.geom != u32::MAX).then_some(r.prim)
    }

    #[inline]
    pub fn occluded(&self, ray: &RayHit) -> bool {
        let mut r = *ray;
        // SAFETY: as above; a RTCRayHit begins with its RTCRay.
        unsafe { (self.occluded)(self.handle, &mut r, std::ptr::null_mut()) };
        r.tfar < 0.0
    }
}
