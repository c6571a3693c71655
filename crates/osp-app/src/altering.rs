//! Changes of the selected strokes: colour, width, rotation, scale, mirror, copies.
//!
//! A changed copy replaces each stroke. All replacements together are one [step](Event::Step) of undo. The file stores
//! the copies and erasures as ordinary events.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Quat, Vec3};

use crate::{groups::whole_groups, studio::Studio};
use osp::math::{Aabb, rotate};
use osp_session::{
    recording::{Alteration, Author, Event, GroupId, Motion, StrokeId},
    scene::Scene,
};

/// A change of the selected strokes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Altering {
    /// Gives the strokes the brush's colour.
    Color,
    /// Gives the strokes the brush's width.
    Width,
    /// Rotation about the vertical axis through the selection's centre, degrees, counter-clockwise seen from above.
    Turn(f32),
    /// Scale about the selection's centre, a factor.
    Scale(f32),
    /// Reflection in the drawing aids' mirror if it is on. Otherwise the plane of reflection is perpendicular to the x
    /// axis and contains the selection's centre.
    Mirror,
    /// A motion in world space.
    Motion(Motion),
}

/// The clipboard: copied strokes in world space.
#[derive(Clone, Debug, Default)]
pub(super) struct Clip {
    pub(super) strokes: Vec<ClipStroke>,
    /// The groups of the strokes; parents come before children.
    pub(super) groups: Vec<ClipGroup>,
    /// Largest extent of all strokes, metres.
    pub(super) extent_m: f32,
    pub(super) pasted: u32,
}

#[derive(Clone, Debug)]
pub(super) struct ClipStroke {
    pub(super) id: StrokeId,
    pub(super) events: Vec<Event>,
    pub(super) layer: u32,
    /// Index of the stroke's group in [`Clip::groups`].
    pub(super) group: Option<usize>,
}

#[derive(Clone, Debug)]
pub(super) struct ClipGroup {
    pub(super) name: Option<String>,
    pub(super) parent: Option<usize>,
}

/// The changed copy of each replaced stroke. Undo and redo move the selection between the stroke and its copy.
#[derive(Clone, Debug, Default)]
pub(super) struct Replaced(pub(super) BTreeMap<StrokeId, StrokeId>);

impl Studio {
    /// The selected strokes that can be changed now: visible, finished, on an open layer.
    fn alterable(&self) -> Vec<StrokeId> {
        let scene = self.scene();
        let can = |id: &StrokeId| {
            scene.stroke(*id).is_some_and(|stroke| {
                stroke.is_visible() && !stroke.is_open() && !self.is_layer_held(stroke.layer())
            })
        };
        self.input.selection.strokes().iter().copied().filter(can).collect()
    }

    /// The box around the selected strokes, in world space; empty without a selection.
    pub fn selection_bounds(&self) -> Aabb {
        let scene = self.scene();
        let strokes = self.input.selection.strokes().iter().filter_map(|id| scene.stroke(*id));
        let ids = strokes.filter(|stroke| stroke.is_visible()).flat_map(|stroke| stroke.polygon_ids());
        ids.fold(Aabb::EMPTY, |bounds, id| bounds.union(&scene.bounds(id)))
    }

    pub(crate) fn alter_selection(&mut self, altering: Altering) {
        self.finish_gestures();
        let bounds = self.selection_bounds();
        if bounds.is_empty() {
            return;
        }
        let middle = bounds.center();
        let [r, g, b, a] = self.input.brush.color;
        let motion = match altering {
            Altering::Color | Altering::Width => Motion::STAY,
            Altering::Turn(degrees) => {
                let half = f64::from(degrees).to_radians() * 0.5;
                let turn = Quat::from_xyzw(0.0, libm::sin(half) as f32, 0.0, libm::cos(half) as f32);
                Motion::about(middle, turn, 1.0)
            }
            Altering::Scale(scale) => Motion::about(middle, Quat::IDENTITY, scale),
            Altering::Mirror => Motion::mirror_x(self.input.aids.mirror_x.unwrap_or(middle.x)),
            Altering::Motion(motion) => motion,
        };
        let alteration = Alteration {
            motion,
            color: (altering == Altering::Color).then_some((r, g, b, a)),
            width_m: (altering == Altering::Width).then_some(self.input.brush.width_m),
        };
        if alteration == Alteration::NONE {
            return;
        }
        let is_placed = !motion.is_mirrored && motion != Motion::STAY;
        if let Some(placed) = is_placed.then(|| self.placed_group(&motion)).flatten() {
            self.events.push(placed);
            self.apply_events();
            return;
        }
        self.replace_by_copies(&alteration);
    }

