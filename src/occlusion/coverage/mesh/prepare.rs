//! Prepares a mesh: welds corners, finds neighbours, and divides the triangles into batches.

use std::{collections::VecDeque, ops::Range};

use glam::{Vec3, swizzles::Vec3Swizzles};

use super::super::table::{NONE, Table, hash_of};
use crate::math::Aabb;

/// Largest number of triangles of a batch. Fewer give more borders, more give larger boxes.
const MOST_TRIANGLES: usize = 512;

/// Largest number of corners of a batch, rounded up to whole lanes.
pub(super) const MOST_CORNERS: usize = 2048;

const _: () = assert!(3 * MOST_TRIANGLES + LANES <= MOST_CORNERS);

/// The corners of a batch fill groups of this number.
pub(super) const LANES: usize = 8;

/// A triangle joins a batch if the cosine between its normal and the first triangle's is at least this. Then most batches
/// of a closed mesh face the eye wholly or not at all.
const LEAST_COSINE: f32 = 0.3;

/// A batch of fewer triangles than this takes neighbours of any direction.
const FEW: usize = 48;

/// A box inside takes twelve triangles, so it pays for meshes of more.
const LEAST_FOR_A_BOX: usize = 24;

/// The corners of a box in the order of [`Aabb::corners`], counterclockwise from outside.
pub(crate) const BOX_SIDES: [[u32; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Neighbouring triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Batch {
    pub(super) corners: Range<u32>,
    pub(super) triangles: Range<u32>,
    pub(super) inner: Range<u32>,
    pub(super) borders: Range<u32>,
    /// Number of borders of the mesh in the batches before.
    pub(super) first_open: u32,
    pub(super) bounds: Aabb,
}

/// An edge of two triangles of a batch, which pass it in opposite directions. Numbers are those in the batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inner {
    pub(super) ends: [u16; 2],
    pub(super) triangles: [u16; 2],
}

/// An edge at the border of a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Border {
    pub(super) ends: [u16; 2],
    pub(super) triangle: u16,
    /// The triangle on the other side, in its batch, and this batch. [`NONE`] at the border of the mesh.
    pub(super) mate: u16,
    pub(super) mate_batch: u32,
}

/// A triangle mesh in its own space, prepared to be drawn by batches. It takes about 30 bytes a
/// triangle if the triangles share vertices.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OccluderMesh {
    pub(super) batches: Vec<Batch>,
    /// The corners of each batch, by axis, with copies of the last corner up to a multiple of [`LANES`].
    pub(super) corners: [Vec<f32>; 3],
    pub(super) triangles: Vec<[u16; 3]>,
    pub(super) inner: Vec<Inner>,
    pub(super) borders: Vec<Border>,
    pub(super) bounds: Aabb,
    /// Whether the mesh has no border, so that from outside only the triangles that face the eye matter.
    pub(super) is_closed: bool,
    /// Whether the triangles are counterclockwise from outside; only for a closed mesh.
    pub(super) faces_out: bool,
    /// A box inside of a closed mesh.
    pub(super) inner_box: Option<InnerBox>,
}

/// A box inside of a closed mesh. From outside the mesh hides what the box hides.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InnerBox {
    pub(super) mesh: Box<OccluderMesh>,
    /// Largest distance of one of its sides from the mesh's box.
    pub(super) gap: f32,
}

impl OccluderMesh {
    /// Prepares a mesh; `None` if no triangle has an area. Corners at the same position are one corner. Each index must be
    /// less than the number of vertices. Vertices must be finite.
    pub(crate) fn new(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Option<Self> {
        let (positions, triangles) = weld(vertices, triangles);
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|corner| positions[corner as usize].as_dvec3());
            (b - a).cross(c - a)
        };
        if !triangles.iter().any(|t| area(t).length_squared() > 0.0) {
            return None;
        }
        let mates = mates_of(&triangles, positions.len());
        let mut faces = Faces { triangles, mates };
        faces.turn_alike();
        let batch_of = faces.batches(&positions);
        let mut mesh = faces.mesh(&positions, &batch_of);
        if mesh.is_closed && mesh.triangles.len() >= LEAST_FOR_A_BOX {
            mesh.inner_box = faces.inner_box(&positions, &mesh.bounds);
        }
        Some(mesh)
    }

    /// The borders of the mesh: its batch, the triangle in it, and the ends, in the direction of the triangle.
    pub(super) fn open(&self) -> impl Iterator<Item = (u32, u16, [Vec3; 2])> + '_ {
        self.batches.iter().zip(0..).flat_map(move |(batch, number)| {
            let borders = &self.borders[batch.borders.start as usize..batch.borders.end as usize];
            let open = borders.iter().filter(|border| border.mate_batch == NONE);
            open.map(move |border| (number, border.triangle, border.ends.map(|end| self.corner(batch, end))))
        })
    }

    fn corner(&self, batch: &Batch, corner: u16) -> Vec3 {
        let at = batch.corners.start as usize + usize::from(corner);
        Vec3::new(self.corners[0][at], self.corners[1][at], self.corners[2][at])
    }

    pub(crate) fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// The distinct positions, and the triangles of three distinct ones. A triangle without area stays, because it may close a
