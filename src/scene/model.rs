use std::{
    collections::{BTreeSet, HashMap},
    ops::Range,
};

use glam::Vec3;

use super::{
    Paged,
    edit::Edit,
    group::{self, Group},
};
use crate::{
    math::{Aabb, unit},
    recording::{Event, GroupId, StrokeId, Transform},
    stroke::{Brush, ConvexPolygon, Drops, Sample, StrokeBuilder, split_into_convex},
};

/// A polygon's number, in order of arrival; never used twice in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct PolygonId(pub u32);

impl PolygonId {
    /// The number as a place in an array.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What an index has to do to follow the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The polygon is there now.
    Insert(PolygonId),
    /// The polygon is gone (it may come back by undo or redo, under the same id).
    Remove(PolygonId),
    /// The polygon has moved.
    Update(PolygonId),
}

/// A stroke and what has become of it.
#[derive(Clone, Debug)]
pub struct Stroke {
    id: Option<StrokeId>,
    color: (f32, f32, f32, f32),
    points: u32,
    /// Its polygons; more than one range where strokes overlap in time.
    polygons: Vec<Range<u32>>,
    erased: bool,
    undone: bool,
    /// Where [`Event::Move`] has brought it, world space.
    offset: Vec3,
    group: Option<usize>,
    /// While it is being drawn.
    builder: Option<Box<StrokeBuilder>>,
}

impl Stroke {
    /// Its number in the recording; none for a polygon that came without a stroke.
    pub fn id(&self) -> Option<StrokeId> {
        self.id
    }

    /// Red, green, blue, opacity, sRGB.
    pub fn color(&self) -> (f32, f32, f32, f32) {
        self.color
    }

    /// Whether its polygons are in the model now.
    pub fn is_visible(&self) -> bool {
        !self.erased && !self.undone
    }

    /// Whether it is still being drawn.
    pub fn is_open(&self) -> bool {
        self.builder.is_some()
    }

    /// Its control points so far.
    pub fn point_count(&self) -> u32 {
        self.points
    }

    /// Its polygons, in order of arrival.
    pub fn polygon_ids(&self) -> impl Iterator<Item = PolygonId> + '_ {
        self.polygons.iter().flat_map(|r| r.clone().map(PolygonId))
    }
}

/// How much there is in a scene, and what was left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneCounts {
    /// Strokes begun (without polygons that came alone).
    pub strokes: u64,
    /// Control points of strokes.
    pub points: u64,
    /// Polygons made, whether visible now or not.
    pub polygons: u64,
    /// Polygons in the model now.
    pub visible: u64,
    /// Strokes that are erased now.
    pub erased_strokes: u64,
    /// Events about a stroke or group that does not exist, a stroke number used twice, an undo of nothing.
    pub ignored_events: u64,
    /// Pieces that did not become polygons.
    pub drops: Drops,
}

/// A model that grows by events. See [`crate::scene`].
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// In the stroke's own space (which is the world's until it is moved or grouped).
    polygons: Paged<ConvexPolygon>,
    /// In world space.
    bounds: Paged<Aabb>,
    /// The place of its stroke in `strokes`.
    owner: Paged<u32>,
    strokes: Vec<Stroke>,
    stroke_by_id: HashMap<StrokeId, u32>,
    groups: Vec<Group>,
    group_by_id: HashMap<GroupId, usize>,
    done: Vec<Edit>,
    taken_back: Vec<Edit>,
    counts: SceneCounts,
    /// Filled and emptied within one call.
    fresh: Vec<ConvexPolygon>,
}

impl Scene {
    /// An empty scene.
    pub fn new() -> Self {
        Self::default()
    }

    /// What there is.
    pub fn counts(&self) -> SceneCounts {
        self.counts
    }

    /// Number of polygon ids given out so far; every id is below.
    pub fn polygon_count(&self) -> usize {
        self.bounds.len()
    }

    /// The tight box of a polygon, world space. Panics if there is no such id.
    pub fn bounds(&self, id: PolygonId) -> &Aabb {
        &self.bounds[id.index()]
    }

    /// A polygon in world space. Panics if there is no such id.
    pub fn polygon(&self, id: PolygonId) -> ConvexPolygon {
        let stroke = self.stroke_of(id);
        let local = self.polygons[id.index()];
        if stroke.group.is_none() && stroke.offset == Vec3::ZERO {
            return local;
        }
        local.map(|p| group::to_world(&self.groups, stroke.group, p) + stroke.offset)
    }

    /// The stroke of a polygon. Panics if there is no such id.
    pub fn stroke_of(&self, id: PolygonId) -> &Stroke {
        &self.strokes[self.owner[id.index()] as usize]
    }

