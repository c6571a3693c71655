use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    ops::Range,
};

use glam::{Quat, Vec3};

use super::{
    authors::AuthorState,
    edit::Edit,
    group::Groups,
    history::{History, HistoryTotals, Lost},
    layers::LayerState,
    log::{Log, State},
    parents::GroupParents,
    stroke::Stroke,
    used::UsedNumbers,
};
use crate::{
    brush::{self, Surface},
    recording::{Author, Event, GroupId, Paint, Shading, StrokeId, Transform},
    stroke::{Drops, Pieces, Sample, StrokeBuilder, StrokeSettings, split_into_convex},
};
use osp::{
    math::{Aabb, unit},
    polygon::{Change, ConvexPolygon, Paged, PolygonId},
};

/// A stroke that became visible or invisible in this frame, its visibility before the frame, and its first unreported
/// polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unreported {
    pub(super) stroke: u32,
    pub(super) was_visible: bool,
    pub(super) first_new: u32,
}

static NOTHING: Stroke = Stroke::NONE;

/// Sizes of a scene, and counts of events and pieces without effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneCounts {
    /// Number of strokes that have begun, without polygons that are no part of a stroke.
    pub strokes: u64,
    /// Number of control points of strokes.
    pub points: u64,
    pub polygons: u64,
    /// Number of currently visible polygons.
    pub visible: u64,
    pub erased_strokes: u64,
    /// Number of events without effect: an unknown stroke or group, a stroke number used twice, an undo without edits.
    pub ignored_events: u64,
    /// Numbers of pieces that did not become polygons.
    pub drops: Drops,
}

/// Work counts of all events so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneWork {
    /// Number of groups visited, of members of moved groups, and of groupings whose effect was determined again.
    pub group_steps: u64,
    /// Number of polygons that were transformed again.
    pub displaced: u64,
    /// Number of all other visits: events, strokes that edits list, arrangements that undo and redo visit, and strokes
    /// of a layer. Polygons that become visible or invisible, or are transformed again, also count.
    pub looked_at: u64,
}

impl SceneWork {
    /// Sum of the counts. A unit takes about ten to several hundred nanoseconds.
    pub fn total(&self) -> u64 {
        self.group_steps + self.displaced + self.looked_at
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownView {
    /// Position of the eye, world space.
    pub eye: Vec3,
    /// Rotation from the camera, which looks along its -z, to world space.
    pub world_from_view: Quat,
    /// Distance from the eye to the point that the view looks at, metres.
    pub distance_m: f32,
}

/// A model that events change. See [`crate::scene`].
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The polygons, in the space of their stroke's points.
    pub(super) polygons: Paged<ConvexPolygon>,
    /// Surfaces of polygons. Polygons beyond its length are plain.
    pub(super) surfaces: Paged<Surface>,
    /// Boxes in world space, except for the polygons of `in_space`.
    pub(super) bounds: Paged<Aabb>,
    /// Index in `strokes` of the polygon's stroke.
    pub(super) owner: Paged<u32>,
    pub(super) strokes: Paged<Stroke, 256>,
    pub(super) stroke_by_id: HashMap<StrokeId, u32>,
    /// Numbers of strokes that were freed.
    pub(super) used: UsedNumbers,
    pub(super) groups: Groups,
    /// Whether groups that are placed repeatedly move as a whole; see [`Scene::keeping_groups_whole`].
    pub(super) keeps_groups_whole: bool,
    /// One bit per polygon, set if its box is in the space of its group instead of world space.
    pub(super) in_space: Vec<u64>,
    pub(super) layers: BTreeMap<u32, LayerState>,
    /// Layers that present owners have closed to all other authors.
    pub(super) closed_layers: BTreeMap<u32, Author>,
    pub(super) views: BTreeMap<u32, KnownView>,
    /// Arrangements that authors can undo or redo.
    pub(super) log: Log,
    /// The parents that the groupings of `log` set.
    pub(super) parents: GroupParents,
    pub(super) authors: BTreeMap<Author, AuthorState>,
    /// Authors with edits that the scene must still undo or redo, and an estimate of the work for them.
    pub(super) behind: BTreeSet<Author>,
    pub(super) behind_named: u64,
    /// Sizes of all histories together.
    pub(super) totals: HistoryTotals,
    /// Scratch memory: edits that a history has dropped.
    pub(super) lost: Lost,
    pub(super) counts: SceneCounts,
    pub(super) displaced: u64,
    pub(super) looked_at: u64,
    pub(super) freed: u64,
    /// Strokes that became unreachable after the last call of [`Scene::free_unreachable`], and strokes that became
    /// unreachable between the last two calls.
    pub(super) gone: [Vec<u32>; 2],
    /// Strokes whose polygons must be transformed again.
    pub(super) to_place: Vec<u32>,
    /// Scratch of [`Scene::place_displaced`].
    pub(super) moved_groups: Vec<usize>,
    /// Layers that were hidden or shown in this frame.
    pub(super) to_hide: BTreeSet<u32>,
    /// Strokes that became visible or invisible in this frame.
    pub(super) to_report: Vec<Unreported>,
    /// Scratch memory: the transforms of a stroke's groups.
    pub(super) chain: Vec<Transform>,
    /// Strokes to repaint after the frame's samples.
    pub(super) to_paint: Vec<u32>,
    /// Number of batches applied so far.
    pub(super) batches: u64,
    /// Length of the caller's list before the current batch.
    pub(super) batch_start: usize,
    /// Scratch memory of one call: the new polygons.
    pub(super) fresh: Pieces,
    pub(super) repainted: Vec<(u32, Surface)>,
}

impl Scene {
    /// Largest number of consecutive [`Event::Undo`]s that have an effect. The number is smaller if the edits list more
    /// than a million strokes in total.
    pub const UNDO_DEPTH: usize = History::DEPTH;