    /// The event that moves the selection if it is a whole group. This event takes one line of the file, while copies
    /// of all strokes would take many.
    pub(crate) fn placed_group(&self, motion: &Motion) -> Option<Event> {
        let (group, scene) = (self.selected_group()?, self.scene());
        let own = Motion { is_mirrored: false, to: scene.group_transform(group)? };
        let parent = match scene.parent_of(group) {
            Some(parent) => scene.world_from_group(parent)?,
            None => Motion::STAY,
        };
        let to = own.then(&parent).then(motion).then(&parent.inverse()?).to;
        Some(Event::Place { author: Author::SOLE, t: self.now_secs(), group, to })
    }

    fn replace_by_copies(&mut self, alteration: &Alteration) {
        let strokes = self.alterable();
        let Some(events) = self.events_of(&strokes) else { return };
        let t = self.now_secs();
        let mut ids = self.new_strokes(strokes.len());
        let scene = self.session.scene();
        let (mut out, mut old, mut copies) = (Vec::new(), Vec::new(), Vec::new());
        let mut members = BTreeMap::<GroupId, Vec<StrokeId>>::new();
        let mut layers = BTreeMap::<u32, Vec<StrokeId>>::new();
        for id in strokes {
            let Some((own, home)) = spaces(scene, id, &alteration.motion) else { continue };
            let Some(copy) = ids.pop() else { break };
            let own = Alteration {
                motion: own,
                width_m: alteration.width_m.map(|width_m| width_m / home.to.s),
                ..*alteration
            };
            let events = own.copy(events.get(&id).into_iter().flatten(), id, copy, t);
            let Some(stroke) = scene.stroke(id).filter(|_| !events.is_empty()) else { continue };
            if stroke.layer() != layer_of(&events) {
                layers.entry(stroke.layer()).or_default().push(copy);
            }
            if let Some(group) = scene.groups_of(stroke).first() {
                members.entry(*group).or_default().push(copy);
            }
            out.extend(events);
            old.push(id);
            copies.push(copy);
        }
        let mut edits = copies.len() + old.len();
        for (group, strokes) in members {
            let parent = scene.parent_of(group);
            let first = out.len();
            out.extend(Event::grouping(t, group, &strokes, parent, None));
            edits += out.len() - first;
        }
        edits += assign(t, layers, &mut out);
        // The copies come first, so that a crash in between loses no stroke.
        out.extend(old.iter().map(|&stroke| Event::Erase { author: Author::SOLE, t, stroke }));
        if self.take_step(edits, out) {
            self.input.replaced.0.extend(old.into_iter().zip(copies.iter().copied()));
            self.input.selection.set(copies);
        }
    }

    fn events_of(&mut self, strokes: &[StrokeId]) -> Option<BTreeMap<StrokeId, Vec<Event>>> {
        if !self.can_draw() || strokes.is_empty() {
            return None;
        }
        match self.session.events_of(&strokes.iter().copied().collect()) {
            Ok(events) => {
                let mut by_stroke = BTreeMap::<StrokeId, Vec<Event>>::new();
                for event in events {
                    if let Event::Begin { stroke, .. }
                    | Event::Point { stroke, .. }
                    | Event::End { stroke, .. }
                    | Event::Polygon { stroke: Some(stroke), .. } = event
                    {
                        by_stroke.entry(stroke).or_default().push(event);
                    }
                }
                Some(by_stroke)
            }
            Err(error) => {
                self.show_message(format!("the strokes cannot be copied: {error}"));
                None
            }
        }
    }

    /// Unused ids for new strokes. The last id is used first.
    fn new_strokes(&mut self, count: usize) -> Vec<StrokeId> {
        let mut ids: Vec<StrokeId> = (0..count).map(|_| self.session.new_stroke()).collect();
        ids.reverse();
        ids
    }

