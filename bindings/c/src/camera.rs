//! Cameras in the form of the C interface.

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
    /// 0 at the near plane, 1 at the far plane: Vulkan, Direct3D, Metal, WebGPU.
    ZeroToOne = 0,
    /// 1 at the near plane, 0 at the far plane or at infinity: reversed depth.
    OneToZero = 1,
    /// -1 at the near plane, 1 at the far plane: OpenGL, and Unity's Camera.projectionMatrix.
    MinusOneToOne = 2,
}

/// A camera or a light. osp_camera_f32 and osp_camera_f64 fill it in.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspCamera {
    /// Matrix from world to clip space, in column-major order; x and y are from -w to w in view. The projection may be
    /// perspective or parallel, on-axis or off-axis, mirrored, y up or down. Its near plane may be oblique, and it
    /// needs no far plane. The numbers count as exact, even for an eye far from the origin.
    pub clip_from_world: [f64; 16],
    /// One of OspDepth. For a perspective projection, a wrong direction of depth has no effect.
    pub depth: i32,
    /// If this is not 0, the results omit objects behind occluders. This has no effect for a parallel projection, an
    /// oblique near plane or a sheared screen.
    pub hide_by_occluders: i32,
    /// Mask of the layers that the camera sees, with a bit for each layer.
    pub layers: u32,
}

impl OspCamera {
    /// Checks and converts the camera. Error messages contain `name`.
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

/// Fills in a camera that sees all layers and ignores occluders, and checks the matrix.
fn fill(clip_from_world: [f64; 16], depth: i32, out: &Out<OspCamera>) -> Outcome<()> {
    let camera = OspCamera { clip_from_world, depth, hide_by_occluders: 0, layers: OSP_ALL_LAYERS };
    camera.checked("camera")?;
    out.set(camera);
    Ok(())
}

/// Makes a camera from a matrix of sixteen numbers from world to clip space, in column-major order, and one of
/// OspDepth. The camera sees all layers and ignores occluders; set hide_by_occluders and layers to change that.
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

/// Does the same as osp_camera_f32 for a matrix of 64-bit numbers. Use it for an eye far from the origin.
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

/// Computes the ray through a point of the screen. x and y are from -1 to 1 in the directions of the matrix. origin
/// gets x y z of the ray's point on the near plane. direction gets x y z of its direction, of length 1. Both are in
/// world space, metres.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_camera_ray(
    camera: *const OspCamera,
    x: f32,
    y: f32,
    origin: *mut f32,
    direction: *mut f32,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires. Three numbers have the same alignment as one.
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
