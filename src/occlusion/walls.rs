//! Walls of many small polygons. When a model is loaded, neighbouring polygons are joined across shared edges to occluders
//! of hundreds of polygons. A [`super::patch::Patch`] has at most a few.
//!
//! A wall grows from its largest polygon by the nearest neighbours, as long as its border stays one closed line that meets
//! no corner twice. Such a border is the sum of the outlines, so the proof in [`super::hull`] holds for any shape of the
//! wall. Each wall keeps the polygons that together hide most, seen along its normal.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap},
};

use glam::{DVec2, DVec3, Vec3};

use super::{
    ShadowVolume,
    hull::Hull,
    patch::{MOST_CORNERS, shadow_of_points},
    sketches::{Sketch, Sketches},
};
use crate::{
    polygon::{ConvexPolygon, PolygonId},
    view::ViewWindow,
};

/// Largest number of walls.
pub(super) const MOST_WALLS: usize = 256;

/// Largest number of walls that are grown. The best of them are kept.
const MOST_TRIES: usize = 1024;

/// Largest number of polygons of a wall.
const MOST_POLYGONS: usize = 512;

/// Least number of polygons of a wall. Smaller groups can be patches.
const LEAST_POLYGONS: usize = 8;

/// A neighbour does not join if the cosine between its normal and the wall's is below this.
const TURNED_COSINE: f32 = 0.5;

/// A wall hides at least this many times as much as the largest other candidate that has one of its polygons.
const WORTH_A_WALL: f64 = 2.0;

/// The hidden area of a wall is measured each time that its number of polygons has grown by this factor.
const MEASURED_AFTER: f64 = 1.1;

/// Many polygons that share edges bit for bit, as one occluder.
#[derive(Clone, Debug)]
struct Wall {
    ids: Box<[PolygonId]>,
    border: Box<[Vec3]>,
    /// The corners that are not on the border.
    inner: Box<[Vec3]>,
    area_vector: Vec3,
}

/// The walls of a model that was loaded.
#[derive(Clone, Debug, Default)]
pub(super) struct Walls {
    walls: Vec<Wall>,
    /// For each wall, its bounds.
    sketches: Sketches,
    /// Each polygon of a wall with the number of its wall, sorted by polygon.
    wall_of: Vec<(PolygonId, u32)>,
}

impl Walls {
    pub(super) fn sketches(&self) -> &Sketches {
        &self.sketches
    }

    /// Number of walls with polygons.
    pub(super) fn len(&self) -> usize {
        self.walls.iter().filter(|wall| !wall.ids.is_empty()).count()
    }

    /// The polygons of a wall; none if the wall was removed.
    pub(super) fn ids(&self, wall: usize) -> &[PolygonId] {
        &self.walls[wall].ids
    }

    /// Whether a polygon belonged to a wall when the walls were joined.
    pub(super) fn has(&self, id: PolygonId) -> bool {
        self.wall_of.binary_search_by_key(&id, |(id, _)| *id).is_ok()
    }

    /// Removes the wall that a removed or changed polygon belongs to, if it belongs to one.
    pub(super) fn take_out(&mut self, id: PolygonId) {
        if let Ok(at) = self.wall_of.binary_search_by_key(&id, |(id, _)| *id) {
            let wall = self.wall_of[at].1 as usize;
            self.walls[wall] = Wall {
                ids: Box::new([]),
                border: Box::new([]),
                inner: Box::new([]),
                area_vector: Vec3::ZERO,
            };
            self.sketches.set(wall, Sketch::FREE);
        }
    }

    /// The shadow of a wall as a whole, if it has one.
    pub(super) fn shadow(&self, wall: usize, window: &ViewWindow) -> Option<ShadowVolume> {
        let Wall { border, inner, area_vector, .. } = &self.walls[wall];
        shadow_of_points(border, inner, *area_vector, window)
    }

    /// Finds the walls among some polygons, and replaces the walls found before. `patch_m2` is, for each polygon, the area
    /// that its patch hides, or the area of the polygon if it has no patch.
    pub(super) fn build(&mut self, polygons: &[(PolygonId, ConvexPolygon)], patch_m2: &[f32]) {
        *self = Self::default();
        let mesh = Mesh::new(polygons);
        let mut seeds: Vec<(f32, u32)> =
            mesh.areas.iter().enumerate().map(|(i, area)| (area.length(), i as u32)).collect();
        seeds.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut taken = vec![false; polygons.len()];
        let mut tries = 0;
        for &(_, seed) in &seeds {
            if tries == MOST_TRIES || self.walls.len() == MOST_WALLS {
                break;
            }
            if taken[seed as usize] || !mesh.has_neighbour(seed) {
                continue;
            }
            tries += 1;
            let Some(region) = Region::grown(&mesh, seed, &taken, patch_m2) else { continue };
            region.members.iter().for_each(|&i| taken[i as usize] = true);
            let number = self.walls.len() as u32;
            self.wall_of.extend(region.members.iter().map(|&i| (polygons[i as usize].0, number)));
            self.push(region.wall(&mesh, polygons));
        }
        self.wall_of.sort_unstable();
    }

