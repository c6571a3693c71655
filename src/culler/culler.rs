use std::fmt;

use thiserror::Error;

use super::{
    boxes::Boxes,
    camera::Camera,
    frame::{Frame, Views},
    hiding::Hiding,
    keys::{Key, Places},
    occluder::Occluder,
};
use crate::{
    frame::{Pipeline, StageClock},
    index::{IndexConfig, Osp},
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{Change, Geometry, PolygonId},
};

/// Changes that wait for the next [`Culler::commit`], at most.
const MOST_WAITING: usize = 1 << 20;

/// Refusals that are remembered from one frame to the next, at most.
const MOST_REFUSED: usize = 4096;

/// Why a culler left an object, or its occluder, out.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The box is empty, infinite or not a number. The object is left out until it has another one.
    #[error("bounds: expected finite corners with min <= max, found {0:?}")]
    Bounds([[f32; 3]; 2]),
    /// A [`Dense`](super::Dense) number is too large, or there are too many keys.
    #[error("key: expected a number below {limit}, and at most as many objects", limit = PolygonId::LIMIT)]
    Key,
    /// All occluders together have too many polygons. The object has none.
    #[error("occluder: expected at most {limit} polygons of all occluders together", limit = PolygonId::LIMIT)]
    Occluder,
}

/// A culler of an engine's objects, each known by a key of the engine's and a box.
///
/// It takes no capacity and no limits of the world: both grow. Objects come, move and go at any time; nothing is ever rebuilt.
/// See the [crate](crate) for an example.
///
/// Changes take effect with the next [`Culler::cull`] or [`Culler::commit`]; what has gone is found by no query from then on that
/// it has gone. Several threads may ask queries at once. No call panics, and nothing visible is ever left out.
///
/// Costs: `set` and `remove` O(1) until the commit, which takes O(changes), and O(log world) for each object that comes or leaves
/// its neighbourhood. A camera takes O(what is in view), and with occluders O(candidates), at most some thousand.
pub struct Culler<K: Key> {
    keys: K::Places,
    boxes: Boxes,
    changes: Vec<Change>,
    pipeline: Pipeline,
    /// Made for the first occluder.
    hiding: Option<Box<Hiding>>,
    /// Of the last frame, and since.
    refused: Vec<(K, Refusal)>,
    refused_since: Vec<(K, Refusal)>,
    frusta: Vec<Frustum>,
    views: Views,
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
            boxes: Boxes::default(),
            changes: Vec::new(),
            pipeline: pipeline_in(&IndexConfig { capacity: 0, ..IndexConfig::default() }),
            hiding: None,
            refused: Vec::new(),
            refused_since: Vec::new(),
            frusta: Vec::new(),
            views: Views::default(),
        }
    }

    /// Inserts an object, or moves it: its box from the least corner to the largest, world space, metres; the tight box of all that
    /// is drawn of it. A box that is empty or not finite is [refused](Culler::refused), and the object left out.
    ///
    /// An object that moves leaves its occluder behind: unless the new box holds the one before, give it its
    /// [occluder](Culler::set_occluder) anew, at the new place.
    pub fn set<P: Into<[f32; 3]>>(&mut self, key: K, bounds: [P; 2]) {
        let [min, max] = bounds.map(Into::into);
        let Some(place) = self.place(key) else { return };
        let bounds = Aabb::new(min.into(), max.into());
        if !bounds.is_valid() {
            self.refuse(key, Refusal::Bounds([min, max]));
            self.take_box(place);
            return;
        }
        let before = self.boxes.set(place, bounds);
        let is_new = before.is_empty();
        if !is_new && !bounds.contains(&before) {
            self.take_occluder(place);
        }
        self.note(if is_new { Change::Insert(place) } else { Change::Update(place) });
    }

    /// Takes an object out, with its occluder and its layers. Nothing happens if there is none.
    pub fn remove(&mut self, key: K) {
        let Some(place) = self.keys.take(key) else { return };
        self.take_box(place);
        self.boxes.forget_layers(place);
    }

    /// Gives an object something that hides what is behind it, in place of what it had. The occluder is in world space: it stays
    /// where it is, until the object moves or goes. It has to be drawn itself, or lie inside of what is drawn.
    ///
    /// A key without a box is a stand-in: it hides, and is never drawn.
    pub fn set_occluder(&mut self, key: K, occluder: Occluder) {
        let Some(place) = self.place(key) else { return };
        let hiding = self.hiding.get_or_insert_with(|| Box::new(Hiding::new()));
        if hiding.set(place, &occluder).is_err() {
            self.refuse(key, Refusal::Occluder);
        }
    }

    /// Takes an object's occluder away. Nothing happens if there is none.
    pub fn remove_occluder(&mut self, key: K) {
        if let Some(place) = self.keys.find(key) {
            self.take_occluder(place);
        }
    }

    /// Puts an object on layers, a bit each: a camera sees it if both share one ([`Camera::on_layers`]). Objects are on the first
    /// layer, the mask 1, unless they are put elsewhere; on none, nobody sees them.
    pub fn set_layers(&mut self, key: K, layers: u32) {
        if let Some(place) = self.place(key) {
            self.boxes.set_layers(place, layers);
        }
    }

    /// Objects in the culler: those with a box that was not refused.
    pub fn len(&self) -> usize {
        self.boxes.count()
    }

    /// Whether there is no object.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The box of an object, as it was set last.
    pub fn bounds(&self, key: K) -> Option<[[f32; 3]; 2]> {
        let bounds = self.boxes.get(self.keys.find(key)?)?;
        Some([bounds.min.into(), bounds.max.into()])
    }

    /// What was refused between the last two calls of [`Culler::cull`], and why; of very much the beginning.
    pub fn refused(&self) -> impl Iterator<Item = (K, Refusal)> {
        self.refused.iter().copied()
    }

    /// Makes all changes known to the queries. [`Culler::cull`] does it, too.
    pub fn commit(&mut self) {
        if self.pipeline.polygon_count() == 0 && !self.changes.is_empty() {
            self.pipeline = pipeline_in(&self.expected());
        }
        self.pipeline.skip(&self.boxes, &self.changes);
        self.changes.clear();
        self.pipeline.commit();
        self.keys.settle();
        if let Some(hiding) = &mut self.hiding {
            hiding.follow();
        }
    }

    /// Finds what each camera sees: whatever of an object may be on its screen, and not behind the occluders where it
    /// [asks for that](Camera::hide_by_occluders). All cameras are culled in one walk, as two eyes, a camera and its lights, or the
    /// sides of a cube.
    pub fn cull(&mut self, cameras: &[Camera]) -> Frame<'_, K> {
        self.commit();
        std::mem::swap(&mut self.refused, &mut self.refused_since);
        self.refused_since.clear();
        let Self { pipeline, boxes, hiding, views, .. } = self;
        views.begin(cameras.len());
        self.frusta.clear();
        self.frusta.extend(cameras.iter().map(Camera::frustum));
        pipeline.index().frustum_cull_views(&self.frusta, &mut views.in_view);
        for (i, camera) in cameras.iter().enumerate() {
            if let (Some(hiding), Some(window)) = (&mut *hiding, camera.hiding_window()) {
                let (in_view, drawn) = (&views.in_view[i], &mut views.drawn[i]);
                let view = (window, camera.frustum());
                views.is_thinned[i] =
                    hiding.cull(pipeline.index(), boxes, camera.layers(), view, in_view, drawn);
            }
            if !boxes.are_all_on(camera.layers()) {
                views.keep(i, |place| boxes.is_on(place, camera.layers()));
            }
        }
        self.frame()
    }

    /// What the cameras of the last [`Culler::cull`] see; to be read beside queries.
    pub fn frame(&self) -> Frame<'_, K> {
        Frame::new(&self.keys, self.views.iter())
    }

    /// The nearest object that a ray meets, and where. `hit` says where the ray meets an object itself, if it does, in lengths of
    /// the ray's direction; it is asked about objects whose boxes the ray enters, in any order.
    pub fn pick(&self, ray: Ray, mut hit: impl FnMut(K, &Ray) -> Option<f32>) -> Option<(K, f32)> {
        let mut meet = |place| hit(self.key(place)?, &ray);
        let (place, t) = self.pipeline.ray_nearest(&self.boxes, &ray, f32::INFINITY, &mut meet)?;
        Some((self.key(place)?, t))
    }

    /// The objects whose boxes share a point with a box, touching included, in any order.
    pub fn in_box<P: Into<[f32; 3]>>(&self, bounds: [P; 2]) -> impl Iterator<Item = K> {
        let [min, max] = bounds.map(|corner| corner.into().into());
        let mut found = Vec::new();
        self.pipeline.box_query(&self.boxes, &Aabb::new(min, max), &mut found);
        found.into_iter().filter_map(|place| self.key(place))
    }

    /// The objects whose boxes share a point with a sphere, in any order.
    pub fn in_sphere<P: Into<[f32; 3]>>(&self, center: P, radius_m: f32) -> impl Iterator<Item = K> {
        let sphere = Sphere { center: center.into().into(), radius_m };
        let mut found = Vec::new();
        let mut is_in = |place| {
            self.boxes.get(place).is_some_and(|bounds| {
                bounds.distance_squared(sphere.center) <= sphere.radius_m * sphere.radius_m
            })
        };
        self.pipeline.sphere_query(&self.boxes, &sphere, &mut is_in, &mut found);
        found.into_iter().filter_map(|place| self.key(place))
    }

    /// The key of an object that is there now.
    fn key(&self, place: PolygonId) -> Option<K> {
        if self.boxes.is_present(place) { self.keys.key(place) } else { None }
    }

    fn place(&mut self, key: K) -> Option<PolygonId> {
        let place = self.keys.find_or_add(key);
        if place.is_none() {
            self.refuse(key, Refusal::Key);
        }
        place
    }

    fn refuse(&mut self, key: K, why: Refusal) {
        if self.refused_since.len() < MOST_REFUSED {
            self.refused_since.push((key, why));
        }
    }

    fn note(&mut self, change: Change) {
        self.changes.push(change);
        if self.changes.len() >= MOST_WAITING {
            self.commit();
        }
    }

    fn take_box(&mut self, place: PolygonId) {
        self.take_occluder(place);
        if !self.boxes.set(place, Aabb::EMPTY).is_empty() {
            self.note(Change::Remove(place));
        }
    }

    #[inline]
    fn take_occluder(&mut self, place: PolygonId) {
        if let Some(hiding) = &mut self.hiding
            && hiding.has(place)
        {
            hiding.remove(place);
        }
    }

    /// What the index is to expect: a cube around all that waits for the first commit, and as many.
    fn expected(&self) -> IndexConfig {
        let boxes = self.changes.iter().filter_map(|change| match *change {
            Change::Insert(place) => self.boxes.get(place),
            _ => None,
        });
        let around = boxes.fold(Aabb::EMPTY, |around, bounds| around.union(&bounds));
        let root = Aabb::cube(around.center(), around.extent().max_element());
        IndexConfig { root, capacity: self.boxes.count() }
    }
}

/// A pipeline around an empty tree. It only follows changes: a culler culls cameras, which a pipeline does not know.
fn pipeline_in(config: &IndexConfig) -> Pipeline {
    Pipeline::new(Box::new(Osp::new(config)), 0, StageClock::default())
}