    /// Applies all edits as one step of undo. Returns `false`, without effect, if an edit is invalid or exceeds a
    /// limit.
    pub(crate) fn take_step(&mut self, edits: usize, events: Vec<Event>) -> bool {
        if edits == 0 || !self.can_draw() {
            return false;
        }
        if let Some(expected) = events.iter().find_map(|event| event.check().err()) {
            self.show_message(format!("nothing was changed: the limit of a session is {expected}"));
            return false;
        }
        if self.session.excess(&self.limits).is_none()
            && let Some((most, what)) = self.session.excess_with(&events, &self.limits)
        {
            self.show_message(format!("nothing was changed: a session may have {most} {what} in all"));
            return false;
        }
        let t = events.first().map_or_else(|| self.now_secs(), Event::time_secs);
        if edits > 1 {
            self.events.push(Event::Step {
                author: Author::SOLE,
                t,
                edits: u32::try_from(edits).unwrap_or(u32::MAX),
            });
        }
        self.events.extend(events);
        self.apply_events();
        // The step does not count edits without effect, so the step may still be open.
        if self.scene().is_step_open() || (edits > 1 && self.session.may_have_open_step()) {
            self.events.push(Event::Step { author: Author::SOLE, t, edits: 0 });
            self.apply_events();
        }
        true
    }

    pub(crate) fn erase_selected(&mut self) {
        self.finish_gestures();
        let t = self.now_secs();
        let erased = self.alterable();
        self.input.selection.clear();
        let events = erased.iter().map(|&stroke| Event::Erase { author: Author::SOLE, t, stroke }).collect();
        self.take_step(erased.len(), events);
    }

    /// Whether there are strokes to paste.
    pub fn has_clip(&self) -> bool {
        !self.input.clip.strokes.is_empty()
    }

    /// Copies the selected strokes. Returns `false` if no stroke could be copied.
    pub(crate) fn copy_selection(&mut self) -> bool {
        self.finish_gestures();
        let Some(clip) = self.clip_selection() else { return false };
        self.show_message(format!("{} strokes copied", clip.strokes.len()));
        self.input.clip = clip;
        true
    }

    /// The selected strokes in world space, with the groups that are selected as a whole.
    fn clip_selection(&mut self) -> Option<Clip> {
        let strokes = self.alterable();
        let extent_m = self.selection_bounds().extent().max_element();
        let events = self.events_of(&strokes)?;
        let t = self.now_secs();
        let scene = self.session.scene();
        let (whole, _) = whole_groups(scene, &strokes);
        let mut clip = Clip { extent_m, ..Clip::default() };
        let mut places = BTreeMap::<GroupId, usize>::new();
        for id in strokes {
            let (Some(stroke), Some(events)) = (scene.stroke(id), events.get(&id)) else { continue };
            let Some(motion) = scene.world_from_stroke(id) else { continue };
            let events = Alteration { motion, ..Alteration::NONE }.copy(events, id, id, t);
            let chain = scene.groups_of(stroke);
            let outermost = chain.iter().rposition(|group| whole.contains(group));
            let mut group = None;
            for of in outermost.map_or(&[][..], |last| &chain[..=last]).iter().rev() {
                let next = clip.groups.len();
                let at = *places.entry(*of).or_insert(next);
                if at == next {
                    let name = scene.group_name(*of).map(str::to_owned);
                    clip.groups.push(ClipGroup { name, parent: group });
                }
                group = Some(at);
            }
            clip.strokes.push(ClipStroke { id, events, layer: stroke.layer(), group });
        }
        (!clip.strokes.is_empty()).then_some(clip)
    }

    pub(crate) fn paste(&mut self) {
        self.finish_gestures();
        let mut clip = std::mem::take(&mut self.input.clip);
        clip.pasted += 1;
        self.place_clip(&clip);
        self.input.clip = clip;
    }

    pub(crate) fn duplicate(&mut self) {
        self.finish_gestures();
        if let Some(clip) = self.clip_selection() {
            self.place_clip(&Clip { pasted: 1, ..clip });
        }
    }