    fn push(&mut self, wall: Wall) {
        let points = || wall.border.iter().chain(&wall.inner).copied();
        let low = points().fold(Vec3::INFINITY, Vec3::min);
        let high = points().fold(Vec3::NEG_INFINITY, Vec3::max);
        let center = low * 0.5 + high * 0.5;
        let radius_m = points().map(|p| p.distance(center)).fold(0.0, f32::max);
        self.sketches.push(Sketch { center, radius_m, area_vector: wall.area_vector });
        self.walls.push(wall);
    }
}

/// Polygons with numbered corners.
struct Mesh {
    points: Vec<Vec3>,
    /// The corners of each triangle or quad; a triangle repeats its last corner.
    corners: Vec<[u32; 4]>,
    /// For each polygon, area times normal.
    areas: Vec<Vec3>,
    /// The polygons of each edge. The second is `NONE` if there is only one; both are equal if there are more than two.
    across: HashMap<(u32, u32), [u32; 2]>,
}

const NONE: u32 = u32::MAX;

impl Mesh {
    fn new(polygons: &[(PolygonId, ConvexPolygon)]) -> Self {
        let mut numbers: HashMap<[u32; 3], u32> = HashMap::with_capacity(polygons.len());
        let mut mesh = Self {
            points: Vec::new(),
            corners: Vec::with_capacity(polygons.len()),
            areas: Vec::with_capacity(polygons.len()),
            across: HashMap::with_capacity(2 * polygons.len()),
        };
        for (at, (_, polygon)) in polygons.iter().enumerate() {
            let vertices = polygon.vertices();
            let mut corners = [NONE; 4];
            for (corner, p) in corners.iter_mut().zip(vertices) {
                // +0 and -0 are the same coordinate.
                let key = (*p + Vec3::ZERO).to_array().map(f32::to_bits);
                *corner = *numbers.entry(key).or_insert_with(|| {
                    mesh.points.push(*p);
                    mesh.points.len() as u32 - 1
                });
            }
            if vertices.len() == 3 {
                corners[3] = corners[2];
            }
            mesh.corners.push(corners);
            mesh.areas.push(polygon.area_vector() * 0.5);
            let corners = &corners[..vertices.len()];
            // A polygon with a repeated corner has no neighbours.
            if (1..corners.len()).any(|i| corners[..i].contains(&corners[i])) {
                continue;
            }
            for (i, &from) in corners.iter().enumerate() {
                let to = corners[(i + 1) % corners.len()];
                let sides = mesh.across.entry((from.min(to), from.max(to))).or_insert([NONE, NONE]);
                *sides = match *sides {
                    [NONE, NONE] => [at as u32, NONE],
                    [first, NONE] if first != NONE => [first, at as u32],
                    // If a third polygon has the edge, no wall crosses the edge.
                    [first, _] => [first, first],
                };
            }
        }
        mesh
    }

    fn corners(&self, polygon: u32) -> &[u32] {
        let corners = &self.corners[polygon as usize];
        &corners[..if corners[3] == corners[2] { 3 } else { 4 }]
    }

    fn neighbour(&self, polygon: u32, from: u32, to: u32) -> Option<u32> {
        let [a, b] = *self.across.get(&(from.min(to), from.max(to)))?;
        let other = if a == polygon { b } else { a };
        (a != b && other != NONE).then_some(other)
    }

    fn has_neighbour(&self, polygon: u32) -> bool {
        let corners = self.corners(polygon);
        // A polygon that meets a corner twice is refused, because its border would not be a closed line around it.
        if (1..corners.len()).any(|i| corners[..i].contains(&corners[i])) {
            return false;
        }
        (0..corners.len())
            .any(|i| self.neighbour(polygon, corners[i], corners[(i + 1) % corners.len()]).is_some())
    }

    fn middle(&self, polygon: u32) -> Vec3 {
        let corners = self.corners(polygon);
        corners.iter().map(|&i| self.points[i as usize]).sum::<Vec3>() / corners.len() as f32
    }
}

