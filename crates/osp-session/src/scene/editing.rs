//! Edits of existing strokes: erase, move, group, place.

use glam::Vec3;

use super::{
    Scene, Stroke,
    edit::{Arrangement, Edit, Grouping, Named, Translation},
    group,
    model::Unreported,
};
use crate::{
    brush::Surface,
    recording::{Author, GroupId, StrokeId, Transform},
};
use osp::polygon::{Change, PolygonId, SpaceId};

impl Scene {
    /// Frees the strokes that were out of reach of undo and redo at the previous call. Receivers of changes may
    /// therefore still query strokes that became unreachable after that call. Call it once a frame in long sessions.
    /// All changes made before the previous call must have been processed.
    pub fn free_unreachable(&mut self) {
        self.gone.swap(0, 1);
        let mut gone = std::mem::take(&mut self.gone[0]);
        for at in gone.drain(..) {
            let Some(stroke) = self.strokes.get_mut(at as usize) else { continue };
            for id in std::mem::take(&mut stroke.polygons).into_iter().flatten() {
                self.polygons.release(id as usize);
                self.bounds.release(id as usize);
                self.surfaces.release(id as usize);
                self.owner.release(id as usize);
                self.freed += 1;
            }
            self.strokes.release(at as usize);
        }
        // Frees the scratch memory, because one event may free a million strokes, and later events free few.
        gone.shrink_to(1024);
        self.gone[0] = gone;
        if self.stroke_by_id.len() * 4 < self.stroke_by_id.capacity() {
            self.stroke_by_id.shrink_to(1024);
        }
    }

    pub(super) fn erase(&mut self, author: Author, id: StrokeId) -> Option<()> {
        let at = *self.stroke_by_id.get(&id)?;
        if !self.may_touch(author, self.strokes[at as usize].layer) {
            return None;
        }
        // An author may also erase a stroke that another author has erased. If the other author undoes the erasure, the
        // stroke stays erased.
        if self.strokes[at as usize].erasers > 0 && self.author_mut(author).erased.contains(&at) {
            return None;
        }
        self.set_erased(author, at, true);
        self.record(author, Edit::Erase { stroke: at });
        Some(())
    }

    pub(super) fn set_erased(&mut self, author: Author, at: u32, erased: bool) {
        let of_author = &mut self.author_mut(author).erased;
        if erased {
            of_author.insert(at);
        } else {
            of_author.remove(&at);
        }
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let was = stroke.is_visible();
        if erased {
            stroke.erasers += 1;
            self.counts.erased_strokes += u64::from(stroke.erasers == 1);
        } else {
            stroke.erasers = stroke.erasers.saturating_sub(1);
            self.counts.erased_strokes -= u64::from(stroke.erasers == 0);
        }
        self.follow_visibility(at, was);
    }