    /// Draws the copied strokes again and selects them. Each further paste has a larger offset from the original place.
    fn place_clip(&mut self, clip: &Clip) {
        /// Offset of one paste, as a fraction of the extent.
        const PASTE_OFFSET: f32 = 0.1;
        let aside = rotate(self.navigator.world_from_view(), Vec3::new(1.0, -1.0, 0.0));
        let motion = Motion::by(aside * (clip.extent_m * PASTE_OFFSET * clip.pasted as f32));
        // Strokes of a closed layer are pasted to the current layer.
        let mut moved_to = BTreeMap::<u32, u32>::new();
        for layer in clip.strokes.iter().map(|stroke| stroke.layer).collect::<BTreeSet<_>>() {
            if !self.is_layer_open(layer) {
                if !self.may_draw_on_layer() {
                    return;
                }
                moved_to.insert(layer, self.input.brush.layer);
            }
        }
        let t = self.now_secs();
        let alteration = Alteration { motion, ..Alteration::NONE };
        let mut ids = self.new_strokes(clip.strokes.len());
        let (mut out, mut copies) = (Vec::new(), Vec::new());
        let mut members = vec![Vec::new(); clip.groups.len()];
        let mut layers = BTreeMap::<u32, Vec<StrokeId>>::new();
        for stroke in &clip.strokes {
            let Some(copy) = ids.pop() else { break };
            let events = alteration.copy(&stroke.events, stroke.id, copy, t);
            if events.is_empty() {
                continue;
            }
            let layer = moved_to.get(&stroke.layer).copied().unwrap_or(stroke.layer);
            if layer != layer_of(&events) {
                layers.entry(layer).or_default().push(copy);
            }
            if let Some(group) = stroke.group {
                members[group].push(copy);
            }
            out.extend(events);
            copies.push(copy);
        }
        let mut edits = copies.len() + assign(t, layers, &mut out);
        let groups = self.session.new_groups(clip.groups.len());
        for ((of, &group), strokes) in clip.groups.iter().zip(&groups).zip(members) {
            let parent = of.parent.and_then(|parent| groups.get(parent)).copied();
            let first = out.len();
            out.extend(Event::grouping(t, group, &strokes, parent, of.name.clone()));
            edits += out.len() - first;
        }
        if self.take_step(edits, out) {
            self.input.selection.set(copies);
        }
    }

    /// Updates the selection after an undo or redo: removes strokes that are no longer visible, and selects the
    /// originals or copies that replaced them.
    pub(crate) fn follow_selection(&mut self, is_undo: bool) {
        let scene = self.session.scene();
        let is_there = |id: &StrokeId| scene.stroke(*id).is_some_and(|stroke| stroke.is_visible());
        let mut selected: BTreeSet<StrokeId> = self.input.selection.strokes().iter().copied().collect();
        let pairs =
            self.input.replaced.0.iter().map(|(&old, &new)| if is_undo { (new, old) } else { (old, new) });
        for (gone, instead) in pairs {
            if selected.contains(&gone) && !is_there(&gone) && is_there(&instead) {
                selected.insert(instead);
            }
        }
        self.input.selection.set(selected);
        self.deselect_locked();
    }
}

/// Two transforms for a copy that moves in the world but stays in its group. The first transform leads from the space
/// of the stroke's samples to the copy's space. The second transform leads from the copy's space to world space. `None`
/// if the group has scale 0.
fn spaces(scene: &Scene, id: StrokeId, motion: &Motion) -> Option<(Motion, Motion)> {
    let stroke = scene.stroke(id)?;
    let home = match scene.groups_of(stroke).first() {
        Some(group) => scene.world_from_group(*group)?,
        None => Motion::STAY,
    };
    let back = home.inverse()?;
    // Without a motion the coordinates stay the same, bit for bit.
    if *motion == Motion::STAY {
        return Some((Motion::by(stroke.offset()), home));
    }
    Some((scene.world_from_stroke(id)?.then(motion).then(&back), home))
}

/// The layer on which a stroke with these events begins.
fn layer_of(events: &[Event]) -> u32 {
    match events.first() {
        Some(Event::Begin { paint: Some(paint), .. }) => paint.layer,
        _ => 0,
    }
}

/// Appends the events that move strokes to layers. Returns the number of events.
pub(super) fn assign(t: f64, layers: BTreeMap<u32, Vec<StrokeId>>, out: &mut Vec<Event>) -> usize {
    let first = out.len();
    for (layer, strokes) in layers {
        let parts = strokes.chunks(Event::MAX_STROKES_NAMED);
        out.extend(parts.map(|strokes| Event::Assign {
            author: Author::SOLE,
            t,
            layer,
            strokes: strokes.to_vec(),
        }));
    }
    out.len() - first
}
