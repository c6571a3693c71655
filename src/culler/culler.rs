use std::{collections::HashMap, fmt, hash::BuildHasherDefault};

use thiserror::Error;

use super::{
    camera::Camera,
    frame::{Frame, Views},
    hiding::Hiding,
    indexed::Indexed,
    keys::{Key, Places, Slot},
    layers::Layers,
    occluder::Occluder,
    pending::PendingChanges,
};
use crate::{
    index::SpatialIndex,
    key_hasher::KeyHasher,
    math::{Aabb, Frustum, Ray, Sphere},
    occlusion::{Columns, OcclusionReport, moved},
    polygon::PolygonId,
};

/// Largest number of refusals that are stored from one frame to the next.
const MOST_REFUSED: usize = 4096;

/// The reason why a culler skipped an object or its occluder.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The box is empty, infinite or NaN. The object is skipped until it gets a valid box.
    #[error("bounds: expected finite corners with min <= max, found {0:?}")]
    Bounds([[f32; 3]; 2]),
    /// A [`Dense`](super::Dense) number is too large, or the culler has too many keys.
    #[error("key: expected a number below {limit}, and at most as many objects", limit = PolygonId::LIMIT)]
    Key,
    /// The occluders of all objects together would have too many polygons. The object gets no occluder.
    #[error("occluder: expected at most {limit} polygons of all occluders together", limit = PolygonId::LIMIT)]
    Occluder,
}

/// A culler of an engine's objects. Each object has a key that the engine chooses, and a box.
///
/// The capacity and the extent of the world grow as needed. Objects can be inserted, moved and removed at any time. The
/// index is rebuilt only if one commit inserts many more objects than are present. See the [crate] for an
/// example.
///
/// Changes take effect with the next [`Culler::cull`] or [`Culler::commit`]. After this call no query finds a removed
/// object. Several threads may run queries at once. No call panics, and no visible object is ever culled.
///
/// Costs: `set` and `remove` take O(1). The commit takes O(changes), and O(log world) for each object that is new or
/// leaves its neighbourhood. A camera takes O(objects in view); with occluders also O(candidates), which are at most
/// some thousand.
pub struct Culler<K: Key> {
    pub(super) keys: K::Places,
    pub(super) pending: PendingChanges,
    pub(super) indexed: Indexed,
    pub(super) layers: Layers,
    /// The objects that have been moved by a transform.
    pub(super) placements: HashMap<Slot, Placement, BuildHasherDefault<KeyHasher>>,
    /// The occluders; `None` until the first occluder is set.
    pub(super) hiding: Option<Box<Hiding>>,
    /// Changes refused before the last call of [`Culler::cull`].
    pub(super) refused: Vec<(K, Refusal)>,
    /// Changes refused since the last call of [`Culler::cull`].
    pub(super) refused_since: Vec<(K, Refusal)>,
    frusta: Vec<Frustum>,
    occlusion: OcclusionReport,
    pub(super) views: Views,
}

/// An object's box in its own space, and its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub(super) bounds: Aabb,
    pub(super) columns: Columns,
}

impl<K: Key> Default for Culler<K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K: Key> fmt::Debug for Culler<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Culler").field("objects", &self.len()).finish_non_exhaustive()
    }
}

impl<K: Key> Culler<K> {
    /// A culler without objects.
    pub fn new() -> Self {
        Self {
            keys: K::Places::default(),
            pending: PendingChanges::default(),
            indexed: Indexed::new(),
            layers: Layers::default(),
            placements: HashMap::default(),
            hiding: None,
            refused: Vec::new(),
            refused_since: Vec::new(),
            frusta: Vec::new(),
            occlusion: OcclusionReport::default(),
            views: Views::default(),
        }
    }