/// Polygons that share edges, and the line around them.
struct Region {
    members: Vec<u32>,
    /// The numbers of the border's corners, in the direction in which the first polygon turns.
    border: Vec<u32>,
    inner: Vec<u32>,
    area_vector: Vec3,
}

impl Region {
    fn of(mesh: &Mesh, seed: u32) -> Self {
        let border = mesh.corners(seed).to_vec();
        Self { members: vec![seed], border, inner: Vec::new(), area_vector: mesh.areas[seed as usize] }
    }

    /// The region around the polygon `seed` with the largest occlusion; `None` if it is not worth a wall.
    fn grown(mesh: &Mesh, seed: u32, taken: &[bool], patch_m2: &[f32]) -> Option<Self> {
        let mut region = Self::of(mesh, seed);
        let home = mesh.middle(seed);
        let mut queue = BinaryHeap::new();
        let mut queued = HashMap::new();
        region.queue_around(mesh, seed, home, &mut queue, &mut queued);
        let mut largest_m2 = patch_m2[seed as usize];
        let (mut best, mut best_len, mut next) = (0.0, 0, LEAST_POLYGONS as f64);
        while let Some(Reverse((_, polygon))) = queue.pop() {
            let is_in = taken[polygon as usize] || region.members.len() >= MOST_POLYGONS;
            if is_in || !region.join(mesh, polygon) {
                // The polygon may fit after a later neighbour has joined.
                queued.remove(&polygon);
                continue;
            }
            region.queue_around(mesh, polygon, home, &mut queue, &mut queued);
            largest_m2 = largest_m2.max(patch_m2[polygon as usize]);
            if region.members.len() as f64 >= next {
                next = region.members.len() as f64 * MEASURED_AFTER;
                let area = region.hull_area(mesh);
                if area > best && area >= WORTH_A_WALL * f64::from(largest_m2) {
                    (best, best_len) = (area, region.members.len());
                }
            }
        }
        if best_len == 0 {
            return None;
        }
        // The region grows again in the same way, up to the best size.
        let mut kept = Self::of(mesh, seed);
        for &polygon in &region.members[1..best_len] {
            let joined = kept.join(mesh, polygon);
            debug_assert!(joined, "the same polygons in the same order");
        }
        Some(kept)
    }

    fn queue_around(
        &self,
        mesh: &Mesh,
        polygon: u32,
        home: Vec3,
        queue: &mut BinaryHeap<Reverse<(u32, u32)>>,
        queued: &mut HashMap<u32, ()>,
    ) {
        let corners = mesh.corners(polygon);
        for (i, &from) in corners.iter().enumerate() {
            let Some(other) = mesh.neighbour(polygon, from, corners[(i + 1) % corners.len()]) else {
                continue;
            };
            if queued.insert(other, ()).is_none() {
                // The bits of non-negative floats sort like their values.
                queue.push(Reverse((mesh.middle(other).distance_squared(home).to_bits(), other)));
            }
        }
    }

    /// Adds a polygon. Returns `false` unless the polygon shares exactly one line of edges with the border.
    fn join(&mut self, mesh: &Mesh, polygon: u32) -> bool {
        let n = self.border.len();
        let mut corners = [0; 4];
        let len = mesh.corners(polygon).len();
        corners[..len].copy_from_slice(mesh.corners(polygon));
        let corners = &mut corners[..len];
        let place = |corner: u32| self.border.iter().position(|b| *b == corner);
        // A shared edge determines the polygon's orientation.
        let find = |corners: &[u32]| {
            (0..len).find_map(|k| {
                let at = place(corners[(k + 1) % len])?;
                (self.border[(at + 1) % n] == corners[k]).then_some(k)
            })
        };
        let mut turned = false;
        let mut first = find(corners);
        if first.is_none() {
            corners.reverse();
            turned = true;
            first = find(corners);
        }
        let Some(first) = first else { return false };
        let area_vector = mesh.areas[polygon as usize] * if turned { -1.0 } else { 1.0 };
        let least = TURNED_COSINE * area_vector.length() * self.area_vector.length();
        let faces_the_same_way = area_vector.dot(self.area_vector) >= least;
        if !faces_the_same_way {
            return false;
        }
        let is_shared = |k: usize| {
            place(corners[(k + 1) % len]).is_some_and(|at| self.border[(at + 1) % n] == corners[k % len])
        };
        // Goes back to the first shared edge of the line, then along the line.
        let mut start = first;
        let mut steps = 0;
        while is_shared((start + len - 1) % len) && steps < len {
            start = (start + len - 1) % len;
            steps += 1;
        }
        let shared = (0..len).take_while(|i| is_shared((start + i) % len)).count();
        if shared >= len || n - shared + (len - shared) > MOST_CORNERS || n <= shared + 1 {
            return false;
        }
        // The polygon's other corners must not be on the border, either.
        let own = |i: usize| corners[(start + shared + 1 + i) % len];
        let own_count = len - shared - 1;
        if (0..own_count).any(|i| place(own(i)).is_some()) {
            return false;
        }
        // The border runs along the shared line against the polygon's direction.
        let Some(entry) = place(corners[(start + shared) % len]) else { return false };
        let mut border = Vec::with_capacity(n + len);
        border.extend((0..=n - shared).map(|i| self.border[(entry + shared + i) % n]));
        border.extend((0..own_count).map(own));
        self.inner.extend((1..shared).map(|i| corners[(start + i) % len]));
        self.border = border;
        self.members.push(polygon);
        self.area_vector += area_vector;
        true
    }

