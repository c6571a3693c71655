use std::{
    collections::HashMap,
    fmt,
    hash::{BuildHasher, BuildHasherDefault},
};

use glam::Vec3;
use thiserror::Error;

use super::{
    camera::Camera,
    detail::Detail,
    hiding::{Hiding, OccludedView},
    keys::{Handle, Key, Places, Slot},
    layers::Layers,
    objects::Objects,
    occluder::Occluder,
    view::{Frame, Seen, ViewState},
};
use crate::{
    FastHash,
    index::SpatialIndex,
    key_hasher::KeyHasher,
    math::{Aabb, Frustum},
    occlusion::{Columns, OcclusionReport, moved},
    polygon::{PolygonId, VisibleBlocks},
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
/// Changes take effect at once, except that queries find a new object from the next [`Culler::commit`] or
/// [`Culler::cull`] on. Several threads may run queries and [views](Culler::cull_view) at once. No call panics, and no
/// visible object is ever culled.
///
/// Costs: `set` and `remove` take O(1), and O(log world) for an object that leaves its neighbourhood. The commit takes
/// O(changes). A camera takes O(objects in view); with occluders also O(candidates), which are at most some thousand.
///
/// `S` is the hash of the keys; see [`Culler::with_hasher`].
pub struct Culler<K: Key, S: BuildHasher = FastHash> {
    pub(super) keys: K::Places<S>,
    pub(super) objects: Objects,
    pub(super) layers: Layers,
    /// The objects that have a [`Detail`].
    pub(super) details: HashMap<Slot, Detail, BuildHasherDefault<KeyHasher>>,
    /// The objects that have been moved by a transform.
    pub(super) placements: HashMap<Slot, Placement, BuildHasherDefault<KeyHasher>>,
    /// The occluders; `None` until the first occluder is set.
    pub(super) hiding: Option<Box<Hiding>>,
    /// Changes refused before the last call of [`Culler::cull`].
    pub(super) refused: Vec<(K, Refusal)>,
    /// Changes refused since the last call of [`Culler::cull`].
    pub(super) refused_since: Vec<(K, Refusal)>,
    /// Whether a box was changed since the last commit.
    pub(super) is_changed: bool,
    /// Whether a commit followed the last change and the last [`Culler::cull`].
    is_committed: bool,
    /// Whether layers were changed since the last [`Culler::cull`].
    are_layers_changed: bool,
    /// The cameras of the last [`Culler::cull`], and spare ones.
    views: Vec<ViewState>,
    pub(super) cameras: usize,
    frusta: Vec<Frustum>,
    /// Working memory for several cameras.
    found: Vec<VisibleBlocks>,
    /// For [`Culler::are_hidden`].
    asked: Option<Box<OccludedView>>,
}

/// An object's box in its own space, and its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub(super) bounds: Aabb,
    pub(super) columns: Columns,
}

impl<K: Key, S: BuildHasher + Default> Default for Culler<K, S> {
    fn default() -> Self {
        Self::with_hasher(S::default())
    }
}

impl<K: Key, S: BuildHasher> Clone for Culler<K, S>
where
    K::Places<S>: Clone,
{
    /// A culler with the same objects, without the results of the last [`Culler::cull`].
    fn clone(&self) -> Self {
        Self {
            objects: self.objects.clone(),
            layers: self.layers.clone(),
            details: self.details.clone(),
            placements: self.placements.clone(),
            hiding: self.hiding.clone(),
            refused: self.refused.clone(),
            refused_since: self.refused_since.clone(),
            is_changed: self.is_changed,
            ..Self::of(self.keys.clone())
        }
    }
}

impl<K: Key, S: BuildHasher> fmt::Debug for Culler<K, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Culler").field("objects", &self.len()).finish_non_exhaustive()
    }
}

impl<K: Key> Culler<K> {
    /// A culler without objects.
    pub fn new() -> Self {
        Self::with_hasher(FastHash::default())
    }
}

impl<K: Key, S: BuildHasher> Culler<K, S> {
    /// A culler without objects that hashes its keys by `hasher`, such as `std::hash::RandomState`. The default,
    /// [`FastHash`], is faster, but does not withstand keys that an attacker chooses. Iteration never uses the hash, so
    /// the results do not depend on it.
    pub fn with_hasher(hasher: S) -> Self {
        Self::of(K::Places::new(hasher))
    }

    fn of(keys: K::Places<S>) -> Self {
        Self {
            keys,
            objects: Objects::new(),
            layers: Layers::default(),
            details: HashMap::default(),
            placements: HashMap::default(),
            hiding: None,
            refused: Vec::new(),
            refused_since: Vec::new(),
            is_changed: false,
            is_committed: false,
            are_layers_changed: false,
            views: Vec::new(),
            cameras: 0,
            frusta: Vec::new(),
            found: Vec::new(),
            asked: None,
        }
    }

