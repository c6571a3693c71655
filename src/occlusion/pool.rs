use glam::Vec3;

use super::{
    ShadowVolume,
    patch::{MAX_PATCH, Patch},
    sketches::{RoughWindow, Sketch, Sketches},
};
use crate::{
    polygon::{Change, ConvexPolygon, Geometry, Paged, PolygonId},
    view::ViewWindow,
};

/// Number of patches that may still grow. It is more than one, because strokes that are drawn at the same time (mirrored,
/// pasted) take turns.
const OPEN_PATCHES: usize = 6;

/// Largest number of polygons of removed candidates that wait to be offered again one by one. The search of the whole
/// geometry finds the others later.
const ORPHANS: usize = 1024;

/// After many removals, a frame offers at most [`OFFERS_A_FRAME`] polygons again, and reads at most [`READS_A_FRAME`] to
/// find them.
const OFFERS_A_FRAME: usize = 256;
const READS_A_FRAME: usize = 8192;

/// Largest capacity. A pool holds at most twice as many candidates and one more.
pub(super) const MOST_CAPACITY: usize = (1 << 19) - 1;

/// The number that stands for no candidate.
const NONE: u32 = u32::MAX;

/// Settings of [`OccluderPool`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolConfig {
    /// Number of candidates that stay when the pool is trimmed, at most half a million. The pool holds up to twice as many,
    /// about 1 kB each.
    pub capacity: usize,
    /// The rule by which polygons form candidates.
    pub grouping: Grouping,
}

impl Default for PoolConfig {
    /// Keeps 2,048 to 4,096 candidates, and joins neighbouring polygons to patches.
    fn default() -> Self {
        Self { capacity: 2048, grouping: Grouping::Patches }
    }
}

/// The rule by which polygons form occluders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grouping {
    /// Each polygon is an occluder by itself.
    Single,
    /// Neighbouring polygons that share an edge form an occluder, as long as they hide more together.
    Patches,
}

impl Sketch {
    /// Whether a polygon may share a corner with the candidate. A wrong result only makes occlusion culling less effective.
    fn may_touch(&self, polygon: &ConvexPolygon) -> bool {
        let vertices = polygon.vertices();
        let first = vertices[0];
        let reach = vertices.iter().map(|v| v.distance_squared(first)).fold(0.0, f32::max).sqrt();
        let near = self.radius_m + reach;
        first.distance_squared(self.center) <= near * near * 1.001
    }
}

/// The candidates for occluders. New polygons are offered to the pool one by one, and erased polygons are removed. If
/// the candidates exceed the capacity, the smallest ones are removed.
///
/// After section 3.2.1 of "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree".
///
/// # Differences from the paper
/// A candidate may be a patch of neighbouring polygons that hide more together than the largest of them alone. Without
/// patches, the small polygons of drawn ribbons would hide nothing. The paper does not solve this problem.
///
/// Only opaque polygons are candidates. If a polygon of a candidate is removed, the whole candidate is removed, and its
/// other polygons are offered again.
#[derive(Clone, Debug)]
pub struct OccluderPool {
    config: PoolConfig,
    patches: Vec<Patch>,
    /// For each slot, the bounds of its patch.
    sketches: Sketches,
    free: Vec<u32>,
    /// For each polygon, the slot of its patch.
    slot_of: Paged<u32>,
    /// Slots of the patches that may still grow, the newest first.
    open: [u32; OPEN_PATCHES],
    /// Smallest area of a candidate that the last trim kept, m^2.
    threshold_m2: f32,
    /// Area from which [`OccluderPool::follow_roughly`] counts a polygon as large, m^2.
    large_m2: f32,
    /// The next polygon in the search for replacements. At the end of the geometry, the search is complete.
    rescan: usize,
    orphans: Vec<PolygonId>,
    areas: Vec<f32>,
}