    /// Area that the region hides, seen along its normal, m^2.
    fn hull_area(&self, mesh: &Mesh) -> f64 {
        let normal = self.area_vector.as_dvec3().normalize_or(DVec3::Z);
        let x = normal.any_orthonormal_vector();
        let y = normal.cross(x);
        let flat = |&i: &u32| {
            let p = mesh.points[i as usize].as_dvec3();
            DVec2::new(x.dot(p), y.dot(p))
        };
        Hull::inside(&self.border.iter().map(flat).collect::<Vec<_>>()).area()
    }

    fn wall(&self, mesh: &Mesh, polygons: &[(PolygonId, ConvexPolygon)]) -> Wall {
        let points = |corners: &[u32]| corners.iter().map(|&i| mesh.points[i as usize]).collect();
        Wall {
            ids: self.members.iter().map(|&i| polygons[i as usize].0).collect(),
            border: points(&self.border),
            inner: points(&self.inner),
            area_vector: self.area_vector.normalize_or_zero() * self.hull_area(mesh) as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The squares of a grid of `columns` columns, 1 m wide, without the squares `missing`.
    fn squares(columns: u32, missing: &[u32]) -> Vec<(PolygonId, ConvexPolygon)> {
        let is_there = |i: &u32| !missing.contains(i);
        let square = |i: u32| {
            let at = |x: u32, y: u32| Vec3::new((i % columns + x) as f32, (i / columns + y) as f32, 0.0);
            (PolygonId(i), ConvexPolygon::quad([at(0, 0), at(1, 0), at(1, 1), at(0, 1)]))
        };
        (0..columns * columns).filter(is_there).map(square).collect()
    }

    /// Checks the invariants of [`Region`]'s border.
    fn check(region: &Region, mesh: &Mesh, context: &str) {
        let border = &region.border;
        assert!((1..border.len()).all(|i| !border[..i].contains(&border[i])), "{context}: {border:?}");
        let flat: Vec<_> = border.iter().map(|&i| mesh.points[i as usize].truncate().as_dvec2()).collect();
        // A line that is the sum of outlines winds around the sum of their areas.
        let area = crate::occlusion::hull::area(&flat);
        assert!((area - region.members.len() as f64).abs() < 1.0e-9, "{context}: {area} of {border:?}");
    }

    #[test]
    fn a_ring_of_squares_does_not_close() {
        // The squares join in order around the missing one.
        let polygons = squares(3, &[4]);
        let mesh = Mesh::new(&polygons);
        let mut region = Region::of(&mesh, 0);
        for next in [1, 2, 4, 7, 6, 5] {
            assert!(region.join(&mesh, next), "{next}");
            check(&region, &mesh, "an open ring");
        }
        // The square shares an edge with either end of the ring, and the border would meet a corner twice.
        assert!(!region.join(&mesh, 3));
        check(&region, &mesh, "the last one refused");
    }

    #[test]
    fn the_border_of_a_wall_with_holes_is_the_sum_of_outlines_and_meets_no_corner_twice() {
        let mut random = 1u32;
        let mut below = |end: u32| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) % end
        };
        let mut refused = 0;
        for round in 0..300 {
            let missing: Vec<u32> = (0..3 + below(9)).map(|_| below(49)).collect();
            let polygons = squares(7, &missing);
            let mesh = Mesh::new(&polygons);
            let count = polygons.len() as u32;
            let mut region = Region::of(&mesh, below(count));
            for _ in 0..6 * count {
                let next = below(count);
                if region.members.contains(&next) {
                    continue;
                }
                let is_in = region.join(&mesh, next);
                refused += u32::from(!is_in && mesh.corners(next).iter().any(|c| region.border.contains(c)));
                check(&region, &mesh, &format!("round {round}"));
            }
        }
        assert!(refused > 100, "{refused}");
    }
}