    /// Inserts an object, or moves it. The box is given as its minimum and maximum corner, world space, metres. It
    /// should be tight around everything that the engine draws of the object. A box that is empty or not finite is
    /// [refused](Culler::refused). Its object loses its former box and its occluder, keeps its layers, and is skipped until
    /// it gets a valid box.
    ///
    /// An object that moves loses its occluder, unless the new box contains the former one. Set the
    /// [occluder](Culler::set_occluder) again at the new place.
    #[inline]
    pub fn set<P: Into<[f32; 3]>>(&mut self, key: K, bounds: [P; 2]) {
        let [min, max] = bounds.map(|corner| corner.into().into());
        if let Some(slot) = self.keys.slot(key).or_else(|| self.new_slot(key)) {
            self.set_slot(slot, &Aabb { min, max });
        }
    }

    /// Does the same as [`Culler::set`], and returns a handle of the object, for calls without a hash. `None` if the key
    /// is refused.
    ///
    /// ```
    /// use osp::Culler;
    ///
    /// let mut culler = Culler::<&str>::new();
    /// let door = culler.insert("door", [[0.0, 0.0, 0.0], [1.0, 2.0, 0.1_f32]]).unwrap();
    /// assert!(culler.set_at(door, [[5.0, 0.0, 0.0], [6.0, 2.0, 0.1_f32]]));
    /// culler.remove("door");
    /// culler.insert("wall", [[0.0, 0.0, 0.0], [9.0, 2.0, 0.1_f32]]);
    /// assert!(!culler.set_at(door, [[0.0; 3], [1.0_f32; 3]]), "it names no other object");
    /// ```
    pub fn insert<P: Into<[f32; 3]>>(&mut self, key: K, bounds: [P; 2]) -> Option<Handle> {
        self.set(key, bounds);
        self.handle(key)
    }

    /// The handle of an object; `None` without an object.
    pub fn handle(&self, key: K) -> Option<Handle> {
        self.keys.handle(self.keys.slot(key)?)
    }

    /// The key of the object that a handle names; `None` if the object has been removed.
    pub fn key_of(&self, handle: Handle) -> Option<K> {
        self.keys.key_in(self.keys.slot_at(handle)?)
    }

    /// Moves the object that a handle names, as [`Culler::set`] does. Returns false, without effect, if the object has been
    /// removed.
    #[inline]
    pub fn set_at<P: Into<[f32; 3]>>(&mut self, handle: Handle, bounds: [P; 2]) -> bool {
        let [min, max] = bounds.map(|corner| corner.into().into());
        let Some(slot) = self.keys.slot_at(handle) else { return false };
        self.set_slot(slot, &Aabb { min, max });
        true
    }

    /// Removes the object that a handle names, as [`Culler::remove`] does. Returns its key; `None` if the object was removed
    /// before.
    pub fn remove_at(&mut self, handle: Handle) -> Option<K> {
        let key = self.key_of(handle)?;
        self.remove(key);
        Some(key)
    }

    /// Does the same as [`Culler::set`] for each pair. If a key comes twice, its last box counts.
    pub fn set_many<P: Into<[f32; 3]> + Copy>(&mut self, boxes: &[(K, [P; 2])]) {
        boxes.iter().for_each(|&(key, bounds)| self.set(key, bounds));
    }

    /// Does the same as [`Culler::set_at`] for each pair. Returns the number of pairs whose object has been removed.
    pub fn set_many_at<P: Into<[f32; 3]> + Copy>(&mut self, boxes: &[(Handle, [P; 2])]) -> usize {
        boxes.iter().map(|&(handle, bounds)| usize::from(!self.set_at(handle, bounds))).sum()
    }

    /// Sets the box of the object in a slot: of an object without occluders and transforms in one write.
    #[inline]
    fn set_slot(&mut self, slot: Slot, bounds: &Aabb) {
        if self.hiding.is_none() && self.placements.is_empty() && bounds.is_valid() {
            self.is_changed = true;
            self.objects.set(slot, self.keys.number(slot), bounds);
        } else {
            self.set_with_occluder(slot, bounds);
        }
    }

    #[inline(never)]
    fn set_with_occluder(&mut self, slot: Slot, bounds: &Aabb) {
        if let Some(placement) = self.placements.get_mut(&slot) {
            let columns = placement.columns;
            placement.bounds = if bounds.is_valid() { *bounds } else { Aabb::EMPTY };
            self.set_moved(slot, bounds, &columns);
        } else {
            self.set_box(slot, bounds);
        }
        if bounds.is_valid()
            && let Some(hiding) = &mut self.hiding
        {
            hiding.follow_object(slot, bounds);
        }
    }

