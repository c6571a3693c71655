//! The index behind the class `Osp`.

use osp::{
    glam::{DVec3, Vec3},
    index::{IndexConfig, IndexError, Osp, SpatialIndex},
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
};
use wasm_bindgen::prelude::*;

use crate::{
    refusal::{Outcome, refused},
    room,
    scratch::{Scratch, round_down, round_up},
    views::{Camera, frustum_of_planes},
};

/// Memory that is requested per box before a batch is applied. If this is too small, the module may run out of memory
/// in the middle of a batch, which ends the program. If it is too large, the module keeps more memory than necessary.
const BOX_BYTES: usize = 80;

/// Largest memory that an index reserves per box of its capacity. It has the same risks as [`BOX_BYTES`].
const ROOM_BYTES: usize = 160;

/// Number of ids that a query may write behind its result.
const BEHIND: usize = 1024;

/// Memory for each of the nearest boxes during the search.
const NEAREST_BYTES: usize = 64;

/// An index of boxes. JavaScript writes arguments into the index's memory and reads the results there.
#[wasm_bindgen]
pub struct Index {
    osp: Osp,
    is_committed: bool,
    /// Number of boxes that were added or moved since the last commit.
    pending: usize,
    /// [`room::asked`] at the last request for memory by this index.
    asked: u64,
    /// Number of boxes for which there was memory at that request.
    room: usize,
    /// The highest id for which there was memory.
    highest: u32,
    /// A box around all boxes that were added since the index was empty.
    extent: Aabb,
    scratch: Scratch,
    list: Vec<PolygonId>,
    nearest: Vec<(PolygonId, f32)>,
    /// The ids of a call, to find ids that are given twice.
    given: VisibleBlocks,
}

impl std::fmt::Debug for Index {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Index").field("len", &self.osp.len()).finish_non_exhaustive()
    }
}

#[wasm_bindgen]
impl Index {
    /// Creates an empty index. The hints are those of [`IndexConfig`].
    #[wasm_bindgen(constructor)]
    pub fn new(x: f64, y: f64, z: f64, size: f64, capacity: f64) -> Outcome<Self> {
        let root = Aabb::cube(DVec3::new(x, y, z).as_vec3(), size as f32);
        if !(size > 0.0 && root.is_valid()) {
            return refused("rootCenter, rootSize: expected finite numbers, and a size above 0");
        }
        if !(0.0..=f64::from(PolygonId::LIMIT)).contains(&capacity) {
            let limit = PolygonId::LIMIT;
            return refused(&format!("capacity: expected a number from 0 to {limit}, found {capacity}"));
        }
        let capacity = capacity as usize;
        if !room::is_left(capacity.saturating_mul(ROOM_BYTES)) {
            return no_memory(capacity);
        }
        Ok(Self {
            osp: Osp::new(&IndexConfig { root, capacity }),
            is_committed: true,
            pending: 0,
            asked: 0,
            room: 0,
            highest: 0,
            extent: Aabb::EMPTY,
            scratch: Scratch::default(),
            list: Vec::new(),
            nearest: Vec::new(),
            given: VisibleBlocks::new(),
        })
    }

    /// Makes room for this many numbers of boxes, and ids.
    pub fn room(&mut self, floats: usize, ids: usize) -> Outcome<()> {
        self.scratch.room(floats, ids)
    }

    /// Address for 24 numbers of 64 bits.
    pub fn numbers_at(&self) -> usize {
        self.scratch.numbers.as_ptr().expose_provenance()
    }

    /// Address for boxes.
    pub fn boxes_at(&self) -> usize {
        self.scratch.boxes.as_ptr().expose_provenance()
    }

    /// Address for ids.
    pub fn ids_at(&self) -> usize {
        self.scratch.ids.as_ptr().expose_provenance()
    }

    /// Address of the last result.
    pub fn found_at(&self) -> usize {
        self.scratch.found.as_ptr().expose_provenance()
    }

    /// Address of the distances of the last result, or of the requested box.
    pub fn measured_at(&self) -> usize {
        self.scratch.measured.as_ptr().expose_provenance()
    }