/// T-junction.
fn weld(vertices: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let hash = |p: Vec3| hash_of([p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), 0]);
    let mut table = Table::with_capacity(vertices.len().min(3 * triangles.len()));
    let mut positions: Vec<Vec3> = Vec::with_capacity(vertices.len());
    let mut corner_of = vec![NONE; vertices.len()];
    let mut kept = Vec::with_capacity(triangles.len());
    for triangle in triangles {
        let corners = triangle.map(|vertex| {
            let corner = &mut corner_of[vertex as usize];
            if *corner == NONE {
                let p = vertices[vertex as usize] + 0.0; // -0 is 0.
                *corner = table.find(hash(p), |other| positions[other as usize] == p).unwrap_or_else(|| {
                    positions.push(p);
                    table.insert(positions.len() as u32 - 1, |other| hash(positions[other as usize]));
                    positions.len() as u32 - 1
                });
            }
            *corner
        });
        let [a, b, c] = corners;
        if a != b && b != c && c != a {
            kept.push(corners);
        }
    }
    (positions, kept)
}

/// For each side of each triangle, the same side of another one (three times the triangle, plus the number of the side);
/// [`NONE`] for a border. Of more than two triangles at an edge, those are mates that pass it in opposite directions.
fn mates_of(triangles: &[[u32; 3]], corners: usize) -> Vec<u32> {
    let sides = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut starts = vec![0_u32; corners + 1];
    for [from, to] in sides() {
        starts[from.min(to) as usize + 1] += 1;
    }
    for i in 0..corners {
        starts[i + 1] += starts[i];
    }
    // For each lower end of an edge: the higher end, and the side.
    let mut at_end = vec![(0_u32, 0_u32); 3 * triangles.len()];
    let mut next = starts.clone();
    for (side, [from, to]) in sides().enumerate() {
        let place = &mut next[from.min(to) as usize];
        at_end[*place as usize] = (from.max(to), side as u32);
        *place += 1;
    }
    let mut mates = vec![NONE; 3 * triangles.len()];
    for i in 0..corners {
        let at_corner = &mut at_end[starts[i] as usize..starts[i + 1] as usize];
        at_corner.sort_unstable();
        for same in at_corner.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, a), (_, b)] = *same {
                (mates[a as usize], mates[b as usize]) = (b, a);
            } else {
                let is_up = |&&(_, side): &&(u32, u32)| {
                    let t = triangles[side as usize / 3];
                    t[side as usize % 3] == i as u32
                };
                let (up, down) = (same.iter().filter(is_up), same.iter().filter(|side| !is_up(side)));
                for ((_, a), (_, b)) in up.zip(down) {
                    (mates[*a as usize], mates[*b as usize]) = (*b, *a);
                }
            }
        }
    }
    mates
}

/// Triangles with their neighbours.
struct Faces {
    triangles: Vec<[u32; 3]>,
    mates: Vec<u32>,
}

impl Faces {
    fn ends(&self, side: usize) -> [u32; 2] {
        let t = self.triangles[side / 3];
        [t[side % 3], t[(side % 3 + 1) % 3]]
    }

    /// Whether a side and its mate pass their edge in opposite directions.
    fn is_alike(&self, side: usize) -> bool {
        self.ends(side)[0] == self.ends(self.mates[side] as usize)[1]
    }

    /// Turns triangles until neighbours pass their edge in opposite directions. Where that is impossible, as on a Möbius
    /// strip, they are neighbours no longer.
    fn turn_alike(&mut self) {
        let sides = 0..self.mates.len();
        if sides.clone().all(|side| self.mates[side] == NONE || self.is_alike(side)) {
            return;
        }
        let mut is_turned = vec![None; self.triangles.len()];
        let mut open = Vec::new();
        for first in 0..self.triangles.len() {
            if is_turned[first].is_some() {
                continue;
            }
            is_turned[first] = Some(false);
            open.push(first);
            while let Some(at) = open.pop() {
                for side in 3 * at..3 * at + 3 {
                    let mate = self.mates[side] as usize / 3;
                    if self.mates[side] != NONE && is_turned[mate].is_none() {
                        is_turned[mate] = is_turned[at].map(|turned| turned == self.is_alike(side));
                        open.push(mate);
                    }
                }
            }
        }
        for (at, is_turned) in is_turned.into_iter().enumerate() {
            if is_turned == Some(true) {
                self.triangles[at].swap(1, 2);
                // Sides 0, 1, 2 were ab, bc, ca, and are ac, cb, ba.
                self.mates.swap(3 * at, 3 * at + 2);
                for side in 3 * at..3 * at + 3 {
                    if let Some(back) = self.mates.get(self.mates[side] as usize).copied() {
                        debug_assert_eq!(back as usize / 3, at);
                        let mate = self.mates[side] as usize;
                        self.mates[mate] = side as u32;
                    }
                }
            }
        }
        for side in sides {
            if self.mates[side] != NONE && !self.is_alike(side) {
                let mate = std::mem::replace(&mut self.mates[side], NONE);
                self.mates[mate as usize] = NONE;
            }
        }
    }

