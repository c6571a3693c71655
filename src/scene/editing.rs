//! What is done to strokes once they are there: erase, move, group, place, undo and redo.

use glam::Vec3;

use super::{Scene, edit::Edit, group, model::Untold};
use crate::{
    brush::Surface,
    polygon::{Change, PolygonId, SpaceId},
    recording::{GroupId, StrokeId, Transform},
};

impl Scene {
    pub(super) fn record(&mut self, edit: Edit) {
        let first = self.gone[0].len();
        self.history.record(edit, &mut self.gone[0]);
        for i in first..self.gone[0].len() {
            self.put_out_of_reach(self.gone[0][i]);
        }
    }

    /// Nothing brings a stroke back any more: its number stays used, all else is as if it had never been.
    fn put_out_of_reach(&mut self, at: u32) {
        let Some(stroke) = self.strokes.get_mut(at as usize) else { return };
        stroke.is_gone = true;
        stroke.builder = None;
        if let Some(id) = stroke.id {
            self.stroke_by_id.remove(&id);
            self.used.insert(id.0);
        }
        let group = stroke.group.take();
        if group.is_some() {
            self.groups.change_member(at, group, None);
            self.displace(at);
        }
    }

    /// Frees the memory of the strokes that no undo or redo can bring back, as far as that was so at the last call: who
    /// follows the changes may still ask about those that went since. To be called once a frame by whoever keeps a scene
    /// for long, after the changes before the last call have been followed.
    pub fn let_go(&mut self) {
        self.gone.swap(0, 1);
        let mut gone = std::mem::take(&mut self.gone[0]);
        for at in gone.drain(..) {
            let Some(stroke) = self.strokes.get_mut(at as usize) else { continue };
            for id in std::mem::take(&mut stroke.polygons).into_iter().flatten() {
                self.polygons.release(id as usize);
                self.bounds.release(id as usize);
                self.surfaces.release(id as usize);
                self.owner.release(id as usize);
                self.let_go += 1;
            }
            self.strokes.release(at as usize);
        }
        // One jump may free a million strokes; the next ones are few again.
        gone.shrink_to(1024);
        self.gone[0] = gone;
        if self.stroke_by_id.len() * 4 < self.stroke_by_id.capacity() {
            self.stroke_by_id.shrink_to(1024);
        }
    }

    pub(super) fn erase(&mut self, id: StrokeId) -> Option<()> {
        let at = *self.stroke_by_id.get(&id)?;
        if self.strokes[at as usize].erased {
            return None;
        }
        self.set_erased(at, true);
        self.record(Edit::Erase { stroke: at });
        Some(())
    }