    /// Number of boxes in the index.
    pub fn len(&self) -> usize {
        self.osp.len()
    }

    /// Whether there are no boxes.
    pub fn is_empty(&self) -> bool {
        self.osp.is_empty()
    }

    /// Memory of the index in bytes.
    pub fn bytes(&self) -> usize {
        self.osp.bytes()
    }

    /// Inserts the boxes in memory under the ids in memory: all or none.
    pub fn insert(&mut self) -> Outcome<()> {
        let count = self.scratch.ids.len();
        self.make_room(count)?;
        let mut extent = self.extent;
        for at in 0..count {
            let (id, bounds) = (PolygonId(self.scratch.ids[at]), self.scratch.bounds(at));
            if let Err(error) = self.osp.insert(id, &bounds) {
                let before = &self.scratch.ids[..at];
                let is_twice = before.contains(&id.0);
                for &id in before {
                    // This box was added in the same call.
                    let _ = self.osp.remove(PolygonId(id));
                }
                self.is_committed &= before.is_empty();
                return match error {
                    IndexError::Duplicate(_) if is_twice => twice(id),
                    IndexError::InvalidBounds(_) => self.scratch.checked(at).map(drop),
                    error => refused(&sentence(error)),
                };
            }
            extent = extent.union(&bounds);
        }
        self.extent = extent;
        self.is_committed &= count == 0;
        self.pending += count;
        Ok(())
    }

    /// Replaces the boxes of the ids in memory: all or none.
    pub fn update(&mut self) -> Outcome<()> {
        self.check_known()?;
        let count = self.scratch.ids.len();
        let mut extent = self.extent;
        for at in 0..count {
            extent = extent.union(&self.scratch.checked(at)?);
        }
        // Each box is removed, and added at another place.
        if !self.is_left(count) {
            return refused(&format!("there is no memory left for {count} boxes at other places"));
        }
        self.extent = extent;
        for at in 0..count {
            let (id, bounds) = (PolygonId(self.scratch.ids[at]), self.scratch.bounds(at));
            self.osp.update(id, &bounds).or_else(|error| refused(&sentence(error)))?;
        }
        self.is_committed &= count == 0;
        self.pending += count;
        Ok(())
    }

    /// Removes the ids in memory: all or none.
    pub fn remove(&mut self) -> Outcome<()> {
        self.check_known()?;
        for &id in &self.scratch.ids {
            self.osp.remove(PolygonId(id)).or_else(|error| refused(&sentence(error)))?;
        }
        self.is_committed &= self.scratch.ids.is_empty();
        self.forget_extent();
        Ok(())
    }

    /// Removes everything.
    pub fn clear(&mut self) {
        self.osp.clear();
        self.is_committed = false;
        self.forget_extent();
    }

    /// Ends a batch of changes. A query does this if it was not done. Refused if others have taken the necessary memory
    /// since the changes were made.
    pub fn commit(&mut self) -> Outcome<()> {
        // Nobody has requested memory since then, so it is still available.
        if self.pending > 0 && !self.asked_last() && !self.is_left(0) {
            return refused("there is no memory left for the changes since the last commit");
        }
        self.osp.commit();
        (self.is_committed, self.pending) = (true, 0);
        Ok(())
    }

    /// Whether an id is in use. Then the six measured numbers are its box.
    pub fn bounds(&mut self, id: u32) -> bool {
        let Some(Aabb { min, max }) = self.osp.bounds(PolygonId(id)) else { return false };
        self.scratch.measured.clear();
        self.scratch.measured.extend(min.to_array().into_iter().chain(max.to_array()));
        true
    }

    /// Finds the boxes that the matrix in memory may see. Returns their number.
    pub fn cull(&mut self, is_webgl: bool) -> Outcome<usize> {
        let frustum = Camera::new(&self.scratch.numbers, is_webgl)?.frustum();
        self.find(&frustum)
    }

    /// Finds the boxes that are not completely behind any of the planes in memory, one to six. Returns their number.
    pub fn cull_planes(&mut self, planes: usize) -> Outcome<usize> {
        let numbers = &self.scratch.numbers[..4 * planes.min(6)];
        let frustum = frustum_of_planes(numbers, &self.extent)?;
        self.find(&frustum)
    }

