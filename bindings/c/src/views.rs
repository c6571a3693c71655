//! Views as C gives them: sixteen numbers, or six planes.

use osp::{
    glam::{Mat4, Vec3},
    math::{Frustum, Plane},
    view::{ClipDepth, View},
};

use crate::{
    status::{Failure, OspStatus, Outcome},
    types::OspDepth,
};

fn refused(message: impl Into<String>) -> Failure {
    Failure::new(OspStatus::InvalidView, message)
}

fn depth_of(depth: i32) -> Outcome<ClipDepth> {
    match depth {
        depth if depth == OspDepth::ZeroToOne as i32 => Ok(ClipDepth::ZeroToOne),
        depth if depth == OspDepth::MinusOneToOne as i32 => Ok(ClipDepth::MinusOneToOne),
        _ => {
            let message = format!("depth: expected one of OspDepth, found {depth}");
            Err(Failure::new(OspStatus::InvalidArgument, message))
        }
    }
}

fn matrix(clip_from_world: [f32; 16]) -> Outcome<Mat4> {
    let matrix = Mat4::from_cols_array(&clip_from_world);
    let determinant = matrix.as_dmat4().determinant();
    if !matrix.is_finite() {
        return Err(refused(format!("clip_from_world: expected finite numbers, found {clip_from_world:?}")));
    }
    if determinant == 0.0 {
        return Err(refused("clip_from_world: expected a matrix with an inverse"));
    }
    Ok(matrix)
}

/// The frustum of any projection.
pub(crate) fn frustum(clip_from_world: [f32; 16], depth: i32) -> Outcome<Frustum> {
    let depth = depth_of(depth)?;
    let matrix = matrix(clip_from_world)?;
    Ok(match depth {
        ClipDepth::ZeroToOne => Frustum::from_matrix(&matrix),
        ClipDepth::MinusOneToOne => Frustum::from_opengl_matrix(&matrix),
    })
}

/// The view of a perspective projection.
pub(crate) fn view(clip_from_world: [f32; 16], depth: i32) -> Outcome<View> {
    let depth = depth_of(depth)?;
    let view = View::from_matrix(&matrix(clip_from_world)?, depth);
    view.ok_or_else(|| {
        refused("clip_from_world: expected a perspective without shear, whose eye f32 holds to a quarter of the near distance")
    })
}

/// The frustum of six planes a b c d: inside is a x + b y + c z + d >= 0.
pub(crate) fn frustum_of_planes(numbers: [f32; 24]) -> Outcome<Frustum> {
    if numbers.iter().any(|number| !number.is_finite()) {
        return Err(refused(format!("planes: expected finite numbers, found {numbers:?}")));
    }
    let plane = |i: usize| Plane {
        normal: Vec3::new(numbers[4 * i], numbers[4 * i + 1], numbers[4 * i + 2]),
        d: numbers[4 * i + 3],
    };
    Ok(Frustum::new(std::array::from_fn(plane)))
}
