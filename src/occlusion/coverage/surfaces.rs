//! Stores occluders by the corners and edges that they share, and follows changes of the model.

use glam::Vec3;

use super::table::{NONE, Table, hash_of};
use crate::polygon::{ConvexPolygon, Geometry, PolygonId};

/// Largest number of corners of a polygon.
pub(super) const SIDES: usize = 4;

/// Largest number of polygons that are linked at one edge. Further polygons are not linked there, as if the
/// edge were a border.
const MOST_AT_AN_EDGE: usize = 16;

/// An edge of a polygon: the polygon's number times four, plus the number of the corner at which the edge begins.
pub(super) type EdgeCode = u32;

/// A polygon that may occlude.
#[derive(Clone, Copy, Debug)]
struct Face {
    /// Numbers of the polygon's corners. The last corner of a triangle is [`NONE`]. If the polygon is no
    /// occluder, all corners are [`NONE`].
    corners: [u32; SIDES],
    /// For each edge, the same edge of another polygon. All polygons at one edge form a ring.
    next: [EdgeCode; SIDES],
}

impl Face {
    /// The numbers of the polygon's corners; none if the polygon is no occluder.
    #[inline]
    fn corners(&self) -> &[u32] {
        let corners = &self.corners;
        let count = if corners[0] == NONE { 0 } else { SIDES - usize::from(corners[SIDES - 1] == NONE) };
        &corners[..count]
    }
}

fn corner_hash(p: Vec3) -> u64 {
    hash_of([p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), 0])
}

const NO_FACE: Face = Face { corners: [NONE; SIDES], next: [NONE; SIDES] };

/// The occluders of a model as surfaces: polygons whose corners have the same coordinates bit for bit share these
/// corners, and the edges between them. A polygon takes 32 bytes, a corner about 40.
#[derive(Clone, Debug, Default)]
pub(in crate::occlusion) struct Surfaces {
    faces: Vec<Face>,
    corners: Vec<Vec3>,
    /// Number of polygons that have a corner; 0 for a free corner.
    uses: Vec<u32>,
    free: Vec<u32>,
    corner_table: Table,
    /// A hash table of edges, with one edge of each ring.
    edge_table: Table,
}

impl Surfaces {
    /// No surfaces, with room for this many polygons.
    pub(in crate::occlusion) fn with_capacity(polygons: usize) -> Self {
        Self {
            faces: Vec::with_capacity(polygons),
            corners: Vec::with_capacity(2 * polygons),
            uses: Vec::with_capacity(2 * polygons),
            free: Vec::with_capacity(2 * polygons),
            corner_table: Table::with_capacity(2 * polygons),
            edge_table: Table::with_capacity(3 * polygons),
        }
    }

    /// Reads a changed polygon. Returns whether it is an occluder with its whole area. A polygon of a group that moves as a
    /// whole is no occluder.
    pub(in crate::occlusion) fn set(&mut self, geometry: &dyn Geometry, id: PolygonId) -> bool {
        let is_fixed = id.0 < PolygonId::LIMIT && geometry.is_present(id) && geometry.space(id).is_none();
        let polygon = if is_fixed { geometry.occluder(id) } else { None };
        let polygon = polygon.filter(|polygon| polygon.vertices().iter().all(|p| p.is_finite()));
        let Some(polygon) = polygon else {
            self.take_out(id);
            return false;
        };
        if !self.is_same(id, &polygon) {
            self.take_out(id);
            self.put_in(id, &polygon);
        }
        geometry.polygon(id) == Some(polygon)
    }

    fn is_same(&self, id: PolygonId, polygon: &ConvexPolygon) -> bool {
        let corners = self.corners_of(id);
        let vertices = polygon.vertices();
        corners.len() == vertices.len()
            && corners.iter().zip(vertices).all(|(&corner, p)| self.position(corner) == *p)
    }

    fn put_in(&mut self, id: PolygonId, polygon: &ConvexPolygon) {
        if self.faces.len() <= id.index() {
            self.faces.resize(id.index() + 1, NO_FACE);
        }
        let mut corners = [NONE; SIDES];
        for (corner, p) in corners.iter_mut().zip(polygon.vertices()) {
            *corner = self.corner_at(*p);
        }
        self.faces[id.index()] = Face { corners, ..NO_FACE };
        for edge in 0..polygon.vertices().len() {
            self.link(id.0 * SIDES as u32 + edge as u32);
        }
    }

    fn corner_at(&mut self, p: Vec3) -> u32 {
        let p = p + 0.0; // -0 is 0.
        let positions = &self.corners;
        let corner = match self.corner_table.find(corner_hash(p), |corner| positions[corner as usize] == p) {
            Some(corner) => corner,
            None => {
                let corner = self.free.pop().unwrap_or(self.corners.len() as u32);
                if corner as usize == self.corners.len() {
                    self.corners.push(p);
                    self.uses.push(0);
                }
                self.corners[corner as usize] = p;
                let positions = &self.corners;
                self.corner_table.insert(corner, |corner| corner_hash(positions[corner as usize]));
                corner
            }
        };
        self.uses[corner as usize] += 1;
        corner
    }