    /// Sets the box of an object in the world, or refuses it.
    fn set_box(&mut self, slot: Slot, bounds: &Aabb) {
        if bounds.is_valid() {
            self.is_changed = true;
            self.objects.set(slot, self.keys.number(slot), bounds);
        } else {
            self.refuse_box(slot, bounds);
        }
    }

    /// Sets the box of an object that has been moved, from its box in its own space.
    fn set_moved(&mut self, slot: Slot, own: &Aabb, columns: &Columns) {
        self.set_box(slot, &if own.is_valid() { moved(columns, own) } else { *own });
    }

    fn refuse_box(&mut self, slot: Slot, bounds: &Aabb) {
        if let Some(key) = self.keys.key_in(slot) {
            self.refuse(key, Refusal::Bounds([bounds.min.into(), bounds.max.into()]));
        }
        self.remove_box(slot);
    }

    /// Inserts an object without a box, such as a sky, in place of its former box. Every camera on its layers draws it, and
    /// all queries find it, as if it filled the world. It loses its occluder and its transform. A later box ends this.
    pub fn set_everywhere(&mut self, key: K) {
        let Some(slot) = self.slot(key) else { return };
        self.is_changed = true;
        self.placements.remove(&slot);
        if let Some(hiding) = &mut self.hiding {
            hiding.remove(slot);
        }
        self.objects.set_endless(slot, self.keys.number(slot));
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
            self.refuse_box(slot, &Aabb::new(Vec3::NAN, Vec3::NAN));
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
            self.set_moved(slot, &own, &columns);
        }
    }

    /// Removes an object with its occluder and its layers. A call for an unknown key has no effect.
    pub fn remove(&mut self, key: K) {
        let Some(slot) = self.keys.slot(key) else { return };
        self.remove_box(slot);
        self.keys.take(key);
        self.placements.remove(&slot);
        self.layers.forget(slot);
        self.details.remove(&slot);
    }

    /// Does the same as [`Culler::remove`] for each key.
    pub fn remove_many(&mut self, keys: &[K]) {
        keys.iter().for_each(|&key| self.remove(key));
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
            self.are_layers_changed = true;
            self.layers.set(slot, layers);
        }
    }

    /// Removes all objects, with their occluders and layers. The handles of these objects name nothing afterwards. Keeps the
    /// budget.
    pub fn clear(&mut self) {
        self.is_changed |= !self.is_empty();
        self.objects.clear();
        self.keys.clear();
        self.layers = Layers::default();
        self.placements.clear();
        self.details.clear();
        if let Some(hiding) = &mut self.hiding {
            let budget = hiding.budget;
            **hiding = Hiding::new();
            hiding.budget = budget;
        }
    }

    /// Makes room for this number of further objects.
    pub fn reserve(&mut self, objects: usize) {
        self.keys.reserve(objects);
        self.objects.reserve(objects);
    }

    /// All objects with an accepted box: the key and the box, in any order.
    pub fn iter(&self) -> impl Iterator<Item = (K, [[f32; 3]; 2])> {
        let in_index = self.objects.numbers().into_iter();
        let in_index = in_index.filter_map(|number| Some((self.keys.key(number), self.objects.get(number)?)));
        let coming =
            self.objects.coming().filter_map(|(slot, bounds)| Some((self.keys.key_in(slot)?, bounds)));
        in_index.chain(coming).map(|(key, bounds)| (key, [bounds.min.into(), bounds.max.into()]))
    }

    /// Removes the objects with an accepted box for which `is_kept` returns false.
    pub fn retain(&mut self, mut is_kept: impl FnMut(K, [[f32; 3]; 2]) -> bool) {
        let gone: Vec<K> =
            self.iter().filter_map(|(key, bounds)| (!is_kept(key, bounds)).then_some(key)).collect();
        self.remove_many(&gone);
    }

    /// Sets from which distance and at which size cameras draw an object, and in which level of detail
    /// ([`Seen::levels`]). The default draws it at every distance. While an object with an occluder has a limit, cameras use
    /// no occluders, because objects behind one that is not drawn would be missing.
    pub fn set_detail(&mut self, key: K, detail: Detail) {
        let Some(slot) = self.slot(key) else { return };
        self.is_changed = true;
        if detail == Detail::default() {
            self.details.remove(&slot);
        } else {
            self.details.insert(slot, detail);
        }
    }

    /// Number of objects in the culler with an accepted box.
    pub fn len(&self) -> usize {
        self.objects.len()
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
        let mut all = OcclusionReport::default();
        self.views[..self.cameras].iter().for_each(|view| all.add(&view.report));
        all
    }

    /// Sets the largest work of a camera's depth buffer of occluders, in units that take about a nanosecond. The work is
    /// counted, so the result is the same on each machine. The nearest occluders are drawn first; those beyond the budget
    /// hide nothing. The default is 720,000.
    pub fn set_occlusion_budget(&mut self, work: u64) {
        self.hiding.get_or_insert_with(|| Box::new(Hiding::new())).budget = work;
    }

    /// Makes new objects known to queries, and does the upkeep of the changes since the last commit. [`Culler::cull`] also
    /// commits.
    pub fn commit(&mut self) {
        if std::mem::take(&mut self.is_changed) {
            self.cameras = 0;
        }
        self.objects.commit::<K, S>(&mut self.keys);
        if let Some(hiding) = &mut self.hiding {
            hiding.follow();
        }
        self.is_committed = true;
    }

    /// Finds the objects that may be on the screen of each camera. With [occlusion culling](Camera::hide_by_occluders),
    /// the result of a camera omits the objects behind occluders. Two similar cameras, such as the eyes of a headset,
    /// share one traversal of the index. Each other camera has its own traversal.
    pub fn cull(&mut self, cameras: &[Camera]) -> Frame<'_, K, S> {
        // A second commit in a frame would do the upkeep of a frame once more.
        if !std::mem::take(&mut self.is_committed) || self.is_changed {
            self.commit();
            self.is_committed = false;
        } else if let Some(hiding) = &mut self.hiding {
            hiding.follow();
        }
        std::mem::swap(&mut self.refused, &mut self.refused_since);
        self.refused_since.clear();
        (self.cameras, self.are_layers_changed) = (cameras.len(), false);
        let (mut views, mut frusta) = (std::mem::take(&mut self.views), std::mem::take(&mut self.frusta));
        views.resize_with(cameras.len().max(views.len()), ViewState::default);
        frusta.clear();
        let index = self.objects.index();
        frusta.extend(cameras.iter().map(|camera| camera.frustum_within(|| index.around())));
        let are_several = cameras.len() > 1;
        if are_several {
            let take = |view: &mut ViewState| std::mem::take(&mut view.found);
            self.found.extend(views[..cameras.len()].iter_mut().map(take));
            self.found.iter_mut().for_each(VisibleBlocks::clear);
            index.frustum_cull_views(&frusta, &mut self.found);
            views.iter_mut().zip(self.found.drain(..)).for_each(|(view, found)| view.found = found);
        }
        for ((camera, frustum), view) in cameras.iter().zip(&frusta).zip(&mut views) {
            self.find(camera, frustum, view, are_several);
        }
        (self.views, self.frusta) = (views, frusta);
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
        let hiding = self.hiding.as_ref().filter(|hiding| self.draws_occluders(hiding, camera.layers()));
        if let (Some(hiding), Some(window)) = (hiding, camera.hiding_window()) {
            hiding.mark_hidden((window, camera.frustum()), &mut self.asked, &boxes, &mut hidden);
        }
        hidden
    }

    /// The results of the last [`Culler::cull`] without objects removed since, to read them while queries run. After a
    /// [`Culler::commit`] of changes, the frame is empty.
    pub fn frame(&self) -> Frame<'_, K, S> {
        let views = &self.views[..self.cameras];
        let is_changed = self.is_changed || self.are_layers_changed;
        Frame::new(views.iter().map(|view| Seen::stored(self, view, is_changed)))
    }

    fn slot(&mut self, key: K) -> Option<Slot> {
        self.keys.slot(key).or_else(|| self.new_slot(key))
    }

    #[inline(never)]
    fn new_slot(&mut self, key: K) -> Option<Slot> {
        let slot = self.keys.slot_or_new(key);
        if slot.is_none() {
            self.refuse(key, Refusal::Key);
        }
        slot
    }

    /// The box of the object in a slot.
    pub(super) fn bounds_of(&self, slot: Slot) -> Option<Aabb> {
        let in_index = self.keys.number(slot).and_then(|number| self.objects.get(number));
        in_index.or_else(|| self.objects.coming_box(slot))
    }

    pub(super) fn refuse(&mut self, key: K, why: Refusal) {
        if self.refused_since.len() < MOST_REFUSED {
            self.refused_since.push((key, why));
        }
    }

    fn remove_box(&mut self, slot: Slot) {
        let removed = self.objects.remove(slot, self.keys.number(slot));
        self.is_changed |= removed;
        if removed {
            self.keys.free(slot);
        }
        if let Some(hiding) = &mut self.hiding {
            hiding.remove(slot);
        }
    }
}