    /// Inserts an object, or moves it. The box is given as its minimum and maximum corner, world space, metres. It
    /// should be tight around everything that the engine draws of the object. A box that is empty or not finite is
    /// [refused](Culler::refused). Its object loses its former box and its occluder, keeps its layers, and is skipped until
    /// it gets a valid box.
    ///
    /// An object that moves loses its occluder, unless the new box contains the former one. Set the
    /// [occluder](Culler::set_occluder) again at the new place.
    pub fn set<P: Into<[f32; 3]>>(&mut self, key: K, bounds: [P; 2]) {
        let [min, max] = bounds.map(Into::into);
        let Some(slot) = self.slot(key) else { return };
        let bounds = Aabb::new(min.into(), max.into());
        if !self.placements.is_empty()
            && let Some(placement) = self.placements.get_mut(&slot)
        {
            let columns = placement.columns;
            placement.bounds = if bounds.is_valid() { bounds } else { Aabb::EMPTY };
            self.set_moved(key, slot, &bounds, &columns);
        } else if !self.pending.set(slot, bounds) {
            self.refuse(key, Refusal::Bounds([min, max]));
            self.remove_box(slot);
        }
        if bounds.is_valid()
            && let Some(hiding) = &mut self.hiding
        {
            hiding.follow_object(slot, &bounds);
        }
    }

    /// Sets the box of an object that has been moved, from its box in its own space.
    fn set_moved(&mut self, key: K, slot: Slot, own: &Aabb, columns: &Columns) {
        let bounds = if own.is_valid() { moved(columns, own) } else { *own };
        if !self.pending.set(slot, bounds) {
            self.refuse(key, Refusal::Bounds([bounds.min.into(), bounds.max.into()]));
            self.remove_box(slot);
        }
    }

    /// Moves an object with its occluder by an affine transform: the images of the axes x, y and z, and of the origin. The
    /// object's box and its occluder are then in the object's own space, where they lay until the first call. Later calls
    /// of [`Culler::set`] and [`Culler::set_occluder`] are in this space, too. If the transform or the moved box is not
    /// finite, the box is [refused](Culler::refused).
    ///
    /// Takes O(1), whatever the number of the occluder's triangles; the first call, and one with the identity, take O(open
    /// edges of the mesh). The depth buffer draws moved occluders; the tree of shadow volumes omits them.
    ///
    /// ```
    /// use osp::{Culler, Occluder};
    ///
    /// let mut culler = Culler::<u32>::new();
    /// let door = [[0.0, 0.0, 0.0], [1.0, 2.0, 0.1_f32]];
    /// culler.set(7, door);
    /// culler.set_occluder(7, Occluder::cuboid(door)?);
    /// culler.set_transform(7, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [5.0, 0.0, 0.0_f32]]);
    /// assert!(culler.bounds(7).is_some_and(|[min, max]| min[0] < 5.1 && max[0] > 5.9));
    /// # Ok::<(), osp::OccluderError>(())
    /// ```
    pub fn set_transform<P: Into<[f32; 3]>>(&mut self, key: K, columns: [P; 4]) {
        let Some(slot) = self.slot(key) else { return };
        let columns: Columns = columns.map(|column| column.into().into());
        if !columns.iter().all(|column| column.is_finite()) {
            self.refuse(key, Refusal::Bounds([[f32::NAN; 3]; 2]));
            self.remove_box(slot);
            return;
        }
        let own = match self.placements.get(&slot) {
            Some(placement) => placement.bounds,
            None => self.bounds_of(slot).unwrap_or(Aabb::EMPTY),
        };
        self.placements.insert(slot, Placement { bounds: own, columns });
        if let Some(hiding) = &mut self.hiding {
            hiding.place(slot, columns);
        }
        if !own.is_empty() {
            self.set_moved(key, slot, &own, &columns);
        }
    }

    /// Removes an object with its occluder and its layers. A call for an unknown key has no effect.
    pub fn remove(&mut self, key: K) {
        let Some(slot) = self.keys.take(key) else { return };
        self.remove_box(slot);
        self.placements.remove(&slot);
        self.layers.forget(slot);
    }

