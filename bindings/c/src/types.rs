//! Values that pass the border.

use osp::{
    glam::Vec3,
    math::{Aabb, Sphere},
    polygon::PolygonId,
};

use crate::status::{Failure, OspStatus, Outcome};

/// Boxes of an index, or boxes and triangles of a scene, that there can be at once; ids are below it.
pub const OSP_MAX_IDS: u32 = 134_217_728;

const _: () = assert!(OSP_MAX_IDS == PolygonId::LIMIT);

/// The id of nothing.
pub const OSP_NO_ID: u32 = u32::MAX;

/// Views of a frame, at most.
pub const OSP_MAX_VIEWS: u32 = 64;

/// A box: its smallest and largest corner, x y z, world space. It may be flat, or a point.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspBox {
    /// Smallest corner, x y z; finite.
    pub min: [f32; 3],
    /// Largest corner, x y z; finite, on no axis less than min.
    pub max: [f32; 3],
}

impl OspBox {
    pub(crate) fn bounds(&self) -> Aabb {
        Aabb::new(self.min.into(), self.max.into())
    }

    /// The box as an index takes it. `at` is its place in a list.
    pub(crate) fn checked(&self, at: usize) -> Outcome<Aabb> {
        let bounds = self.bounds();
        if bounds.is_valid() {
            return Ok(bounds);
        }
        let Self { min, max } = self;
        let message = format!("box {at}: expected finite numbers and min <= max, found {min:?} {max:?}");
        Err(Failure::new(OspStatus::InvalidBox, message))
    }
}

/// What is hit by a ray.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspHit {
    /// What is hit, OSP_NO_ID for nothing.
    pub id: u32,
    /// Where, in units of the direction's length from the origin; 0 for nothing.
    pub t: f32,
}

impl From<Option<(PolygonId, f32)>> for OspHit {
    fn from(hit: Option<(PolygonId, f32)>) -> Self {
        hit.map_or(Self { id: OSP_NO_ID, t: 0.0 }, |(id, t)| Self { id: id.0, t })
    }
}

/// How a ray is asked.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspRayMode {
    /// What is hit first; of several at the same place that with the lowest id.
    Nearest = 0,
    /// Anything that is hit: cheaper, for "is there something".
    Any = 1,
}

/// Which depths a matrix gives to what is drawn, after the division by w.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspDepth {
    /// From 0 to 1 or, reversed, from 1 to 0: Vulkan, Direct3D, Metal, WebGPU.
    ZeroToOne = 0,
    /// From -1 to 1, in either direction: OpenGL, and Unity's Camera.projectionMatrix.
    MinusOneToOne = 1,
}

/// How a scene finds what is hidden.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspOcclusion {
    /// Not at all: frustum culling alone.
    None = 0,
    /// A tree of the shadow volumes of the largest occluders of each frame: for walls and other large polygons.
    Msvbsp = 1,
    /// A depth buffer of the largest occluders of each frame.
    Depth = 2,
    /// A depth buffer of what was visible in the last frame: for many small triangles.
    DepthLast = 3,
    /// In each frame whichever of none, MSVBSP and DEPTH_LAST takes the least time.
    Auto = 4,
}

/// What an index should expect: hints. Boxes outside of the cube and beyond the capacity are kept and found as well.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspIndexConfig {
    /// Centre of a cube around most of what will come, x y z.
    pub root_center: [f32; 3],
    /// Its edge length, more than 0.
    pub root_size: f32,
    /// Boxes to reserve memory for now, so that hardly a frame has to: about 70 bytes each in an index, 105 in a scene; 1.4 MB
    /// are taken in any case. At most OSP_MAX_IDS.
    pub capacity: u32,
}

/// What a scene should expect, and how it culls.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspSceneConfig {
    /// Hints for the index of the scene.
    pub index: OspIndexConfig,
    /// One of OspOcclusion.
    pub occlusion: i32,
    /// What it costs to draw one box or triangle, nanoseconds; more than 0. 10 for the triangles of a stroke; what a mesh costs
    /// where boxes stand for meshes (10000, say). From 400 on each of them is tested for itself; at 10, only groups of 40 and more.
    pub draw_ns: f32,
}

/// What a frame has found, for all its views together.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OspFrame {
    /// Boxes and triangles of the scene.
    pub count: u64,
    /// Of these, in the frustum, hidden or not.
    pub in_view: u64,
    /// Of these, to be drawn: osp_scene_visible lists them.
    pub visible: u64,
    /// Occluders that hid the others.
    pub occluders: u64,
    /// To follow the changes, nanoseconds.
    pub insert_ns: u64,
    /// To cull by the frustum, nanoseconds.
    pub cull_ns: u64,
    /// To find what is hidden, nanoseconds.
    pub occlusion_ns: u64,
}

/// A point as a function takes it.
pub(crate) fn point(xyz: [f32; 3], name: &str) -> Outcome<Vec3> {
    let point = Vec3::from(xyz);
    if point.is_finite() {
        return Ok(point);
    }
    Err(Failure::new(OspStatus::InvalidArgument, format!("{name}: expected finite numbers, found {xyz:?}")))
}

/// A ball as a function takes it.
pub(crate) fn sphere(center: [f32; 3], radius: f32) -> Outcome<Sphere> {
    let center = point(center, "center")?;
    if radius >= 0.0 && radius.is_finite() {
        return Ok(Sphere { center, radius_m: radius });
    }
    let message = format!("radius: expected a finite number from 0 on, found {radius}");
    Err(Failure::new(OspStatus::InvalidArgument, message))
}