    pub(super) fn set_undone(&mut self, at: u32, undone: bool) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let was = stroke.is_visible();
        stroke.undone = undone;
        self.follow_visibility(at, was);
    }

    /// Marks a stroke whose visibility may have changed. The change is reported after all events of the frame. A frame
    /// therefore reports each polygon at most once, however often it undoes and redoes a stroke.
    pub(super) fn follow_visibility(&mut self, at: u32, was: bool) {
        let stroke = &mut self.strokes[at as usize];
        let is = stroke.is_visible();
        if was == is {
            return;
        }
        self.groups.note_changed(stroke.group);
        let count = stroke.kept_polygons();
        self.looked_at += count;
        if is {
            self.counts.visible += count;
        } else {
            self.counts.visible -= count;
        }
        if !std::mem::replace(&mut stroke.is_unreported, true) {
            self.to_report.push(Unreported {
                stroke: at,
                was_visible: was,
                first_new: self.bounds.len() as u32,
            });
        }
    }

    /// Reports the strokes that became visible or invisible in this frame.
    pub(super) fn note_visibility(&mut self, changes: &mut Vec<Change>) {
        let mut to_report = std::mem::take(&mut self.to_report);
        for Unreported { stroke: at, was_visible, first_new } in to_report.drain(..) {
            let Some(stroke) = self.strokes.get_mut(at as usize) else { continue };
            stroke.is_unreported = false;
            {
                let ids = stroke.polygon_ids();
                match (was_visible, stroke.is_visible()) {
                    (true, false) => changes.extend(ids.filter(|id| id.0 < first_new).map(Change::Remove)),
                    (true, true) => changes.extend(ids.filter(|id| id.0 >= first_new).map(Change::Insert)),
                    (false, true) => changes.extend(ids.map(Change::Insert)),
                    (false, false) => {}
                }
            }
            // The last reported position of the polygons is out of date.
            if stroke.is_visible() && std::mem::take(&mut stroke.was_displaced_unseen) {
                self.displace(at);
            }
        }
        self.to_report = to_report;
    }

    pub(super) fn move_strokes(&mut self, author: Author, ids: &[StrokeId], by: Vec3) -> Option<()> {
        // The move of a stroke in a group depends on the parents of groups, so earlier undo and redo are processed
        // first. For other strokes they are processed at the end of the frame.
        if ids.iter().any(|&id| self.stroke(id).is_some_and(|stroke| stroke.group.is_some())) {
            self.parents.settle(&mut self.groups);
        }
        let groups = &self.groups;
        let moved = self.named(author, ids, |stroke| {
            Some(Translation { by: groups.way_from_world(stroke.group, by)?, before: stroke.offset })
        });
        if moved.is_empty() {
            return None;
        }
        moved.iter().for_each(|named| self.set_offset(named.stroke, named.of.before + named.of.by));
        self.arrange(author, Arrangement::Move(moved));
        Some(())
    }

    /// Calls `of` for the strokes with these numbers, and returns the results, sorted by stroke and without duplicates.
    /// Strokes without a result, and strokes that the author may not edit, are skipped.
    pub(super) fn named<T>(
        &self,
        author: Author,
        ids: &[StrokeId],
        of: impl Fn(&Stroke) -> Option<T>,
    ) -> Vec<Named<T>> {
        let mut strokes: Vec<u32> = ids.iter().filter_map(|id| self.stroke_by_id.get(id)).copied().collect();
        strokes.sort_unstable();
        strokes.dedup();
        let named = |at| {
            let stroke = &self.strokes[at as usize];
            let may = self.may_touch(author, stroke.layer);
            may.then(|| Some(Named { stroke: at, of: of(stroke)? })).flatten()
        };
        strokes.into_iter().filter_map(named).collect()
    }

    pub(super) fn set_offset(&mut self, at: u32, offset: Vec3) {
        if let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) {
            stroke.offset = offset;
            self.displace(at);
        }
    }

    /// Marks a stroke as moved. Its polygons are transformed again after all events of the frame.
    pub(super) fn displace(&mut self, at: u32) {
        if let Some(stroke) = self.strokes.get_mut(at as usize)
            && !std::mem::replace(&mut stroke.is_displaced, true)
        {
            self.looked_at += stroke.kept_polygons();
            self.to_place.push(at);
        }
    }

    /// Recomputes the boxes of all strokes whose position in the world has changed, and reports the groups that have
    /// moved as a whole.
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
        author: Author,
        id: GroupId,
        strokes: &[StrokeId],
        parent: Option<GroupId>,
        name: Option<&str>,
    ) -> Option<()> {
        self.parents.settle(&mut self.groups);
        let parent = match parent {
            Some(parent) => Some(self.groups.find(parent)?),
            None => None,
        };
        let is_own = author.is_sole() || id.author() == author;
        if !is_own && self.groups.find(id).is_none() {
            return None;
        }
        let hangs_elsewhere = |group: usize| self.groups.parent(group) != parent;
        if self.groups.find(id).is_some_and(|group| hangs_elsewhere(group) && !self.may_place(author, group))
        {
            return None;
        }
        let group = self.groups.find_or_make(id, parent)?;
        let members = self.named(author, strokes, |stroke| Some(stroke.group));
        let before = self.groups.parent(group);
        self.groups.set_parent(group, parent);
        members.iter().for_each(|named| self.set_group(named.stroke, Some(group)));
        let names = name.map(|name| {
            let name = Some(name.to_owned()).filter(|name| !name.is_empty());
            [self.groups.set_name(group, name.clone()), name]
        });
        let grouping = Grouping { group, members, new_parent: Some(parent), names };
        self.parents.add(self.log.next, group, before, parent);
        self.arrange(author, Arrangement::Group(Box::new(grouping)));
        Some(())
    }

    pub(super) fn set_group(&mut self, at: u32, to: Option<usize>) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let from = std::mem::replace(&mut stroke.group, to);
        if from != to {
            self.groups.change_member(at, stroke.layer, from, to);
            self.displace(at);
        }
    }

    pub(super) fn place(&mut self, author: Author, id: GroupId, to: Transform) -> Option<()> {
        if !self.closed_layers.is_empty() {
            self.parents.settle(&mut self.groups);
        }
        let group = self.groups.find(id).filter(|&group| self.may_place(author, group))?;
        let before = self.groups.transform(group);
        self.groups.place(group, to);
        self.arrange(author, Arrangement::Place { group, before, to });
        Some(())
    }
}
