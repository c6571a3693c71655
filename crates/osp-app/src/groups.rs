//! Groups in the window: made from the selection, named, selected as a whole, moved and placed.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Quat, Vec3};

use osp::math::rotate;
use osp_session::{
    recording::{GroupId, StrokeId, Transform},
    scene::Scene,
};

/// Change of a group's transform: translation in its parent's space, then rotation and scale about the group's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placing {
    /// Translation, metres.
    pub by: Vec3,
    /// Direction of the axis of rotation, in the parent's space, of any length. An axis of length 0 gives no rotation.
    pub axis: Vec3,
    /// Rotation, degrees, counter-clockwise seen from the tip of the axis.
    pub turn_degrees: f32,
    /// Scale factor.
    pub scale: f32,
}

impl Placing {
    /// No change.
    pub const STAY: Self = Self { by: Vec3::ZERO, axis: Vec3::Y, turn_degrees: 0.0, scale: 1.0 };

    /// The transform after the change; `middle` is the group's centre in the parent's space.
    pub(super) fn after(&self, before: &Transform, middle: Vec3) -> Transform {
        let half = f64::from(self.turn_degrees).to_radians() * 0.5;
        let turn = self.axis.as_dvec3().try_normalize().map_or(Quat::IDENTITY, |axis| {
            Quat::from_vec4((axis * libm::sin(half)).extend(libm::cos(half)).as_vec4())
        });
        let p = middle + self.by + rotate(turn, before.p - middle) * self.scale;
        Transform { p, q: (turn * before.q).normalize(), s: before.s * self.scale }
    }
}

/// The outermost groups whose visible strokes are all among `strokes`, and the strokes outside of these groups.
pub(super) fn whole_groups(scene: &Scene, strokes: &[StrokeId]) -> (Vec<GroupId>, Vec<StrokeId>) {
    let mut chosen = BTreeMap::<GroupId, usize>::new();
    let chain_of = |id: &StrokeId| scene.stroke(*id).map_or_else(Vec::new, |stroke| scene.groups_of(stroke));
    for group in strokes.iter().flat_map(chain_of) {
        *chosen.entry(group).or_default() += 1;
    }
    let is_visible = |id: &StrokeId| scene.stroke(*id).is_some_and(|stroke| stroke.is_visible());
    let is_whole = |group: &GroupId, count: usize| {
        scene.strokes_below(*group).iter().filter(|id| is_visible(id)).count() == count
    };
    let whole: BTreeSet<GroupId> =
        chosen.iter().filter(|&(group, &count)| is_whole(group, count)).map(|(&group, _)| group).collect();
    let outermost = |id: &StrokeId| chain_of(id).into_iter().rev().find(|group| whole.contains(group));
    let groups: BTreeSet<GroupId> = strokes.iter().filter_map(outermost).collect();
    let loose = strokes.iter().filter(|id| outermost(id).is_none()).copied().collect();
    (groups.into_iter().collect(), loose)
}
