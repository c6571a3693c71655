//! Groups in the window: made from the selection, named, selected as a whole, moved and placed.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Quat, Vec3};

use crate::studio::Studio;
use osp::math::rotate;
use osp_session::{
    recording::{Author, Event, GroupId, StrokeId, Transform},
    scene::{GroupNode, Scene},
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

impl Studio {
    pub fn group_tree(&mut self) -> Vec<GroupNode> {
        self.session.group_tree()
    }

    /// The outermost group whose strokes are exactly the selection.
    pub fn selected_group(&self) -> Option<GroupId> {
        match whole_groups(self.scene(), self.input.selection.strokes()) {
            (groups, loose) if loose.is_empty() && groups.len() == 1 => groups.first().copied(),
            _ => None,
        }
    }

    pub(crate) fn select_group(&mut self, group: GroupId) {
        self.input.selection.set(self.session.scene().strokes_below(group));
        self.deselect_locked();
    }

    /// Groups the selected strokes. Groups that are selected as a whole become children. No stroke moves.
    pub(crate) fn group_selection(&mut self) {
        let scene = self.session.scene();
        let (groups, loose) = whole_groups(scene, self.input.selection.strokes());
        let parent_of_loose =
            |id: &StrokeId| scene.stroke(*id).and_then(|stroke| scene.groups_of(stroke).first().copied());
        let parents: BTreeSet<Option<GroupId>> = groups
            .iter()
            .map(|&group| scene.parent_of(group))
            .chain(loose.iter().map(parent_of_loose))
            .collect();
        let Some(&parent) = parents.first() else { return };
        if parents.len() > 1 {
            self.show_message(
                "the selection has parts of several groups: select whole groups, or strokes of one"
                    .to_owned(),
            );
            return;
        }
        let Some(group) = self.session.new_groups(1).pop() else { return };
        let t = self.now_secs();
        let name = Some(format!("group {}", group.0 & ((1 << Author::NUMBER_BITS) - 1)));
        let mut events: Vec<Event> = Event::grouping(t, group, &loose, parent, name).collect();
        events.extend(groups.into_iter().map(|below| Event::Group {
            author: Author::SOLE,
            t,
            group: below,
            strokes: Vec::new(),
            parent: Some(group),
            name: None,
        }));
        self.take_step(events.len(), events);
    }

    pub(crate) fn name_group(&mut self, group: GroupId, name: &str) {
        let scene = self.session.scene();
        if scene.group_transform(group).is_none() {
            return;
        }
        let (t, parent) = (self.now_secs(), scene.parent_of(group));
        let name = Some(name[..name.floor_char_boundary(Event::MAX_GROUP_NAME_BYTES)].to_owned());
        self.events.push(Event::Group { author: Author::SOLE, t, group, strokes: Vec::new(), parent, name });
    }

    pub(crate) fn place_group(&mut self, group: GroupId, placing: &Placing) {
        let scene = self.session.scene();
        let is_held = |id: &StrokeId| {
            scene
                .stroke(*id)
                .is_some_and(|stroke| !stroke.is_taken_away() && self.is_layer_held(stroke.layer()))
        };
        if scene.strokes_below(group).iter().any(is_held) {
            self.show_once(
                "this group holds strokes of a locked layer, or of a layer that only another author may edit",
            );
            return;
        }
        let bounds = self.group_tree().into_iter().find(|node| node.id == group).map(|node| node.bounds);
        let scene = self.session.scene();
        let middle = bounds
            .filter(|bounds| !bounds.is_empty())
            .and_then(|bounds| scene.in_parent_of(group, bounds.center()));
        let (Some(before), Some(middle)) = (scene.group_transform(group), middle) else { return };
        self.events.push(Event::Place {
            author: Author::SOLE,
            t: self.now_secs(),
            group,
            to: placing.after(&before, middle),
        });
    }
}