impl OccluderPool {
    /// An empty pool; allocates its memory now.
    pub fn new(config: PoolConfig) -> Self {
        let config = PoolConfig { capacity: config.capacity.min(MOST_CAPACITY), ..config };
        let room = 2 * config.capacity.max(1);
        Self {
            config,
            patches: Vec::with_capacity(room),
            sketches: Sketches::with_capacity(room),
            free: Vec::with_capacity(room),
            slot_of: Paged::new(),
            open: [NONE; OPEN_PATCHES],
            threshold_m2: 0.0,
            large_m2: 1.0e-4,
            rescan: usize::MAX,
            orphans: Vec::with_capacity(ORPHANS),
            areas: Vec::with_capacity(room),
        }
    }

    /// Makes room for scenes with `polygons` polygons; takes 4 bytes for each.
    pub fn reserve(&mut self, polygons: usize) {
        while self.slot_of.len() < polygons {
            self.slot_of.push(NONE);
        }
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.patches.len() - self.free.len()
    }

    /// Whether there is no candidate.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The polygons of every candidate.
    pub fn candidates(&self) -> impl Iterator<Item = &[PolygonId]> {
        let is_live = |slot: &usize| !self.sketches.get(*slot).is_free();
        (0..self.patches.len()).filter(is_live).map(|slot| self.patches[slot].ids())
    }

    /// Applies one frame's changes. The work is bounded for each change, and for the frame while removed candidates are
    /// being replaced.
    pub fn follow(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.follow_in_steps(geometry, changes, usize::MAX);
    }

    /// Applies changes as [`OccluderPool::follow`] does, in steps. It offers at most `offers` polygons of removed
    /// candidates again, and at most four times as many polygons that came during calls of
    /// [`OccluderPool::follow_roughly`]. The others wait for later calls.
    pub(crate) fn follow_in_steps(&mut self, geometry: &dyn Geometry, changes: &[Change], offers: usize) {
        self.reserve(geometry.id_end());
        for &change in changes {
            match change {
                Change::Insert(id) => {
                    self.offer(geometry, id);
                }
                Change::Remove(id) => self.take_out(geometry, id),
                Change::Repaint(id) if !self.hides_otherwise(geometry, id) => {}
                // A polygon in a moving space is no candidate.
                Change::Place(_) => {}
                Change::Update(id) | Change::Repaint(id) => {
                    self.take_out(geometry, id);
                    self.offer(geometry, id);
                }
            }
        }
        // These are polygons of removed patches. Polygons that are not present, or are candidates again, are skipped.
        // (After a replay jumps back, the geometry may not have them.)
        let mut made = 0;
        while made < offers
            && let Some(id) = self.orphans.pop()
        {
            let is_there = geometry.is_present(id);
            if is_there && self.slot(id) == NONE {
                made += usize::from(self.offer(geometry, id));
            }
        }
        self.catch_up(geometry, OFFERS_A_FRAME.min(offers.saturating_mul(4)));
    }

    /// Applies changes at low cost, for frames that do not use the pool: it only removes candidates and offers the largest
    /// new polygons, at most `offers`. Later calls of `follow` or `catch_up` offer the others. Returns the number of
    /// offers.
    pub fn follow_roughly(&mut self, geometry: &dyn Geometry, changes: &[Change], offers: usize) -> usize {
        let mut made = 0;
        for &change in changes {
            if let Change::Repaint(id) = change
                && !self.hides_otherwise(geometry, id)
            {
                continue;
            }
            if let Change::Remove(id) | Change::Update(id) | Change::Repaint(id) = change {
                self.take_out(geometry, id);
            }
            if let Change::Insert(id) | Change::Update(id) | Change::Repaint(id) = change {
                self.rescan = self.rescan.min(id.index());
                if made < offers && self.is_large(geometry, id) {
                    self.reserve(geometry.id_end());
                    made += usize::from(self.offer(geometry, id));
                }
            }
        }
        made
    }

    /// Whether painting a polygon again may have changed its shadow, because its texture determines its holes.
    fn hides_otherwise(&self, geometry: &dyn Geometry, id: PolygonId) -> bool {
        match fixed_occluder(geometry, id) {
            None => self.slot(id) != NONE,
            part => part != geometry.polygon(id),
        }
    }

