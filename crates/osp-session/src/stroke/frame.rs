use glam::{Quat, Vec3};

use super::{Drops, Sample};
use crate::recording::NormalRule;
use osp::math::{TOLERANCE_M, rotate};

/// The unit direction from one sample to the next. If both positions coincide or a position is out of range, counts the
/// sample and returns `None`.
pub(super) fn travel(last: &Sample, sample: &Sample, drops: &mut Drops) -> Option<Vec3> {
    let step = sample.position - last.position;
    let length_m = step.length();
    if !length_m.is_finite() {
        drops.out_of_range += 1;
        return None;
    }
    if length_m <= TOLERANCE_M {
        drops.zero_length += 1;
        return None;
    }
    Some(step / length_m)
}

pub(crate) fn any_perpendicular(m: Vec3) -> Vec3 {
    let helper = if m.x.abs() < 0.6 { Vec3::X } else { Vec3::Y };
    m.cross(helper).normalize_or(Vec3::Y)
}

/// The component of `v` perpendicular to the unit vector `m`, normalised; `None` if it is nearly zero.
pub(super) fn perpendicular_part(v: Vec3, m: Vec3) -> Option<Vec3> {
    let part = v - m * m.dot(v);
    // If `v` is within a twentieth of a degree of the direction of travel, the component is numerical noise.
    (part.length_squared() > 1.0e-6 * v.length_squared())
        .then(|| part.normalize_or_zero())
        .filter(|p| *p != Vec3::ZERO)
}

/// The direction of the ribbon's width at a sample: a unit vector, with the sign that agrees with `previous`.
///
/// `travel` is the unit direction from the previous sample.
///
/// * [`NormalRule::LocalX`]: the normal is the tracker's X axis, so the width is normal x travel.
/// * [`NormalRule::SideX`]: the width is the tracker's X axis itself.
/// * [`NormalRule::Travel`]: Tilt Brush's `±(f x m) + |f.m| ±(u x m)` with forward f = -z and up u = +y, each sign
///   chosen to agree with the previous side.
/// * [`NormalRule::Transport`]: the component of the previous side perpendicular to the travel.
///
/// If a rule gives no direction, because the axis is parallel to the travel, [`NormalRule::Transport`] is used.
pub(crate) fn side(rule: NormalRule, sample: &Sample, travel: Vec3, previous: Option<Vec3>) -> Vec3 {
    let q = sample.orientation;
    let agreeing = |v: Vec3| if previous.is_some_and(|p| p.dot(v) < 0.0) { -v } else { v };
    let ruled = match rule {
        NormalRule::LocalX => perpendicular_part(rotate(q, Vec3::X), travel)
            .map(|normal| normal.cross(travel).normalize_or_zero()),
        NormalRule::SideX => Some(rotate(q, Vec3::X).normalize_or_zero()),
        NormalRule::Travel => {
            let forward = rotate(q, Vec3::NEG_Z);
            let up = rotate(q, Vec3::Y);
            let by_forward = agreeing(forward.cross(travel));
            let by_up = agreeing(up.cross(travel));
            Some((by_forward + by_up * forward.dot(travel).abs()).normalize_or_zero())
        }
        NormalRule::Transport => None,
    };
    let side = ruled
        .filter(|s| *s != Vec3::ZERO)
        .or_else(|| previous.and_then(|p| perpendicular_part(p, travel)))
        .unwrap_or_else(|| any_perpendicular(travel));
    agreeing(side)
}

/// The frame of a brush's ribbon at a sample, computed as in Tilt Brush: unit vectors along the width and along the
/// normal. The sign of the width agrees with `previous`, which may be zero.
pub(super) fn ribbon(previous: Vec3, travel: Vec3, orientation: Quat) -> [Vec3; 2] {
    let agreeing = |v: Vec3| if previous.dot(v) < 0.0 { -v } else { v };
    let forward = rotate(orientation, Vec3::NEG_Z);
    let by_forward = agreeing(travel.cross(forward));
    // If the tracker points in the direction of travel, its up axis decides the ribbon's normal.
    let by_up = agreeing(travel.cross(rotate(orientation, Vec3::Y)));
    let sum = by_forward + by_up * forward.dot(travel).abs();
    let right = sum.try_normalize().unwrap_or_else(|| any_perpendicular(travel));
    [right, right.cross(travel)]
}
