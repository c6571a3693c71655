//! Geometry on top of [`glam`]: boxes, planes, frusta, rays and the tolerances they share.
//!
//! World space is right-handed, +y up, -z forward, in metres.
//!
//! **Exactness.** Every box test of the crate computes the distance to a plane as `((n.x*x + n.y*y) + n.z*z) + d` in `f32`,
//! in this order and without fused multiply-add. Each step of the sum rounds monotonically. So the result for a box holds
//! exactly for every box inside it, and all indexes report the same set.
//!
//! Depends on `glam` and on no other module of the crate.

mod aabb;
mod capsule;
mod clip;
mod frustum;
mod obb;
mod outward;
mod plane;
mod quad;
mod ray;
mod rotation;
mod solid_angle;
mod sphere;
mod tolerance;
mod volume;

pub use aabb::Aabb;
pub(crate) use clip::Edges;
pub use frustum::{Containment, Frustum};
pub(crate) use outward::Corners;
pub use plane::Plane;
pub(crate) use quad::QUAD_FLATNESS;
pub use ray::Ray;
pub(crate) use ray::{is_no_later, latest};
pub(crate) use solid_angle::triangle_solid_angle_sr;
pub use sphere::Sphere;
pub use tolerance::{COORDINATE_LIMIT_M, TOLERANCE_M};
pub use volume::Volume;

// Volumes and calculations that the other crates of the workspace share. They change without notice.
#[doc(hidden)]
pub use self::{
    capsule::Capsule,
    clip::{Part, clip_convex, split_convex},
    frustum::PlaneMask,
    obb::Obb,
    quad::is_flat_and_convex,
    rotation::{rotate, rotate_exactly, unit},
};
