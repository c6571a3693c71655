//! The transform from a tracker's space to room space. It is a rotation and a translation, computed from three points
//! in both spaces.
//!
//! The method is TRIAD: Harold Black, "A passive system for determining the attitude of a satellite", 1964. The three
//! points define orthonormal axes in each space. The rotation maps one set of axes to the other. Differences: the
//! translation maps the mean of the points in one space to their mean in the other, and the largest remaining error is
//! returned.

use glam::{Mat3, Quat, Vec3};
use serde::{Deserialize, Serialize};

use osp::math::{COORDINATE_LIMIT_M, rotate};

/// The transform from tracker space to room space: rotate, then translate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoomFromTracker {
    /// The tracker's origin in room space, metres.
    pub p: Vec3,
    /// The rotation, a unit quaternion, x y z w.
    pub q: Quat,
}

impl Default for RoomFromTracker {
    fn default() -> Self {
        Self { p: Vec3::ZERO, q: Quat::IDENTITY }
    }
}

/// A transform computed from three points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    pub room_from_tracker: RoomFromTracker,
    /// Largest distance between a transformed point and the same point measured in the room, metres.
    pub error_m: f32,
    /// Distances in tracker space divided by distances in room space: 1 if both are in metres.
    pub scale: f32,
}

impl RoomFromTracker {
    pub(super) fn is_identity(&self) -> bool {
        *self == Self::default()
    }

    pub(super) fn check(&self) -> Result<(), &'static str> {
        if !(self.p.is_finite() && self.p.abs().max_element() <= COORDINATE_LIMIT_M) {
            return Err("a place with coordinates up to 1e15 m");
        }
        if (self.q.length() - 1.0).abs() < 1.0e-3 { Ok(()) } else { Err("a unit quaternion") }
    }

    /// Transforms a point from tracker space to room space.
    pub fn point(&self, p: Vec3) -> Vec3 {
        if self.is_identity() { p } else { rotate(self.q, p) + self.p }
    }

    /// Transforms a rotation from tracker space to room space.
    pub fn turn(&self, tracker_from_it: Quat) -> Quat {
        if self.is_identity() { tracker_from_it } else { (self.q * tracker_from_it).normalize() }
    }

    /// The transform that maps three points in tracker space to the same points in room space.
    ///
    /// # Errors
    /// Two of the points coincide, or all three are collinear.
    pub fn from_points(in_tracker: [Vec3; 3], in_room: [Vec3; 3]) -> Result<Calibration, &'static str> {
        let from = axes(in_tracker).ok_or("three points that are apart and not on a line")?;
        let to = axes(in_room).ok_or("three places that are apart and not on a line")?;
        let q = Quat::from_mat3(&(to * from.transpose())).normalize();
        let mean = |points: [Vec3; 3]| points.iter().sum::<Vec3>() / 3.0;
        let found = Self { p: mean(in_room) - rotate(q, mean(in_tracker)), q };
        let error_m = in_tracker
            .iter()
            .zip(in_room)
            .map(|(p, place)| found.point(*p).distance(place))
            .fold(0.0, f32::max);
        let around = |[a, b, c]: [Vec3; 3]| a.distance(b) + b.distance(c) + c.distance(a);
        Ok(Calibration { room_from_tracker: found, error_m, scale: around(in_tracker) / around(in_room) })
    }
}

/// Orthonormal axes defined by three points; `None` if the points are collinear.
fn axes([a, b, c]: [Vec3; 3]) -> Option<Mat3> {
    /// Sine of the smallest accepted angle between two sides.
    const FLAT: f32 = 1.0e-2;
    let x = (b - a).try_normalize()?;
    let across = x.cross((c - a).try_normalize()?);
    if across.length() < FLAT {
        return None;
    }
    let z = across.normalize();
    Some(Mat3::from_cols(x, z.cross(x), z))
}