    pub fn new() -> Self {
        Self::default()
    }

    pub fn counts(&self) -> SceneCounts {
        self.counts
    }

    /// Number of polygon ids assigned so far. Every id is below this number.
    pub fn polygon_count(&self) -> usize {
        self.bounds.len()
    }

    /// The work of all events so far. The difference before and after a call is the work of that call. See also
    /// [`Scene::apply_within`].
    pub fn work(&self) -> SceneWork {
        SceneWork {
            group_steps: self.groups.steps + self.parents.steps,
            displaced: self.displaced,
            looked_at: self.looked_at + self.log.looked_at,
        }
    }

    /// Number of polygons freed so far.
    pub fn let_go_count(&self) -> u64 {
        self.freed
    }

    /// Whether all of these polygons were freed.
    pub fn are_freed(&self, ids: Range<usize>) -> bool {
        self.owner.all_released(ids)
    }

    /// The tight box of a polygon, world space; empty if the polygon was freed. Panics if the id was never assigned.
    pub fn bounds(&self, id: PolygonId) -> Aabb {
        match self.bounds.get(id.index()) {
            Some(_) if self.is_in_space(id) => self.world_bounds_of(id),
            Some(bounds) => *bounds,
            None => self.let_go_or_panic(id, Aabb::EMPTY),
        }
    }

    /// A polygon in world space; a point if the polygon was freed. Panics if the id was never assigned.
    pub fn polygon(&self, id: PolygonId) -> ConvexPolygon {
        let Some(local) = self.polygons.get(id.index()) else {
            return self.let_go_or_panic(id, ConvexPolygon::triangle(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO));
        };
        let stroke = self.stroke_of(id);
        if stroke.group.is_none() && stroke.offset == Vec3::ZERO {
            return *local;
        }
        local.map(|p| self.groups.to_world(stroke.group, p + stroke.offset))
    }

    /// Surface of a polygon. Panics if the id was never assigned.
    pub fn surface(&self, id: PolygonId) -> Surface {
        match self.surfaces.get(id.index()) {
            Some(&surface) => surface,
            None => self.let_go_or_panic(id, Surface::PLAIN),
        }
    }

    /// Surface of a polygon, with normals in world space. Panics if the id was never assigned.
    pub fn surface_in_world(&self, id: PolygonId) -> Surface {
        let surface = self.surface(id);
        match self.stroke_of(id).group {
            Some(group) if surface.is_smooth() => {
                surface.turned(|normal| self.groups.direction_to_world(Some(group), normal))
            }
            _ => surface,
        }
    }

    /// The stroke of a polygon; an invisible placeholder if the polygon was freed. Panics if the id was never assigned.
    pub fn stroke_of(&self, id: PolygonId) -> &Stroke {
        match self.owner.get(id.index()) {
            Some(&at) => &self.strokes[at as usize],
            None => self.let_go_or_panic(id, &NOTHING),
        }
    }