    /// Whether a polygon is approximately among the largest sixteenth of the polygons that earlier calls received.
    fn is_large(&mut self, geometry: &dyn Geometry, id: PolygonId) -> bool {
        // The box is read first, because it was just inserted and is in the cache. A polygon is no larger than a disk with
        // the box's diagonal.
        let disk_m2 = std::f32::consts::FRAC_PI_4 * geometry.bounds(id).extent().length_squared();
        let mut is_large = disk_m2 > self.large_m2;
        if is_large {
            let Some(polygon) = fixed_occluder(geometry, id) else { return false };
            is_large = 0.5 * polygon.area_vector().length() > self.large_m2;
        }
        // Steps up and down cancel if one polygon of sixteen is larger. The steps are small, so that the polygons of a
        // wide stroke count as large for a few hundred calls.
        let step = if is_large { 1.016 } else { 0.999 };
        self.large_m2 = (self.large_m2 * step).clamp(1.0e-12, 1.0e12);
        is_large
    }

    /// Appends score and number of every candidate that may fill enough of a window.
    pub(super) fn score(&self, window: &RoughWindow, out: &mut Vec<(f32, u32)>) {
        self.sketches.score(window, out);
    }

    /// Numbers and sketches of all candidates, and of free slots.
    pub(super) fn sketches(&self) -> impl Iterator<Item = (u32, Sketch)> + '_ {
        (0..).zip(self.sketches.iter())
    }

    /// The sketch of a candidate.
    pub(super) fn sketch(&self, slot: u32) -> Sketch {
        self.sketches.get(slot as usize)
    }

    /// Appends the shadows of a candidate.
    pub(super) fn push_shadows(
        &self,
        slot: u32,
        geometry: &dyn Geometry,
        window: &ViewWindow,
        out: &mut Vec<ShadowVolume>,
    ) {
        self.patches[slot as usize].push_shadows(geometry, window, out);
    }

    /// Whether `follow` and `catch_up` have not examined all polygons yet.
    pub(crate) fn is_behind(&self, geometry: &dyn Geometry) -> bool {
        self.rescan < geometry.id_end()
    }

    /// Offers polygons that came while the pool was not used, or that may replace removed ones. Makes at most `offers`
    /// offers, about 1.5 µs each. Returns their number.
    pub fn catch_up(&mut self, geometry: &dyn Geometry, offers: usize) -> usize {
        self.reserve(geometry.id_end());
        let end = geometry.id_end().min(self.rescan.saturating_add(READS_A_FRAME));
        let mut made = 0;
        while self.rescan < end && made < offers {
            let id = PolygonId(self.rescan as u32);
            self.rescan += 1;
            if geometry.is_present(id) && self.slot(id) == NONE {
                made += usize::from(self.offer(geometry, id));
            }
        }
        if self.rescan >= geometry.id_end() {
            self.rescan = usize::MAX;
        }
        made
    }

    fn slot(&self, id: PolygonId) -> u32 {
        self.slot_of.get(id.index()).copied().unwrap_or(NONE)
    }

    fn set_slot(&mut self, id: PolygonId, slot: u32) {
        if let Some(entry) = self.slot_of.get_mut(id.index()) {
            *entry = slot;
        }
    }

    /// Makes a polygon a candidate, or a part of a candidate, if possible. Returns whether this took more than a quick
    /// test.
    fn offer(&mut self, geometry: &dyn Geometry, id: PolygonId) -> bool {
        // A change may concern an erased polygon, because erased polygons can be moved.
        if !geometry.is_present(id) {
            return false;
        }
        if self.slot(id) != NONE {
            return false;
        }
        let Some(polygon) = fixed_occluder(geometry, id) else { return false };
        // Even a patch of [`MAX_PATCH`] such polygons would be too small.
        if self.threshold_m2 > 0.0 {
            let enough_m2 = self.threshold_m2 / MAX_PATCH as f32;
            if polygon.area_vector().length_squared() < 4.0 * enough_m2 * enough_m2 {
                return false;
            }
        }
        if self.config.grouping == Grouping::Patches {
            for k in 0..OPEN_PATCHES {
                let slot = self.open[k];
                let Some(patch) = self.patches.get(slot as usize) else { continue };
                if !self.sketches.get(slot as usize).may_touch(&polygon) {
                    continue;
                }
                if let Some(joined) = patch.joined(id, &polygon) {
                    self.open[..=k].rotate_right(1);
                    self.put(slot, joined);
                    self.set_slot(id, slot);
                    self.merge_newest(&polygon);
                    return true;
                }
            }
        }
        let patch = Patch::new(id, &polygon);
        let area = patch.area_m2();
        if !(area > 0.0 && area.is_finite()) {
            return true;
        }
        if self.len() >= 2 * self.config.capacity.max(1) {
            self.trim();
        }
        let slot = self.free.pop().unwrap_or(self.patches.len() as u32);
        if slot as usize == self.patches.len() {
            self.patches.push(patch);
            self.sketches.push(Sketch::FREE);
        }
        self.put(slot, patch);
        self.set_slot(id, slot);
        // The patch that has not grown for the longest time is closed. A closed patch that is too small is removed at once,
        // so that a stream of small polygons does not displace the pool's contents.
        self.open.rotate_right(1);
        let given_way = std::mem::replace(&mut self.open[0], slot);
        let is_small = self.patches.get(given_way as usize).is_some_and(|r| r.area_m2() < self.threshold_m2);
        if is_small && !self.open.contains(&given_way) {
            self.release(given_way);
        }
        true
    }

    /// Merges the newest open patch with another open patch, if its new polygon closes the gap between them.
    fn merge_newest(&mut self, polygon: &ConvexPolygon) {
        let slot = self.open[0];
        for k in 1..OPEN_PATCHES {
            let other = self.open[k];
            let Some(patch) = self.patches.get(other as usize) else { continue };
            if !self.sketches.get(other as usize).may_touch(polygon) {
                continue;
            }
            if let Some(merged) = self.patches[slot as usize].merged(patch, polygon) {
                self.release(other);
                for &id in merged.ids() {
                    self.set_slot(id, slot);
                }
                self.put(slot, merged);
                return;
            }
        }
    }

    fn put(&mut self, slot: u32, patch: Patch) {
        let slot = slot as usize;
        let (low, high) = patch
            .points()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let center = low * 0.5 + high * 0.5;
        let area_vector = patch.area_vector();
        self.sketches.set(slot, Sketch { center, radius_m: (high - center).length(), area_vector });
        self.patches[slot] = patch;
    }

    /// Removes the candidate that a removed polygon belongs to. The candidate's other polygons are offered again.
    fn take_out(&mut self, geometry: &dyn Geometry, id: PolygonId) {
        let slot = self.slot(id);
        if slot == NONE {
            return;
        }
        self.release(slot);
        // Only the polygons of the removed patch are read.
        for &other in self.patches[slot as usize].ids().iter().filter(|other| **other != id) {
            if self.orphans.len() < ORPHANS {
                self.orphans.push(other);
            } else {
                self.rescan = self.rescan.min(other.index());
            }
        }
        // Polygons that were too small before may be large enough now.
        if self.len() < self.config.capacity / 2
            && self.rescan >= geometry.id_end()
            && self.threshold_m2 > 0.0
        {
            self.rescan = 0;
            self.threshold_m2 = 0.0;
        }
    }

    fn release(&mut self, slot: u32) {
        if self.sketches.get(slot as usize).is_free() {
            return;
        }
        self.sketches.set(slot as usize, Sketch::FREE);
        for &id in self.patches[slot as usize].ids() {
            if let Some(entry) = self.slot_of.get_mut(id.index()) {
                *entry = NONE;
            }
        }
        for open in &mut self.open {
            if *open == slot {
                *open = NONE;
            }
        }
        self.free.push(slot);
    }

    /// Removes the smallest candidates beyond the capacity.
    fn trim(&mut self) {
        self.areas.clear();
        self.areas.extend(self.sketches.iter().map(|s| s.area_vector.length()));
        let excess = self.areas.len().saturating_sub(self.config.capacity.max(1));
        if excess == 0 {
            return;
        }
        let (_, &mut threshold, _) = self.areas.select_nth_unstable_by(excess - 1, f32::total_cmp);
        self.threshold_m2 = threshold;
        for slot in 0..self.sketches.len() as u32 {
            let is_open = self.open.contains(&slot);
            if self.sketches.get(slot as usize).area_vector.length() <= threshold && !is_open {
                self.release(slot);
            }
        }
        // If many candidates have the threshold's size, some of them have to be removed, too.
        let mut slot = 0;
        while self.len() >= 2 * self.config.capacity.max(1) && (slot as usize) < self.sketches.len() {
            self.release(slot);
            slot += 1;
        }
    }
}

