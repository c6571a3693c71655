//! The types of values that C passes and receives.

use osp::{
    Refusal,
    glam::Vec3,
    math::{Aabb, Ray, Sphere},
    polygon::PolygonId,
};

use crate::status::{Failure, OspStatus, Outcome};

/// Largest number of objects at once, and in a batch.
pub const OSP_MAX_OBJECTS: u32 = 134_217_728;

const _: () = assert!(OSP_MAX_OBJECTS == PolygonId::LIMIT);

/// Largest number of cameras of a frame.
pub const OSP_MAX_CAMERAS: u32 = 64;

/// The layers of a camera that sees all layers.
pub const OSP_ALL_LAYERS: u32 = u32::MAX;

const _: () = assert!(OSP_ALL_LAYERS == osp::ALL_LAYERS);

/// A box by its smallest and largest corner, x y z, in world space, metres. It may be flat, or a point.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspBox {
    /// Smallest corner, x y z; finite.
    pub min: [f32; 3],
    /// Largest corner, x y z; finite, and on no axis less than min.
    pub max: [f32; 3],
}

impl OspBox {
    pub(crate) fn corners(&self) -> [[f32; 3]; 2] {
        [self.min, self.max]
    }

    /// Returns the box in which a function searches.
    pub(crate) fn checked(&self) -> Outcome<[[f32; 3]; 2]> {
        if Aabb::new(self.min.into(), self.max.into()).is_valid() {
            return Ok(self.corners());
        }
        let Self { min, max } = self;
        let message = format!("bounds: expected finite numbers and min <= max, found {min:?} {max:?}");
        Err(Failure::new(OspStatus::InvalidArgument, message))
    }
}

/// An object whose box a ray enters, or that is near a point.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspHit {
    /// The object's key.
    pub key: u64,
    /// For a ray, the distance from its origin to the box, in lengths of the ray's direction. For a point, the distance
    /// from the box in metres. 0 if the origin or the point is inside.
    pub t: f32,
}

/// Numbers of objects that a camera sees.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OspSeen {
    /// Number of objects to draw, which osp_culler_visible lists.
    pub visible: usize,
    /// Number of objects in view that occluders hide.
    pub hidden: usize,
}

/// The reason why an object, or its occluder, was refused.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspRefusal {
    /// The box contains NaN or an infinite number, or min > max. The object is skipped until it gets a valid box.
    Bounds = 0,
    /// There are OSP_MAX_OBJECTS keys already.
    Key = 1,
    /// All occluders together would have too many polygons. The object gets no occluder.
    Occluder = 2,
}

impl From<Refusal> for OspRefusal {
    fn from(why: Refusal) -> Self {
        match why {
            Refusal::Bounds(_) => Self::Bounds,
            Refusal::Key => Self::Key,
            _ => Self::Occluder,
        }
    }
}

/// An object whose box or occluder was refused, with the reason.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OspRefused {
    /// The key of the object.
    pub key: u64,
    /// One of OspRefusal.
    pub why: i32,
}

fn refused<T>(message: String) -> Outcome<T> {
    Err(Failure::new(OspStatus::InvalidArgument, message))
}

/// Checks a point that a function receives.
pub(crate) fn point(xyz: [f32; 3], name: &str) -> Outcome<Vec3> {
    let point = Vec3::from(xyz);
    if point.is_finite() {
        Ok(point)
    } else {
        refused(format!("{name}: expected finite numbers, found {xyz:?}"))
    }
}

/// Checks a sphere that a function receives.
pub(crate) fn sphere(center: [f32; 3], radius: f32) -> Outcome<Sphere> {
    let center = point(center, "center")?;
    if radius >= 0.0 && radius.is_finite() {
        return Ok(Sphere { center, radius_m: radius });
    }
    refused(format!("radius: expected a finite number from 0 on, found {radius}"))
}

/// Checks a ray that a function receives.
pub(crate) fn ray(origin: [f32; 3], direction: [f32; 3], t_max: f32) -> Outcome<Ray> {
    let (origin, along) = (point(origin, "origin")?, point(direction, "direction")?);
    if along == Vec3::ZERO {
        return refused("direction: expected a vector other than 0 0 0".into());
    }
    if t_max.is_nan() || t_max < 0.0 {
        return refused(format!("t_max: expected a number from 0 on, found {t_max}"));
    }
    Ok(Ray::new(origin, along))
}