    /// Sets an object's occluder, in place of the former one. The occluder is in world space, and stays in place until
    /// the object moves or is removed; after [`Culler::set_transform`] it is in the object's own space, and moves with it.
    /// The engine must draw the occluder itself, or an opaque object around it.
    ///
    /// A key without a box may have an occluder. Such an occluder hides objects, and is never drawn.
    pub fn set_occluder(&mut self, key: K, occluder: Occluder) {
        let Some(slot) = self.slot(key) else { return };
        let placement = self.placements.get(&slot);
        let bounds = match placement {
            Some(placement) => Some(placement.bounds).filter(|bounds| !bounds.is_empty()),
            None => self.bounds_of(slot),
        };
        let columns = placement.map(|placement| placement.columns);
        let hiding = self.hiding.get_or_insert_with(|| Box::new(Hiding::new()));
        if hiding.set(slot, bounds, columns, occluder).is_err() {
            self.refuse(key, Refusal::Occluder);
        }
    }

    /// Removes an object's occluder. An object without an occluder stays unchanged.
    pub fn remove_occluder(&mut self, key: K) {
        if let (Some(hiding), Some(slot)) = (&mut self.hiding, self.keys.slot(key)) {
            hiding.remove(slot);
        }
    }

    /// Sets the layers of an object, a mask with a bit for each layer. A camera sees the object if they share a layer
    /// ([`Camera::on_layers`]). The default is the first layer, mask 1. An object on no layer is never seen.
    pub fn set_layers(&mut self, key: K, layers: u32) {
        if let Some(slot) = self.slot(key) {
            self.layers.set(slot, layers);
        }
    }

    /// Number of objects in the culler with an accepted box.
    pub fn len(&self) -> usize {
        self.pending.count()
    }

    /// Whether there is no object.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The box of an object, as min and max; `None` if the last box was refused.
    pub fn bounds(&self, key: K) -> Option<[[f32; 3]; 2]> {
        let bounds = self.bounds_of(self.keys.slot(key)?)?;
        Some([bounds.min.into(), bounds.max.into()])
    }

    /// The changes that were refused between the last two calls of [`Culler::cull`], with reasons. Only the first 4096
    /// are stored.
    pub fn refused(&self) -> impl Iterator<Item = (K, Refusal)> {
        self.refused.iter().copied()
    }

    /// What the cameras of the last [`Culler::cull`] did with the occluders, all cameras together. An occluder that hides
    /// nothing was too small, hidden itself, or beyond the budget.
    pub fn occlusion(&self) -> OcclusionReport {
        self.occlusion
    }

    /// Sets the largest work of a camera's depth buffer of occluders, in units that take about a nanosecond. The work is
    /// counted, so the result is the same on each machine. The nearest occluders are drawn first; those beyond the budget
    /// hide nothing. The default is 720,000.
    pub fn set_occlusion_budget(&mut self, work: u64) {
        self.hiding.get_or_insert_with(|| Box::new(Hiding::new())).budget = work;
    }

    /// Applies all changes; later queries find the new state. [`Culler::cull`] also commits.
    pub fn commit(&mut self) {
        if !self.pending.is_empty() {
            self.views.begin(0);
        }
        self.pending.take_all(|changes| self.indexed.take_all::<K>(&mut self.keys, changes));
        self.indexed.commit::<K>(&mut self.keys);
        self.keys.settle();
        if let Some(hiding) = &mut self.hiding {
            hiding.follow();
        }
    }