/// The occluding part of a polygon with a fixed position. A polygon of a moving space is no candidate, because it would be
/// a new candidate in every frame that moves the space.
fn fixed_occluder(geometry: &dyn Geometry, id: PolygonId) -> Option<ConvexPolygon> {
    geometry.space(id).is_none().then(|| geometry.occluder(id)).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;

    /// A row of squares of 1 m, each with holes except in its last `solid_m` metres. A texture stretched over a growing
    /// stroke gives such a row.
    struct Row {
        squares: u32,
        solid_m: f32,
    }

    impl Row {
        fn square(&self, id: PolygonId, left_m: f32) -> ConvexPolygon {
            let x = id.0 as f32 * 2.0;
            let corners = [(x + left_m, 0.0), (x + 1.0, 0.0), (x + 1.0, 1.0), (x + left_m, 1.0)];
            ConvexPolygon::quad(corners.map(|(x, y)| Vec3::new(x, y, 0.0)))
        }
    }

    impl Geometry for Row {
        fn id_end(&self) -> usize {
            self.squares as usize
        }

        fn is_present(&self, id: PolygonId) -> bool {
            id.0 < self.squares
        }

        fn bounds(&self, id: PolygonId) -> Aabb {
            self.square(id, 0.0).bounds()
        }

        fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
            Some(self.square(id, 0.0))
        }

        fn may_occlude(&self, _: PolygonId) -> bool {
            true
        }

        fn occluder(&self, id: PolygonId) -> Option<ConvexPolygon> {
            Some(self.square(id, 1.0 - self.solid_m))
        }
    }

    #[test]
    fn a_candidate_hides_what_its_polygon_with_holes_hides_now() {
        let mut row = Row { squares: 0, solid_m: 0.0 };
        let config = PoolConfig { capacity: 64, grouping: Grouping::Single };
        let (mut pool, mut rough) = (OccluderPool::new(config), OccluderPool::new(config));
        for step in 1..=20_u32 {
            row.squares = step;
            row.solid_m = step as f32 / 32.0;
            let repainted = (0..step - 1).map(|id| Change::Repaint(PolygonId(id)));
            let changes: Vec<_> = repainted.chain([Change::Insert(PolygonId(step - 1))]).collect();
            pool.follow(&row, &changes);
            rough.follow_roughly(&row, &changes, 1);
            rough.catch_up(&row, 1);
            for pool in [&pool, &rough] {
                for patch in pool.patches.iter().filter(|patch| pool.slot(patch.ids()[0]) != NONE) {
                    let part = row.occluder(patch.ids()[0]).expect("it hides something");
                    assert!(patch.points().all(|p| part.vertices().contains(&p)), "{patch:?} of {part:?}");
                }
            }
        }
        assert!(pool.len() > 5 && !rough.is_empty(), "{} and {}", pool.len(), rough.len());
    }
}