    /// For each triangle, its batch.
    fn batches(&self, positions: &[Vec3]) -> Vec<u32> {
        let normal = |t: usize| {
            let [a, b, c] = self.triangles[t].map(|corner| positions[corner as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let mut batch_of = vec![NONE; self.triangles.len()];
        let (mut queue, mut apart, mut later) = (VecDeque::new(), Vec::new(), VecDeque::new());
        let (mut batch, mut unseen) = (0, 0);
        while let Some(first) = later.pop_front().or_else(|| {
            unseen += batch_of[unseen..].iter().position(|&batch| batch == NONE)?;
            Some(unseen)
        }) {
            let (up, mut count) = (normal(first), 0);
            queue.push_back(first);
            let mut takes_all = false;
            loop {
                while let Some(at) = queue.pop_front() {
                    if batch_of[at] != NONE {
                        continue;
                    }
                    let is_apart = |normal: Vec3| normal.dot(up) < LEAST_COSINE && normal != Vec3::ZERO;
                    if count == MOST_TRIANGLES || !takes_all && count > 0 && is_apart(normal(at)) {
                        apart.push(at);
                        continue;
                    }
                    batch_of[at] = batch;
                    count += 1;
                    let mates = self.mates[3 * at..3 * at + 3].iter().filter(|&&mate| mate != NONE);
                    queue.extend(mates.map(|&mate| mate as usize / 3));
                }
                takes_all = count < FEW && !apart.is_empty();
                if !takes_all {
                    break;
                }
                queue.extend(apart.drain(..));
            }
            later.extend(apart.drain(..));
            batch += u32::from(count > 0);
        }
        batch_of
    }

    /// A box around the middle of a closed mesh that no triangle enters. The middle must have a winding number, and then so
    /// has each point of the box. So each ray from outside meets the mesh before the box.
    fn inner_box(&self, positions: &[Vec3], bounds: &Aabb) -> Option<InnerBox> {
        let center = bounds.center();
        let corners = |t: &[u32; 3]| t.map(|corner| positions[corner as usize]);
        let parts: Vec<_> = self.triangles.iter().map(|t| Aabb::from_points(&corners(t))).collect();
        let (to_min, to_max) = (center - bounds.min, bounds.max - center);
        // The largest box of the shape of `bounds` that the boxes of the triangles do not enter, and a little less.
        let mut share = 1.0_f32;
        for part in &parts {
            let apart = ((part.min - center) / to_max).max((center - part.max) / to_min);
            share = share.min(apart.max_element());
        }
        let share = share * 0.999;
        let mut inner = Aabb::new(center - to_min * share, center + to_max * share);
        let enters = |part: &Aabb| part.min.cmplt(inner.max).all() && part.max.cmpgt(inner.min).all();
        if share <= 0.1 || parts.iter().any(enters) || !self.surrounds(positions, &parts, &inner) {
            return None;
        }
        // Each side moves outwards to the next triangle.
        for (axis, is_max) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, false), (axis, true)]) {
            let (mut low, mut high) = (bounds.min[axis], bounds.max[axis]);
            for part in &parts {
                let (before, behind) = (part.min.cmplt(inner.max), part.max.cmpgt(inner.min));
                if (0..3).all(|other| other == axis || before.test(other) && behind.test(other)) {
                    if before.test(axis) {
                        low = low.max(part.max[axis]);
                    } else {
                        high = high.min(part.min[axis]);
                    }
                }
            }
            if is_max {
                inner.max[axis] = high;
            } else {
                inner.min[axis] = low;
            }
        }
        let gaps = (inner.min - bounds.min).max(bounds.max - inner.max);
        let triangles: Vec<_> = BOX_SIDES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = OccluderMesh::new(&inner.corners(), &triangles)?;
        Some(InnerBox { mesh: Box::new(mesh), gap: gaps.max_element() })
    }