    /// Both ends of an edge, the lower number first.
    fn ends(&self, edge: EdgeCode) -> [u32; 2] {
        let [from, to] = self.directed(edge);
        [from.min(to), from.max(to)]
    }

    /// Both ends of an edge, in the direction in which its polygon passes them.
    pub(super) fn directed(&self, edge: EdgeCode) -> [u32; 2] {
        let (corners, at) = (self.faces[edge as usize / SIDES].corners(), edge as usize % SIDES);
        [corners[at], corners[if at + 1 == corners.len() { 0 } else { at + 1 }]]
    }

    fn edge_hash(&self, edge: EdgeCode) -> u64 {
        let [low, high] = self.ends(edge);
        hash_of([low, high, 0, 0])
    }

    fn next(&self, edge: EdgeCode) -> EdgeCode {
        self.faces[edge as usize / SIDES].next[edge as usize % SIDES]
    }

    fn set_next(&mut self, edge: EdgeCode, next: EdgeCode) {
        self.faces[edge as usize / SIDES].next[edge as usize % SIDES] = next;
    }

    /// The same edge of other polygons.
    #[inline]
    pub(super) fn mates(&self, edge: EdgeCode) -> impl Iterator<Item = EdgeCode> + '_ {
        let next = move |&at: &EdgeCode| Some(self.next(at)).filter(|&next| next != edge);
        std::iter::successors(next(&edge), next)
    }

    fn link(&mut self, edge: EdgeCode) {
        let ends = self.ends(edge);
        self.set_next(edge, edge);
        match self.edge_table.find(self.edge_hash(edge), |other| self.ends(other) == ends) {
            Some(first) if self.mates(first).nth(MOST_AT_AN_EDGE - 2).is_none() => {
                let next = self.next(first);
                self.set_next(edge, next);
                self.set_next(first, edge);
            }
            Some(_) => {}
            None => {
                let mut table = std::mem::take(&mut self.edge_table);
                table.insert(edge, |edge| self.edge_hash(edge));
                self.edge_table = table;
            }
        }
    }

    fn unlink(&mut self, edge: EdgeCode) {
        let next = self.next(edge);
        let before = self.mates(edge).last();
        if let Some(before) = before {
            self.set_next(before, next);
        }
        let mut table = std::mem::take(&mut self.edge_table);
        match before {
            Some(_) => table.replace(edge, next, self.edge_hash(edge)),
            None => table.remove(edge, |edge| self.edge_hash(edge)),
        }
        self.edge_table = table;
    }

    /// Removes a polygon, if present.
    pub(in crate::occlusion) fn take_out(&mut self, id: PolygonId) {
        let count = self.corners_of(id).len();
        if count == 0 {
            return;
        }
        for edge in 0..count {
            self.unlink(id.0 * SIDES as u32 + edge as u32);
        }
        let corners = std::mem::replace(&mut self.faces[id.index()], NO_FACE).corners;
        for corner in &corners[..count] {
            let at = *corner as usize;
            self.uses[at] -= 1;
            if self.uses[at] == 0 {
                let positions = &self.corners;
                self.corner_table.remove(*corner, |corner| corner_hash(positions[corner as usize]));
                self.free.push(*corner);
            }
        }
    }

    /// The corners of a polygon; none if it is no occluder.
    #[inline]
    pub(super) fn corners_of(&self, id: PolygonId) -> &[u32] {
        self.faces.get(id.index()).map_or(&[], Face::corners)
    }

    /// Whether a polygon may occlude.
    pub(in crate::occlusion) fn is_occluder(&self, id: PolygonId) -> bool {
        !self.corners_of(id).is_empty()
    }

    /// Approximate solid angle of a polygon, steradians; infinite if the eye is very near.
    pub(in crate::occlusion) fn solid_angle(&self, id: PolygonId, eye: Vec3) -> f32 {
        let corners = self.corners_of(id);
        let [Some(&a), Some(&b), Some(&c)] = [0, 1, 2].map(|i| corners.get(i)) else { return 0.0 };
        let [a, b, c] = [a, b, c].map(|corner| self.position(corner) - eye);
        let sides = if corners.len() == 3 { 0.5 } else { 1.0 };
        // Half the triple product over the cube of the distance, twice for a quad.
        let away = (a + b + c).length() / 3.0;
        let nearest = a.length_squared().min(b.length_squared()).min(c.length_squared());
        let size = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        if nearest < size { f32::INFINITY } else { sides * a.cross(b).dot(c).abs() / (away * away * away) }
    }

    /// Position of a corner, world space.
    #[inline]
    pub(super) fn position(&self, corner: u32) -> Vec3 {
        self.corners[corner as usize]
    }

    /// One more than the highest number of a corner.
    pub(super) fn corner_end(&self) -> usize {
        self.corners.len()
    }

    /// One more than the highest number of a polygon.
    pub(super) fn face_end(&self) -> usize {
        self.faces.len()
    }
}