    /// Finds the objects that may be on the screen of each camera. With [occlusion culling](Camera::hide_by_occluders),
    /// the result of a camera omits the objects behind occluders. Two similar cameras, such as the eyes of a headset,
    /// share one traversal of the index. Each other camera has its own traversal.
    pub fn cull(&mut self, cameras: &[Camera]) -> Frame<'_, K> {
        self.commit();
        std::mem::swap(&mut self.refused, &mut self.refused_since);
        self.refused_since.clear();
        self.occlusion = OcclusionReport::default();
        let Self { indexed, keys, layers, hiding, views, occlusion, .. } = self;
        views.begin(cameras.len());
        self.frusta.clear();
        self.frusta.extend(cameras.iter().map(|camera| camera.frustum_within(|| indexed.index().around())));
        indexed.index().frustum_cull_views(&self.frusta, &mut views.in_view);
        for (i, camera) in cameras.iter().enumerate() {
            let mask = camera.layers();
            if let (Some(hiding), Some(window)) = (&mut *hiding, camera.hiding_window()) {
                let (in_view, drawn) = (&views.in_view[i], &mut views.drawn[i]);
                let view = (i, window, camera.frustum());
                views.is_occluded[i] = hiding.cull(indexed, (layers, mask), view, in_view, drawn, occlusion);
            } else {
                occlusion.unsupported += usize::from(camera.asks_to_hide());
            }
            if !layers.sees_all(mask) {
                let is_seen = |number| keys.slot_of(number).is_some_and(|slot| layers.sees(slot, mask));
                views.keep(i, is_seen);
            }
        }
        self.frame()
    }

    /// Returns for each box whether it is hidden from a camera: out of view, or behind the occluders of a camera that
    /// [uses them](Camera::hide_by_occluders). The boxes need not belong to objects of the culler; they may surround
    /// sounds, characters or triggers. An empty or non-finite box is not hidden. Applies all changes, as
    /// [`Culler::cull`] does.
    pub fn are_hidden<P: Into<[f32; 3]> + Copy>(&mut self, camera: &Camera, boxes: &[[P; 2]]) -> Vec<bool> {
        self.commit();
        let corner = |corner: P| corner.into().into();
        let boxes: Vec<_> = boxes.iter().map(|&[min, max]| Aabb::new(corner(min), corner(max))).collect();
        let is_out = |bounds: &Aabb| bounds.is_valid() && !camera.frustum_within(|| *bounds).may_see(bounds);
        let mut hidden: Vec<_> = boxes.iter().map(is_out).collect();
        if let (Some(hiding), Some(window)) = (&mut self.hiding, camera.hiding_window()) {
            hiding.mark_hidden(
                (&self.layers, camera.layers()),
                (window, camera.frustum()),
                &boxes,
                &mut hidden,
            );
        }
        hidden
    }

    /// The results of the last [`Culler::cull`] without objects removed since, to read them while queries run. After a
    /// [`Culler::commit`] of changes, the frame is empty.
    pub fn frame(&self) -> Frame<'_, K> {
        let views = self.views.iter().enumerate().map(|(camera, (in_view, drawn, is_occluded))| {
            let hiding = self.hiding.as_ref().filter(|_| is_occluded);
            (in_view, drawn, hiding.and_then(|hiding| hiding.culler(camera)))
        });
        Frame::new(&self.keys, views)
    }

    /// The nearest object that a ray meets, and its distance. `hit` is the exact test: it returns the distance to the
    /// object itself, in lengths of the ray's direction, or `None` for a miss. It is called for objects whose boxes the ray
    /// enters, in any order, on any layer.
    pub fn pick(&self, ray: Ray, mut hit: impl FnMut(K, &Ray) -> Option<f32>) -> Option<(K, f32)> {
        let mut meet = |number| hit(self.key(number)?, &ray);
        let (number, t) = self.indexed.index().ray_nearest(&ray, f32::INFINITY, &mut meet)?;
        Some((self.key(number)?, t))
    }

    /// The objects whose boxes a ray enters, the nearest first, with the distance of each entry, in lengths of the
    /// ray's direction. The distance is at most `t_max`, and 0 if the ray starts inside. An engine that tests the
    /// objects themselves may stop at the first box behind its nearest hit. Layers have no effect.
    pub fn on_ray(&self, ray: Ray, t_max: f32) -> impl Iterator<Item = (K, f32)> {
        let mut entered = Vec::new();
        let mut note = |number| {
            let t = ray.enter_box(&self.indexed.get(number)?, t_max)?;
            entered.push((t, number));
            // Without a hit the traversal continues.
            None
        };
        self.indexed.index().ray_nearest(&ray, t_max, &mut note);
        entered.sort_unstable_by(|(a, first), (b, second)| a.total_cmp(b).then(first.cmp(second)));
        entered.into_iter().filter_map(|(t, number)| Some((self.key(number)?, t)))
    }

    /// The objects whose boxes share a point with `bounds`, in any order. Boxes that touch share a point.
    pub fn in_box<P: Into<[f32; 3]>>(&self, bounds: [P; 2]) -> impl Iterator<Item = K> {
        let [min, max] = bounds.map(|corner| corner.into().into());
        let mut found = Vec::new();
        self.indexed.index().box_query(&Aabb::new(min, max), &mut found);
        found.into_iter().filter_map(|number| self.key(number))
    }

    /// The objects whose boxes share a point with a sphere, in any order.
    pub fn in_sphere<P: Into<[f32; 3]>>(&self, center: P, radius_m: f32) -> impl Iterator<Item = K> {
        let sphere = Sphere { center: center.into().into(), radius_m };
        let mut found = Vec::new();
        let mut is_in = |number| {
            let bounds = self.indexed.get(number);
            bounds.is_some_and(|bounds| bounds.distance_squared(sphere.center) <= radius_m * radius_m)
        };
        self.indexed.index().sphere_query(&sphere, &mut is_in, &mut found);
        found.into_iter().filter_map(|number| self.key(number))
    }

    /// The `count` objects whose boxes are nearest to a point, the nearest first, with their distances from it, metres. The
    /// distance from a box that contains the point is 0. Layers have no effect.
    pub fn nearest<P: Into<[f32; 3]>>(&self, point: P, count: usize) -> impl Iterator<Item = (K, f32)> {
        let point = point.into().into();
        let mut distance_m = |number| {
            let is_there = self.key(number).is_some();
            let bounds = self.indexed.get(number).filter(|_| is_there);
            // A distance of NaN excludes a removed object.
            bounds.map_or(f32::NAN, |bounds| bounds.distance_squared(point).sqrt())
        };
        let mut found = Vec::new();
        self.indexed.index().nearest(
            point,
            count.min(self.indexed.index().len()),
            &mut distance_m,
            &mut found,
        );
        found.into_iter().filter_map(|(number, distance_m)| Some((self.key(number)?, distance_m)))
    }

    /// The key of the object with this number; `None` if the object has been removed.
    pub(super) fn key(&self, number: PolygonId) -> Option<K> {
        let slot = self.keys.slot_of(number)?;
        if self.pending.has_box(slot) { self.keys.key(number) } else { None }
    }

    fn slot(&mut self, key: K) -> Option<Slot> {
        let slot = self.keys.slot_or_new(key);
        if slot.is_none() {
            self.refuse(key, Refusal::Key);
        }
        slot
    }

    /// The box of the object in a slot.
    pub(super) fn bounds_of(&self, slot: Slot) -> Option<Aabb> {
        let pending = self.pending.pending_box(slot);
        pending.or_else(|| self.indexed.get(self.keys.number(slot)?)).filter(|bounds| !bounds.is_empty())
    }

    pub(super) fn refuse(&mut self, key: K, why: Refusal) {
        if self.refused_since.len() < MOST_REFUSED {
            self.refused_since.push((key, why));
        }
    }

    fn remove_box(&mut self, slot: Slot) {
        self.pending.remove(slot);
        if let Some(number) = self.keys.number(slot) {
            self.views.remove(number);
        }
        if let Some(hiding) = &mut self.hiding {
            hiding.remove(slot);
        }
    }
}