    /// Finds the boxes that have a point in common with the box from the first three numbers to the next three. Returns
    /// their number.
    pub fn in_box(&mut self) -> Outcome<usize> {
        let (min, max) = (self.scratch.point(0), self.scratch.point(3));
        // The box is widened to the next numbers of single precision.
        let bounds = Aabb::new(Vec3::from_array(min.map(round_down)), Vec3::from_array(max.map(round_up)));
        if !min.iter().zip(&max).all(|(min, max)| min <= max) || !bounds.is_valid() {
            return refused("box: expected finite numbers and min <= max");
        }
        self.commit_if_changed()?;
        self.list.clear();
        self.osp.box_query(&bounds, &mut self.list);
        Ok(self.scratch.answer(self.list.iter().copied()))
    }

    /// Finds the boxes that have a point in common with the ball around the first three numbers, with the radius after
    /// them. Returns their number.
    pub fn in_sphere(&mut self) -> Outcome<usize> {
        let (center, radius) = (DVec3::from_array(self.scratch.point(0)), self.scratch.numbers[3]);
        let near = center.as_vec3();
        // The index searches with a larger ball of single precision. Then each box is tested against the exact ball.
        let shift = (center - near.as_dvec3()).length();
        let around = Sphere { center: near, radius_m: round_up((radius + shift) * (1.0 + SPHERE_ROUNDING)) };
        if !(radius >= 0.0 && around.radius_m.is_finite() && near.is_finite()) {
            return refused("sphere: expected a finite center, and a finite radius from 0 on");
        }
        self.commit_if_changed()?;
        self.list.clear();
        let osp = &self.osp;
        let mut is_within = |id: PolygonId| {
            let Some(bounds) = osp.bounds(id) else { return false };
            let nearest = center.clamp(bounds.min.as_dvec3(), bounds.max.as_dvec3());
            nearest.distance_squared(center) <= radius * radius
        };
        osp.sphere_query(&around, &mut is_within, &mut self.list);
        Ok(self.scratch.answer(self.list.iter().copied()))
    }

    /// Finds the first box that a ray enters: one found id and one measured number, or none. The ray starts at the
    /// first three numbers, has the next three as its direction, and is as long as the number after them. Returns
    /// whether there is one.
    pub fn ray(&mut self) -> Outcome<bool> {
        let [origin, along] = [0, 3].map(|from| DVec3::from_array(self.scratch.point(from)).as_vec3());
        let t_max = self.scratch.numbers[6] as f32;
        if !(origin.is_finite() && along.is_finite() && along != Vec3::ZERO) {
            return refused("ray: expected a finite origin, and a finite direction other than 0, 0, 0");
        }
        if t_max.is_nan() || t_max < 0.0 {
            return refused("tMax: expected a number from 0 on");
        }
        self.commit_if_changed()?;
        let (ray, osp) = (Ray::new(origin, along), &self.osp);
        let hit = osp.ray_nearest(&ray, t_max, &mut |id| ray.enter_box(&osp.bounds(id)?, t_max));
        self.scratch.answer(hit.iter().map(|(id, _)| *id));
        self.scratch.measured.clear();
        self.scratch.measured.extend(hit.map(|(_, t)| t));
        Ok(hit.is_some())
    }

    /// Finds the boxes nearest to the point of the first three numbers, with their distances, the nearest first.
    /// Returns their number.
    pub fn nearest(&mut self, count: f64) -> Outcome<usize> {
        let point = DVec3::from_array(self.scratch.point(0)).as_vec3();
        if !point.is_finite() {
            return refused("point: expected finite numbers");
        }
        if count.is_nan() || count < 0.0 {
            return refused(&format!("count: expected a number from 0 on, found {count}"));
        }
        self.commit_if_changed()?;
        // A larger count would only reserve more memory.
        let (osp, count) = (&self.osp, (count as usize).min(self.osp.len()));
        if !room::is_left(count.saturating_mul(NEAREST_BYTES)) {
            return refused(&format!("there is no memory left for the {count} nearest boxes"));
        }
        let mut distance_m =
            |id| osp.bounds(id).map_or(f32::NAN, |bounds| bounds.distance_squared(point).sqrt());
        osp.nearest(point, count, &mut distance_m, &mut self.nearest);
        self.scratch.measured.clear();
        self.scratch.measured.extend(self.nearest.iter().map(|(_, distance_m)| *distance_m));
        Ok(self.scratch.answer(self.nearest.iter().map(|(id, _)| *id)))
    }
}