    fn let_go_or_panic<T>(&self, id: PolygonId, nothing: T) -> T {
        assert!(id.index() < self.polygon_count(), "polygon {}: there is none", id.0);
        nothing
    }

    /// Colour of a polygon: red, green, blue, sRGB, and the stroke's opacity. Panics if the id was never assigned.
    pub fn color(&self, id: PolygonId) -> (f32, f32, f32, f32) {
        let (r, g, b, opacity) = self.stroke_of(id).color;
        let [r, g, b] = self.surface(id).color().map_or([r, g, b], |own| own.map(|c| f32::from(c) / 255.0));
        (r, g, b, opacity)
    }

    /// Whether the polygon is visible now. Panics if the id was never assigned.
    pub fn is_visible(&self, id: PolygonId) -> bool {
        self.stroke_of(id).is_visible()
    }

    /// Whether the polygon has an area. Unused polygons of a stroke with a brush are points, and its ends may have
    /// width 0. Panics if the id was never assigned.
    pub fn has_area(&self, id: PolygonId) -> bool {
        self.stroke_of(id).brush().is_none() || self.polygon(id).area_vector() != Vec3::ZERO
    }

    /// All strokes in order of their beginnings. Iteration skips freed strokes, but the length includes them.
    pub fn strokes(&self) -> &Paged<Stroke, 256> {
        &self.strokes
    }

    /// Whether a stroke has or had this number. Such a number is never used again.
    pub fn is_used(&self, id: StrokeId) -> bool {
        self.stroke_by_id.contains_key(&id) || self.used.contains(id.0)
    }

    /// The stroke with this number, unless it was freed.
    pub fn stroke(&self, id: StrokeId) -> Option<&Stroke> {
        self.stroke_by_id.get(&id).map(|&at| &self.strokes[at as usize])
    }

    pub fn visible_ids(&self) -> impl Iterator<Item = PolygonId> + '_ {
        (0..self.polygon_count() as u32).map(PolygonId).filter(|&id| self.is_visible(id))
    }

    /// Whether the sole author of a recording without authors has an edit to undo.
    pub fn can_undo(&self) -> bool {
        self.can_undo_of(Author::SOLE)
    }

    /// Whether the sole author of a recording without authors has an edit to redo.
    pub fn can_redo(&self) -> bool {
        self.can_redo_of(Author::SOLE)
    }

    /// The views stored in the session, by their numbers.
    pub fn views(&self) -> &BTreeMap<u32, KnownView> {
        &self.views
    }

    /// Whether the next edit of the sole author of a recording without authors becomes part of the last edit's step.
    pub fn is_step_open(&self) -> bool {
        self.is_step_open_of(Author::SOLE)
    }

    /// Applies one event and appends its changes. An event without effect is counted in
    /// [`SceneCounts::ignored_events`]. Examples are an event about an unknown stroke, or an undo without edits.
    pub fn apply(&mut self, event: &Event, changes: &mut Vec<Change>) {
        self.apply_all([event], changes);
    }

