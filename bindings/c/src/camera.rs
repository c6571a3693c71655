//! Cameras as C gives them.

use osp::{Camera, Depth};

use crate::{
    border::{Out, border, numbers, value},
    status::{Failure, OspStatus, Outcome},
    types::OSP_ALL_LAYERS,
};

/// Range of depths of a matrix in clip space, after the division by w.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspDepth {
    /// 0 at the near plane, 1 at the far one: Vulkan, Direct3D, Metal, WebGPU.
    ZeroToOne = 0,
    /// 1 at the near plane, 0 at the far one or at infinity: reversed depth.
    OneToZero = 1,
    /// -1 at the near plane, 1 at the far one: OpenGL, and Unity's Camera.projectionMatrix.
    MinusOneToOne = 2,
}

/// A camera or a light: osp_camera_f32 and osp_camera_f64 fill it in.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspCamera {
    /// From world to clip space, column after column; x and y from -w to w. Perspective or parallel, on-axis or off-axis, mirrored, y up
    /// or down, with an oblique near plane, with a far plane or without. Taken as exact, however far from the origin the eye is.
    pub clip_from_world: [f64; 16],
    /// One of OspDepth. Of a perspective it may have the wrong direction.
    pub depth: i32,
    /// Not 0: what occluders hide is left out. Without effect for a parallel projection, an oblique near plane and a sheared screen.
    pub hide_by_occluders: i32,
    /// The camera sees objects on one of these layers, a bit each.
    pub layers: u32,
}

impl OspCamera {
    /// `name` says which camera it is.
    pub(crate) fn checked(&self, name: &str) -> Outcome<Camera> {
        let depths = [
            (OspDepth::ZeroToOne, Depth::ZeroToOne),
            (OspDepth::OneToZero, Depth::OneToZero),
            (OspDepth::MinusOneToOne, Depth::MinusOneToOne),
        ];
        let Some((_, depth)) = depths.iter().find(|(number, _)| *number as i32 == self.depth) else {
            let message = format!("{name}, depth: expected one of OspDepth, found {}", self.depth);
            return Err(Failure::new(OspStatus::InvalidArgument, message));
        };
        let camera = Camera::from_matrix(self.clip_from_world, *depth)
            .map_err(|why| Failure::new(OspStatus::InvalidCamera, format!("{name}, {why}")))?;
        let camera = camera.on_layers(self.layers);
        Ok(if self.hide_by_occluders == 0 { camera } else { camera.hide_by_occluders() })
    }
}

/// Fills a camera in that sees all layers and hides nothing, and checks the matrix.
fn fill(clip_from_world: [f64; 16], depth: i32, out: &Out<OspCamera>) -> Outcome<()> {
    let camera = OspCamera { clip_from_world, depth, hide_by_occluders: 0, layers: OSP_ALL_LAYERS };
    camera.checked("camera")?;
    out.set(camera);
    Ok(())
}

/// The camera of a matrix of sixteen numbers from world to clip space, column after column, and one of OspDepth. It sees all layers,
/// and nothing is hidden: set hide_by_occluders and layers for another one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_camera_f32(
    clip_from_world: *const f32,
    depth: i32,
    camera: *mut OspCamera,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (out, matrix) =
            unsafe { (Out::new(camera, "camera")?, numbers::<f32, 16>(clip_from_world, "clip_from_world")?) };
        fill(matrix.map(f64::from), depth, &out)
    })
}

/// osp_camera_f32 of a matrix in 64 bits: for an eye that is far from the origin.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_camera_f64(
    clip_from_world: *const f64,
    depth: i32,
    camera: *mut OspCamera,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (out, matrix) =
            unsafe { (Out::new(camera, "camera")?, numbers(clip_from_world, "clip_from_world")?) };
        fill(matrix, depth, &out)
    })
}

/// The ray through a point of the screen, x and y from -1 to 1 as the matrix has them. origin gets x y z of its point on the near plane,
/// direction x y z of its direction, of the length 1: world space, metres.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_camera_ray(
    camera: *const OspCamera,
    x: f32,
    y: f32,
    origin: *mut f32,
    direction: *mut f32,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires. Three numbers are aligned as one is.
        let (camera, origin, direction) = unsafe {
            (
                value(camera, "camera")?,
                Out::new(origin.cast::<[f32; 3]>(), "origin")?,
                Out::new(direction.cast::<[f32; 3]>(), "direction")?,
            )
        };
        let ray = camera.checked("camera")?.ray(x, y);
        origin.set(ray.origin.to_array());
        direction.set(ray.direction.to_array());
        Ok(())
    })
}
