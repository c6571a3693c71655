//! Converts the pieces of stroke builders to new, replaced and repainted polygons of the scene.

use super::Scene;
use crate::{
    brush::Surface,
    stroke::{Piece, StrokeBuilder},
};
use osp::{
    math::Aabb,
    polygon::{Change, ConvexPolygon, PolygonId},
};

/// A redundant change is searched among this number of the latest changes of a batch. A sample of a ribbon replaces
/// about eight polygons.
const RECENT: usize = 64;

/// Whether an earlier change in `covered` makes `change` redundant. Receivers read the polygon's state at the end of
/// the batch.
fn is_covered(change: Change, covered: &[Change]) -> bool {
    let is_covered_by = |earlier: &Change| match (change, *earlier) {
        (Change::Update(id), Change::Insert(other) | Change::Update(other)) => id == other,
        (Change::Repaint(id), Change::Insert(other) | Change::Update(other) | Change::Repaint(other)) => {
            id == other
        }
        _ => false,
    };
    covered.iter().rev().any(is_covered_by)
}

impl Scene {
    /// For strokes with new samples in this frame, rebuilds and repaints the polygons that depend on the length of the
    /// whole stroke.
    pub(super) fn paint(&mut self, changes: &mut Vec<Change>) {
        let mut to_paint = std::mem::take(&mut self.to_paint);
        for at in to_paint.drain(..) {
            let Some(stroke) = self.strokes.get_mut(at as usize) else { continue };
            stroke.is_unpainted = false;
            if let Some(mut builder) = stroke.builder.take() {
                self.fresh.begin(stroke.used, stroke.fixed);
                builder.settle(&mut self.fresh, &mut self.counts.drops);
                self.assign_ids(at, changes);
                self.paint_stroke(at, &mut builder, changes);
                self.strokes[at as usize].builder = Some(builder);
            }
        }
        self.to_paint = to_paint;
    }

    pub(super) fn paint_stroke(&mut self, at: u32, builder: &mut StrokeBuilder, changes: &mut Vec<Change>) {
        let mut repainted = std::mem::take(&mut self.repainted);
        builder.repaint(&mut repainted);
        for (place, surface) in repainted.drain(..) {
            let Some(id) = self.strokes[at as usize].id_at(place) else { continue };
            if self.surface(id) != surface {
                self.set_surface(id, surface);
                self.note_replaced(at, Change::Repaint(id), changes);
            }
        }
        self.repainted = repainted;
    }

    /// Replaces the polygons of a stroke that its last sample has changed, and assigns ids to new polygons.
    pub(super) fn assign_ids(&mut self, at: u32, changes: &mut Vec<Change>) {
        let fresh = std::mem::take(&mut self.fresh);
        let used_before = std::mem::replace(&mut self.strokes[at as usize].used, fresh.len());
        let count = self.strokes[at as usize].polygons.iter().map(|r| r.end - r.start).sum::<u32>();
        for (place, piece) in (fresh.kept()..).zip(fresh.fresh()) {
            if place < count {
                self.replace(at, place, piece, changes);
            } else {
                self.add_piece(at, piece, changes);
            }
        }
        if fresh.len() < used_before
            && let Some(point) =
                self.strokes[at as usize].id_at(0).map(|id| self.polygons[id.index()].vertices()[0])
        {
            let shrunk =
                Piece { polygon: ConvexPolygon::triangle(point, point, point), surface: Surface::PLAIN };
            for place in fresh.len()..used_before {
                self.replace(at, place, &shrunk, changes);
            }
        }
        self.fresh = fresh;
    }

    fn replace(&mut self, at: u32, place: u32, piece: &Piece, changes: &mut Vec<Change>) {
        let stroke = &self.strokes[at as usize];
        let Some(id) = stroke.id_at(place) else { return };
        let is_same = self.polygons[id.index()] == piece.polygon;
        if is_same && self.surface(id) == piece.surface {
            return;
        }
        self.polygons[id.index()] = piece.polygon;
        self.set_surface(id, piece.surface);
        let bounds = self.kept_bounds(at, piece);
        self.keep_bounds(id, self.strokes[at as usize].group, bounds);
        self.groups.note_changed(self.strokes[at as usize].group);
        self.note_replaced(at, if is_same { Change::Repaint(id) } else { Change::Update(id) }, changes);
    }

    /// The box of a piece of a stroke. It is in the space of the stroke's group if the group moves as a whole, else in
    /// world space.
    fn kept_bounds(&self, at: u32, piece: &Piece) -> Aabb {
        let stroke = &self.strokes[at as usize];
        let group = stroke.group.filter(|_| !self.groups.is_whole(stroke.group));
        let placed = piece.polygon.map(|p| self.groups.to_world(group, p + stroke.offset));
        stroke.bounds_of(&placed, &piece.surface, self.groups.scale_to_world(group))
    }

    /// Reports a replaced polygon. If the stroke became visible or invisible in this frame, its polygons are reported
    /// together at the end of the frame.
    fn note_replaced(&mut self, at: u32, change: Change, changes: &mut Vec<Change>) {
        let stroke = &mut self.strokes[at as usize];
        if stroke.is_unreported {
            self.displace(at);
        } else if stroke.is_visible() {
            let covered = &changes[self.batch_start..];
            if !is_covered(change, &covered[covered.len().saturating_sub(RECENT)..]) {
                changes.push(change);
            }
        } else {
            stroke.was_displaced_unseen = true;
        }
    }

    fn add_piece(&mut self, at: u32, piece: &Piece, changes: &mut Vec<Change>) {
        let id = PolygonId(self.bounds.len() as u32);
        let bounds = self.kept_bounds(at, piece);
        let stroke = &mut self.strokes[at as usize];
        self.groups.note_changed(stroke.group);
        match stroke.polygons.last_mut() {
            Some(range) if range.end == id.0 => range.end += 1,
            _ => stroke.polygons.push(id.0..id.0 + 1),
        }
        self.polygons.push(piece.polygon);
        let group = stroke.group;
        self.keep_bounds(id, group, bounds);
        self.owner.push(at);
        let stroke = &self.strokes[at as usize];
        self.counts.polygons += 1;
        if stroke.is_visible() {
            self.counts.visible += 1;
            if !stroke.is_unreported {
                changes.push(Change::Insert(id));
            }
        }
        if piece.surface != Surface::PLAIN {
            self.set_surface(id, piece.surface);
        }
    }

    fn set_surface(&mut self, id: PolygonId, surface: Surface) {
        if id.index() >= self.surfaces.len() {
            if surface == Surface::PLAIN {
                return;
            }
            while self.surfaces.len() <= id.index() {
                self.surfaces.push(Surface::PLAIN);
            }
        }
        if let Some(painted) = self.surfaces.get_mut(id.index()) {
            *painted = surface;
        }
    }
}