    fn set_erased(&mut self, at: u32, erased: bool) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let was = stroke.is_visible();
        stroke.erased = erased;
        if erased {
            self.counts.erased_strokes += 1;
        } else {
            self.counts.erased_strokes -= 1;
        }
        self.follow_visibility(at, was);
    }

    fn set_undone(&mut self, at: u32, undone: bool) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let was = stroke.is_visible();
        stroke.undone = undone;
        self.follow_visibility(at, was);
    }

    /// Counts a stroke that has come or gone. It is told of once all events of the frame are taken, so that the changes
    /// of a frame are as many as its polygons, however often it takes a stroke back.
    pub(super) fn follow_visibility(&mut self, at: u32, was: bool) {
        let stroke = &mut self.strokes[at as usize];
        let is = stroke.is_visible();
        if was == is {
            return;
        }
        self.groups.note_changed(stroke.group);
        let count = stroke.polygons.iter().map(|r| u64::from(r.end - r.start)).sum::<u64>();
        if is {
            self.counts.visible += count;
        } else {
            self.counts.visible -= count;
        }
        if !std::mem::replace(&mut stroke.is_untold, true) {
            self.to_tell.push(Untold { stroke: at, was_visible: was, first_new: self.bounds.len() as u32 });
        }
    }

    /// Tells of the strokes that have come or gone in this frame.
    pub(super) fn tell_of_visibility(&mut self, changes: &mut Vec<Change>) {
        let mut to_tell = std::mem::take(&mut self.to_tell);
        for Untold { stroke: at, was_visible, first_new } in to_tell.drain(..) {
            let Some(stroke) = self.strokes.get_mut(at as usize) else { continue };
            stroke.is_untold = false;
            {
                let ids = stroke.polygon_ids();
                match (was_visible, stroke.is_visible()) {
                    (true, false) => changes.extend(ids.filter(|id| id.0 < first_new).map(Change::Remove)),
                    (true, true) => changes.extend(ids.filter(|id| id.0 >= first_new).map(Change::Insert)),
                    (false, true) => changes.extend(ids.map(Change::Insert)),
                    (false, false) => {}
                }
            }
            // Whoever has kept its polygons from before has them at the old place.
            if stroke.is_visible() && std::mem::take(&mut stroke.was_displaced_unseen) {
                self.displace(at);
            }
        }
        self.to_tell = to_tell;
    }

    pub(super) fn move_strokes(&mut self, ids: &[StrokeId], by: Vec3) -> Option<()> {
        let mut offsets: Vec<(u32, Vec3)> = self.named(ids).map(|at| (at, Vec3::ZERO)).collect();
        offsets.sort_unstable_by_key(|(at, _)| *at);
        offsets.dedup_by_key(|(at, _)| *at);
        offsets.retain_mut(|(at, offset)| {
            let stroke = &self.strokes[*at as usize];
            let by = self.groups.way_from_world(stroke.group, by);
            by.inspect(|by| *offset = stroke.offset + *by).is_some()
        });
        if offsets.is_empty() {
            return None;
        }
        self.swap_offsets(&mut offsets);
        self.record(Edit::Move { offsets });
        Some(())
    }

    pub(super) fn named(&self, ids: &[StrokeId]) -> impl Iterator<Item = u32> {
        ids.iter().filter_map(|id| self.stroke_by_id.get(id)).copied()
    }

    fn swap_offsets(&mut self, offsets: &mut [(u32, Vec3)]) {
        for (at, offset) in offsets {
            if let Some(stroke) = self.strokes.get_mut(*at as usize).filter(|stroke| !stroke.is_gone) {
                std::mem::swap(&mut stroke.offset, offset);
                self.displace(*at);
            }
        }
    }

    /// A stroke is elsewhere now: it is placed anew once all events of the frame are taken.
    pub(super) fn displace(&mut self, at: u32) {
        if let Some(stroke) = self.strokes.get_mut(at as usize)
            && !std::mem::replace(&mut stroke.is_displaced, true)
        {
            self.to_place.push(at);
        }
    }

    /// Recomputes the boxes of all strokes whose place in the world has changed, and tells of the groups that have moved as a
    /// whole.
    pub(super) fn place_displaced(&mut self, changes: &mut Vec<Change>) {
        let mut to_place = std::mem::take(&mut self.to_place);
        let mut moved = std::mem::take(&mut self.moved_groups);
        self.groups.take_moved(|group| moved.push(group));
        for group in moved.drain(..) {
            if self.moves_as_whole(group) {
                self.groups.note_stale(Some(group));
                changes.push(Change::Place(SpaceId(group as u32)));
                continue;
            }
            for at in self.groups.strokes(group) {
                if let Some(stroke) = self.strokes.get_mut(at as usize)
                    && !std::mem::replace(&mut stroke.is_displaced, true)
                {
                    to_place.push(at);
                }
            }
        }
        self.moved_groups = moved;
        to_place.sort_unstable();
        for at in to_place.drain(..) {
            self.place_stroke(at, changes);
        }
        self.to_place = to_place;
    }

    fn place_stroke(&mut self, at: u32, changes: &mut Vec<Change>) {
        let Some(stroke) = self.strokes.get_mut(at as usize) else { return };
        stroke.is_displaced = false;
        stroke.was_displaced_unseen = !stroke.is_visible();
        self.groups.note_changed(stroke.group);
        let is_whole = self.groups.is_whole(stroke.group);
        let group = stroke.group.filter(|_| !is_whole);
        self.groups.chain(group, &mut self.chain);
        let scale = self.chain.iter().map(|to| to.s).product();
        let (own, first) = (stroke.group, changes.len());
        let ranges = std::mem::take(&mut self.strokes[at as usize].polygons);
        for id in ranges.iter().cloned().flatten().map(PolygonId) {
            let stroke = &self.strokes[at as usize];
            let local = &self.polygons[id.index()];
            let placed =
                local.map(|p| self.chain.iter().fold(p + stroke.offset, |p, to| group::apply(to, p)));
            let surface = self.surfaces.get(id.index()).copied().unwrap_or(Surface::PLAIN);
            let bounds = stroke.bounds_of(&placed, &surface, scale);
            self.keep_bounds(id, own, bounds);
            self.displaced += 1;
            changes.push(Change::Update(id));
        }
        let stroke = &mut self.strokes[at as usize];
        stroke.polygons = ranges;
        if stroke.was_displaced_unseen {
            changes.truncate(first);
        }
    }

    pub(super) fn group(
        &mut self,
        id: GroupId,
        strokes: &[StrokeId],
        parent: Option<GroupId>,
        name: Option<&str>,
    ) -> Option<()> {
        let parent = match parent {
            Some(parent) => Some(self.groups.find(parent)?),
            None => None,
        };
        let at = self.groups.find_or_make(id, parent)?;
        let mut before: Vec<(u32, Option<usize>)> = self.named(strokes).map(|s| (s, None)).collect();
        before.sort_unstable_by_key(|(s, _)| *s);
        before.dedup_by_key(|(s, _)| *s);
        for (stroke, group_before) in &mut before {
            *group_before = self.strokes[*stroke as usize].group;
        }
        let parent_before = self.groups.parent(at);
        self.groups.hang(at, parent);
        before.iter().for_each(|&(stroke, _)| self.set_group(stroke, Some(at)));
        let names = name.map(|name| {
            let name = Some(name.to_owned()).filter(|name| !name.is_empty());
            Box::new([self.groups.set_name(at, name.clone()), name])
        });
        self.record(Edit::Group { before, group: at, parent_before, parent, names });
        Some(())
    }

    fn set_group(&mut self, at: u32, to: Option<usize>) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let from = std::mem::replace(&mut stroke.group, to);
        if from != to {
            self.groups.change_member(at, from, to);
            self.displace(at);
        }
    }

    pub(super) fn place(&mut self, id: GroupId, to: Transform) -> Option<()> {
        let group = self.groups.find(id)?;
        let before = self.groups.transform(group);
        self.groups.place(group, to);
        self.record(Edit::Place { group, before, after: to });
        Some(())
    }

    pub(super) fn undo(&mut self) -> Option<()> {
        let mut edit = self.history.undo()?;
        self.play_backward(&mut edit);
        self.history.taken_back(edit);
        Some(())
    }

    fn play_backward(&mut self, edit: &mut Edit) {
        match edit {
            Edit::Draw { stroke } => self.set_undone(*stroke, true),
            Edit::Erase { stroke } => self.set_erased(*stroke, false),
            Edit::Move { offsets } => self.swap_offsets(offsets),
            Edit::Group { before, group, parent_before, names, .. } => {
                if let Some(names) = names {
                    self.groups.set_name(*group, names[0].clone());
                }
                self.groups.hang(*group, *parent_before);
                before.iter().for_each(|&(stroke, group)| self.set_group(stroke, group));
            }
            Edit::Place { group, before, .. } => self.groups.place(*group, *before),
            Edit::Assign { layers } => self.swap_layers(layers),
            Edit::Several(edits) => edits.iter_mut().rev().for_each(|edit| self.play_backward(edit)),
        }
    }

    pub(super) fn redo(&mut self) -> Option<()> {
        let mut edit = self.history.redo()?;
        self.play_forward(&mut edit);
        self.history.made_again(edit);
        Some(())
    }

    fn play_forward(&mut self, edit: &mut Edit) {
        match edit {
            Edit::Draw { stroke } => self.set_undone(*stroke, false),
            Edit::Erase { stroke } => self.set_erased(*stroke, true),
            Edit::Move { offsets } => self.swap_offsets(offsets),
            Edit::Group { before, group, parent, names, .. } => {
                if let Some(names) = names {
                    self.groups.set_name(*group, names[1].clone());
                }
                self.groups.hang(*group, *parent);
                before.iter().for_each(|&(stroke, _)| self.set_group(stroke, Some(*group)));
            }
            Edit::Place { group, after, .. } => self.groups.place(*group, *after),
            Edit::Assign { layers } => self.swap_layers(layers),
            Edit::Several(edits) => edits.iter_mut().for_each(|edit| self.play_forward(edit)),
        }
    }
}