    /// Whether a point of a box that no triangle enters has a winding number. It counts the triangles on a ray along x. If
    /// the ray comes near an edge, the answer is no.
    fn surrounds(&self, positions: &[Vec3], parts: &[Aabb], inner: &Aabb) -> bool {
        let from = (inner.center() + inner.extent() * Vec3::new(0.0, 0.137, -0.071)).as_dvec3();
        let mut winding = 0;
        for (t, part) in self.triangles.iter().zip(parts) {
            let (min, max) = (part.min.as_dvec3(), part.max.as_dvec3());
            if max.x < from.x || min.y > from.y || max.y < from.y || min.z > from.z || max.z < from.z {
                continue;
            }
            let [a, b, c] = t.map(|corner| (positions[corner as usize].as_dvec3() - from).yz());
            let sides = [a.perp_dot(b), b.perp_dot(c), c.perp_dot(a)];
            let least = 1.0e-9 * (max - min).length_squared();
            if sides.iter().any(|side| side.abs() <= least) {
                return false;
            }
            winding += i32::from(sides.iter().all(|&side| side > 0.0));
            winding -= i32::from(sides.iter().all(|&side| side < 0.0));
        }
        winding != 0
    }

    fn mesh(&self, positions: &[Vec3], batch_of: &[u32]) -> OccluderMesh {
        let batches = batch_of.iter().max().map_or(0, |&last| last as usize + 1);
        let mut starts = vec![0_u32; batches + 1];
        batch_of.iter().for_each(|&batch| starts[batch as usize + 1] += 1);
        for i in 0..batches {
            starts[i + 1] += starts[i];
        }
        // The triangles by batch, and the place of each triangle in its batch.
        let mut order = vec![0_u32; batch_of.len()];
        let mut place = vec![0_u16; batch_of.len()];
        let mut next = starts.clone();
        for (t, &batch) in batch_of.iter().enumerate() {
            let at = &mut next[batch as usize];
            order[*at as usize] = t as u32;
            place[t] = (*at - starts[batch as usize]) as u16;
            *at += 1;
        }
        let mut mesh = OccluderMesh {
            batches: Vec::with_capacity(batches),
            corners: Default::default(),
            triangles: Vec::with_capacity(batch_of.len()),
            inner: Vec::with_capacity(2 * batch_of.len()),
            borders: Vec::new(),
            bounds: Aabb::EMPTY,
            is_closed: false,
            faces_out: false,
            inner_box: None,
        };
        let mut local = vec![(NONE, 0_u16); positions.len()];
        let (mut volume, mut open) = (0.0, 0);
        for batch in 0..batches {
            let first_open = open;
            let own = &order[starts[batch] as usize..starts[batch + 1] as usize];
            let first = mesh.corners[0].len();
            let (inner, borders) = (mesh.inner.len() as u32, mesh.borders.len() as u32);
            let mut bounds = Aabb::EMPTY;
            for &t in own {
                let corners = self.triangles[t as usize];
                let [a, b, c] = corners.map(|corner| (positions[corner as usize] - positions[0]).as_dvec3());
                volume += a.cross(b).dot(c);
                mesh.triangles.push(corners.map(|corner| {
                    let (of_batch, number) = &mut local[corner as usize];
                    if *of_batch != batch as u32 {
                        let p = positions[corner as usize];
                        (*of_batch, *number) = (batch as u32, (mesh.corners[0].len() - first) as u16);
                        mesh.corners.iter_mut().zip(p.to_array()).for_each(|(axis, v)| axis.push(v));
                        bounds = bounds.union(&Aabb::new(p, p));
                    }
                    *number
                }));
            }
            for &t in own {
                for side in 3 * t as usize..3 * t as usize + 3 {
                    let ends = self.ends(side).map(|corner| local[corner as usize].1);
                    let triangle = place[t as usize];
                    let mate = self.mates[side];
                    if mate == NONE {
                        open += 1;
                        mesh.borders.push(Border { ends, triangle, mate: 0, mate_batch: NONE });
                        continue;
                    }
                    let (mate_triangle, mate_batch) = (mate as usize / 3, batch_of[mate as usize / 3]);
                    let mate_place = place[mate_triangle];
                    if mate_batch != batch as u32 {
                        mesh.borders.push(Border { ends, triangle, mate: mate_place, mate_batch });
                    } else if side < mate as usize {
                        mesh.inner.push(Inner { ends, triangles: [triangle, mate_place] });
                    }
                }
            }
            while !mesh.corners[0].len().is_multiple_of(LANES) {
                mesh.corners.iter_mut().for_each(|axis| axis.push(axis.last().copied().unwrap_or(0.0)));
            }
            mesh.bounds = mesh.bounds.union(&bounds);
            mesh.batches.push(Batch {
                corners: first as u32..mesh.corners[0].len() as u32,
                triangles: starts[batch]..starts[batch + 1],
                inner: inner..mesh.inner.len() as u32,
                borders: borders..mesh.borders.len() as u32,
                first_open,
                bounds,
            });
        }
        (mesh.is_closed, mesh.faces_out) = (open == 0, volume > 0.0);
        mesh
    }
}