    /// Whether the polygon is in the model now. Panics if there is no such id.
    pub fn is_visible(&self, id: PolygonId) -> bool {
        self.stroke_of(id).is_visible()
    }

    /// All strokes in order of their beginning.
    pub fn strokes(&self) -> &[Stroke] {
        &self.strokes
    }

    /// The stroke with this number.
    pub fn stroke(&self, id: StrokeId) -> Option<&Stroke> {
        self.stroke_by_id.get(&id).map(|&at| &self.strokes[at as usize])
    }

    /// The polygons that are in the model now, ascending.
    pub fn visible_ids(&self) -> impl Iterator<Item = PolygonId> + '_ {
        (0..self.polygon_count() as u32).map(PolygonId).filter(|&id| self.is_visible(id))
    }

    /// Whether there is something to undo.
    pub fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    /// Whether there is something to redo.
    pub fn can_redo(&self) -> bool {
        !self.taken_back.is_empty()
    }

    /// Takes one event and appends what it changed. Events that make no sense here (an unknown stroke, an undo of
    /// nothing) are counted in [`SceneCounts::ignored_events`] and change nothing.
    pub fn apply(&mut self, event: &Event, changes: &mut Vec<Change>) {
        let known = match event {
            Event::Head { .. } => Some(()),
            Event::Begin { stroke, tool, width, color, normal, thinnest, .. } => {
                let brush = Brush { tool: *tool, width_m: *width, thinnest: *thinnest, normal: *normal };
                self.begin(*stroke, brush, *color)
            }
            Event::Point { stroke, p, q, pressure, .. } => {
                let sample = Sample { position: *p, orientation: unit(*q), pressure: *pressure };
                self.point(*stroke, sample, changes)
            }
            Event::End { stroke, .. } => self.end(*stroke, changes),
            Event::Erase { stroke, .. } => self.erase(*stroke, changes),
            Event::Undo { .. } => self.undo(changes),
            Event::Redo { .. } => self.redo(changes),
            Event::Move { strokes, by, .. } => self.move_strokes(strokes, *by, changes),
            Event::Group { group, strokes, parent, .. } => self.group(*group, strokes, *parent, changes),
            Event::Place { group, to, .. } => self.place(*group, Transform { q: unit(to.q), ..*to }, changes),
            Event::Polygon { stroke, vertices, color, .. } => {
                self.add_polygon(*stroke, vertices, *color, changes)
            }
        };
        if known.is_none() {
            self.counts.ignored_events += 1;
        }
    }

    fn begin(&mut self, id: StrokeId, brush: Brush, color: (f32, f32, f32, f32)) -> Option<()> {
        if self.stroke_by_id.contains_key(&id) {
            return None;
        }
        let at = self.add_stroke(Some(id), color);
        self.strokes[at as usize].builder = Some(Box::new(StrokeBuilder::new(brush)));
        self.counts.strokes += 1;
        self.record(Edit::Draw { stroke: at });
        Some(())
    }

    fn point(&mut self, id: StrokeId, sample: Sample, changes: &mut Vec<Change>) -> Option<()> {
        let at = *self.stroke_by_id.get(&id)?;
        let stroke = &mut self.strokes[at as usize];
        stroke.builder.as_mut()?.push(sample, &mut self.fresh, &mut self.counts.drops);
        stroke.points += 1;
        self.counts.points += 1;
        self.file_fresh(at, changes);
        Some(())
    }

    fn end(&mut self, id: StrokeId, changes: &mut Vec<Change>) -> Option<()> {
        let at = *self.stroke_by_id.get(&id)?;
        let mut builder = self.strokes[at as usize].builder.take()?;
        builder.finish(&mut self.fresh, &mut self.counts.drops);
        self.file_fresh(at, changes);
        Some(())
    }

    fn add_polygon(
        &mut self,
        id: Option<StrokeId>,
        vertices: &[Vec3],
        color: (f32, f32, f32, f32),
        changes: &mut Vec<Change>,
    ) -> Option<()> {
        let at = match id.and_then(|id| self.stroke_by_id.get(&id)) {
            Some(&at) => at,
            None => {
                let at = self.add_stroke(id, color);
                self.counts.strokes += u64::from(id.is_some());
                self.record(Edit::Draw { stroke: at });
                at
            }
        };
        split_into_convex(vertices, &mut self.fresh, &mut self.counts.drops);
        self.file_fresh(at, changes);
        Some(())
    }

    fn add_stroke(&mut self, id: Option<StrokeId>, color: (f32, f32, f32, f32)) -> u32 {
        let at = self.strokes.len() as u32;
        if let Some(id) = id {
            self.stroke_by_id.insert(id, at);
        }
        self.strokes.push(Stroke {
            id,
            color,
            points: 0,
            polygons: Vec::new(),
            erased: false,
            undone: false,
            offset: Vec3::ZERO,
            group: None,
            builder: None,
        });
        at
    }

    /// Gives the fresh polygons their ids and files them under their stroke.
    fn file_fresh(&mut self, at: u32, changes: &mut Vec<Change>) {
        for local in self.fresh.drain(..) {
            let id = PolygonId(self.bounds.len() as u32);
            let stroke = &mut self.strokes[at as usize];
            match stroke.polygons.last_mut() {
                Some(range) if range.end == id.0 => range.end += 1,
                _ => stroke.polygons.push(id.0..id.0 + 1),
            }
            let world = local.map(|p| group::to_world(&self.groups, stroke.group, p) + stroke.offset);
            self.polygons.push(local);
            self.bounds.push(world.bounds());
            self.owner.push(at);
            self.counts.polygons += 1;
            if stroke.is_visible() {
                self.counts.visible += 1;
                changes.push(Change::Insert(id));
            }
        }
    }

    fn record(&mut self, edit: Edit) {
        self.done.push(edit);
        self.taken_back.clear();
    }

    fn erase(&mut self, id: StrokeId, changes: &mut Vec<Change>) -> Option<()> {
        let at = *self.stroke_by_id.get(&id)?;
        if self.strokes[at as usize].erased {
            return None;
        }
        self.set_erased(at, true, changes);
        self.record(Edit::Erase { stroke: at });
        Some(())
    }

    fn set_erased(&mut self, at: u32, erased: bool, changes: &mut Vec<Change>) {
        let was = self.strokes[at as usize].is_visible();
        self.strokes[at as usize].erased = erased;
        if erased {
            self.counts.erased_strokes += 1;
        } else {
            self.counts.erased_strokes -= 1;
        }
        self.follow_visibility(at, was, changes);
    }

    fn set_undone(&mut self, at: u32, undone: bool, changes: &mut Vec<Change>) {
        let was = self.strokes[at as usize].is_visible();
        self.strokes[at as usize].undone = undone;
        self.follow_visibility(at, was, changes);
    }

    fn follow_visibility(&mut self, at: u32, was: bool, changes: &mut Vec<Change>) {
        let stroke = &self.strokes[at as usize];
        let is = stroke.is_visible();
        if was == is {
            return;
        }
        let count = stroke.polygons.iter().map(|r| u64::from(r.end - r.start)).sum::<u64>();
        if is {
            self.counts.visible += count;
            changes.extend(stroke.polygon_ids().map(Change::Insert));
        } else {
            self.counts.visible -= count;
            changes.extend(stroke.polygon_ids().map(Change::Remove));
        }
    }

    fn move_strokes(&mut self, ids: &[StrokeId], by: Vec3, changes: &mut Vec<Change>) -> Option<()> {
        let mut before: Vec<(u32, Vec3)> =
            ids.iter().filter_map(|id| self.stroke_by_id.get(id)).map(|&at| (at, Vec3::ZERO)).collect();
        before.sort_unstable_by_key(|(at, _)| *at);
        before.dedup_by_key(|(at, _)| *at);
        if before.is_empty() {
            return None;
        }
        for (at, offset) in &mut before {
            *offset = self.strokes[*at as usize].offset;
            self.set_offset(*at, *offset + by, changes);
        }
        self.record(Edit::Move { before, by });
        Some(())
    }

    fn set_offset(&mut self, at: u32, offset: Vec3, changes: &mut Vec<Change>) {
        self.strokes[at as usize].offset = offset;
        self.refresh_bounds(at, changes);
    }

    /// Recomputes the boxes of a stroke whose place in the world has changed.
    fn refresh_bounds(&mut self, at: u32, changes: &mut Vec<Change>) {
        let stroke = &self.strokes[at as usize];
        for id in stroke.polygon_ids() {
            let local = &self.polygons[id.index()];
            let world = local.map(|p| group::to_world(&self.groups, stroke.group, p) + stroke.offset);
            self.bounds[id.index()] = world.bounds();
            if stroke.is_visible() {
                changes.push(Change::Update(id));
            }
        }
    }

    fn group(
        &mut self,
        id: GroupId,
        strokes: &[StrokeId],
        parent: Option<GroupId>,
        changes: &mut Vec<Change>,
    ) -> Option<()> {
        let parent = match parent {
            Some(parent) => Some(*self.group_by_id.get(&parent)?),
            None => None,
        };
        let height = self.group_by_id.get(&id).map_or(1, |&at| group::height(&self.groups, at));
        if group::depth(&self.groups, parent) + height > group::MAX_GROUP_DEPTH {
            return None;
        }
        let at = match self.group_by_id.get(&id) {
            Some(&at) => at,
            None => {
                let at = self.groups.len();
                self.groups.push(Group { id, parent: None, to: group::IDENTITY, strokes: BTreeSet::new() });
                self.group_by_id.insert(id, at);
                at
            }
        };
        if group::is_under(&self.groups, parent, at) {
            return None;
        }
        let parent_before = self.groups[at].parent;
        let mut before: Vec<(u32, Option<usize>)> =
            strokes.iter().filter_map(|id| self.stroke_by_id.get(id)).map(|&s| (s, None)).collect();
        before.sort_unstable_by_key(|(s, _)| *s);
        before.dedup_by_key(|(s, _)| *s);
        for (stroke, group_before) in &mut before {
            *group_before = self.strokes[*stroke as usize].group;
        }
        let edit = Edit::Group { before, group: at, parent_before, parent };
        self.replay_group(&edit, Direction::Forward, changes);
        self.record(edit);
        Some(())
    }

    fn place(&mut self, id: GroupId, to: Transform, changes: &mut Vec<Change>) -> Option<()> {
        let group = *self.group_by_id.get(&id)?;
        let before = self.groups[group].to;
        self.set_place(group, to, changes);
        self.record(Edit::Place { group, before, after: to });
        Some(())
    }

    fn set_place(&mut self, group: usize, to: Transform, changes: &mut Vec<Change>) {
        self.groups[group].to = to;
        self.refresh_group(group, changes);
    }

    /// Recomputes the boxes of every stroke under a group.
    fn refresh_group(&mut self, group: usize, changes: &mut Vec<Change>) {
        let under = (0..self.groups.len()).filter(|&g| group::is_under(&self.groups, Some(g), group));
        let strokes: Vec<u32> = under.flat_map(|g| self.groups[g].strokes.iter().copied()).collect();
        for at in strokes {
            self.refresh_bounds(at, changes);
        }
    }

    fn set_group(&mut self, at: u32, to: Option<usize>, changes: &mut Vec<Change>) {
        let from = std::mem::replace(&mut self.strokes[at as usize].group, to);
        if from == to {
            return;
        }
        if let Some(from) = from {
            self.groups[from].strokes.remove(&at);
        }
        if let Some(to) = to {
            self.groups[to].strokes.insert(at);
        }
        self.refresh_bounds(at, changes);
    }

    fn replay_group(&mut self, edit: &Edit, direction: Direction, changes: &mut Vec<Change>) {
        let Edit::Group { before, group, parent_before, parent } = edit else { return };
        let new_parent = if direction == Direction::Forward { parent } else { parent_before };
        if self.groups[*group].parent != *new_parent {
            self.groups[*group].parent = *new_parent;
            self.refresh_group(*group, changes);
        }
        for (stroke, group_before) in before {
            let to = if direction == Direction::Forward { Some(*group) } else { *group_before };
            self.set_group(*stroke, to, changes);
        }
    }

    fn undo(&mut self, changes: &mut Vec<Change>) -> Option<()> {
        let edit = self.done.pop()?;
        match &edit {
            Edit::Draw { stroke } => self.set_undone(*stroke, true, changes),
            Edit::Erase { stroke } => self.set_erased(*stroke, false, changes),
            Edit::Move { before, .. } => {
                for &(stroke, offset) in before {
                    self.set_offset(stroke, offset, changes);
                }
            }
            Edit::Group { .. } => self.replay_group(&edit, Direction::Backward, changes),
            Edit::Place { group, before, .. } => self.set_place(*group, *before, changes),
        }
        self.taken_back.push(edit);
        Some(())
    }

    fn redo(&mut self, changes: &mut Vec<Change>) -> Option<()> {
        let edit = self.taken_back.pop()?;
        match &edit {
            Edit::Draw { stroke } => self.set_undone(*stroke, false, changes),
            Edit::Erase { stroke } => self.set_erased(*stroke, true, changes),
            Edit::Move { before, by } => {
                for &(stroke, offset) in before {
                    self.set_offset(stroke, offset + *by, changes);
                }
            }
            Edit::Group { .. } => self.replay_group(&edit, Direction::Forward, changes),
            Edit::Place { group, after, .. } => self.set_place(*group, *after, changes),
        }
        self.done.push(edit);
        Some(())
    }

    /// The groups that a stroke is in, innermost first.
    pub fn groups_of(&self, stroke: &Stroke) -> Vec<GroupId> {
        let mut ids = Vec::new();
        let mut at = stroke.group;
        while let Some(g) = at {
            ids.push(self.groups[g].id);
            at = self.groups[g].parent;
        }
        ids
    }
}

/// Which way an edit is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    Forward,
    Backward,
}