    /// Applies the events of a frame and appends their changes. The cost grows with the number of events and of
    /// polygons that they change. A polygon that several events move is transformed once. A polygon that several events
    /// erase and restore is reported once. An edit that is undone and redone in turns is visited once. A polygon that several samples of a stroke change is usually reported once.
    pub fn apply_all<'e>(&mut self, events: impl IntoIterator<Item = &'e Event>, changes: &mut Vec<Change>) {
        self.begin_batch(changes);
        for event in events {
            self.take(event, changes);
        }
        self.end_batch(changes);
    }

    /// Applies events as one frame, like [`Scene::apply_all`], until they have cost `most` units. The cost is the sum of
    /// [`SceneWork::total`] and of the number of new polygons. Returns the number of applied events, at least one. The
    /// caller applies the others in later frames. The final model does not depend on this division. At the end of the
    /// frame, the polygons of moved groups are transformed again, which costs additional work.
    pub fn apply_within(&mut self, events: &[Event], most: u64, changes: &mut Vec<Change>) -> usize {
        let cost = |scene: &Self| scene.work().total() + scene.counts.polygons + scene.behind_named;
        let before = cost(self);
        self.begin_batch(changes);
        let mut taken = 0;
        while let Some(event) = events.get(taken)
            && (taken == 0 || cost(self) - before < most)
        {
            self.take(event, changes);
            taken += 1;
        }
        self.end_batch(changes);
        taken
    }

    fn begin_batch(&mut self, changes: &[Change]) {
        self.batch_start = changes.len();
        self.batches += 1;
    }

    fn end_batch(&mut self, changes: &mut Vec<Change>) {
        self.catch_up_all();
        self.hide_layers();
        self.parents.settle(&mut self.groups);
        self.paint(changes);
        self.note_visibility(changes);
        self.place_displaced(changes);
    }

    fn take(&mut self, event: &Event, changes: &mut Vec<Change>) {
        self.looked_at += 1;
        if let Event::Move { strokes, .. } | Event::Group { strokes, .. } | Event::Assign { strokes, .. } =
            event
        {
            self.looked_at += strokes.len() as u64;
        }
        let known = self.take_known(event, changes);
        if known.is_none() {
            self.counts.ignored_events += 1;
        }
    }

    fn take_known(&mut self, event: &Event, changes: &mut Vec<Change>) -> Option<()> {
        let author = event.author().unwrap_or_default();
        if let Event::Join { t, name, color, .. } = event {
            return self.join(*t, author, name, *color);
        }
        if !self.is_there(author) {
            return None;
        }
        match event {
            // These events depend on the groups of all authors.
            Event::Move { .. } | Event::Group { parent: Some(_), .. } => self.catch_up_all(),
            Event::Begin { .. }
            | Event::Polygon { .. }
            | Event::Erase { .. }
            | Event::Group { .. }
            | Event::Place { .. }
            | Event::Assign { .. } => match self.closed_layers.is_empty() {
                true => self.catch_up(author),
                // Whether the author may edit a stroke depends on its layer.
                false => self.catch_up_all(),
            },
            _ => {}
        }
        match event {
            Event::Join { .. } | Event::Head { .. } => Some(()),
            Event::Leave { t, .. } => self.leave(*t, author, changes),
            Event::Begin { stroke, tool, width, color, normal, thinnest, paint, .. } => {
                let settings = StrokeSettings {
                    brush: paint.as_ref().and_then(|paint| brush::find(&paint.brush)),
                    tool: *tool,
                    width_m: *width,
                    thinnest: *thinnest,
                    normal: *normal,
                    seed: paint.as_ref().map_or(0, |paint| paint.seed),
                    scale: paint.as_ref().map_or(1.0, |paint| paint.scale),
                };
                self.begin(author, *stroke, settings, *color, paint.as_deref())
            }
            Event::Point { stroke, p, q, pressure, .. } => {
                let sample = Sample { position: *p, orientation: unit(*q), pressure: *pressure };
                self.point(*stroke, sample, changes)
            }
            Event::End { stroke, .. } => self.end(*stroke, changes),
            Event::Erase { stroke, .. } => self.erase(author, *stroke),
            Event::Undo { .. } => self.turn(author, State::Undone),
            Event::Redo { .. } => self.turn(author, State::Active),
            Event::Move { strokes, by, .. } => self.move_strokes(author, strokes, *by),
            Event::Group { group, strokes, parent, name, .. } => {
                self.group(author, *group, strokes, *parent, name.as_deref())
            }
            Event::Place { group, to, .. } => self.place(author, *group, Transform { q: unit(to.q), ..*to }),
            Event::Step { edits, .. } => {
                self.author_mut(author).history.open_step(*edits);
                Some(())
            }
            Event::Layer { layer, name, hidden, locked, mine, .. } => {
                self.claim_layer(author, *layer, *mine)?;
                self.change_layer(*layer, name.as_deref(), *hidden, *locked)
            }
            Event::View { slot, p, q, distance, .. } => {
                self.views
                    .insert(*slot, KnownView { eye: *p, world_from_view: unit(*q), distance_m: *distance });
                Some(())
            }
            Event::Assign { layer, strokes, .. } => self.assign(author, *layer, strokes),
            Event::Polygon { stroke, vertices, shading, color, .. } => {
                self.add_polygon(author, *stroke, (vertices, shading.as_deref()), *color, changes)
            }
        }
    }

    fn begin(
        &mut self,
        author: Author,
        id: StrokeId,
        settings: StrokeSettings,
        color: (f32, f32, f32, f32),
        paint: Option<&Paint>,
    ) -> Option<()> {
        let layer = paint.map_or(0, |paint| paint.layer);
        if self.is_used(id) || !author.owns(id) || !self.may_touch(author, layer) {
            return None;
        }
        let at = self.add_stroke(author, Some(id), color);
        let stroke = &mut self.strokes[at as usize];
        stroke.builder = Some(Box::new(StrokeBuilder::new(settings)));
        stroke.brush = settings.brush;
        stroke.padding_m = settings.brush.map_or(0.0, |brush| brush.bounds_padding_m * settings.scale);
        if let Some(paint) = paint {
            stroke.layer = paint.layer;
            stroke.was_hidden = paint.hidden;
        }
        let state = self.layers.get(&stroke.layer);
        stroke.is_hidden = state.and_then(|state| state.hidden).unwrap_or(stroke.was_hidden);
        self.counts.strokes += 1;
        if !author.is_sole() {
            self.author_mut(author).open.insert(at);
        }
        self.record(author, Edit::Draw { stroke: at });
        Some(())
    }

    fn point(&mut self, id: StrokeId, sample: Sample, changes: &mut Vec<Change>) -> Option<()> {
        let at = *self.stroke_by_id.get(&id)?;
        let stroke = &mut self.strokes[at as usize];
        let builder = stroke.builder.as_mut()?;
        self.fresh.begin(stroke.used, stroke.fixed);
        builder.push(sample, &mut self.fresh, &mut self.counts.drops);
        stroke.points += 1;
        self.counts.points += 1;
        if stroke.brush.is_some() && !std::mem::replace(&mut stroke.is_unpainted, true) {
            self.to_paint.push(at);
        }
        self.assign_ids(at, changes);
        Some(())
    }

    pub(super) fn end(&mut self, id: StrokeId, changes: &mut Vec<Change>) -> Option<()> {
        let at = *self.stroke_by_id.get(&id)?;
        let stroke = &mut self.strokes[at as usize];
        let mut builder = stroke.builder.take()?;
        let author = stroke.author();
        if !author.is_sole() {
            self.author_mut(author).open.remove(&at);
        }
        let stroke = &self.strokes[at as usize];
        self.fresh.begin(stroke.used, stroke.fixed);
        builder.finish(&mut self.fresh, &mut self.counts.drops);
        self.assign_ids(at, changes);
        self.paint_stroke(at, &mut builder, changes);
        Some(())
    }

    fn add_polygon(
        &mut self,
        author: Author,
        id: Option<StrokeId>,
        (vertices, shading): (&[Vec3], Option<&Shading>),
        color: (f32, f32, f32, f32),
        changes: &mut Vec<Change>,
    ) -> Option<()> {
        let at = match id.and_then(|id| self.stroke_by_id.get(&id)) {
            Some(&at) => Some(at).filter(|&at| self.strokes[at as usize].author() == author)?,
            None if id.is_some_and(|id| self.is_used(id) || !author.owns(id)) => return None,
            None => {
                let at = self.add_stroke(author, id, color);
                self.counts.strokes += u64::from(id.is_some());
                self.record(author, Edit::Draw { stroke: at });
                at
            }
        };
        let stroke = &self.strokes[at as usize];
        self.fresh.begin(stroke.used, stroke.fixed);
        let drops = &mut self.counts.drops;
        self.fresh.push_all(drops, |out, drops| split_into_convex(vertices, out, drops));
        let bytes = |(r, g, b, _)| [r, g, b].map(|c: f32| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        if let Some(shading) = shading {
            self.fresh.shade(vertices, shading);
        }
        if bytes(color) != bytes(stroke.color) {
            self.fresh.paint(bytes(color));
        }
        self.assign_ids(at, changes);
        let stroke = &mut self.strokes[at as usize];
        stroke.fixed = stroke.used;
        Some(())
    }

    fn add_stroke(&mut self, author: Author, id: Option<StrokeId>, color: (f32, f32, f32, f32)) -> u32 {
        let at = self.strokes.len() as u32;
        if let Some(id) = id {
            self.stroke_by_id.insert(id, at);
        }
        let is_hidden = self.layers.get(&0).is_some_and(|state| state.hidden == Some(true));
        self.strokes.push(Stroke {
            undone: false,
            is_gone: false,
            is_hidden,
            author: author.0 as u16,
            ..Stroke::new(id, color)
        });
        at
    }

    /// The groups that a stroke is in, innermost first.
    pub fn groups_of(&self, stroke: &Stroke) -> Vec<GroupId> {
        let mut ids = Vec::new();
        let mut at = stroke.group;
        while let Some(group) = at {
            ids.push(self.groups.id(group));
            at = self.groups.parent(group);
        }
        ids
    }
}