/// Factor by which the ball for the index is larger. It covers the rounding of squares in single precision.
const SPHERE_ROUNDING: f64 = 1.0e-6;

impl Index {
    fn commit_if_changed(&mut self) -> Outcome<()> {
        if self.is_committed { Ok(()) } else { self.commit() }
    }

    /// Whether nobody has requested memory since this index did, so that the same memory is still available.
    fn asked_last(&self) -> bool {
        self.asked == room::asked()
    }

    /// Whether there is memory for this many boxes, and for the changes that are not committed.
    fn is_left(&mut self, boxes: usize) -> bool {
        let asked_last = self.asked_last();
        let again = if asked_last { 0 } else { self.pending };
        let is_left = room::is_left((boxes + again).saturating_mul(BOX_BYTES));
        if asked_last || is_left {
            self.asked = room::asked();
        }
        // The memory that was counted on before may be in use now.
        self.room = self.osp.len();
        is_left
    }

    /// Refuses boxes for which there is no memory, or whose complete list as a result would have none.
    fn make_room(&mut self, more: usize) -> Outcome<()> {
        let needed = self.osp.len() + more;
        let highest = self.scratch.ids.iter().fold(self.highest, |highest, &id| highest.max(id));
        let asked_last = self.asked_last();
        if asked_last && needed <= self.room && highest <= self.highest {
            return Ok(());
        }
        let again = if asked_last { 0 } else { self.pending };
        if !asked_last {
            self.room = self.osp.len();
        }
        let of_sets = room::bytes_of_sets(&self.scratch.ids);
        // The steps are larger, so that single boxes do not request memory each time.
        for room in [needed.max(self.room + self.room / 2), needed] {
            self.list.clear();
            self.scratch.found.clear();
            let bytes = (room - self.osp.len() + again).saturating_mul(BOX_BYTES);
            let Some(trial) = room::take(bytes.saturating_add(of_sets)) else { continue };
            let is_there =
                self.list.try_reserve(room + BEHIND).is_ok() && self.scratch.found.try_reserve(room).is_ok();
            drop(trial);
            if is_there {
                self.asked = room::asked();
                // There is room in reserve before the next request.
                self.room = room;
                if highest > self.highest {
                    self.highest = highest.saturating_add(highest / 2);
                }
                return Ok(());
            }
        }
        if asked_last {
            // Nothing was taken.
            self.asked = room::asked();
        }
        no_memory(more)
    }

    fn find(&mut self, frustum: &Frustum) -> Outcome<usize> {
        self.commit_if_changed()?;
        self.list.clear();
        self.osp.frustum_cull(frustum, &mut self.list);
        Ok(self.scratch.answer(self.list.iter().copied()))
    }

    /// Checks that each id in memory is in the index, and given once.
    fn check_known(&mut self) -> Outcome<()> {
        self.given.clear();
        for &id in &self.scratch.ids {
            let id = PolygonId(id);
            if self.osp.bounds(id).is_none() {
                return refused(&sentence(IndexError::Unknown(id)));
            }
            if !self.given.insert(id) {
                return twice(id);
            }
        }
        Ok(())
    }

    fn forget_extent(&mut self) {
        if self.osp.is_empty() {
            self.extent = Aabb::EMPTY;
        }
    }
}

fn twice<T>(id: PolygonId) -> Outcome<T> {
    refused(&format!("id {}: it is given twice", id.0))
}

/// Returns the error of the index, with ids instead of polygons.
fn sentence(error: IndexError) -> String {
    error.to_string().replacen("polygon", "id", 1)
}

fn no_memory<T>(boxes: usize) -> Outcome<T> {
    refused(&format!("there is no memory left for {boxes} more boxes"))
}
